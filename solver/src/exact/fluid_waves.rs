//! The waves in a stack of fluids on one side of the bone, at one wavenumber and complex frequency.
//!
//! In a fluid of thickness d, at the distance ζ from its face nearer to the bone, the pressure is
//!
//! ```text
//! a (exp(-g ζ) + r exp(-g (2 d - ζ))),   g = √(k² + s²/c²)
//! ```
//!
//! where r is the reflection at its other face: with y = g/ρ, and M = -∂p/(ρ p) of what lies beyond,
//! (y - M)/(y + M); -1 where p = 0, and 0 where the fluid has no end. From the outermost inwards, M of the
//! face nearer to the bone follows as y (1 - q)/(1 + q) with q = r exp(-2 g d). Pressure and ∂p/ρ are
//! continuous on the joints, and all exponentials decay.

use osteon_common::fluid_sublayers::FluidSublayers;
use osteon_common::limits::FLUID_SUBLAYERS_MAX;

use crate::complex::Complex;

/// The waves in the fluids of a stack whose pressure on the bone's face is 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FluidWaves {
    fluids: [FluidWave; FLUID_SUBLAYERS_MAX],
    count: usize,
    /// -∂p/(ρ p) on the bone's face, ∂ leading away from it, m²/kg: s² times the displacement per pressure.
    pub(crate) admittance: Complex,
}

/// The waves in one fluid.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FluidWave {
    /// Distances of both faces from the bone, m.
    near: f64,
    far: f64,
    /// Vertical wavenumber, rad/m.
    pub(crate) g: Complex,
    /// Amplitude of the part that leads away from the bone, on the nearer face.
    amplitude: Complex,
    /// r.
    reflection: Complex,
}

impl FluidWaves {
    /// Computes the waves in `fluids`, listed from the bone outwards: at least one. `k` is in rad/m, `s` (1/s)
    /// the fluids' lossless frequency; p = 0 on the outer face of the last one, unless it has no end.
    pub(crate) fn new(fluids: &FluidSublayers, k: f64, s: Complex, has_end: bool) -> Self {
        let one = Complex::new(1.0, 0.0);
        let mut waves = Self {
            fluids: [FluidWave::default(); FLUID_SUBLAYERS_MAX],
            count: fluids.as_slice().len(),
            admittance: Complex::default(),
        };
        let mut reflection = if has_end { -one } else { Complex::default() };
        for (index, fluid) in fluids.as_slice().iter().enumerate().rev() {
            let g = vertical_wavenumber(k, s, fluid.sound_speed);
            let own = g.scale(1.0 / fluid.density);
            if index + 1 < waves.count {
                reflection = (own - waves.admittance) / (own + waves.admittance);
            }
            let back = reflection * (-g.scale(2.0 * fluid.thickness)).exp();
            waves.admittance = own * ((one - back) / (one + back));
            // The pressure on the nearer face is 1 for the present.
            let amplitude = one / (one + back);
            waves.fluids[index] =
                FluidWave { near: 0.0, far: fluid.thickness, g, amplitude, reflection };
        }
        let (mut distance, mut pressure) = (0.0, one);
        for wave in &mut waves.fluids[..waves.count] {
            let thickness = wave.far;
            (wave.near, wave.far) = (distance, distance + thickness);
            wave.amplitude = wave.amplitude * pressure;
            let through = (-wave.g.scale(thickness)).exp() * (one + wave.reflection);
            (distance, pressure) = (wave.far, wave.amplitude * through);
        }
        waves
    }

    /// Returns the waves in the fluid at a distance, m, from the bone; on a joint in the nearer fluid.
    pub(crate) fn at(&self, distance: f64) -> &FluidWave {
        let fluids = &self.fluids[..self.count];
        let last = &self.fluids[self.count.saturating_sub(1)];
        fluids.iter().find(|wave| distance <= wave.far).unwrap_or(last)
    }

    /// Returns the pressure at a distance, m, from the bone.
    pub(crate) fn pressure(&self, distance: f64) -> Complex {
        let wave = self.at(distance);
        wave.outwards(distance) * (Complex::new(1.0, 0.0) + wave.inwards_ratio(distance))
    }
}

impl FluidWave {
    /// Returns the part of the pressure at a distance, m, from the bone that leads away from it.
    pub(crate) fn outwards(&self, distance: f64) -> Complex {
        self.amplitude * (-self.g.scale(distance - self.near)).exp()
    }

    /// Returns the ratio of the part that leads to the bone to the one that leads away from it.
    pub(crate) fn inwards_ratio(&self, distance: f64) -> Complex {
        self.reflection * (-self.g.scale(2.0 * (self.far - distance))).exp()
    }
}

/// Returns √(k² + s²/c²), real part > 0; `s` is the fluid's lossless frequency.
pub(crate) fn vertical_wavenumber(k: f64, s: Complex, c: f64) -> Complex {
    let over_c = s.scale(1.0 / c);
    (over_c * over_c + Complex::new(k * k, 0.0)).sqrt()
}
