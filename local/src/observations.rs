//! All observables of the realizations at one point of a job.

mod observation;
mod summary;

use std::fmt::Write as _;

use osteon_common::job::JobSpecification;
use osteon_common::observables::Observable;
use osteon_common::parameters::Point;
use osteon_common::realization::PointError;
use osteon_common::settings::Extremum;
use osteon_solver::{Isa, Solver, Workspace};
use rayon::ThreadPoolBuildError;
use rayon::prelude::*;
use thiserror::Error;

use self::observation::Observation;

pub use self::summary::{ObservableMoments, ObservationSummary};

/// The realizations at one point, in index order.
#[derive(Debug, PartialEq)]
pub struct Observations {
    other_extremum: Extremum,
    rows: Vec<Observation>,
}

/// Error when realizations cannot be observed.
#[derive(Debug, Error)]
pub enum ObservationError {
    /// The point has no ensemble.
    #[error(transparent)]
    Point(#[from] PointError),
    /// No threads can be started.
    #[error(transparent)]
    Threads(#[from] ThreadPoolBuildError),
}

impl Observations {
    /// Computes all realizations of the job at `point`. They are the same for every number of threads.
    /// `done` is called after each.
    ///
    /// # Errors
    /// If the point has no ensemble, or if no threads can be started.
    pub fn compute(
        specification: &JobSpecification,
        point: &Point,
        isa: Isa,
        threads: usize,
        done: impl Fn() + Sync,
    ) -> Result<Self, ObservationError> {
        let ensemble = specification.ensemble(point)?;
        let setup = point.setup(&specification.setup);
        let solver = Solver::with_isa(&setup, isa);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let count = specification.monte_carlo.realizations;
        let observe = |workspace: &mut Workspace, index| {
            let observed = solver.observed_realization(&ensemble, index, workspace);
            done();
            match observed {
                Ok(observed) => Observation::from(observed),
                Err(kind) => Observation::failed(kind),
            }
        };
        let rows = pool
            .install(|| (0..count).into_par_iter().map_init(Workspace::default, observe).collect());
        Ok(Self { other_extremum: setup.picking.extremum.other(), rows })
    }

    /// Returns one row for each realization, with a heading.
    pub fn to_csv(&self) -> String {
        let names = Observable::ALL.map(Observable::name).join(",");
        let mut text = format!("index,velocity,{names},failure\n");
        for (index, row) in self.rows.iter().enumerate() {
            let cell = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v:?}"));
            let velocity = cell(row.outcome.ok());
            let observables = row.observables.map(cell).0.join(",");
            let failure = row.outcome.err().map_or("", |kind| kind.name());
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{index},{velocity},{observables},{failure}");
        }
        text
    }

    /// Returns the summary.
    pub fn summary(&self) -> ObservationSummary {
        ObservationSummary::new(self.other_extremum, &self.rows)
    }
}

#[cfg(test)]
mod tests;
