//! The hybrid method against references, against the exact method, and at its bounds.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on should say where")]

use std::fs;
use std::path::PathBuf;

use osteon_common::bone::{Bone, BoneRef, Sublayer, Sublayers};
use osteon_common::case::Setup;
use osteon_common::elasticity::Elasticity;
use osteon_common::outcome::FailureKind;
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_common::settings::{Extremum, Method};
use osteon_solver::{Arrival, Failure, Hybrid, HybridWorkspace, Isa, Solver, Workspace};
use serde_json::Value;

type Change = fn(&mut Setup);

fn setup(change: impl Fn(&mut Setup)) -> Setup {
    let mut setup = Setup::default();
    setup.solver.method = Method::Hybrid;
    change(&mut setup);
    setup
}

fn bone(dispersion: f64, seed: u64, index: u64) -> Bone {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion]);
    Ensemble::new(&point, seed).unwrap().bone(index).unwrap()
}

fn hybrid<'a>(setup: &Setup, bone: impl Into<BoneRef<'a>>) -> Result<Arrival, Failure> {
    Hybrid::new(setup).arrival(bone, &mut HybridWorkspace::default())
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn latest(times: &[f64], expected: &[f64]) -> f64 {
    times.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn check_reference(name: &str, extremum: Extremum) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/reference");
    let text = fs::read_to_string(path.join(format!("{name}.json"))).unwrap();
    let value: Value = serde_json::from_str(&text).unwrap();
    let mut rows = [[0.0; 6]; 6];
    for (row, from) in rows.iter_mut().zip(value["mandel"].as_array().unwrap()) {
        row.copy_from_slice(&numbers(from));
    }
    let setup = setup(|s| {
        s.layers.bone_thickness = value["thickness"].as_f64().unwrap();
        s.picking.extremum = extremum;
    });
    let density = value["density"].as_f64().unwrap();
    let bone = Bone { density, elasticity: Elasticity::new(rows).unwrap() };
    let arrival = hybrid(&setup, &bone).unwrap();
    let (velocity, times) = match extremum {
        Extremum::First => ("velocity", "times"),
        Extremum::Second => ("velocity_second", "times_second"),
    };
    let velocity = value["reference"][velocity].as_f64().unwrap();
    let error = arrival.velocity / velocity - 1.0;
    assert!(error.abs() < 1e-4, "{name}: {} against {velocity}: {error:e}", arrival.velocity);
    let late = latest(&arrival.times, &numbers(&value["reference"][times]));
    assert!(late < 1e-9, "{name}: {late} s");
}

#[test]
fn reference_cases() {
    for name in ["A", "D", "G"] {
        check_reference(name, Extremum::First);
    }
    check_reference("D", Extremum::Second);
}

/// The hybrid method and the refined exact one tell the same of a bone.
fn check_agreement<'a>(setup: &Setup, bone: impl Into<BoneRef<'a>>, relative: f64, what: &str) {
    let bone = bone.into();
    let mut refined = setup.clone();
    refined.solver.method = Method::Exact;
    refined.solver.refinement = 5.0;
    let exact = Solver::new(&refined).arrival(bone, &mut Workspace::default());
    match (hybrid(setup, bone), exact) {
        (Ok(hybrid), Ok(exact)) => {
            let error = (hybrid.velocity / exact.velocity - 1.0).abs();
            assert!(error < relative, "{what}: {error:e}");
            let late = latest(&hybrid.times, &exact.times);
            assert!(late < 1e-9, "{what}: {late} s");
            assert!(
                error < 10.0 * hybrid.estimated_error && hybrid.estimated_error < 1e-2,
                "{what}: error {error:e}, estimated {:e}",
                hybrid.estimated_error
            );
        }
        (Err(hybrid), Err(exact)) => {
            assert_eq!(hybrid.kind, exact.kind, "{what}: {}; {}", hybrid.detail, exact.detail);
        }
        (hybrid, exact) => panic!("{what}: {hybrid:?} against {exact:?}"),
    }
}

