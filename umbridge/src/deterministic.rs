//! The velocity of one case, computed in this process.

use std::sync::{Arc, Mutex, PoisonError};

use osteon_common::case::Setup;
use osteon_common::parameters::Point;
use osteon_common::realization::mean_bone;
use osteon_solver::{Isa, Solver, Workspace};
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;

use super::protocol_error::ProtocolError;

/// Solves cases, each on a thread of its own, at most as many at a time as there are cores.
#[derive(Debug)]
pub(super) struct CaseSolver {
    isa: Isa,
    cores: Semaphore,
    /// That of the last setup.
    solver: Mutex<Option<Arc<Solver>>>,
}

impl CaseSolver {
    pub(super) fn new(isa: Isa) -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Self { isa, cores: Semaphore::new(cores), solver: Mutex::default() }
    }

    /// Returns the velocity of the mean model of a point, m/s.
    ///
    /// # Errors
    /// If the mean model is not admissible, or no velocity is found.
    pub(super) async fn velocity(
        &self,
        point: &Point,
        setup: &Setup,
    ) -> Result<f64, ProtocolError> {
        let setup = point.setup(setup);
        let bone = mean_bone(point, &setup)
            .map_err(|error| ProtocolError::input(format!("input[0]: {error}")).without_value())?;
        let _core = self.cores.acquire().await;
        let solver = self.solver(&setup);
        let solved = spawn_blocking(move || solver.arrival(&bone, &mut Workspace::default())).await;
        match solved {
            Ok(Ok(arrival)) => Ok(arrival.velocity),
            Ok(Err(failure)) => Err(ProtocolError::output(format!(
                "no velocity ({}): {}",
                failure.kind.name(),
                failure.detail
            ))),
            Err(_) => Err(ProtocolError::output("the solver has failed; please report this input")),
        }
    }

    fn solver(&self, setup: &Setup) -> Arc<Solver> {
        let mut kept = self.solver.lock().unwrap_or_else(PoisonError::into_inner);
        match &*kept {
            Some(solver) if solver.setup() == setup => Arc::clone(solver),
            _ => Arc::clone(kept.insert(Arc::new(Solver::with_isa(setup, self.isa)))),
        }
    }
}
