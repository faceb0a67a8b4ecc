//! Quantities from inside the exact method, for tests that compare them with other solutions.

use osteon_common::bone::BoneRef;
use osteon_common::case::Setup;
use osteon_common::sampling::WaveSampling;

use crate::complex::Complex;
use crate::exact::attenuation::LosslessFrequencies;
use crate::exact::fluid_spectra::{FluidSpectra, SourceWaves};
use crate::exact::heights::Heights;
use crate::exact::plate_stack::PlateStack;
use crate::exact::spectral_point::{marrow_load, spectral_point};
use crate::isa::Isa;
use crate::lanes::{ComplexLanes, Lanes};
use crate::media::Media;
use crate::vector::{ComplexVector, Scalar};

/// Bound of the speed, m/s, of every wave along x1 in the bone: √(λ/ρ) with the largest eigenvalue
/// λ of the Christoffel matrix of x1, in the sublayer where that is largest.
pub fn fastest_wave<'a>(bone: impl Into<BoneRef<'a>>) -> f64 {
    Media::new(Isa::fastest(), bone.into(), 1.0).fastest()
}

/// Admittance Y(k, s) = û3(0)/p̂(0), m/Pa, of the bone on its marrow.
///
/// `k` in rad/m, of either sign; `s` in 1/s with a positive real part.
pub fn admittance<'a>(setup: &Setup, bone: impl Into<BoneRef<'a>>, k: f64, s: Complex) -> Complex {
    let isa = Isa::fastest();
    let media = Media::new(isa, bone.into(), setup.layers.bone_thickness);
    let mut plates = PlateStack::<11>::default();
    plates.fill(isa, &media);
    let lossless = LosslessFrequencies::at(&setup.layers, s);
    let load = marrow_load(setup, s, &lossless, k, true);
    let load = ComplexLanes { re: Lanes::splat(load.re), im: Lanes::splat(load.im) };
    plates.prepare(isa, &media, lossless.bone, &Lanes::splat(k.abs()));
    let k = Lanes::splat(k);
    let found: ComplexVector<Scalar> = match plates.foundation(isa, &media, &k, &load) {
        None => plates.uppermost.impedance(&k, &load, 0),
        Some(foundation) => plates.uppermost.impedance(&k, &foundation, 0),
    };
    let mut impedance = ComplexLanes::ZERO;
    found.store(&mut impedance, 0);
    -(lossless.bone_compliance / Complex::new(impedance.re.0[0], impedance.im.0[0]))
}

/// Pressure p̂(k, s) at the height of the receivers of a level probe per unit of F, s²/m² Pa: of all waves,
/// with the reflections of both outer faces.
///
/// `k` in rad/m; `s` in 1/s with a positive real part.
pub fn pressure<'a>(setup: &Setup, bone: impl Into<BoneRef<'a>>, k: f64, s: Complex) -> Complex {
    let (heights, lossless) =
        (Heights::from_setup(setup), LosslessFrequencies::at(&setup.layers, s));
    // Only whether faces are heard is asked of it.
    let sampling = WaveSampling::for_traces(setup, 5000.0, 20e-6);
    let point = spectral_point(setup, &heights, &sampling, (s, &lossless), k);
    let impedance = -(lossless.bone_compliance / admittance(setup, bone, k, s));
    let inertia = (lossless.bone * lossless.bone).scale(heights.face_density());
    let gd = point.g * impedance;
    let of_bone = point.factor * gd / (gd + inertia + (gd - inertia) * point.echo);
    let waves = SourceWaves::new(&FluidSpectra::new(setup), k, lossless.coupling);
    of_bone + waves.pressure(heights.lowest - heights.source)
}