#[test]
fn random_draws_agree_with_the_exact_method() {
    for (thickness, dispersion, relative) in [
        (4e-3, 0.1, 1e-4),
        (4e-3, 0.6, 1e-4),
        (6e-3, 0.3, 1e-4),
        (2e-3, 0.3, 1e-4),
        (1e-3, 0.1, 3e-4),
    ] {
        let setup = setup(|s| s.layers.bone_thickness = thickness);
        for index in 0..2 {
            let what = format!("{thickness} m, dispersion {dispersion}, draw {index}");
            check_agreement(&setup, &bone(dispersion, 7, index), relative, &what);
        }
    }
}

/// Two halves, a thin sublayer between thick ones, and five of one thickness.
#[test]
fn sublayers_agree_with_the_exact_method() {
    let stacks: [&[f64]; 3] = [&[1.5e-3, 2.5e-3], &[2e-3, 0.3e-3, 1.7e-3], &[0.6e-3; 5]];
    for (seed, thicknesses) in (20..).zip(stacks) {
        let sublayers: Vec<Sublayer> = thicknesses
            .iter()
            .zip(0..)
            .map(|(&thickness, index)| Sublayer { thickness, solid: bone(0.2, seed, index) })
            .collect();
        let sublayers = Sublayers::new(&sublayers).unwrap();
        let setup = setup(|s| s.layers.bone_thickness = sublayers.thickness());
        check_agreement(&setup, &sublayers, 1e-4, &format!("{thicknesses:?}"));
    }
}

/// Bones whose coarser passes tell the same by accident, and a slow one in a thin plate.
#[test]
fn bones_that_converge_late_agree_with_the_exact_method() {
    for (thickness, index, relative) in [(1e-3, 2, 3e-4), (2e-3, 40, 1e-4), (4e-3, 25, 1e-4)] {
        let setup = setup(|s| s.layers.bone_thickness = thickness);
        let what = format!("{thickness} m, draw {index}");
        check_agreement(&setup, &bone(0.6, 7, index), relative, &what);
    }
}

#[test]
fn other_probes_and_layers_agree_with_the_exact_method() {
    let changes: [(&str, Change); 4] = [
        ("0.5 MHz", |s| s.probe.center_frequency = 0.5e6),
        ("a near outer face of the coupling", |s| s.layers.coupling.thickness = 4e-3),
        ("a thin marrow", |s| s.layers.marrow.thickness = 2.5e-3),
        ("unlike heights and fluids", |s| {
            s.probe.source.x3 = 1.3e-3;
            s.probe.receivers.x3 = 2.9e-3;
            s.layers.coupling.sound_speed = 1580.0;
            s.layers.marrow.density = 930.0;
        }),
    ];
    for (what, change) in changes {
        check_agreement(&setup(change), &bone(0.1, 7, 3), 1e-4, what);
    }
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    // Few and large elements at a low frequency: without fused multiply-adds each is a call.
    let setup = setup(|s| {
        s.solver.element_size = 1.5e-3;
        s.solver.element_order = 4;
        s.probe.center_frequency = 0.5e6;
        s.probe.source.x3 = 1e-3;
        s.probe.receivers.x3 = 1e-3;
        s.probe.receivers.first_x1 = 10e-3;
        s.probe.receivers.count = 3;
    });
    let bits = |isa: Isa| {
        let arrival = Hybrid::with_isa(&setup, isa)
            .arrival(&bone(0.2, 1, 0), &mut HybridWorkspace::default())
            .unwrap();
        let times: Vec<u64> = arrival.times.iter().map(|t| t.to_bits()).collect();
        (arrival.velocity.to_bits(), times, arrival.estimated_error.to_bits())
    };
    let sets = Isa::available();
    let expected = bits(sets[0]);
    for &isa in &sets[1..] {
        assert_eq!(bits(isa), expected, "{} against {}", isa.name(), sets[0].name());
    }
}

#[test]
fn a_velocity_does_not_depend_on_what_was_computed_before() {
    let setup = setup(|s| s.solver.element_size = 1e-3);
    let mut used = HybridWorkspace::default();
    let solver = Hybrid::new(&setup);
    for index in (0..4).rev() {
        let bone = bone(0.5, 3, index);
        let fresh = hybrid(&setup, &bone).map(|arrival| arrival.velocity);
        let again = solver.arrival(&bone, &mut used).map(|arrival| arrival.velocity);
        assert_eq!(again, fresh, "index {index}");
    }
}

