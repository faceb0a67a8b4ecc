//! Pulses of every shape, and elements of a width: both methods against each other, and traces against
//! averages of those between lines.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use osteon_common::case::{Bone, Setup};
use osteon_common::parameters::Point;
use osteon_common::pulse::PulseForm;
use osteon_common::pulse_samples::PulseSamples;
use osteon_common::realization::Ensemble;
use osteon_common::settings::Method;
use osteon_solver::{Arrival, Solver, Workspace};

fn bone(dispersion: f64, index: u64) -> Bone {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion]);
    Ensemble::new(&point, 7).unwrap().bone(index).unwrap()
}

fn setup(pulse: PulseForm, element_width: f64) -> Setup {
    let mut setup = Setup::default();
    setup.probe.pulse = pulse;
    setup.probe.element_width = element_width;
    setup
}

fn arrival(setup: &Setup, method: Method, refinement: f64, bone: &Bone) -> Arrival {
    let mut setup = setup.clone();
    (setup.solver.method, setup.solver.refinement) = (method, refinement);
    Solver::new(&setup).arrival(bone, &mut Workspace::default()).unwrap()
}

#[test]
fn both_methods_agree_on_every_pulse_and_width() {
    use PulseForm::{Paper, Ricker, Tone};
    for (index, (pulse, width, thickness)) in (0..).zip([
        (Paper, 0.6e-3, 4e-3),
        (Tone { cycles: 1.0 }, 0.0, 4e-3),
        (Tone { cycles: 3.0 }, 0.5e-3, 2e-3),
        (Tone { cycles: 6.0 }, 0.0, 3e-3),
        (Ricker, 0.0, 1.5e-3),
        (Ricker, 0.7e-3, 5e-3),
        (transducer_pulse(), 0.0, 4e-3),
        (transducer_pulse(), 0.5e-3, 2e-3),
    ]) {
        let mut setup = setup(pulse.clone(), width);
        setup.layers.bone_thickness = thickness;
        let bone = bone(0.2, index);
        let refined = arrival(&setup, Method::Exact, 5.0, &bone);
        for method in [Method::Exact, Method::Hybrid] {
            let found = arrival(&setup, method, 1.0, &bone);
            let error = found.velocity / refined.velocity - 1.0;
            assert!(error.abs() < 1e-4, "{pulse:?}, {width}, {method:?}: {error:e}");
        }
    }
}

/// The response of a transducer of 0.9 MHz that rings for some microseconds, at steps of 40 ns.
fn transducer_pulse() -> PulseForm {
    let value = |t: f64| t * t * libm::exp(-2.2 * t) * libm::sin(5.65 * t);
    let values: Vec<f64> = (1..150).map(|j| value(0.04 * f64::from(j))).collect();
    PulseForm::Samples(PulseSamples::new(4e-8, &values).unwrap())
}

/// Samples of a formula give the velocity of the formula, the better the finer they are.
#[test]
fn samples_of_a_pulse_give_its_velocity() {
    let ricker = |t: f64| {
        let u = std::f64::consts::PI * (t - 1.25);
        (1.0 - 2.0 * u * u) * libm::exp(-u * u)
    };
    let bone = bone(0.1, 4);
    let expected = arrival(&setup(PulseForm::Ricker, 0.0), Method::Exact, 3.0, &bone).velocity;
    for (step, error_max) in [(0.1, 2e-4), (0.05, 1e-5), (0.02, 3e-6)] {
        let count = (2.9 / step) as u32;
        let values: Vec<f64> = (1..count).map(|j| ricker(step * f64::from(j))).collect();
        let pulse = PulseForm::Samples(PulseSamples::new(1e-6 * step, &values).unwrap());
        let found = arrival(&setup(pulse, 0.0), Method::Exact, 3.0, &bone).velocity;
        let error = (found / expected - 1.0).abs();
        assert!(error < error_max, "{step}: {error:e}");
    }
}

