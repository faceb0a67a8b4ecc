//! The fundamental guided waves against the Rayleigh-Lamb equations, the limits of thin plates, and two
//! dense systems: polynomials across the plate, and eigenvectors of the first-order system.

use std::f64::consts::TAU;

use faer::prelude::Solve as _;
use faer::{Mat, Side, c64};
use osteon_common::attenuation::Attenuation;
use osteon_common::case::{Bone, Setup};
use osteon_common::elasticity::Elasticity;
use osteon_solver::{GuidedWave, GuidedWaves, Isa, Solver};

use super::rayleigh_lamb::rayleigh_lamb;
use super::{isotropic, optimum, random_bone};

fn setup(thickness: f64, frequency: f64) -> Setup {
    let mut setup = Setup::default();
    setup.layers.bone_thickness = thickness;
    setup.probe.center_frequency = frequency;
    setup
}

fn waves(bone: &Bone, thickness: f64, frequency: f64) -> GuidedWaves {
    Solver::new(&setup(thickness, frequency)).guided_waves(bone)
}

fn both(waves: &GuidedWaves) -> [GuidedWave; 2] {
    [waves.a0.unwrap(), waves.s0.unwrap()]
}

/// A random bone of the seed of these tests.
fn draw(dispersion: f64, index: u64) -> Bone {
    random_bone(17, dispersion, index)
}

/// Phase and group velocity of a root that is followed from low frequencies, where it is `start`.
fn follow_root(slow: f64, symmetric: bool, omega: f64, start: impl Fn(f64) -> f64) -> [f64; 2] {
    let function = |k: f64, omega: f64| rayleigh_lamb(slow, symmetric, k, omega);
    let steps = 8000;
    let at = |step: i32| omega * f64::from(step) / f64::from(steps);
    let (mut before, mut k) = (start(at(7)), start(at(8)));
    for step in 9..=steps {
        let expected = 2.0 * k - before;
        before = k;
        k = nearest_root(|k| function(k, at(step)), expected);
    }
    let small = 1e-6;
    let by_k = function(k * (1.0 + small), omega) - function(k * (1.0 - small), omega);
    let by_omega = function(k, omega * (1.0 + small)) - function(k, omega * (1.0 - small));
    [omega / k, -(by_k / k) / (by_omega / omega)]
}

fn nearest_root(function: impl Fn(f64) -> f64, expected: f64) -> f64 {
    for width in 1..200 {
        let reach = 1e-4 * f64::from(width) * expected;
        let (mut low, mut high) = (expected - reach, expected + reach);
        if function(low) * function(high) > 0.0 {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let same = function(middle) * function(low) > 0.0;
            *(if same { &mut low } else { &mut high }) = middle;
        }
        return low;
    }
    f64::NAN
}

#[test]
fn an_isotropic_plate_obeys_rayleigh_and_lamb() {
    let young = 16e9;
    for poisson in [0.2, 0.3, 0.38] {
        let bone = isotropic(young, poisson);
        let shear = (bone.elasticity.component(1, 2, 1, 2) / bone.density).sqrt();
        let slow = (0.5 * (1.0 - 2.0 * poisson) / (1.0 - poisson)).sqrt();
        let plate = (young / (1.0 - poisson * poisson) / bone.density).sqrt() / shear;
        for (thickness, frequency) in [(1e-3, 0.1e6), (1e-3, 1e6), (2e-3, 1e6), (3e-3, 1.3e6)] {
            let [a0, s0] = both(&waves(&bone, thickness, frequency));
            let omega = TAU * frequency * 0.5 * thickness / shear;
            let flexural = |omega: f64| (3.0f64.sqrt() * omega / plate).sqrt();
            let expected_a0 = follow_root(slow, false, omega, flexural);
            let expected_s0 = follow_root(slow, true, omega, |omega| omega / plate);
            for (found, [phase, group]) in [(a0, expected_a0), (s0, expected_s0)] {
                let phase = found.phase_velocity / (phase * shear) - 1.0;
                let group = found.group_velocity / (group * shear) - 1.0;
                // The group velocity is a difference quotient.
                assert!(
                    phase.abs() < 1e-10 && group.abs() < 3e-7,
                    "{poisson}, {thickness} m, {frequency} Hz, {found:?}: {phase:e}, {group:e}"
                );
            }
        }
    }
}

