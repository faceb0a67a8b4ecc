//! A velocity has the same bits on every instruction set.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use osteon_common::bone::{Sublayer, Sublayers};
use osteon_common::case::Setup;
use osteon_common::parameters::Point;
use osteon_common::pulse::PulseForm;
use osteon_common::realization::Ensemble;
use osteon_solver::{Isa, Solver, Workspace};

/// The first `count` draws at a dispersion, on every instruction set: all numbers of an arrival.
fn check(change: impl Fn(&mut Setup), dispersion: f64, count: u64) {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion]);
    let ensemble = Ensemble::new(&point, 2).unwrap();
    let mut setup = Setup::default();
    change(&mut setup);
    let arrivals = |isa: Isa| -> Vec<_> {
        let solver = Solver::with_isa(&setup, isa);
        let mut workspace = Workspace::default();
        (0..count)
            .map(|index| solver.arrival(&ensemble.bone(index).unwrap(), &mut workspace))
            .collect()
    };
    let sets = Isa::available();
    let expected = arrivals(sets[0]);
    assert!(expected.iter().any(Result::is_ok));
    for isa in &sets[1..] {
        assert_eq!(arrivals(*isa), expected, "{} against {}", isa.name(), sets[0].name());
    }
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    check(|_| (), 0.25, 12);
}

#[test]
fn and_so_it_does_where_bones_are_computed_again() {
    check(|setup| setup.layers.bone_thickness = 1e-3, 0.6, 6);
}

#[test]
fn and_when_refined_with_echoes() {
    let change = |setup: &mut Setup| {
        setup.solver.refinement = 2.0;
        setup.layers.coupling.thickness = 4e-3;
        setup.layers.marrow.thickness = 3e-3;
    };
    check(change, 0.1, 3);
}

#[test]
fn and_with_a_tilted_probe_in_both_directions() {
    let change = |setup: &mut Setup| {
        setup.layers.coupling.thickness = 4e-3;
        setup.probe.tilt = 0.02;
        setup.probe.bidirectional = true;
    };
    check(change, 0.25, 3);
}

#[test]
fn and_with_another_pulse_and_wide_elements() {
    let change = |setup: &mut Setup| {
        setup.probe.pulse = PulseForm::Ricker;
        setup.probe.element_width = 0.5e-3;
        setup.probe.tilt = 0.02;
    };
    check(change, 0.25, 3);
}

#[test]
fn and_with_sublayers() {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.25]);
    let ensemble = Ensemble::new(&point, 6).unwrap();
    // One so thin that it needs no doubling, and one so thick that it needs many.
    let sublayers: Vec<_> = [2e-3, 0.05e-3, 0.6e-3, 1.35e-3]
        .into_iter()
        .zip(0..)
        .map(|(thickness, i)| Sublayer { thickness, solid: ensemble.bone(i).unwrap() })
        .collect();
    let sublayers = Sublayers::new(&sublayers).unwrap();
    for refinement in [1.0, 1.5] {
        let mut setup = Setup::default();
        setup.layers.bone_thickness = sublayers.thickness();
        setup.solver.refinement = refinement;
        let arrival =
            |isa| Solver::with_isa(&setup, isa).arrival(&sublayers, &mut Workspace::default());
        let waves = |isa| Solver::with_isa(&setup, isa).guided_waves(&sublayers);
        let expected = (arrival(Isa::fastest()), waves(Isa::fastest()));
        assert!(expected.0.is_ok(), "{expected:?}");
        for isa in Isa::available() {
            assert_eq!((arrival(isa), waves(isa)), expected, "{}", isa.name());
        }
    }
}

#[test]
fn every_instruction_set_gives_the_same_traces() {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.25]);
    let bone = Ensemble::new(&point, 4).unwrap().bone(0).unwrap();
    let sets = Isa::available();
    // The set without fused multiply-adds takes minutes for a trace.
    let traces =
        |isa: Isa| Solver::with_isa(&Setup::default(), isa).traces(&bone, 8e-6, 50e-9).unwrap();
    let fastest = traces(Isa::fastest());
    for isa in sets.into_iter().skip(1) {
        assert_eq!(traces(isa), fastest, "{}", isa.name());
    }
}

#[test]
fn a_velocity_does_not_depend_on_what_was_computed_before() {
    let setup = Setup::default();
    let solver = Solver::new(&setup);
    let wide = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.5]);
    let ensemble = Ensemble::new(&wide, 3).unwrap();
    let mut used = Workspace::default();
    for index in (0..20).rev() {
        let bone = ensemble.bone(index).unwrap();
        let fresh = Solver::new(&setup).outcome(&bone, &mut Workspace::default());
        assert_eq!(solver.outcome(&bone, &mut used), fresh, "index {index}");
    }
}
