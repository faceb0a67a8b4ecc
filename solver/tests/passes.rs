//! An arrival says what was sampled for it.

use osteon_common::case::Setup;
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_common::sampling;
use osteon_solver::{Solver, Workspace};

/// Most bones need one pass. For the others the arrival names the last pass that contributed, and
/// the number of pairs in all passes.
#[test]
fn an_arrival_says_what_was_sampled() {
    let (setup, mut workspace) = (Setup::default(), Workspace::default());
    let nominal = sampling::nominal(&setup);
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.6]);
    let ensemble = Ensemble::new(&point, 7).unwrap();
    let solver = Solver::new(&setup);
    let (mut once, mut often) = (0, 0);
    for index in 0..40 {
        let Ok(found) = solver.arrival(&ensemble.bone(index).unwrap(), &mut workspace) else {
            continue;
        };
        let passes = found.passes.unwrap();
        if passes.count == 1 {
            once += 1;
            assert_eq!(passes.last.band, nominal.first_band());
            assert_eq!(passes.last.pairs, passes.pairs_computed);
        } else {
            often += 1;
            assert!(passes.pairs_computed >= passes.last.pairs, "{passes:?}");
        }
    }
    assert!(once > 0 && often > 0, "{once} once, {often} more often");
    let mut refined = setup;
    refined.solver.refinement = 2.0;
    let usual = Ensemble::new(
        &Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1]),
        7,
    );
    let bone = usual.unwrap().bone(0).unwrap();
    let found = Solver::new(&refined).arrival(&bone, &mut workspace).unwrap();
    let band = sampling::nominal(&refined).first_band();
    assert_eq!(found.passes.map(|passes| passes.last.band), Some(band));
}
