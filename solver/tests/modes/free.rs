//! All guided waves of a plate or stack in a vacuum against the equations of Rayleigh and Lamb, cut-off
//! frequencies in closed form, and scans over finite elements.

use std::f64::consts::{PI, TAU};

use faer::{Mat, Side};
use osteon_common::bone::{Bone, BoneRef, Sublayers};
use osteon_common::case::Setup;
use osteon_solver::{Isa, Mode, ModesError, Solver};

use super::finite_elements::{FiniteElements, roots};
use super::rayleigh_lamb::rayleigh_lamb;
use super::{across, draw, isotropic, optimum, solver, stack};

fn modes(bone: &Bone, thickness: f64, frequency: f64) -> Vec<Mode> {
    solver(thickness).modes(bone, frequency).unwrap()
}

fn modes_of_stack(stack: &Sublayers, frequency: f64) -> Vec<Mode> {
    solver(stack.thickness()).modes(stack, frequency).unwrap()
}

/// Roots with the group velocity, which is below zero where a wave is a backward one.
fn lamb_waves(slow: f64, symmetric: bool, omega: f64) -> Vec<[f64; 2]> {
    let function = |k: f64, omega: f64| rayleigh_lamb(slow, symmetric, k, omega);
    // No wave is slower than half a shear wave, but for A0 below the frequencies here.
    let found = roots(|k| function(k, omega), 3.0 * omega, 200_000);
    let small = 1e-6;
    let group = |k: f64| {
        let by_k = function(k * (1.0 + small), omega) - function(k * (1.0 - small), omega);
        let by_omega = function(k, omega * (1.0 + small)) - function(k, omega * (1.0 - small));
        -(by_k / k) / (by_omega / omega)
    };
    found.into_iter().map(|k| [k, group(k)]).collect()
}

fn of_family<'a>(modes: &'a [Mode], family: &str) -> Vec<&'a Mode> {
    let mut found: Vec<_> = modes.iter().filter(|mode| mode.family == family).collect();
    found.sort_by(|a, b| a.wavenumber.total_cmp(&b.wavenumber));
    found
}

#[test]
fn an_isotropic_plate_has_the_waves_of_rayleigh_and_lamb() {
    let (young, thickness) = (16e9, 3e-3);
    let mut backward = 0;
    for poisson in [0.2, 0.3, 0.38] {
        let bone = isotropic(young, poisson);
        let shear = across(&bone)[0];
        let slow = (0.5 * (1.0 - 2.0 * poisson) / (1.0 - poisson)).sqrt();
        // Frequency times thickness, divided by the shear velocity; at 0.91, S1 is a backward wave, too.
        for scaled in [0.3, 0.7, 0.91, 1.6, 3.3, 6.1] {
            let found = modes(&bone, thickness, scaled * shear / thickness);
            for (family, symmetric) in [("symmetric", true), ("antisymmetric", false)] {
                let expected = lamb_waves(slow, symmetric, PI * scaled);
                let found = of_family(&found, family);
                assert_eq!(found.len(), expected.len(), "{poisson}, {scaled}, {family}: {found:?}");
                for (mode, [k, group]) in found.into_iter().zip(expected) {
                    let error = mode.wavenumber * 0.5 * thickness / k - 1.0;
                    assert!(error.abs() < 1e-9, "{poisson}, {scaled}, {mode:?}: {error:e}");
                    let error = mode.group_velocity / shear - group;
                    assert!(error.abs() < 1e-5, "{poisson}, {scaled}, {mode:?}: {error:e}");
                    backward += usize::from(mode.group_velocity < 0.0);
                }
            }
            for (family, first) in [("shear_symmetric", 0), ("shear_antisymmetric", 1)] {
                // (kh)² = (ωh/c)² - (nπ)², for n below twice the scaled frequency.
                let square = |n: i32| (TAU * scaled).powi(2) - (PI * f64::from(n)).powi(2);
                let numbers: Vec<i32> =
                    (first..40).step_by(2).filter(|n| square(*n) > 0.0).collect();
                let found = of_family(&found, family);
                assert_eq!(found.len(), numbers.len(), "{poisson}, {scaled}, {family}");
                for (mode, n) in found.into_iter().rev().zip(numbers) {
                    assert_eq!(mode.name, Some(format!("SH{n}")));
                    let error = mode.wavenumber * thickness / square(n).sqrt() - 1.0;
                    assert!(error.abs() < 1e-9, "{poisson}, {scaled}, {mode:?}: {error:e}");
                }
            }
        }
    }
    assert!(backward >= 1, "{backward} backward waves");
}

