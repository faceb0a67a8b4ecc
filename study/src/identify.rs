//! Identifications in this process, over all cores, without a coordinator.

use std::collections::BTreeMap;
use std::sync::Arc;

use osteon_common::case::Setup;
use osteon_common::job::{JobSpecification, MonteCarlo};
use osteon_common::outcome::Outcome;
use osteon_common::parameters::Point;
use osteon_common::realization::{Ensemble, PointError};
use osteon_common::results::{Evaluation, JobResult};
use osteon_common::version::Program;
use osteon_search::{Search, Step};
use osteon_solver::{Isa, Solver, Workspace};
use rayon::prelude::*;

use crate::draws::{arrival, not_elastic};

/// Outcomes at points that several identifications begin at, by the bits of the point.
pub(crate) type Known = BTreeMap<[u64; 7], Arc<[Outcome]>>;

/// The outcomes of every realization at a point of the paper's geometry, in index order.
///
/// # Errors
/// When the point has no ensemble.
pub(crate) fn outcomes(
    point: &Point,
    monte_carlo: &MonteCarlo,
    isa: Isa,
) -> Result<Vec<Outcome>, PointError> {
    let ensemble = Ensemble::drawn(point, monte_carlo.germs())?;
    let solver = Solver::with_isa(&Setup::default(), isa);
    let solved = (0..monte_carlo.realizations).into_par_iter().map_init(
        Workspace::default,
        |workspace, index| {
            let bone = ensemble.bone(index).map_err(not_elastic);
            let arrival = arrival(&solver, &bone, workspace);
            arrival.map(|arrival| arrival.velocity).map_err(|failure| failure.kind)
        },
    );
    Ok(solved.collect())
}

/// Goes to the end of an identification; its result and all its evaluations. The outcomes at its
/// first point are taken from `known`, or kept there.
///
/// # Errors
/// When a point that it goes to has no ensemble.
pub(crate) fn identify(
    specification: &JobSpecification,
    known: &mut Known,
    isa: Isa,
) -> Result<(JobResult, Vec<Evaluation>), PointError> {
    let mut search = Search::new(Arc::new(specification.clone()));
    loop {
        match search.ask() {
            Step::Evaluate(point) => {
                let bits = point.0.map(f64::to_bits);
                let found: Arc<[Outcome]> = match known.get(&bits) {
                    Some(found) => Arc::clone(found),
                    None => outcomes(&point, &specification.monte_carlo, isa)?.into(),
                };
                if search.evaluations() == 0 {
                    known.insert(bits, Arc::clone(&found));
                }
                search.tell(found, None);
            }
            Step::Done(ending) => {
                let result = search.result(&ending, &Program::this(None));
                return Ok((result, search.history().to_vec()));
            }
        }
    }
}
