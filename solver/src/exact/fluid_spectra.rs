//! The waves of the source in a stack of fluids on a face without stiffness: what a trace adds to the
//! response of the bone where the direct wave and its images have no closed form.
//!
//! With M of the fluids above the source and of those below it, the pressure at its height is 1/(M + M') per
//! unit of F, and elsewhere as much less as the waves above or below it say. At large wavenumbers that
//! falls slowly, or not at all where receivers have the source's height. But all that is there belongs to
//! the surroundings of the source: a smooth end of the sum over wavenumbers changes nothing at a distance.

use std::f64::consts::PI;

use osteon_common::case::Setup;
use osteon_common::fluid_sublayers::FluidSublayers;
use osteon_common::probe::Place;
use osteon_common::sampling::WaveSampling;

use crate::complex::Complex;
use crate::exact::fluid_waves::FluidWaves;
use crate::exact::tables::Line;

/// Width of the sum's smooth end, erfc((k - k0)/width)/2, times the distance of the nearest receiver: what it
/// changes there is exp(-100/4) of the field of the source's surroundings.
const END_WIDTH: f64 = 10.0;
/// Number of widths from the slowest wave to k0, and from there to the last wavenumber, at which 2e-10 are left.
const END_REACH: f64 = 4.5;

/// The fluids on both sides of the source, from its height to the outer face and to the bone.
pub(super) struct FluidSpectra {
    above: FluidSublayers,
    below: FluidSublayers,
    source: f64,
    places: Vec<Place>,
    slowest: f64,
}

impl FluidSpectra {
    pub(super) fn new(setup: &Setup) -> Self {
        let (fluids, source) = (setup.layers.coupling_fluids(), setup.probe.source.x3);
        let speeds = fluids.as_slice().iter().map(|fluid| fluid.sound_speed);
        Self {
            above: fluids.between(source, f64::INFINITY),
            below: fluids.between(0.0, source).reversed(),
            source,
            places: setup.probe.places().collect(),
            slowest: speeds.fold(f64::INFINITY, f64::min),
        }
    }

    /// Returns the pressure at each receiver, in the order of the receivers, per unit of F, at the complex
    /// frequency of a line.
    pub(super) fn pressures(&self, sampling: &WaveSampling, line: &Line) -> Vec<Complex> {
        let nearest = self.places.iter().map(|place| place.x).fold(f64::INFINITY, f64::min);
        let width = END_WIDTH / nearest;
        let middle = END_REACH.mul_add(width, line.s.im / self.slowest);
        let last = (END_REACH.mul_add(width, middle) / sampling.wavenumber_step) as usize;
        let mut pressures = vec![Complex::default(); self.places.len()];
        for m in 0..=last {
            let k = m as f64 * sampling.wavenumber_step;
            let waves = SourceWaves::new(self, k, line.lossless.coupling);
            // The trapezoidal rule from k = 0 on, for (1/π) ∫ … cos(kx) dk.
            let end = if m == 0 { 0.5 } else { 1.0 };
            let weight = 0.5 * libm::erfc((k - middle) / width);
            let measure = end * weight * sampling.wavenumber_step / PI;
            for (pressure, place) in pressures.iter_mut().zip(&self.places) {
                let here = waves.pressure(place.x3 - self.source);
                *pressure = *pressure + here.scale(measure * libm::cos(k * place.x));
            }
        }
        pressures
    }
}

/// The waves on both sides of the source at one wavenumber and frequency.
pub(super) struct SourceWaves {
    above: FluidWaves,
    below: FluidWaves,
    /// Pressure at the height of the source, per unit of F.
    at_source: Complex,
}

impl SourceWaves {
    /// Computes the waves; `k` is in rad/m, `s` (1/s) the coupling's lossless frequency.
    pub(super) fn new(fluids: &FluidSpectra, k: f64, s: Complex) -> Self {
        let [above, below] =
            [&fluids.above, &fluids.below].map(|fluids| FluidWaves::new(fluids, k, s, true));
        let at_source = Complex::new(1.0, 0.0) / (above.admittance + below.admittance);
        Self { above, below, at_source }
    }

    /// Returns the pressure by so much `higher` than the source, m, per unit of F.
    pub(super) fn pressure(&self, higher: f64) -> Complex {
        let waves = if higher > 0.0 { &self.above } else { &self.below };
        self.at_source * waves.pressure(higher.abs())
    }
}