/// c1111 where the tractions on planes of constant x3 are zero, and with it the limits of thin plates.
#[test]
fn thin_plates_have_the_velocities_of_membranes_and_of_bending() {
    for bone in [optimum(), draw(0.1, 3), draw(0.4, 8)] {
        let rows = bone.elasticity.rows();
        // Condensed 11, 12 by 33, 23, 31; 12 of the membrane couples extension to shear.
        let block = |of: &[usize], with: &[usize]| {
            Mat::from_fn(of.len(), with.len(), |i, j| rows[of[i]][with[j]])
        };
        let (plane, across) = ([0, 5], [2, 3, 4]);
        let condensed = block(&plane, &plane)
            - block(&plane, &across)
                * block(&across, &across).partial_piv_lu().solve(block(&across, &plane));
        let (c11, c16) = (condensed[(0, 0)], condensed[(0, 1)] / 2.0f64.sqrt());
        let c66 = 0.5 * condensed[(1, 1)];
        let largest = 0.5 * (c11 + c66) + (0.25 * (c11 - c66).powi(2) + c16 * c16).sqrt();
        let (thickness, frequency) = (0.05e-3, 20e3);
        let [a0, s0] = both(&waves(&bone, thickness, frequency));
        let extensional = (largest / bone.density).sqrt();
        let bending: f64 = c11 * thickness * thickness / (12.0 * bone.density);
        let flexural = (TAU * frequency).sqrt() * bending.powf(0.25);
        for (found, phase, group) in
            [(s0, extensional, extensional), (a0, flexural, 2.0 * flexural)]
        {
            // What is neglected grows as the square of k times the thickness, here 0.05 for A0.
            assert!((found.phase_velocity / phase - 1.0).abs() < 3e-3, "{found:?}, {phase}");
            assert!((found.group_velocity / group - 1.0).abs() < 6e-3, "{found:?}, {group}");
        }
    }
}

#[test]
fn plates_thinner_than_rounding_have_no_waves() {
    for (thickness, found) in [(1e-6, true), (1e-12, false)] {
        let waves = waves(&draw(0.1, 3), thickness, 1e6);
        assert_eq!(waves.a0.is_some(), found, "{thickness}: {waves:?}");
        assert_eq!(waves.reason().is_none(), found, "{thickness}: {waves:?}");
    }
    // The largest error of bending: its velocity and the one of its group, which is twice as large.
    let waves = waves(&optimum(), 1e-7, 0.25e6);
    let a0 = waves.a0.unwrap();
    assert!((a0.group_velocity / a0.phase_velocity - 2.0).abs() < 2e-3, "{a0:?}");
}

/// Frequencies (rad/s) of all waves at one wavenumber in ascending order, with their group velocities,
/// by Legendre polynomials across the plate.
fn by_polynomials(c: &Elasticity, density: f64, h: f64, k: f64, degree: usize) -> Vec<[f64; 2]> {
    let block = |j: usize, l: usize| move |i: usize, m: usize| c.component(i, j, m, l);
    let (a11, a13, a31, a33) = (block(0, 0), block(0, 2), block(2, 0), block(2, 2));
    let norm = |n: usize| (n as f64 + 0.5).sqrt();
    let slope = |m: usize, n: usize| match m > n && (m - n) % 2 == 1 {
        true => 2.0 * norm(m) * norm(n),
        false => 0.0,
    };
    let bend = |m: usize, n: usize| {
        let low = m.min(n);
        if (m + n).is_multiple_of(2) { norm(m) * norm(n) * (low * (low + 1)) as f64 } else { 0.0 }
    };
    let size = 3 * (degree + 1);
    // Stiffness and its derivative by k, both divided by the mass.
    let matrix = |derivative: bool| {
        let (first, second) = if derivative { (1.0, 2.0 * k) } else { (k, k * k) };
        Mat::from_fn(size, size, |row, column| {
            let ((m, i), (n, j)) = ((row / 3, row % 3), (column / 3, column % 3));
            let mut real = if m == n { second * a11(i, j) * 0.5 * h } else { 0.0 };
            if !derivative {
                real += a33(i, j) * bend(m, n) * 2.0 / h;
            }
            let imaginary = first * (a31(i, j) * slope(m, n) - a13(i, j) * slope(n, m));
            c64::new(real, imaginary) / (0.5 * h * density)
        })
    };
    let eigen = matrix(false).self_adjoint_eigen(Side::Lower).unwrap();
    let slopes = eigen.U().adjoint() * matrix(true) * eigen.U();
    let omega = |n: usize| eigen.S()[n].re.max(0.0).sqrt();
    (0..size).map(|n| [omega(n), slopes[(n, n)].re / (2.0 * omega(n))]).collect()
}

