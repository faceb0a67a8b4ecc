//! What one bone's computation takes: mesh, wavenumbers, times, and whether that is within bounds.

use std::f64::consts::PI;

use osteon_common::case::{Bone, Setup};
use osteon_common::outcome::FailureKind;
use osteon_common::sampling::{distances, earliest_arrival, smooth_step};

use super::mesh::Mesh;
use super::scope::Scope;
use crate::Failure;
use crate::lanes::LANES;

/// Highest frequency over centre frequency whose waves along the coupling fluid are resolved, at
/// the fineness that the setup says. The large reflected wave needs it more than the first arrival.
const BAND: f64 = 4.0;
/// Exponent at which evanescent waves between face and probe are neglected.
const EVANESCENCE: f64 = 12.0;
/// Where the taper of wavenumbers starts, as a fraction of their limit.
const TAPER_START: f64 = 0.6;
/// Samples per period of the centre frequency.
const SAMPLES_PER_PERIOD: f64 = 100.0;
/// Samples beyond a window for interpolation.
pub(super) const SAMPLES_BEYOND: usize = 8;
/// Most elements of a mesh.
const ELEMENTS_MAX: usize = 2000;
/// Nodes per wavelength in the coupling fluid at the frequency above which nothing is resolved.
const NODES_PER_WAVELENGTH: f64 = 4.0;
/// Samples per period of that frequency.
const BAND_SAMPLES: f64 = 6.0;
/// Most time steps.
const STEPS_MAX: f64 = 2e5;
/// Most products of elements, wavenumbers and time steps.
const WORK_MAX: f64 = 2e9;

/// Everything that is fixed before the first time step but its length.
#[derive(Debug, Clone)]
pub(super) struct Plan {
    pub(super) mesh: Mesh,
    /// Δk, rad/m.
    pub(super) wavenumber_step: f64,
    /// Where the taper ends, rad/m.
    pub(super) wavenumber_limit: f64,
    /// Highest frequency that the mesh resolves, Hz.
    pub(super) band: f64,
    /// End of the last window, s.
    pub(super) end: f64,
}

/// Times of one computation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Times {
    /// Time step, s.
    pub(super) step: f64,
    /// Time steps per sample.
    pub(super) ratio: usize,
    /// Number of samples.
    pub(super) samples: usize,
}

impl Times {
    /// Time between samples, s.
    pub(super) fn sample(&self) -> f64 {
        self.step * self.ratio as f64
    }
}

impl Plan {
    /// The plan for what `scope` takes in, `finer` times as fine as the setup says.
    ///
    /// # Errors
    /// `NoConvergence` when the mesh would be too large.
    pub(super) fn new(
        setup: &Setup,
        bone: &Bone,
        scope: &Scope,
        finer: f64,
    ) -> Result<Self, Failure> {
        let mesh = Mesh::new(setup, bone, scope, finer);
        if mesh.elements() > ELEMENTS_MAX {
            return Err(too_large(format!(
                "the mesh would have {} elements, allowed are {ELEMENTS_MAX}",
                mesh.elements()
            )));
        }
        let heights = setup.probe.source.x3 + setup.probe.receivers.x3;
        let farthest = distances(setup).fold(0.0, f64::max);
        let end = scope.end();
        // The nearest repeated source is heard at the farthest receiver only after the end.
        let length =
            farthest + scope.speed * (end - earliest_arrival(setup, 0.0, scope.speed)) + heights;
        let sound_speed = setup.layers.coupling.sound_speed;
        let propagating = 2.0 * PI * BAND * setup.probe.center_frequency / sound_speed;
        let evanescent = EVANESCENCE / heights;
        let spacing = mesh.coupling.size / (mesh.element.count() - 1) as f64;
        Ok(Self {
            band: sound_speed / (NODES_PER_WAVELENGTH * spacing),
            mesh,
            wavenumber_step: 2.0 * PI / length,
            wavenumber_limit: finer
                * propagating.mul_add(propagating, evanescent * evanescent).sqrt(),
            end,
        })
    }

    /// Blocks of eight wavenumbers.
    pub(super) fn blocks(&self) -> usize {
        (self.wavenumber_limit / self.wavenumber_step) as usize / LANES + 1
    }

    /// Weight of wavenumber `k` (rad/m) in the cosine transform.
    pub(super) fn weight(&self, k: f64) -> f64 {
        let taper = smooth_step((1.0 - k / self.wavenumber_limit) / (1.0 - TAPER_START));
        let half = if k == 0.0 { 0.5 } else { 1.0 };
        half * taper * self.wavenumber_step / PI
    }

    /// Times from `onset` (s) on, with steps of `share` of the largest stable one, `limit` (s).
    ///
    /// # Errors
    /// `NoConvergence` when there are too many.
    pub(super) fn times(
        &self,
        setup: &Setup,
        onset: f64,
        limit: f64,
        share: f64,
    ) -> Result<Times, Failure> {
        let step = share * limit;
        let duration = (self.end - onset).max(0.0);
        let steps = duration / step;
        let wavenumbers = (self.blocks() * LANES) as f64;
        let work = steps * wavenumbers * self.mesh.elements() as f64;
        if !(steps <= STEPS_MAX && work <= WORK_MAX) {
            return Err(too_large(format!(
                "{steps:.0} time steps of {step:.3e} s, {wavenumbers} wavenumbers and {} elements are \
                 too much: at most {STEPS_MAX} steps and a product of {WORK_MAX:e}",
                self.mesh.elements()
            )));
        }
        let rate =
            (SAMPLES_PER_PERIOD * setup.probe.center_frequency).max(BAND_SAMPLES * self.band);
        let spacing = 1.0 / rate;
        let ratio = ((spacing / step) as usize).max(1);
        let mut times = Times { step, ratio, samples: 0 };
        times.samples = (duration / times.sample()) as usize + SAMPLES_BEYOND;
        Ok(times)
    }
}

/// The computation would take more than its bounds allow.
fn too_large(detail: String) -> Failure {
    Failure { kind: FailureKind::NoConvergence, detail }
}