/// With Poisson's ratio ¼, waves of a single face have the velocity √(2 - 2/√3) of shear waves (Rayleigh). In a thin
/// plate S0 has the velocity √(E/(ρ (1 - ν²))).
#[test]
fn thick_and_thin_plates_have_the_velocities_of_a_face_and_of_a_membrane() {
    let (young, poisson, thickness) = (16e9, 0.25, 3e-3);
    let bone = isotropic(young, poisson);
    let shear = across(&bone)[0];
    let face = shear * (2.0 - 2.0 / 3.0f64.sqrt()).sqrt();
    let membrane = (young / (1.0 - poisson * poisson) / bone.density).sqrt();
    // Both faces know of each other by exp(-32). The membrane is slower by (kh)² ν²/(24 (1 - ν)²) = 1.7e-4.
    for (name, scaled, expected, limit) in
        [("A0", 12.0, face, 1e-10), ("S0", 12.0, face, 1e-10), ("S0", 0.05, membrane, 2e-4)]
    {
        let found = modes(&bone, thickness, scaled * shear / thickness);
        let mode = found.iter().find(|mode| mode.name.as_deref() == Some(name)).unwrap();
        let error = mode.phase_velocity / expected - 1.0;
        assert!(error.abs() < limit, "{scaled}, {mode:?}: {error:e}");
    }
}

/// A thin plate has A0, S0 and SH0 alone, however low the frequency.
#[test]
fn thin_plates_have_three_waves() {
    let (young, poisson, thickness) = (16e9, 0.25, 3e-3);
    let bone = isotropic(young, poisson);
    let shear = across(&bone)[0];
    let membrane = (young / (1.0 - poisson * poisson) / bone.density).sqrt();
    for step in 0..30 {
        let scaled = 3e-4 * 1.2_f64.powi(step);
        let found = modes(&bone, thickness, scaled * shear / thickness);
        let velocity = |name: &str| {
            let mode = found.iter().find(|mode| mode.name.as_deref() == Some(name)).unwrap();
            mode.phase_velocity
        };
        assert_eq!(found.len(), 3, "{scaled}: {found:?}");
        // What is neglected grows as the square of the thickness in wavelengths.
        let limit = 1e-6 + 0.1 * scaled * scaled;
        assert!((velocity("S0") / membrane - 1.0).abs() < limit, "{scaled}: {found:?}");
        assert!((velocity("SH0") / shear - 1.0).abs() < 1e-6, "{scaled}: {found:?}");
    }
}

/// A wave begins at its cut-off frequency, at which its wavelength is infinite.
#[test]
fn waves_begin_at_the_resonances_of_the_thickness() {
    let thickness = 4e-3;
    let check = |bone: &Bone, speeds: [f64; 3]| {
        for speed in speeds {
            for n in [1, 2, 3] {
                let cut_off = f64::from(n) * speed / (2.0 * thickness);
                let [below, above] =
                    [-1e-7, 1e-7].map(|part| modes(bone, thickness, cut_off * (1.0 + part)).len());
                // A wave whose frequency falls from its cut-off on, is there below it.
                assert_eq!(below.abs_diff(above), 1, "{cut_off} Hz: {below}, {above}");
                let counts = [0.99, 0.999, 1.001, 1.01].map(|part| {
                    let near = cut_off * (1.0 + 1e-7 * part);
                    modes(bone, thickness, near).len()
                });
                assert_eq!(counts, [above; 4], "{cut_off} Hz");
            }
        }
    };
    let bone = optimum();
    check(&bone, across(&bone));
    // √(λ/ρ) of the Christoffel matrix across a triclinic plate.
    let bone = draw(0.3, 4);
    let christoffel =
        Mat::from_fn(3, 3, |i, j| bone.elasticity.component(i, 2, j, 2) / bone.density);
    let values = christoffel.self_adjoint_eigen(Side::Lower).unwrap();
    check(&bone, [0, 1, 2].map(|i| values.S()[i].sqrt()));
}

#[test]
fn fundamental_waves_are_those_of_the_centre_frequency() {
    for bone in [optimum(), draw(0.1, 0), draw(0.4, 3), isotropic(16e9, 0.3)] {
        for thickness in [0.5e-3, 1e-3, 4e-3] {
            let solver = solver(thickness);
            let expected = solver.guided_waves(&bone);
            let all = solver.modes(&bone, expected.frequency).unwrap();
            for (name, wave) in [("A0", expected.a0), ("S0", expected.s0)] {
                let wave = wave.unwrap();
                let named: Vec<&Mode> =
                    all.iter().filter(|mode| mode.name.as_deref() == Some(name)).collect();
                assert_eq!(named.len(), 1, "{thickness} m: {all:?}");
                let error = named[0].phase_velocity / wave.phase_velocity - 1.0;
                assert!(error.abs() < 1e-12, "{name}, {thickness} m: {error:e}");
                // Both are difference quotients over 1e-4 of the wavenumber, of frequencies to some 1e-12.
                let error = named[0].group_velocity / wave.group_velocity - 1.0;
                assert!(error.abs() < 1e-7, "{name}, {thickness} m: {error:e}");
            }
        }
    }
}

/// Sublayers of one solid that differ in the last bits of the density, and so are not merged.
fn divided(bone: &Bone, thicknesses: &[f64]) -> Sublayers {
    let nearly = |bits| Bone { density: f64::from_bits(bone.density.to_bits() + bits), ..*bone };
    let all: Vec<_> =
        (0..).zip(thicknesses).map(|(i, &thickness)| (thickness, nearly(i % 2))).collect();
    stack(&all)
}

