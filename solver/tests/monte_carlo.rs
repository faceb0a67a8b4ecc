//! The law of the velocity at the paper's optimum.

use osteon_common::case::Setup;
use osteon_common::job::MonteCarlo;
use osteon_common::outcome::Outcome;
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_common::statistics::estimate;
use osteon_solver::{Solver, Workspace};

#[test]
fn moments_at_the_papers_optimum_are_those_of_an_independent_sampler() {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
    let ensemble = Ensemble::new(&point, 1).unwrap();
    let solver = Solver::new(&Setup::default());
    let mut workspace = Workspace::default();
    let outcomes: Vec<Outcome> =
        (0..2000).map(|i| solver.outcome(&ensemble.bone(i).unwrap(), &mut workspace)).collect();
    assert!(outcomes.iter().all(Result::is_ok));
    let found = estimate(&MonteCarlo::default(), &point, &outcomes).unwrap();
    // 400 000 quasi-random points of an independent code: 3906.27 m/s and 0.02708.
    let mean = (found.moments.mean - 3906.27) / found.standard_error.mean;
    let spread = (found.moments.coefficient_of_variation - 0.02708)
        / found.standard_error.coefficient_of_variation;
    assert!(mean.abs() < 3.0, "mean is {mean} standard errors off: {found:?}");
    assert!(spread.abs() < 3.0, "spread is {spread} standard errors off: {found:?}");
}