/// The pulse of two cycles is the paper's in every bit of the result.
#[test]
fn a_tone_of_two_cycles_gives_the_papers_bits() {
    for method in [Method::Exact, Method::Hybrid] {
        let of = |pulse| arrival(&setup(pulse, 0.0), method, 1.0, &bone(0.1, 1));
        assert_eq!(of(PulseForm::Tone { cycles: 2.0 }), of(PulseForm::Paper), "{method:?}");
    }
}

/// Nodes and weights of the mean of a function over ±0.6 mm, the differences of two places on elements of
/// that width: the weight falls linearly from the middle. Gauss-Legendre with four nodes on either side.
fn differences() -> Vec<(f64, f64)> {
    let inner = (3.0_f64 / 7.0 - 2.0 / 7.0 * 1.2_f64.sqrt()).sqrt();
    let outer = (3.0_f64 / 7.0 + 2.0 / 7.0 * 1.2_f64.sqrt()).sqrt();
    let (near, far) = ((18.0 + 30.0_f64.sqrt()) / 36.0, (18.0 - 30.0_f64.sqrt()) / 36.0);
    let side = [(-outer, far), (-inner, near), (inner, near), (outer, far)];
    let side = side.map(|(x, weight)| (0.5 * (1.0 + x), 0.5 * weight));
    let half = |sign: f64| side.map(|(x, weight)| (sign * 0.6e-3 * x, weight * (1.0 - x)));
    [half(-1.0), half(1.0)].concat()
}

/// Traces, with the direct wave and the reflections of the outer faces, are the means of those between lines
/// at all places of the elements.
#[test]
fn traces_of_wide_elements_are_means_over_lines() {
    let bone = bone(0.2, 3);
    let traces = |setup: &Setup| Solver::new(setup).traces(&bone, 12e-6, 50e-9).unwrap().pressures;
    let mut wide = setup(PulseForm::Ricker, 0.6e-3);
    wide.layers.coupling.thickness = 5e-3;
    wide.probe.receivers.count = 3;
    let found = traces(&wide);
    let mut mean = vec![vec![0.0; found[0].len()]; 3];
    for (difference, weight) in differences() {
        let mut lines = wide.clone();
        lines.probe.element_width = 0.0;
        lines.probe.receivers.first_x1 += difference;
        for (mean, trace) in mean.iter_mut().zip(traces(&lines)) {
            for (mean, pressure) in mean.iter_mut().zip(trace) {
                *mean += weight * pressure;
            }
        }
    }
    let mut lines = wide;
    lines.probe.element_width = 0.0;
    for ((found, mean), line) in found.iter().zip(&mean).zip(traces(&lines)) {
        let largest = mean.iter().fold(0.0_f64, |largest, p| largest.max(p.abs()));
        let off = |other: &[f64]| {
            let off = found.iter().zip(other).map(|(a, b)| (a - b).abs());
            off.fold(0.0, f64::max) / largest
        };
        // Traces are accurate to 1e-3; without the width the direct wave would be 0.6 times as large again.
        assert!(off(mean) < 1e-3, "{:e}", off(mean));
        assert!(off(&line) > 0.3, "{:e}", off(&line));
    }
}

/// Times of a tilted probe of wide elements are those of lines to within the curvature of the paths.
#[test]
fn a_tilted_probe_of_wide_elements_is_as_fast_as_one_of_lines() {
    for width in [0.3e-3, 0.7e-3] {
        let mut setup = setup(PulseForm::Paper, width);
        (setup.probe.tilt, setup.probe.bidirectional) = (0.02, true);
        let wide = arrival(&setup, Method::Exact, 2.0, &bone(0.1, 2));
        setup.probe.element_width = 0.0;
        let lines = arrival(&setup, Method::Exact, 2.0, &bone(0.1, 2));
        let [there, back] =
            [0, 1].map(|i| wide.directions.unwrap()[i] / lines.directions.unwrap()[i] - 1.0);
        assert!(
            there.abs() < 2e-3 && back.abs() < 2e-3 && there != 0.0,
            "{width}: {there:e} {back:e}"
        );
    }
}
