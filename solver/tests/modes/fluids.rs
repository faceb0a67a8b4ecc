//! Guided waves between fluids and with attenuation against the limit of light fluids, closed forms, and finite
//! elements with loads.

use std::f64::consts::TAU;

use faer::c64;
use osteon_common::bone::{BoneRef, Sublayers};
use osteon_common::case::Setup;
use osteon_common::fluid_sublayers::{FluidSublayer, FluidSublayers};
use osteon_solver::{FluidModes, Mode, ModesError, Solver};

use super::finite_elements::FiniteElements;
use super::{across, draw, isotropic, optimum, stack};

fn setup(thickness: f64, densities: [f64; 2], quality_factor: Option<f64>) -> Setup {
    let mut setup = Setup::default();
    setup.layers.bone_thickness = thickness;
    [setup.layers.coupling.density, setup.layers.marrow.density] = densities;
    setup.layers.marrow.sound_speed = 1400.0;
    setup.layers.bone_attenuation.quality_factor = quality_factor;
    setup
}

fn fluid_modes<'a>(setup: &Setup, bone: impl Into<BoneRef<'a>>, frequency: f64) -> FluidModes {
    Solver::new(setup).modes_in_fluids(bone, frequency).unwrap()
}

/// The wave in a vacuum that one in fluids comes from.
fn origin<'a>(mode: &Mode, free: &'a [Mode]) -> &'a Mode {
    let same = |one: &&Mode| {
        (one.family, one.rank) == (mode.family, mode.rank)
            && (one.group_velocity > 0.0) == (mode.group_velocity > 0.0)
    };
    free.iter().find(same).unwrap()
}

/// A wave loses what both faces radiate: with displacements u of unit mass, Σ (ρω/q) |u3|² / (2 v), where q is the
/// wavenumber across the fluid and v the group velocity.
#[test]
fn light_fluids_take_away_what_the_faces_radiate() {
    for bone in [optimum(), isotropic(16e9, 0.3), draw(0.2, 1)] {
        let (densities, frequency) = ([0.1, 0.05], 0.7e6);
        let setup = setup(2e-3, densities, None);
        let free = Solver::new(&setup).modes(&bone, frequency).unwrap();
        let found = fluid_modes(&setup, &bone, frequency);
        assert_eq!((found.lost.len(), found.modes.len()), (0, free.len()), "{found:?}");
        let elements = FiniteElements::new(&stack(&[(2e-3, bone)]), 14);
        let omega = TAU * frequency;
        for mode in &found.modes {
            let free = origin(mode, &free);
            assert!((mode.wavenumber / free.wavenumber - 1.0).abs() < 1e-3, "{mode:?}, {free:?}");
            let u = elements.displacement(free.wavenumber, omega);
            let faces = [u[u.len() - 1], u[2]];
            let radiated = |(u3, (density, c)): (c64, (f64, f64))| {
                let square = (omega / c).powi(2) - free.wavenumber.powi(2);
                if square > 0.0 { density * omega / square.sqrt() * u3.norm_sqr() } else { 0.0 }
            };
            let fluids = densities.into_iter().zip([1500.0, 1400.0]);
            let all: f64 = faces.into_iter().zip(fluids).map(radiated).sum();
            let expected = all / (2.0 * free.group_velocity.abs());
            // The next order is in proportion to the density of the fluid over that of the bone, 6e-5.
            let error = mode.attenuation * free.group_velocity.signum() - expected;
            assert!(error.abs() < 1e-3 * expected + 1e-9, "{mode:?}: {expected}");
        }
    }
}

/// The constant factor of all moduli, (iω/ω0)^(2γ) with γ = atan(1/Q)/π.
fn modulus(quality_factor: f64, frequency: f64) -> c64 {
    let exponent = 2.0 * (1.0 / quality_factor).atan() / std::f64::consts::PI;
    let size = (frequency / 1e6).powf(exponent);
    let angle = 0.5 * std::f64::consts::PI * exponent;
    c64::new(size * angle.cos(), size * angle.sin())
}

#[test]
fn shear_without_fluids_is_attenuated_in_closed_form() {
    let (bone, thickness, frequency) = (isotropic(16e9, 0.3), 2e-3, 1.2e6);
    let found = fluid_modes(&setup(thickness, [1000.0; 2], Some(15.0)), &bone, frequency);
    let (omega, shear) = (TAU * frequency, across(&bone)[1]);
    for n in [0, 1, 2] {
        let name = format!("SH{n}");
        let mode = found.modes.iter().find(|mode| mode.name.as_deref() == Some(&name)).unwrap();
        // k² = ω²/(m c²) - (nπ/h)².
        let across = std::f64::consts::PI * f64::from(n) / thickness;
        let square = c64::from((omega / shear).powi(2)) / modulus(15.0, frequency);
        let k = (square - c64::from(across * across)).sqrt();
        let error = (mode.wavenumber - k.re).hypot(mode.attenuation + k.im) / k.re;
        assert!(error < 1e-10, "{mode:?}, {k:?}: {error:e}");
    }
}

