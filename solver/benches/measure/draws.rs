//! The bones that are timed.

use osteon_common::case::{Bone, Setup};
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_common::settings::{Method, SolverSettings};

/// Seed of the draws.
pub(crate) const SEED: u64 = 1;
/// The paper's optimum, dispersion 0.1029.
const OPTIMUM: Point =
    Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);

/// The ensemble that bones are drawn from.
pub(crate) fn ensemble() -> Ensemble {
    Ensemble::new(&OPTIMUM, SEED).expect("the paper's optimum is admissible")
}

/// Bones `from` … `from + count` - 1 of the ensemble.
pub(crate) fn bones(from: u64, count: u64) -> Vec<Bone> {
    let ensemble = ensemble();
    (from..from + count).map(|i| ensemble.bone(i).expect("small dispersions are elastic")).collect()
}

/// The paper's geometry, solved by `method` at this refinement.
pub(crate) fn setup(method: Method, refinement: f64) -> Setup {
    let mut setup = Setup::default();
    setup.solver = SolverSettings { method, refinement, ..setup.solver };
    setup
}
