//! What a report is made from: the parsed result of each run, its job or case, and its tables.

use osteon_common::case::Case;
use osteon_common::job::JobSpecification;
use osteon_files::report::{Identification, Propagation, Simulation};

use crate::sample::VelocitySample;
use crate::table::{NumberTable, TableError};

/// One run, as its directory holds it.
#[derive(Debug)]
pub struct ReportedRun {
    /// Name of the run, for people.
    pub(crate) name: String,
    /// What was computed.
    pub(crate) content: RunContent,
}

/// What was computed, by kind.
#[derive(Debug)]
pub(crate) enum RunContent {
    /// `identify`.
    Identification(Box<Identification>, JobContext),
    /// `propagate`.
    Propagation(Box<Propagation>, JobContext),
    /// `simulate`.
    Simulation(Box<Simulation>, Box<SimulationContext>),
}

/// The job of a result, and its tables.
#[derive(Debug)]
pub(crate) struct JobContext {
    pub(crate) specification: Box<JobSpecification>,
    /// `history.csv`.
    pub(crate) history: Option<NumberTable>,
    /// `realizations.csv`.
    pub(crate) realizations: Option<RealizationRows>,
    /// `posterior.csv`.
    pub(crate) posterior: Option<NumberTable>,
    /// `comparison.csv`.
    pub(crate) comparison: Option<NumberTable>,
}

/// The case of a simulation, and its traces.
#[derive(Debug)]
pub(crate) struct SimulationContext {
    pub(crate) case: Case,
    /// Times, s, and for each receiver its pressures, Pa.
    pub(crate) traces: Option<(Vec<f64>, Vec<Vec<f64>>)>,
}

/// The texts of the tables of a run; `None` where there is no such file.
#[derive(Debug, Default)]
pub struct JobTables {
    /// `history.csv`.
    pub history: Option<String>,
    /// `realizations.csv`.
    pub realizations: Option<String>,
    /// `posterior.csv`.
    pub posterior: Option<String>,
    /// `comparison.csv`.
    pub comparison: Option<String>,
}

/// The rows of `realizations.csv`.
#[derive(Debug)]
pub(crate) struct RealizationRows {
    /// Name of the group of each; empty strings without groups.
    groups: Vec<String>,
    /// Velocities, m/s, NaN for failures.
    velocities: Vec<f64>,
    /// Kinds of the failures; empty strings for velocities.
    failures: Vec<String>,
}

/// One part of the realizations: those of a group, or all.
#[derive(Debug, Default)]
pub(crate) struct ModelOutcomes {
    pub(crate) velocities: Option<VelocitySample>,
    /// Index and kind of each failure.
    pub(crate) failures: Vec<(f64, String)>,
    /// Number of all.
    pub(crate) count: usize,
}

impl RealizationRows {
    fn read(text: &str) -> Result<Self, TableError> {
        let table = NumberTable::read(text)?;
        let texts = |name: &str| -> Vec<String> {
            let found = table.texts(name).unwrap_or_else(|| vec![""; table.len()]);
            found.into_iter().map(str::to_owned).collect()
        };
        let velocities = table.numbers("velocity")?.unwrap_or_default();
        Ok(Self { groups: texts("group"), velocities, failures: texts("failure") })
    }

    /// Returns the realizations of a group, or all of a run without groups.
    pub(crate) fn outcomes_of_group(&self, group: Option<&str>) -> ModelOutcomes {
        let is_of_group = |place: &usize| {
            group.is_none_or(|name| self.groups.get(*place).is_some_and(|one| one == name))
        };
        let places: Vec<usize> = (0..self.velocities.len()).filter(is_of_group).collect();
        let failures = places.iter().enumerate().filter_map(|(index, place)| {
            let kind = self.failures.get(*place)?;
            (!kind.is_empty()).then(|| (index as f64, kind.clone()))
        });
        ModelOutcomes {
            failures: failures.collect(),
            velocities: VelocitySample::new(
                places.iter().map(|place| self.velocities[*place]).collect(),
            ),
            count: places.len(),
        }
    }
}

impl JobContext {
    fn read(specification: JobSpecification, tables: &JobTables) -> Result<Self, TableError> {
        let table = |text: &Option<String>| text.as_deref().map(NumberTable::read).transpose();
        Ok(Self {
            specification: Box::new(specification),
            history: table(&tables.history)?,
            realizations: tables.realizations.as_deref().map(RealizationRows::read).transpose()?,
            posterior: table(&tables.posterior)?,
            comparison: table(&tables.comparison)?,
        })
    }
}

impl ReportedRun {
    /// The run of `identify` with this result, job and tables.
    ///
    /// # Errors
    /// If a table is damaged.
    pub fn identification(
        name: String,
        result: Identification,
        specification: JobSpecification,
        tables: &JobTables,
    ) -> Result<Self, TableError> {
        let context = JobContext::read(specification, tables)?;
        Ok(Self { name, content: RunContent::Identification(Box::new(result), context) })
    }

    /// Same as [`identification`](Self::identification), for `propagate`.
    ///
    /// # Errors
    /// If a table is damaged.
    pub fn propagation(
        name: String,
        result: Propagation,
        specification: JobSpecification,
        tables: &JobTables,
    ) -> Result<Self, TableError> {
        let context = JobContext::read(specification, tables)?;
        Ok(Self { name, content: RunContent::Propagation(Box::new(result), context) })
    }

    /// The run of `simulate` with this result, case and `traces.csv`.
    ///
    /// # Errors
    /// If the traces are damaged.
    pub fn simulation(
        name: String,
        result: Simulation,
        case: Case,
        traces: Option<&str>,
    ) -> Result<Self, TableError> {
        let traces = match traces {
            None => None,
            Some(text) => {
                let table = NumberTable::read(text)?;
                let column = |name: &String| table.numbers(name).map(Option::unwrap_or_default);
                let mut columns = table
                    .names()
                    .iter()
                    .map(column)
                    .collect::<Result<std::collections::VecDeque<_>, _>>()?;
                columns.pop_front().map(|times| (times, columns.into()))
            }
        };
        let context = Box::new(SimulationContext { case, traces });
        Ok(Self { name, content: RunContent::Simulation(Box::new(result), context) })
    }
}
