//! Whatever passes validation gives a velocity or a kind of failure: never a panic, never a NaN,
//! with bits that depend on the case alone.

use faer::{Mat, Side};
use osteon_common::case::{Bone, Setup};
use osteon_common::check;
use osteon_common::elasticity::{Elasticity, EngineeringConstants};
use osteon_common::layers::{Fluid, Layers};
use osteon_common::parameters::Point;
use osteon_common::probe::{Probe, Receivers, Source};
use osteon_common::pulse::PulseForm;
use osteon_common::realization::Ensemble;
use osteon_common::sampling::{WaveSampling, pair_count};
use osteon_common::violations::Violations;
use osteon_fuzz::properties;
use osteon_solver::{Isa, Solver, Workspace};
use proptest::prelude::*;

/// Setups with more pairs are left out: they are as right, and take too long here.
const PAIRS_MAX: f64 = 3e4;

type Change = fn(&mut Setup);

/// 10^exponent for an exponent between the given ones.
fn decades(from: f64, to: f64) -> impl Strategy<Value = f64> {
    (from..to).prop_map(libm::exp10)
}

/// Up to fluids as heavy as bone.
fn fluid() -> impl Strategy<Value = Fluid> {
    (decades(-3.5, -1.5), 1.0..3000.0, 300.0..2500.0).prop_map(
        |(thickness, density, sound_speed)| Fluid {
            thickness,
            density,
            sound_speed,
            ..Layers::default().coupling
        },
    )
}

/// Returns a tilt with which neither source nor receivers reach a face of the coupling.
fn largest_tilt(heights: (f64, f64), thickness: f64, row: (f64, f64, u32)) -> f64 {
    let across = heights.0.min(heights.1).min(1.0 - heights.0.max(heights.1)) * thickness;
    let along = 2.0 * row.0 + row.1 * f64::from(row.2) + thickness;
    (across / along).min(0.2)
}

fn pulse() -> impl Strategy<Value = PulseForm> {
    let tone = (1.0..6.0).prop_map(|cycles| PulseForm::Tone { cycles });
    prop_oneof![2 => Just(PulseForm::default()), 1 => tone, 1 => Just(PulseForm::Ricker)]
}

/// Receivers from 1 mm to 50 mm, rarely much nearer, up to 64 of them, up to 10 mm apart.
fn setup() -> impl Strategy<Value = Setup> {
    let probe = (
        0.25e6..2e6,
        (0.01..0.99, 0.01..0.99),
        (
            prop_oneof![8 => decades(-3.0, -1.3), 1 => decades(-300.0, -3.0)],
            decades(-4.0, -2.0),
            3_u32..=64,
        ),
        (prop_oneof![2 => Just(0.0), 1 => -0.9..0.9], any::<bool>()),
        (pulse(), prop_oneof![2 => Just(0.0), 1 => 0.0..0.99], prop::option::of(decades(0.0, 9.0))),
    );
    let plate = prop_oneof![1 => decades(-6.0, -3.3), 3 => decades(-3.3, -2.09)];
    (fluid(), plate, fluid(), probe).prop_map(
        |(
            coupling,
            bone_thickness,
            marrow,
            (
                center_frequency,
                heights,
                row,
                (share, bidirectional),
                (pulse, width, guided_wave_frequency),
            ),
        )| Setup {
            layers: Layers { coupling, bone_thickness, marrow, ..Layers::default() },
            probe: Probe {
                tilt: share * largest_tilt(heights, coupling.thickness, row),
                bidirectional,
                center_frequency,
                amplitude: 100.0,
                pulse,
                guided_wave_frequency,
                a0_in_fluids: guided_wave_frequency.is_some(),
                element_width: width * row.0.min(row.1),
                source: Source { x1: 0.0, x3: heights.0 * coupling.thickness },
                receivers: Receivers {
                    first_x1: row.0,
                    pitch: row.1,
                    count: row.2,
                    x3: heights.1 * coupling.thickness,
                },
            },
            ..Setup::default()
        },
    )
}

/// Draws of the paper's optimum, hardly scattered (so that u2 is nearly decoupled) to as wide as
/// there is.
fn random_bone() -> impl Strategy<Value = Option<Bone>> {
    (decades(-4.0, -0.11), any::<u32>(), 0..1000_u64).prop_map(|(dispersion, seed, index)| {
        let point =
            Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion]);
        Ensemble::new(&point, u64::from(seed)).ok()?.bone(index).ok()
    })
}

