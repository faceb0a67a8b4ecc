//! The plate's admittance against dense linear algebra: eigenvectors of the first-order system,
//! as long as its exponentials stay within reach of double precision.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]
#![expect(clippy::disallowed_methods, reason = "an independent formula")]

use std::f64::consts::{PI, TAU};

use faer::prelude::Solve as _;
use faer::{Mat, c64};
use osteon_common::attenuation::Attenuation;
use osteon_common::case::{Bone, Setup};
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_solver::{Complex, admittance};

/// A bone whose moduli are all multiplied by a complex factor.
struct Plate<'a> {
    bone: &'a Bone,
    factor: c64,
}

impl Plate<'_> {
    fn block(&self, j: usize, l: usize) -> Mat<c64> {
        let entry = |i, m| self.factor * self.bone.elasticity.component(i, j, m, l);
        Mat::from_fn(3, 3, entry)
    }
}

/// The system ∂3 (u, τ) = M (u, τ) at one (k, s), tractions in units of `unit`.
fn system(plate: &Plate<'_>, k: f64, s: c64, unit: f64) -> Mat<c64> {
    let ik = c64::new(0.0, k);
    let (a11, a13) = (plate.block(0, 0), plate.block(0, 2));
    let (a31, a33) = (plate.block(2, 0), plate.block(2, 2));
    let identity: Mat<c64> = Mat::identity(3, 3);
    let inverse = a33.partial_piv_lu().solve(&identity);
    let coupling = &inverse * &a31;
    let membrane = &a11 - &a13 * &coupling;
    let back = &a13 * &inverse;
    let inertia = s * s * plate.bone.density;
    Mat::from_fn(6, 6, |i, j| match (i < 3, j < 3) {
        (true, true) => -ik * coupling[(i, j)],
        (true, false) => inverse[(i, j - 3)] * unit,
        (false, true) => {
            let mass = if i - 3 == j { inertia } else { c64::new(0.0, 0.0) };
            (mass + membrane[(i - 3, j)] * (k * k)) / unit
        }
        (false, false) => -ik * back[(i - 3, j - 3)],
    })
}

/// û3(0)/p̂(0) with the lower face loaded by τ3 = `load` u3.
fn dense_admittance(plate: &Plate<'_>, h: f64, k: f64, s: c64, load: c64) -> c64 {
    let unit = plate.bone.elasticity.rows()[0][0] / h;
    let eigen = system(plate, k, s, unit).eigen().unwrap();
    let vectors = eigen.U().to_owned();
    let stretched = Mat::from_fn(6, 6, |i, j| vectors[(i, j)] * (eigen.S()[j] * h).exp());
    let identity: Mat<c64> = Mat::identity(6, 6);
    // (u, τ) at the top = transfer · (u, τ) at the bottom, where τ = (0, 0, load u3).
    let transfer = stretched * vectors.partial_piv_lu().solve(&identity);
    let from_bottom = Mat::from_fn(6, 3, |i, j| {
        let loaded = if j == 2 { transfer[(i, 5)] * load / unit } else { c64::new(0.0, 0.0) };
        transfer[(i, j)] + loaded
    });
    // τ at the top is -p e3, with p = 1.
    let tractions = Mat::from_fn(3, 3, |i, j| from_bottom[(i + 3, j)] * unit);
    let pressure = Mat::from_fn(3, 1, |i, _| c64::new(if i == 2 { -1.0 } else { 0.0 }, 0.0));
    let bottom = tractions.partial_piv_lu().solve(&pressure);
    (0..3).map(|j| from_bottom[(2, j)] * bottom[(j, 0)]).sum()
}

/// m(s) = (s/ω0)^(2 atan(1/Q)/π): Kjartansson's law.
fn constant_quality(found: &Attenuation, s: c64) -> c64 {
    let Some(quality) = found.quality_factor else { return c64::new(1.0, 0.0) };
    (s / (TAU * found.reference_frequency)).powf(2.0 * (1.0 / quality).atan() / PI)
}

fn thin_plate_setup() -> Setup {
    let mut setup = Setup::default();
    setup.layers.bone_thickness = 0.6e-3;
    setup
}

#[test]
fn random_plates_agree_with_dense_eigenvectors() {
    check(&thin_plate_setup());
}

#[test]
fn attenuated_plates_agree_with_dense_eigenvectors() {
    let quality = |quality: f64, reference_frequency: f64| Attenuation {
        quality_factor: Some(quality),
        reference_frequency,
    };
    for (bone, marrow) in [(10.0, None), (5.0, Some(30.0)), (400.0, Some(2.0))] {
        let mut setup = thin_plate_setup();
        setup.layers.bone_attenuation = quality(bone, 0.7e6);
        if let Some(marrow) = marrow {
            setup.layers.marrow.attenuation = quality(marrow, 3e6);
        }
        check(&setup);
    }
}

fn check(setup: &Setup) {
    let marrow = setup.layers.marrow;
    let seed = 21;
    for dispersion in [0.1, 0.4, 0.7] {
        let point =
            Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion]);
        let ensemble = Ensemble::new(&point, seed).unwrap();
        for index in 0..10 {
            let bone = ensemble.bone(index).unwrap();
            for (k, omega) in [(300.0, 1e6), (-1500.0, 6e6), (4000.0, 9e6), (9000.0, 2e7)] {
                let s = c64::new(1.2e6, omega);
                let squared = marrow.sound_speed * marrow.sound_speed;
                let squared = constant_quality(&marrow.attenuation, s) * squared;
                let g = (s * s / squared + k * k).sqrt();
                let load = s * s * marrow.density * (g * marrow.thickness).tanh() / g;
                let factor = constant_quality(&setup.layers.bone_attenuation, s);
                let plate = Plate { bone: &bone, factor };
                let expected = dense_admittance(&plate, setup.layers.bone_thickness, k, s, load);
                let found = admittance(setup, &bone, k, Complex::new(s.re, s.im));
                let error = (c64::new(found.re, found.im) - expected).norm() / expected.norm();
                // Exponentials up to e⁸ cost the dense side up to seven of its sixteen digits.
                assert!(
                    error < 1e-9,
                    "{setup:?}, seed {seed}, dispersion {dispersion}, index {index}, k {k}: {error:e}"
                );
            }
        }
    }
}
