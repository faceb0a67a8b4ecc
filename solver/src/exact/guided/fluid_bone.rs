//! A bone between two fluids: where it has waves with complex wavenumbers.
//!
//! The fluids are half-spaces, without their outer faces. With g = √(k² + s²/c²) a face answers displacements
//! across it by ρ s²/g. The root has two values: fields decay away from the bone, where waves are slower than
//! sound in the fluid, or carry energy away, where they are faster. Then they lose it along the bone, and so
//! grow away from it: the pressure at a height is what left the bone earlier, farther back.

use std::f64::consts::TAU;

use osteon_common::fluid_sublayers::FluidSublayer;
use osteon_common::layers::Layers;

use super::complex_plate::WaveDeterminant;
use super::contour::zeros_within;
use super::dense::Scaled;
use crate::complex::Complex;
use crate::exact::attenuation::LosslessFrequencies;
use crate::isa::Isa;
use crate::media::Media;

/// Step of a derivative as a part of its variable.
const STEP: f64 = 1e-6;
/// Maximum number of iterations of all roots together.
const ITERATIONS_MAX: usize = 16;
/// An iteration ends when the largest step is below this part of the wavenumber.
const CONVERGED: f64 = 1e-11;
/// Corners of the polygon around one root.
const CORNERS: usize = 12;

/// Whether waves radiate into the fluid above and below.
pub(super) type Radiation = [bool; 2];

/// A bone with the fluids and the attenuation of its case, or with a share of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct FluidBone<'a> {
    pub(super) isa: Isa,
    pub(super) media: &'a Media,
    /// The layers, of which the attenuation is used.
    pub(super) layers: &'a Layers,
    /// The fluids above and below.
    pub(super) fluids: [FluidSublayer; 2],
    /// The components of the displacement.
    pub(super) components: &'a [usize],
    pub(super) radiation: Radiation,
    /// Frequency, rad/s.
    pub(super) omega: f64,
    /// Share of the fluids' densities and of the loss, from 0 (a bone in a vacuum) to 1.
    pub(super) share: f64,
}

impl FluidBone<'_> {
    /// Returns a function of k (rad/m) without poles that is zero where the bone has a wave.
    pub(super) fn determinant(&self, k: Complex) -> Scaled {
        let (lossless, loads) = self.loads(k);
        let Self { isa, media, components, .. } = *self;
        isa.run(WaveDeterminant { media, components, s: lossless.bone, k, loads })
    }

    /// Returns the frequencies at which the layers have no loss, and what answers displacements across both
    /// faces there, Pa/m.
    pub(super) fn loads(&self, k: Complex) -> (LosslessFrequencies, [Complex; 2]) {
        let s = Complex::new(0.0, self.omega);
        let lossless = LosslessFrequencies::at(&self.layers_of_share(), s);
        let load = |fluid: &FluidSublayer, frequency: Complex, radiates: bool| {
            let over_c = frequency.scale(1.0 / fluid.sound_speed);
            let square = k * k + over_c * over_c;
            // e^(iωt - gx3): a wave that leaves has a positive imaginary part of g.
            let g = if radiates {
                let root = (-square).sqrt();
                Complex::new(-root.im, root.re)
            } else {
                square.sqrt()
            };
            (s * s).scale(fluid.density * self.share) / g * lossless.bone_compliance
        };
        let [coupling, marrow] = &self.fluids;
        let loads = [
            load(coupling, lossless.coupling, self.radiation[0]),
            load(marrow, lossless.marrow, self.radiation[1]),
        ];
        (lossless, loads)
    }

    /// Returns the layers with their share of the loss.
    fn layers_of_share(&self) -> Layers {
        let mut layers = *self.layers;
        for attenuation in [
            &mut layers.coupling.attenuation,
            &mut layers.bone_attenuation,
            &mut layers.marrow.attenuation,
        ] {
            attenuation.quality_factor = attenuation.quality_factor.map(|q| q / self.share);
        }
        layers
    }

    /// Finds the roots nearest to these guesses (rad/m), all at once: the iteration of O. Aberth (Math. Comp. 27
    /// (1973) 339), in which no two tend to one root. `None` where it does not converge.
    pub(super) fn roots(&self, guesses: &[Complex]) -> Vec<Option<Complex>> {
        let mut roots = guesses.to_vec();
        let mut converged = vec![false; roots.len()];
        for _ in 0..ITERATIONS_MAX {
            for place in 0..roots.len() {
                let k = roots[place];
                let newton = self.newton_step(k);
                let mut repulsion = Complex::default();
                for (other, root) in roots.iter().enumerate() {
                    if other != place {
                        repulsion = repulsion + Complex::new(1.0, 0.0) / (k - *root);
                    }
                }
                let step = newton / (Complex::new(1.0, 0.0) - newton * repulsion);
                roots[place] = k - step;
                converged[place] = step.abs() <= CONVERGED * k.abs();
            }
            if converged.iter().all(|converged| *converged) {
                break;
            }
        }
        roots.into_iter().zip(converged).map(|(root, good)| good.then_some(root)).collect()
    }

    /// Returns F/F' of the determinant.
    fn newton_step(&self, k: Complex) -> Complex {
        let step = k.scale(STEP);
        // In units of a value beside the root, where it is not zero.
        let unit = self.determinant(k + step);
        let slope = Complex::new(1.0, 0.0) - self.determinant(k - step).over(unit);
        step.scale(2.0) * self.determinant(k).over(unit) / slope
    }

    /// Returns the group velocity dω/dk along x1 of the wave with this wavenumber (rad/m), m/s: 1/Re(dk/dω).
    pub(super) fn group_velocity(&self, k: Complex) -> f64 {
        let step = k.scale(STEP);
        let unit = self.determinant(k + step);
        let by_k = Complex::new(1.0, 0.0) - self.determinant(k - step).over(unit);
        let at = |omega: f64| Self { omega, ..*self }.determinant(k).over(unit);
        let by_omega = at(self.omega * (1.0 + STEP)) - at(self.omega * (1.0 - STEP));
        // -F_ω/F_k, with differences over parts of ω and of k.
        let slope = (by_omega / by_k * k).scale(-1.0 / self.omega);
        1.0 / slope.re
    }

    /// Returns whether there is exactly one root within `radius` (rad/m) of this one.
    pub(super) fn is_single_root(&self, root: Complex, radius: f64) -> bool {
        let corner = |corner: usize| {
            let (sin, cos) = libm::sincos(TAU * corner as f64 / CORNERS as f64);
            root + Complex::new(cos, sin).scale(radius)
        };
        let corners: Vec<Complex> = (0..CORNERS).map(corner).collect();
        zeros_within(|k| self.determinant(k), &corners, 1) == Some(1)
    }

    /// Returns the number of roots in a rectangle, given by its lower left and upper right corner (rad/m); `None`
    /// if one is on its sides.
    pub(super) fn roots_within(&self, [low, high]: [Complex; 2], pieces: usize) -> Option<i64> {
        let corners = [low, Complex::new(high.re, low.im), high, Complex::new(low.re, high.im)];
        zeros_within(|k| self.determinant(k), &corners, pieces)
    }
}