/// Isotropic solids, soft to stiff, with any Poisson ratio.
fn isotropic_bone() -> impl Strategy<Value = Option<Bone>> {
    (500.0..3000.0, decades(7.0, 11.0), -0.9..0.4999).prop_map(|(density, modulus, ratio)| {
        let constants = EngineeringConstants {
            longitudinal_young_modulus: modulus,
            longitudinal_poisson_ratio: ratio,
            longitudinal_shear_modulus: 0.5 * modulus / (1.0 + ratio),
            transverse_young_modulus: modulus,
            transverse_poisson_ratio: ratio,
        };
        Some(Bone { density, elasticity: constants.elasticity().ok()? })
    })
}

/// What fits on a setup, or, for `None`, a solid with the coupling's impedance and sound speed.
fn bone() -> impl Strategy<Value = Option<Bone>> {
    prop_oneof![4 => random_bone(), 2 => isotropic_bone(), 1 => Just(None)]
}

/// The solid whose density and longitudinal speed are the coupling's.
fn bone_like_coupling(setup: &Setup) -> Option<Bone> {
    let Fluid { density, sound_speed, .. } = setup.layers.coupling;
    let stiffness = density * sound_speed * sound_speed;
    let mut rows = [[0.0; 6]; 6];
    for i in 0..3 {
        rows[i][..3].fill(0.6 * stiffness);
        rows[i][i] = stiffness;
        rows[i + 3][i + 3] = 0.4 * stiffness;
    }
    Some(Bone { density, elasticity: Elasticity::new(rows).ok()? })
}

/// No wave along x1 is faster, m/s.
fn speed_bound(setup: &Setup, bone: &Bone) -> f64 {
    let acoustic = Mat::from_fn(3, 3, |i, m| bone.elasticity.component(i, 0, m, 0));
    let largest = acoustic.self_adjoint_eigenvalues(Side::Lower).map_or(f64::NAN, |all| all[2]);
    let fluids = setup.layers.coupling.sound_speed.max(setup.layers.marrow.sound_speed);
    (largest / bone.density).sqrt().max(fluids)
}

fn is_admissible(setup: &Setup) -> bool {
    let mut violations = Violations::new();
    check::setup(setup, &mut violations);
    violations.is_empty() && pair_count(setup) < PAIRS_MAX
}

