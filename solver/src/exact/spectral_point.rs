//! The contribution of the fluids to the pressure at one wavenumber and frequency.

use osteon_common::case::Setup;
use osteon_common::sampling::WaveSampling;

use crate::complex::Complex;
use crate::exact::attenuation::LosslessFrequencies;
use crate::exact::fluid_waves::{FluidWaves, vertical_wavenumber};
use crate::exact::heights::Heights;

/// The contribution of the fluids at one (k, s).
pub(super) struct SpectralPoint {
    /// g of the coupling, rad/m; of a stack, ρ1 M with the fluid on the bone's face.
    pub(super) g: Complex,
    /// The load on the bone's lower face ([`marrow_load`]).
    pub(super) load: Complex,
    /// Twice the factor of (R + 1)/(1 + R E2) in p̂ per unit of F.
    pub(super) factor: Complex,
    /// E2.
    pub(super) echo: Complex,
}

/// Computes the contribution of the fluids. The pressure in fluid 1, without the direct wave and
/// its image in the outer face, is, per unit of F,
///
/// ```text
/// ρ1/(2g) e2 (1 - ea) (1 - eb) R / (1 + R E2)
/// e2 = exp(-g (x3 + x3S)), ea = exp(-2g (h1 - x3)), eb = exp(-2g (h1 - x3S)), E2 = exp(-2g h1)
/// ```
///
/// The mirror wave is the same with R = -1. All of it travels through the coupling by paths longer than
/// the direct one, and so arrives later. What remains without it is
///
/// ```text
/// ρ1/(2g) e2 (1 - ea) (1 - eb) (R + 1) / ((1 + R E2) (1 - E2))
/// ```
///
/// Elements of a width multiply all of it by their factor ([`crate::exact::element_average`]).
/// If no reflection of the outer face can arrive in a window, ea, eb and E2 are 0. With a tilted probe x3
/// is the height of the lowest receiver, and 1 - ea is left to the sum over wavenumbers.
///
/// In a stack of fluids, what remains without the response to a face without stiffness is
/// T(x3) T(x3S)/(M + s² Y'), where T is the pressure that 1 on the bone's face causes, M = -∂T/ρ1 there, and
/// Y' = -Y the admittance of the bone. With ρ1 M in place of g it has the form of a single fluid without end.
pub(super) fn spectral_point(
    setup: &Setup,
    heights: &Heights,
    sampling: &WaveSampling,
    (s, lossless): (Complex, &LosslessFrequencies),
    k: f64,
) -> SpectralPoint {
    let Heights { source, lowest, .. } = *heights;
    let load = marrow_load(setup, s, lossless, k, sampling.lower_echoes);
    let [coupling] = heights.fluids.as_slice() else {
        let waves = FluidWaves::new(&heights.fluids, k, lossless.coupling, sampling.upper_echoes);
        let receiver = if heights.are_different() {
            waves.at(lowest).outwards(lowest)
        } else {
            waves.pressure(lowest)
        };
        return SpectralPoint {
            g: waves.admittance.scale(heights.face_density()),
            load,
            factor: receiver * waves.pressure(source) / waves.admittance,
            echo: Complex::default(),
        };
    };
    let one = Complex::new(1.0, 0.0);
    let g = vertical_wavenumber(k, lossless.coupling, coupling.sound_speed);
    let damp = |length: f64| (-g.scale(length)).exp();
    let mut factor = damp(source + lowest).scale(coupling.density) / g;
    if let Some(elements) = &heights.elements {
        factor = factor * elements.factor(k, g);
    }
    let mut echo = Complex::default();
    if sampling.upper_echoes {
        if !heights.are_different() {
            factor = factor * (one - damp(2.0 * (coupling.thickness - lowest)));
        }
        factor = factor * (one - damp(2.0 * (coupling.thickness - source)));
        echo = damp(2.0 * coupling.thickness);
        factor = factor / (one - echo);
    }
    SpectralPoint { g, load, factor, echo }
}

/// Returns Z with τ3 = Z u3 at the bone's lower face, divided by m(s) of the bone, Pa/m: Z is
/// ρ2 s² tanh(g2 h2)/g2, or ρ2 s²/g2 if no reflection of the marrow's outer face can arrive in a window; of a
/// stack of fluids s²/M with its admittance M.
pub(crate) fn marrow_load(
    setup: &Setup,
    s: Complex,
    lossless: &LosslessFrequencies,
    k: f64,
    echoes: bool,
) -> Complex {
    let fluids = setup.layers.marrow_fluids();
    let [marrow] = fluids.as_slice() else {
        let waves = FluidWaves::new(&fluids, k, lossless.marrow, echoes);
        return s * s / waves.admittance * lossless.bone_compliance;
    };
    let g = vertical_wavenumber(k, lossless.marrow, marrow.sound_speed);
    let mut load = (s * s).scale(marrow.density) / g;
    if echoes {
        let one = Complex::new(1.0, 0.0);
        let decay = (-g.scale(2.0 * marrow.thickness)).exp();
        load = load * ((one - decay) / (one + decay));
    }
    load * lossless.bone_compliance
}