#[test]
fn a_stack_of_equal_sublayers_is_a_plate() {
    for bone in [optimum(), draw(0.3, 1)] {
        let plate = modes(&bone, 3e-3, 1e6);
        for thicknesses in [&[1.5e-3, 1.5e-3][..], &[1e-3; 3], &[0.4e-3, 1.9e-3, 0.7e-3]] {
            let found = modes_of_stack(&divided(&bone, thicknesses), 1e6);
            assert_eq!(found.len(), plate.len(), "{thicknesses:?}");
            for (one, other) in found.iter().zip(&plate) {
                let error = one.wavenumber / other.wavenumber - 1.0;
                assert!(error.abs() < 1e-9, "{thicknesses:?}, {one:?}, {other:?}: {error:e}");
            }
        }
    }
}

/// A stack of 1 to 6 sublayers: random bones, or with the symmetries of the mean one, of which every third is
/// the same from both faces.
fn random_stack(number: u64) -> (Sublayers, f64) {
    let digit =
        |place: u32, base: u64| number.wrapping_mul(2_654_435_761).wrapping_shr(place) % base;
    let count = 1 + digit(3, 6);
    let mut all = Vec::new();
    for place in 0..count {
        let thickness = 1e-4 * (3 + digit(5 + place as u32, 9)) as f64;
        let bone = match digit(11, 3) {
            0 => Bone { density: 1500.0 + 50.0 * digit(place as u32, 7) as f64, ..optimum() },
            strength => draw(0.2 * strength as f64, 100 * number + place),
        };
        all.push((thickness, bone));
    }
    if digit(13, 3) == 0 {
        let mirrored: Vec<_> = all.iter().rev().skip(1).copied().collect();
        all.extend(mirrored);
    }
    (stack(&all), 0.3e6 + 0.1e6 * digit(7, 8) as f64)
}

#[test]
fn waves_below_a_frequency_are_counted_without_their_frequencies() {
    for number in 0..3 {
        let (stack, frequency) = random_stack(number);
        let (omega, elements) = (TAU * frequency, FiniteElements::new(&stack, 11));
        for k in [0.1, 0.7, 1.3].map(|share| share * omega / 2000.0) {
            let below = elements.frequencies(k).iter().filter(|found| **found < omega).count();
            assert_eq!(elements.count_below(k, omega), below, "stack {number}, {k} rad/m");
        }
    }
}

/// Every wave that a scan over wavenumbers finds is found, and every one that is found is one.
fn check_stack(number: u64, points: usize) {
    let (stack, frequency) = random_stack(number);
    let (omega, elements) = (TAU * frequency, FiniteElements::new(&stack, 11));
    let found = modes_of_stack(&stack, frequency);
    for mode in &found {
        let below = |share: f64| elements.count_below(mode.wavenumber, omega * share);
        assert!(
            below(1.0 + 1e-8) > below(1.0 - 1e-8),
            "stack {number}, {frequency} Hz: {mode:?} is no wave"
        );
    }
    let last = 1.1 * found.first().map_or(omega / 500.0, |mode| mode.wavenumber);
    let at = |point: usize| last * (point as f64 + 0.37) / points as f64;
    let mut before = elements.count_below(at(0), omega);
    for point in 1..=points {
        let next = elements.count_below(at(point), omega);
        let range = at(point - 1)..at(point);
        let between = found.iter().filter(|mode| range.contains(&mode.wavenumber)).count();
        let expected = before.abs_diff(next);
        assert!(
            between >= expected && (between - expected).is_multiple_of(2),
            "stack {number}, {frequency} Hz, {range:?}: {between} instead of {expected}"
        );
        before = next;
    }
    assert_eq!(before, 0, "stack {number}, {frequency} Hz: slower waves than all that were found");
}

#[test]
fn no_wave_of_a_random_stack_is_missed() {
    let stacks = std::env::var("OSTEON_STACKS").map_or(30, |count| count.parse().unwrap());
    (0..stacks).for_each(|number| check_stack(number, 120));
}

#[test]
fn frequencies_out_of_scale_are_refused() {
    let solver = solver(4e-3);
    let error = solver.modes(&optimum(), 1.0).unwrap_err();
    assert!(matches!(error, ModesError::TooLow { .. }), "{error}");
    assert!(error.to_string().starts_with("frequency: 1 Hz is too low"), "{error}");
    let error = solver.modes(&optimum(), 1e9).unwrap_err();
    assert!(matches!(error, ModesError::TooMany { .. }), "{error}");
}

#[test]
fn processors_do_not_matter() {
    let bone = draw(0.1, 0);
    let stack = stack(&[(1e-3, bone), (0.5e-3, optimum())]);
    for bone in [BoneRef::Homogeneous(&bone), BoneRef::Layered(&stack)] {
        let mut setup = Setup::default();
        setup.layers.bone_thickness = 1.5e-3;
        let expected = Solver::with_isa(&setup, Isa::fastest()).modes(bone, 1e6).unwrap();
        for isa in Isa::available() {
            let found = Solver::with_isa(&setup, isa).modes(bone, 1e6).unwrap();
            assert_eq!(found, expected, "{}", isa.name());
        }
    }
}