/// Smallest singular value, relative to the largest, of the tractions at both faces by the waves of the
/// first-order system: 0 where the plate has a free wave.
fn free_tractions(bone: &Bone, h: f64, k: f64, omega: f64) -> f64 {
    let c = &bone.elasticity;
    let block = |j: usize, l: usize| Mat::from_fn(3, 3, |i, m| c64::from(c.component(i, j, m, l)));
    let identity: Mat<c64> = Mat::identity(3, 3);
    let inverse = block(2, 2).partial_piv_lu().solve(&identity);
    let coupling = &inverse * block(2, 0);
    let membrane = block(0, 0) - block(0, 2) * &coupling;
    let back = block(0, 2) * &inverse;
    let (ik, unit) = (c64::new(0.0, k), c.rows()[0][0] * k);
    let system = Mat::from_fn(6, 6, |i, j| match (i < 3, j < 3) {
        (true, true) => -ik * coupling[(i, j)],
        (true, false) => inverse[(i, j - 3)] * unit,
        (false, true) => {
            let mass = if i - 3 == j { bone.density * omega * omega } else { 0.0 };
            (membrane[(i - 3, j)] * (k * k) - mass) / unit
        }
        (false, false) => -ik * back[(i - 3, j - 3)],
    });
    let eigen = system.eigen().unwrap();
    let tractions = Mat::from_fn(6, 6, |i, j| {
        let wave = eigen.S()[j];
        // Each wave is of size one at the face from which it decays.
        let grows = wave.re > 0.0;
        let depth = if grows == (i < 3) {
            0.0
        } else if grows {
            -h
        } else {
            h
        };
        eigen.U()[(i % 3 + 3, j)] * (wave * depth).exp()
    });
    let values = tractions.singular_values().unwrap();
    values[5] / values[0]
}

/// Ranks of both waves among all, and errors of their velocities.
fn check(bone: &Bone, thickness: f64, frequency: f64, rank: impl Fn(usize, &[[f64; 2]]) -> usize) {
    let omega = TAU * frequency;
    for (place, found) in both(&waves(bone, thickness, frequency)).into_iter().enumerate() {
        let k = omega / found.phase_velocity;
        let all = by_polynomials(&bone.elasticity, bone.density, thickness, k, 24);
        let [expected, group] = all[rank(place, &all)];
        let error = expected / omega - 1.0;
        assert!(error.abs() < 1e-9, "wave {place}, {thickness} m, {found:?}: {error:e}");
        let error = found.group_velocity / group - 1.0;
        assert!(error.abs() < 1e-5, "wave {place}, {thickness} m, {found:?}: {group}");
        let there = free_tractions(bone, thickness, k, omega);
        let beside = free_tractions(bone, thickness, 1.001 * k, omega);
        assert!(there < 1e-6 * beside, "wave {place}, {thickness} m: {there:e}, {beside:e}");
    }
}

#[test]
fn waves_of_the_optimum_are_waves_of_dense_systems() {
    // No wave is below A0, but S0 crosses waves of horizontal shear.
    let nearest = |omega: f64| {
        move |place: usize, all: &[[f64; 2]]| {
            let distance = |n: &usize| (all[*n][0] - omega).abs();
            let count = if place == 0 { 1 } else { all.len() };
            (0..count).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
        }
    };
    for (thickness, frequency) in [(0.5e-3, 0.5e6), (1e-3, 1e6), (2e-3, 1e6), (4e-3, 1e6)] {
        check(&optimum(), thickness, frequency, nearest(TAU * frequency));
    }
}

/// No two waves of a triclinic plate cross, so that A0 is the first of all and S0 the third.
#[test]
fn waves_of_random_bones_are_the_first_and_the_third_of_dense_systems() {
    for (dispersion, index) in [(0.1, 0), (0.1, 5), (0.3, 1), (0.5, 2)] {
        for (thickness, frequency) in [(0.5e-3, 0.5e6), (1e-3, 1e6), (3e-3, 1e6)] {
            let bone = draw(dispersion, index);
            check(&bone, thickness, frequency, |place, _| 2 * place);
        }
    }
}

#[test]
fn fluids_method_attenuation_and_processor_do_not_matter() {
    let bone = draw(0.1, 0);
    let expected = waves(&bone, 2e-3, 1e6);
    let mut other = setup(2e-3, 1e6);
    other.layers.coupling.density = 900.0;
    other.solver.refinement = 4.0;
    other.layers.bone_attenuation =
        Attenuation { quality_factor: Some(10.0), reference_frequency: 1e6 };
    for isa in Isa::available() {
        assert_eq!(Solver::with_isa(&other, isa).guided_waves(&bone), expected, "{}", isa.name());
    }
}
