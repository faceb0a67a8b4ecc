//! A velocity has the same bits on every instruction set.

use osteon_common::case::Setup;
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_solver::{Isa, Solver, Workspace};

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let point = Point([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.25]);
    let ensemble = Ensemble::new(&point, 2).unwrap();
    let setup = Setup::default();
    let outcomes = |isa: Isa| -> Vec<_> {
        let solver = Solver::with_isa(&setup, isa);
        let mut workspace = Workspace::default();
        (0..12)
            .map(|i| {
                let outcome = solver.outcome(&ensemble.bone(i).unwrap(), &mut workspace);
                outcome.map(f64::to_bits)
            })
            .collect()
    };
    let sets = Isa::available();
    let expected = outcomes(sets[0]);
    assert!(expected.iter().any(Result::is_ok));
    for isa in &sets[1..] {
        assert_eq!(outcomes(*isa), expected, "{} against {}", isa.name(), sets[0].name());
    }
}

#[test]
fn a_velocity_does_not_depend_on_what_was_computed_before() {
    let setup = Setup::default();
    let solver = Solver::new(&setup);
    let wide = Point([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.5]);
    let ensemble = Ensemble::new(&wide, 3).unwrap();
    let mut used = Workspace::default();
    for index in (0..20).rev() {
        let bone = ensemble.bone(index).unwrap();
        let fresh = Solver::new(&setup).outcome(&bone, &mut Workspace::default());
        assert_eq!(solver.outcome(&bone, &mut used), fresh, "index {index}");
    }
}
