//! Quantities from inside the exact method, for tests that compare them with other solutions.

use osteon_common::case::{Bone, Setup};

use crate::complex::Complex;
use crate::exact::attenuation::LosslessFrequencies;
use crate::exact::plate::AccuratePlate;
use crate::exact::tables;
use crate::lanes::ComplexLanes;
use crate::medium::Medium;
use crate::vector::{ComplexVector, Scalar, Vector as _};

/// Bound of the speed, m/s, of every wave along x1 in the bone: √(λ/ρ) with the largest eigenvalue
/// λ of the Christoffel matrix of x1.
pub fn fastest_wave(bone: &Bone) -> f64 {
    Medium::new(bone).fastest
}

/// Admittance Y(k, s) = û3(0)/p̂(0), m/Pa, of the bone on its marrow.
///
/// `k` in rad/m, of either sign; `s` in 1/s with a positive real part.
pub fn admittance(setup: &Setup, bone: &Bone, k: f64, s: Complex) -> Complex {
    let medium = Medium::new(bone);
    let mut plate = AccuratePlate::default();
    plate.fill::<Scalar>(&medium, setup.layers.bone_thickness);
    let lossless = LosslessFrequencies::at(&setup.layers, s);
    plate.prepare::<Scalar>(&medium, lossless.bone, (k.abs(), k.abs()));
    let load = tables::marrow_load(setup, s, &lossless, k, true);
    let splat = |z: Complex| ComplexVector { re: Scalar::splat(z.re), im: Scalar::splat(z.im) };
    let mut impedance = ComplexLanes::ZERO;
    plate.impedance(Scalar::splat(k), splat(load)).store(&mut impedance, 0);
    -(lossless.bone_compliance / Complex::new(impedance.re.0[0], impedance.im.0[0]))
}
