//! What one bone's computation takes: mesh, wavenumbers, times, and whether that is within bounds.

use std::f64::consts::PI;

use osteon_common::case::{Bone, Setup};
use osteon_common::outcome::FailureKind;
use osteon_common::sampling::{direct_arrival, distances, earliest_arrival};

use super::mesh::{Mesh, thin_plate};
use super::samples;
use crate::Failure;
use crate::lanes::LANES;

/// Highest frequency over centre frequency whose waves along the coupling fluid are resolved, at
/// refinement 1 and for a plate that is not thin.
const BAND: f64 = 4.0;
/// Exponent at which evanescent waves between face and probe are neglected.
const EVANESCENCE: f64 = 12.0;
/// Where the taper of wavenumbers starts, as a fraction of their limit.
const TAPER_START: f64 = 0.6;
/// Samples per period of the centre frequency.
const SAMPLES_PER_PERIOD: f64 = 100.0;
/// Samples beyond a window for interpolation.
const SAMPLES_BEYOND: usize = 8;
/// Nodes per wavelength in the coupling fluid at the frequency above which nothing is resolved.
const NODES_PER_WAVELENGTH: f64 = 4.0;
/// Most elements of a mesh.
const ELEMENTS_MAX: usize = 2000;
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
    /// Samples in half a period of the highest frequency that the mesh resolves.
    pub(super) half_period: usize,
}

impl Times {
    /// Samples that are needed on both sides of a window.
    pub(super) fn margin(&self) -> usize {
        SAMPLES_BEYOND + samples::REACH * self.half_period
    }

    /// Time between samples, s.
    pub(super) fn sample(&self) -> f64 {
        self.step * self.ratio as f64
    }
}

impl Plan {
    /// The plan for a bone of waves up to `speed` (m/s).
    pub(super) fn new(setup: &Setup, bone: &Bone, speed: f64) -> Result<Self, Failure> {
        let finer = setup.solver.refinement.sqrt();
        let mesh = Mesh::new(setup, bone, speed);
        if mesh.elements() > ELEMENTS_MAX {
            return Err(too_large(format!(
                "the mesh would have {} elements, allowed are {ELEMENTS_MAX}",
                mesh.elements()
            )));
        }
        let heights = setup.probe.source.x3 + setup.probe.receivers.x3;
        let farthest = distances(setup).fold(0.0, f64::max);
        let end = distances(setup).map(|x| direct_arrival(setup, x)).fold(0.0, f64::max);
        // The nearest repeated source is heard at the farthest receiver only after the end.
        let length = farthest + speed * (end - earliest_arrival(setup, 0.0, speed)) + heights;
        let fluid = &setup.layers.coupling;
        let band = BAND * thin_plate(setup);
        let propagating = 2.0 * PI * band * setup.probe.center_frequency / fluid.sound_speed;
        let evanescent = EVANESCENCE / heights;
        Ok(Self {
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

    /// Weight of wavenumber `k` (rad/m) in the cosine transform whose taper ends at `share` of the
    /// limit.
    pub(super) fn weight(&self, k: f64, share: f64) -> f64 {
        let limit = share * self.wavenumber_limit;
        let x = (k / limit - TAPER_START) / (1.0 - TAPER_START);
        let taper = if x <= 0.0 {
            1.0
        } else if x >= 1.0 {
            0.0
        } else {
            let (rising, falling) = (libm::exp(-1.0 / x), libm::exp(-1.0 / (1.0 - x)));
            falling / (rising + falling)
        };
        let half = if k == 0.0 { 0.5 } else { 1.0 };
        half * taper * self.wavenumber_step / PI
    }

    /// Times from `onset` (s) on, with the time step that the setup asks for or, if it leaves the
    /// choice, with the largest stable one.
    ///
    /// # Errors
    /// `NoConvergence` when the setup's step is above `limit` (s), or there are too many.
    pub(super) fn times(&self, setup: &Setup, onset: f64, limit: f64) -> Result<Times, Failure> {
        let wanted = setup.solver.time_step.map(|step| step / setup.solver.refinement.sqrt());
        if let Some(step) = wanted.filter(|step| *step > limit) {
            return Err(too_large(format!(
                "the time step of {step:e} s is above this bone's stability limit of {limit:e} s; \
                 give a smaller solver.time_step, or none"
            )));
        }
        let step = wanted.unwrap_or(limit);
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
        let spacing = 1.0 / (SAMPLES_PER_PERIOD * setup.probe.center_frequency);
        let ratio = ((spacing / step) as usize).max(1);
        let sample = step * ratio as f64;
        let spacing = self.mesh.coupling.size / (self.mesh.element.count() - 1) as f64;
        let sound_speed = setup.layers.coupling.sound_speed;
        let half_period = 0.5 * NODES_PER_WAVELENGTH * spacing / (sound_speed * sample);
        let mut times =
            Times { step, ratio, samples: 0, half_period: (half_period as usize).max(1) };
        times.samples = (duration / sample) as usize + times.margin();
        Ok(times)
    }
}

/// The computation would take more than its bounds allow.
fn too_large(detail: String) -> Failure {
    Failure { kind: FailureKind::NoConvergence, detail }
}