#[test]
fn a_time_step_above_the_stability_limit_is_refused_with_the_limit() {
    let with_step =
        |step: f64| hybrid(&setup(|s| s.solver.time_step = Some(step)), &bone(0.1, 7, 0));
    let failure = with_step(20e-9).unwrap_err();
    assert_eq!(failure.kind, FailureKind::NoConvergence);
    assert!(failure.detail.contains("time step of 2e-8 s"), "{}", failure.detail);
    // The limit that it names is a step that works.
    let (_, limit) = failure.detail.split_once("stability limit of ").unwrap();
    let (limit, _) = limit.split_once(" s").unwrap();
    let limit: f64 = limit.parse().unwrap();
    assert!((2e-9..20e-9).contains(&limit), "{limit}");
    let (largest, default) = (with_step(limit).unwrap(), hybrid(&setup(|_| ()), &bone(0.1, 7, 0)));
    assert_eq!(largest, default.unwrap());
}

#[test]
fn a_finer_mesh_and_step_move_the_velocity_little() {
    let bone = bone(0.3, 7, 2);
    let usual = hybrid(&setup(|_| ()), &bone).unwrap();
    let finer = hybrid(&setup(|s| s.solver.refinement = 2.0), &bone).unwrap();
    let change = (usual.velocity / finer.velocity - 1.0).abs();
    assert!(change < 5e-5, "{change:e}");
    assert!(finer.estimated_error < usual.estimated_error);
}

#[test]
fn absurd_inputs_are_typed_failures_or_right() {
    let bone = bone(0.1, 7, 0);
    let kind = |change: Change| hybrid(&setup(change), &bone).map_err(|e| e.kind).err();
    assert_eq!(kind(|s| s.layers.bone_thickness = 1e-6), Some(FailureKind::NoConvergence));
    assert_eq!(kind(|s| s.solver.element_size = 1e-6), Some(FailureKind::NoConvergence));
    assert_eq!(kind(|s| s.probe.source.x3 = 1e-6), None);
    assert_eq!(kind(|s| s.probe.receivers.pitch = 10.0), Some(FailureKind::NoConvergence));
    assert_eq!(kind(|s| s.solver.time_step = Some(1e-15)), Some(FailureKind::NoConvergence));
    assert_eq!(
        kind(|s| s.layers.coupling.sound_speed = 4500.0),
        Some(FailureKind::DirectWaveFirst)
    );
}

/// The bound is on all passes of a bone together, and a thin plate that is refined stays within it.
#[test]
fn work_is_bounded_per_bone() {
    let bone = bone(0.1, 7, 0);
    let mut thin = setup(|s| s.layers.bone_thickness = 1e-3);
    thin.solver.refinement = 4.0;
    assert!(hybrid(&thin, &bone).unwrap().estimated_error < 1e-3);
    let wide = setup(|s| {
        s.probe.receivers.count = 64;
        s.probe.receivers.pitch = 5e-3;
    });
    let failure = hybrid(&wide, &bone).unwrap_err();
    assert_eq!(failure.kind, FailureKind::NoConvergence);
    assert!(failure.detail.contains("at most 8e8 are computed for one bone"), "{}", failure.detail);
    assert!(failure.detail.contains("solver.element_size"), "{}", failure.detail);
}

/// Passes that do not resolve the waves can agree; the estimate says that this means nothing.
#[test]
fn a_mesh_that_resolves_nothing_says_so() {
    let bone = bone(0.1, 7, 0);
    let exact = Solver::new(&Setup::default()).arrival(&bone, &mut Workspace::default()).unwrap();
    // With the least estimate that is honest; `None` where a failure is, too.
    for (element_size, element_order, least) in
        [(1e-2, 2, Some(1.0)), (1e-2, 4, None), (2e-3, 2, None), (1e-3, 2, None), (5e-3, 8, None)]
    {
        let setup = setup(|s| {
            s.solver.element_size = element_size;
            s.solver.element_order = element_order;
        });
        let Ok(found) = hybrid(&setup, &bone) else {
            assert_eq!(least, None, "{element_size} m, order {element_order}");
            continue;
        };
        let error = (found.velocity / exact.velocity - 1.0).abs();
        let estimate = found.estimated_error;
        assert!(
            error < 10.0 * estimate && (least.unwrap_or(0.0)..=1.0).contains(&estimate),
            "{element_size} m, order {element_order}: {error:e}, estimated {estimate:e}"
        );
    }
}
