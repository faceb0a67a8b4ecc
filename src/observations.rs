//! All observables of the realizations at one point of a job.

mod summary;

use std::fmt::Write as _;

use indicatif::{ProgressBar, ProgressStyle};
use osteon_common::job::JobSpecification;
use osteon_common::outcome::{FailureKind, Outcome};
use osteon_common::parameters::Point;
use osteon_common::settings::Extremum;
use osteon_solver::{FirstSignal, Isa, ObservedRealization, Solver, Workspace};
use rayon::prelude::*;

use crate::exit_status::CommandFailure;

pub(crate) use self::summary::{ObservableMoments, ObservationSummary};

/// Progress on a terminal.
const BAR: &str = "{bar:30} {pos} of {len} realizations, {eta} left";

/// The realizations at one point, in index order.
#[derive(Debug, PartialEq)]
pub(crate) struct Observations {
    other_extremum: Extremum,
    rows: Vec<Observation>,
}

/// One realization. Without a velocity, the other observables are `None`, too.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Observation {
    outcome: Outcome,
    /// Velocity of the extremum that the job does not pick, m/s.
    other_velocity: Option<f64>,
    /// dB/cm.
    decay: Option<f64>,
    /// Hz.
    center_frequency: Option<f64>,
}

impl Observations {
    /// Computes all realizations of the job at `point`. They are the same for every number of threads.
    ///
    /// # Errors
    /// If the point has no ensemble, or if no threads can be started.
    pub(crate) fn compute(
        specification: &JobSpecification,
        point: &Point,
        isa: Isa,
        threads: usize,
    ) -> Result<Self, CommandFailure> {
        let ensemble = specification.ensemble(point).map_err(CommandFailure::bad_input)?;
        let setup = point.setup(&specification.setup);
        let solver = Solver::with_isa(&setup, isa);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(CommandFailure::failed)?;
        let count = specification.monte_carlo.realizations;
        let style = ProgressStyle::with_template(BAR).map_err(CommandFailure::failed)?;
        // Hidden unless stderr is a terminal.
        let bar = ProgressBar::new(count).with_style(style);
        let observe = |workspace: &mut Workspace, index| {
            let observed = solver.observed_realization(&ensemble, index, workspace);
            bar.inc(1);
            match observed {
                Ok(observed) => Observation::from(&observed),
                Err(kind) => Observation::failed(kind),
            }
        };
        let rows = pool
            .install(|| (0..count).into_par_iter().map_init(Workspace::default, observe).collect());
        bar.finish_and_clear();
        Ok(Self { other_extremum: setup.picking.extremum.other(), rows })
    }

    /// Returns one row for each realization, with a heading.
    pub(crate) fn to_csv(&self) -> String {
        let mut text = "index,velocity,other_velocity,decay,center_frequency,failure\n".to_owned();
        for (index, row) in self.rows.iter().enumerate() {
            let cell = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v:?}"));
            let [velocity, other, decay, frequency] = row.values().map(cell);
            let failure = row.outcome.err().map_or("", |kind| kind.name());
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{index},{velocity},{other},{decay},{frequency},{failure}");
        }
        text
    }

    /// Returns the summary.
    pub(crate) fn summary(&self) -> ObservationSummary {
        ObservationSummary::new(self.other_extremum, &self.rows)
    }
}

impl Observation {
    fn failed(kind: FailureKind) -> Self {
        Self { outcome: Err(kind), other_velocity: None, decay: None, center_frequency: None }
    }

    /// Returns velocity, other velocity, decay and frequency.
    fn values(&self) -> [Option<f64>; 4] {
        [self.outcome.ok(), self.other_velocity, self.decay, self.center_frequency]
    }
}

impl From<&ObservedRealization> for Observation {
    fn from(observed: &ObservedRealization) -> Self {
        let FirstSignal { other_velocity, decay, center_frequency, .. } = &observed.signal;
        Self {
            outcome: Ok(observed.velocity),
            other_velocity: other_velocity.as_ref().ok().copied(),
            decay: Some(*decay),
            center_frequency: *center_frequency,
        }
    }
}

#[cfg(test)]
mod tests;