/// Smallest singular value, relative to the largest, of finite elements with the loads of both fluids.
fn singular(elements: &FiniteElements, setup: &Setup, k: c64, omega: f64) -> f64 {
    let factor = setup
        .layers
        .bone_attenuation
        .quality_factor
        .map_or(c64::from(1.0), |q| modulus(q, omega / TAU));
    let mut matrix = elements.stiffness(k);
    let size = matrix.nrows();
    for i in 0..size {
        for j in 0..size {
            matrix[(i, j)] =
                matrix[(i, j)] * factor - elements.mass()[(i, j)] * c64::from(omega * omega);
        }
    }
    let fluids = [(size - 1, setup.layers.coupling), (2, setup.layers.marrow)];
    for (place, fluid) in fluids {
        let q = (c64::from((omega / fluid.sound_speed).powi(2)) - k * k).sqrt();
        // Outwards: exp(i(ωt - qx3)); slower than sound, decaying.
        let radiates = k.re < omega / fluid.sound_speed;
        let q = if (radiates && q.re < 0.0) || (!radiates && q.im > 0.0) { -q } else { q };
        let load = c64::new(0.0, fluid.density * omega * omega) / q;
        matrix[(place, place)] += load;
    }
    let values = matrix.singular_values().unwrap();
    values[size - 1] / values[0]
}

#[test]
fn every_wave_is_one_of_finite_elements_with_loads() {
    let layered: Sublayers = stack(&[(0.8e-3, draw(0.2, 5)), (1.2e-3, optimum())]);
    let plate = stack(&[(2e-3, optimum())]);
    for bone in [&plate, &layered] {
        for (quality_factor, frequency) in [(None, 0.5e6), (Some(15.0), 0.5e6), (Some(30.0), 1e6)] {
            let setup = setup(2e-3, [1000.0, 900.0], quality_factor);
            let found = fluid_modes(&setup, bone, frequency);
            let free = Solver::new(&setup).modes(bone, frequency).unwrap();
            assert_eq!(found.modes.len() + found.lost.len(), free.len());
            assert!(found.lost.len() <= 1, "{frequency} Hz: {:?}", found.lost);
            let elements = FiniteElements::new(bone, 12);
            for mode in &found.modes {
                let k = c64::new(mode.wavenumber, -mode.attenuation);
                let omega = TAU * frequency;
                let there = singular(&elements, &setup, k, omega);
                let beside = singular(&elements, &setup, k * c64::from(1.001), omega);
                assert!(there < 1e-5 * beside, "{frequency} Hz, {mode:?}: {there:e}, {beside:e}");
            }
        }
    }
}

/// A fluid that is divided is one half-space; a stack of fluids is none.
#[test]
fn only_single_fluids_are_half_spaces() {
    let mut setup = setup(2e-3, [1000.0, 950.0], None);
    let expected = fluid_modes(&setup, &optimum(), 0.7e6);
    let marrow = FluidSublayer { thickness: 4e-3, density: 950.0, sound_speed: 1400.0 };
    setup.layers.marrow = Setup::default().layers.marrow;
    setup.layers.marrow.sublayers = FluidSublayers::new(&[marrow; 2]).unwrap();
    assert_eq!(fluid_modes(&setup, &optimum(), 0.7e6), expected);
    let fat = FluidSublayer { sound_speed: 1440.0, ..marrow };
    setup.layers.marrow.sublayers = FluidSublayers::new(&[marrow, fat]).unwrap();
    let refused = Solver::new(&setup).modes_in_fluids(&optimum(), 0.7e6);
    assert_eq!(refused, Err(ModesError::SeveralFluids { field: "layers.marrow.sublayers" }));
}

/// A0 of a setup with `a0_in_fluids` is the wave that is followed from the vacuum into the fluids.
#[test]
fn a0_between_fluids_is_the_wave_that_is_followed_into_them() {
    let check = |bone: BoneRef<'_>, thickness: f64, frequency: f64| {
        let mut setup = setup(thickness, [1000.0, 930.0], None);
        (setup.probe.guided_wave_frequency, setup.probe.a0_in_fluids) = (Some(frequency), true);
        let found = Solver::new(&setup).guided_waves(bone).a0.unwrap();
        let modes = fluid_modes(&setup, bone, frequency).modes;
        let followed = modes.iter().find(|mode| mode.name.as_deref() == Some("A0")).unwrap();
        let pairs = [
            (found.phase_velocity, followed.phase_velocity, 1e-9),
            (found.group_velocity, followed.group_velocity, 1e-4),
        ];
        for (found, expected, tolerance) in pairs {
            assert!((found / expected - 1.0).abs() < tolerance, "{found}, {expected}: {frequency}");
        }
    };
    for frequency in [0.05e6, 0.15e6] {
        for bone in [optimum(), isotropic(16e9, 0.3), draw(0.2, 1), draw(0.4, 2)] {
            check((&bone).into(), 1.5e-3, frequency);
        }
        let layered = stack(&[(0.4e-3, optimum()), (0.9e-3, draw(0.2, 3)), (0.3e-3, draw(0.2, 4))]);
        check((&layered).into(), 1.6e-3, frequency);
    }
}

#[test]
fn an_a0_that_radiates_is_not_stated() {
    let mut setup = setup(4e-3, [1000.0, 930.0], None);
    setup.probe.a0_in_fluids = true;
    let waves = Solver::new(&setup).guided_waves(&optimum());
    assert!(waves.a0.is_none() && waves.a0_radiates && waves.s0.is_some(), "{waves:?}");
    assert!(waves.reason().unwrap().contains("lower probe.guided_wave_frequency"), "{waves:?}");
}