/// Pressures or a typed refusal, of a few periods at a few times.
fn check_traces(solver: &Solver, bone: &Bone) {
    let duration = 2.0 / solver.setup().probe.center_frequency;
    let sampling =
        WaveSampling::for_traces(solver.setup(), speed_bound(solver.setup(), bone), duration);
    if sampling.pairs(sampling.whole_band()) > PAIRS_MAX {
        return;
    }
    match solver.traces(bone, duration, duration / 16.0) {
        Ok(traces) => {
            assert_eq!(traces.pressures.len(), solver.setup().probe.receivers.count as usize);
            for pressures in &traces.pressures {
                assert_eq!(pressures.len(), traces.times.len());
                assert!(pressures.iter().all(|pressure| pressure.is_finite()));
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// All receivers count, and what the message names is accepted.
#[test]
fn traces_are_bounded_together() {
    let mut setup = Setup::default();
    let bone = bone_like_coupling(&setup).unwrap();
    setup.probe.receivers.count = 64;
    let solver = Solver::new(&setup);
    let refusal = |duration, time_step| {
        let found = solver.traces(&bone, duration, time_step);
        found.map_err(|error| error.to_string()).unwrap_err()
    };
    assert_eq!(
        refusal(16e-6, 1e-11),
        "traces of 1.6e-5 s every 1e-11 s at 64 receivers are 1.0e8 pressures; at most 5e6 are computed: \
         give a --time-step of 2.07e-10 s or more, shorten --duration, or lower probe.receivers.count"
    );
    assert!(refusal(16e-6, 2e-10).contains("64 receivers are 5.1e6 pressures"));
    for (duration, time_step) in [(1e-9, 2e-9), (-1.0, 1.0), (1.0, 0.0), (f64::NAN, 1.0)] {
        let text = refusal(duration, time_step);
        assert!(
            text.ends_with("--time-step must be above 0, and --duration at least as long"),
            "{text}"
        );
    }
    // As many, of a shorter time.
    let traces = solver.traces(&bone, 1e-6, 2.07e-10 / 16.0).unwrap();
    assert!(traces.pressures.len() * traces.times.len() < 5_000_000);
}

/// The direct wave of a receiver at the source is infinite there, and finite next to it.
#[test]
fn traces_next_to_the_source_end() {
    let mut setup = Setup::default();
    setup.probe.receivers.count = 3;
    let bone = bone_like_coupling(&setup).unwrap();
    let mut before = 0.0;
    for first_x1 in [1e-3, 1e-6, 1e-12, 1e-20, 1e-40, 1e-300] {
        setup.probe.receivers.first_x1 = first_x1;
        let traces = Solver::new(&setup).traces(&bone, 2e-6, 1e-7).unwrap();
        let largest =
            |r: usize| traces.pressures[r].iter().fold(0.0_f64, |max, p| max.max(p.abs()));
        // It grows as the logarithm of the distance.
        assert!(largest(0) > before, "{first_x1}: {} Pa", largest(0));
        assert!(largest(0) < 1e3 * largest(1), "{first_x1}: {} Pa", largest(0));
        before = largest(0);
    }
}

properties! {
    #![cases(100)]

    fn a_velocity_or_a_typed_failure(setup in setup(), bone in bone()) {
        prop_assume!(is_admissible(&setup));
        let Some(bone) = bone.or_else(|| bone_like_coupling(&setup)) else {
            return Ok(());
        };
        let solver = Solver::new(&setup);
        let mut workspace = Workspace::default();
        let found = solver.arrival(&bone, &mut workspace);
        match &found {
            Ok(arrival) => {
                prop_assert!(arrival.velocity.is_finite() && arrival.velocity > 0.0);
                // An extremum's apparent velocity may exceed every wave's; its way from the source
                // does not.
                let bound = speed_bound(&setup, &bone);
                for (x1, &time) in setup.probe.receivers.positions().zip(&arrival.times) {
                    prop_assert!(time.is_finite() && x1 < bound * time, "{x1} m in {time} s, {bound} m/s");
                }
                prop_assert_eq!(arrival.times.len(), setup.probe.receivers.count as usize);
                prop_assert!(arrival.estimated_error.is_finite());
                prop_assert!(arrival.estimated_error >= 0.0);
                let signal = solver.first_signal(&bone, arrival, &mut workspace);
                prop_assert!(signal.decay.is_finite());
                prop_assert!(signal.center_frequency.is_none_or(|f| f.is_finite() && f > 0.0));
            }
            Err(failure) => prop_assert!(!failure.detail.is_empty()),
        }
        check_traces(&solver, &bone);
        let waves = solver.guided_waves(&bone);
        prop_assert!(waves.a0.is_some() != waves.a0_radiates && waves.s0.is_some(), "{waves:?}");
        for wave in [waves.a0, waves.s0].into_iter().flatten() {
            let phase = wave.phase_velocity;
            prop_assert!(phase > 0.0 && phase < 1.001 * speed_bound(&setup, &bone), "{waves:?}");
            prop_assert!(wave.group_velocity.is_finite(), "{waves:?}");
        }
        // Another bone in between leaves no mark.
        if let Some(other) = bone_like_coupling(&setup) {
            let _other = solver.arrival(&other, &mut workspace);
        }
        prop_assert_eq!(&solver.arrival(&bone, &mut workspace), &found);
        // The slowest set of all has no fused multiply-add, and takes fifty times as long.
        for isa in Isa::available().into_iter().skip(1).take(2) {
            let again = Solver::with_isa(&setup, isa).arrival(&bone, &mut Workspace::default());
            prop_assert_eq!(&again, &found, "{}", isa.name());
        }
    }
}

/// Messages say what may be wrong, and no number in them has hundreds of digits.
#[test]
fn numbers_out_of_scale_are_told_in_short() {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1]);
    let bone = Ensemble::new(&point, 1).unwrap().bone(0).unwrap();
    let changes: [(&str, Change); 5] = [
        ("thickness", |s| s.layers.bone_thickness = 1e-12),
        ("frequency", |s| s.probe.center_frequency = 1e-9),
        ("speed", |s| s.layers.marrow.sound_speed = 1e300),
        ("distance", |s| s.probe.receivers.first_x1 = 1e300),
        ("amplitude", |s| s.probe.amplitude = 1e300),
    ];
    for (what, change) in changes {
        let mut setup = Setup::default();
        change(&mut setup);
        let solver = Solver::new(&setup);
        if let Err(failure) = solver.arrival(&bone, &mut Workspace::default()) {
            let text = failure.detail;
            assert!(text.len() < 200, "{what}: {text}");
            assert!(!text.contains("NaN") || text.contains("layers, probe"), "{what}: {text}");
        }
    }
    let mut setup = Setup::default();
    setup.probe.amplitude = 1e306;
    setup.probe.receivers.first_x1 = 1e-9;
    let refused = Solver::new(&setup).traces(&bone, 4e-6, 1e-7).map_err(|error| error.to_string());
    assert_eq!(
        refused.unwrap_err(),
        "a pressure came out as NaN or infinite; a number of layers, probe, density or elasticity is out of scale"
    );
}
