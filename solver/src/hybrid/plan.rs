//! Plan of one bone's computation: mesh, wavenumbers, times, and the check of its work against the
//! limits.

use std::f64::consts::PI;

use osteon_common::bone::Sublayers;
use osteon_common::case::Setup;
use osteon_common::outcome::FailureKind;
use osteon_common::probe::Place;
use osteon_common::sampling::{earliest_arrival, nearest_and_farthest, smooth_step};

use super::mesh::{FluidMesh, Mesh};
use super::scope::Scope;
use crate::failure::Failure;
use crate::lanes::LANES;

/// Highest frequency, as a multiple of the centre frequency, whose waves along the coupling fluid
/// are resolved at the setup's fineness. The large reflected wave requires it more than the first
/// arrival.
const BAND: f64 = 4.0;
/// Plates thinner than this many metres at 1 Hz (m·Hz) are computed more finely: their first
/// extremum lies closer to the wave of the kink.
const THIN_PLATE: f64 = 2000.0;
/// Thinness beyond which the fineness does not increase further.
const THINNESS_MAX: f64 = 2.25;
/// Exponent at which evanescent waves between face and probe are neglected.
const EVANESCENCE: f64 = 12.0;
/// Where the taper of wavenumbers starts, as a fraction of their limit.
const TAPER_START: f64 = 0.6;
/// Samples per period of the centre frequency.
const SAMPLES_PER_PERIOD: f64 = 100.0;
/// Number of samples beyond a window for interpolation.
pub(super) const SAMPLES_BEYOND: usize = 8;
/// Maximum number of elements of a mesh.
const ELEMENTS_MAX: usize = 2000;
/// Nodes per wavelength in the coupling fluid at the highest resolved frequency.
const NODES_PER_WAVELENGTH: f64 = 3.0;
/// Samples per period of that frequency.
const BAND_SAMPLES: f64 = 6.0;
/// Maximum number of time steps.
const STEPS_MAX: f64 = 2e5;
/// Maximum product of elements, wavenumbers and time steps, for all passes of a bone: some 20 s.
/// Four passes of a plate of 1 mm in the paper's geometry take 1.1e8, and 7e8 at refinement 4.
const WORK_MAX: f64 = 8e8;

/// Everything that is fixed before the first time step, except the length of the steps.
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
    /// Width of source and receivers, m.
    element_width: f64,
}

/// Times of one computation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Times {
    /// Time step, s.
    pub(super) step: f64,
    /// Time steps per sample.
    pub(super) ratio: usize,
    pub(super) samples: usize,
}

/// The work that passes may still use.
#[derive(Debug, Clone, Copy)]
pub(super) struct WorkBudget(f64);

impl Default for WorkBudget {
    fn default() -> Self {
        Self(WORK_MAX)
    }
}

impl WorkBudget {
    /// Takes the work of one pass off the budget.
    ///
    /// # Errors
    /// `NoConvergence` if less is left.
    fn take(&mut self, work: f64) -> Result<(), Failure> {
        if work <= self.0 {
            self.0 -= work;
            return Ok(());
        }
        Err(too_large(format!(
            "elements × wavenumbers × time steps are {:.1e}, of which at most {WORK_MAX:.0e} are computed for \
             one bone",
            WORK_MAX - self.0 + work
        )))
    }
}

impl Times {
    /// Time between samples, s.
    pub(super) fn sample(&self) -> f64 {
        self.step * self.ratio as f64
    }
}

impl Plan {
    /// Plans the computation of the windows in `scope`, `finer` times as fine as in the setup.
    ///
    /// # Errors
    /// `NoConvergence` if the mesh would be too large.
    pub(super) fn new(
        setup: &Setup,
        bone: &Sublayers,
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
        let (_, farthest) = nearest_and_farthest(setup);
        let end = scope.end();
        // The nearest repeated source must reach the farthest receiver only after the end.
        let above = Place { x: 0.0, x3: setup.probe.receivers.x3 };
        let length =
            farthest + scope.speed * (end - earliest_arrival(setup, above, scope.speed)) + heights;
        let fluids = setup.layers.coupling_fluids();
        let speeds = fluids.as_slice().iter().map(|fluid| fluid.sound_speed);
        let slowest = speeds.fold(f64::INFINITY, f64::min);
        let propagating = 2.0 * PI * BAND * setup.probe.band_unit() / slowest;
        let evanescent = EVANESCENCE / heights;
        let band = |one: &FluidMesh| {
            let spacing = one.mesh.size / (mesh.element.count() - 1) as f64;
            one.fluid.sound_speed / (NODES_PER_WAVELENGTH * spacing)
        };
        Ok(Self {
            band: mesh.coupling.iter().map(band).fold(f64::INFINITY, f64::min),
            mesh,
            wavenumber_step: 2.0 * PI / length,
            wavenumber_limit: wavenumber_fineness(setup, finer)
                * propagating.mul_add(propagating, evanescent * evanescent).sqrt(),
            end,
            element_width: setup.probe.element_width,
        })
    }

    /// Returns the number of blocks of eight wavenumbers.
    pub(super) fn blocks(&self) -> usize {
        (self.wavenumber_limit / self.wavenumber_step) as usize / LANES + 1
    }

    /// Returns the weight of wavenumber `k` (rad/m) in the cosine transform.
    pub(super) fn weight(&self, k: f64) -> f64 {
        let taper = smooth_step((1.0 - k / self.wavenumber_limit) / (1.0 - TAPER_START));
        let half = if k == 0.0 { 0.5 } else { 1.0 };
        half * taper * self.wavenumber_step / PI * self.element_factor(k)
    }

    /// Returns the mean of e^(ikx) over the width of the source, times that over a receiver's.
    fn element_factor(&self, k: f64) -> f64 {
        let phase = 0.5 * k * self.element_width;
        let mean = if phase == 0.0 { 1.0 } else { libm::sin(phase) / phase };
        mean * mean
    }

    /// Returns the times from `onset` (s) on, with steps of `share` of the largest stable one,
    /// `limit` (s); their work is taken from the `budget`.
    ///
    /// # Errors
    /// `NoConvergence` if there are too many, or if they are too much work.
    pub(super) fn times(
        &self,
        setup: &Setup,
        onset: f64,
        limit: f64,
        share: f64,
        budget: &mut WorkBudget,
    ) -> Result<Times, Failure> {
        let step = share * limit;
        let duration = (self.end - onset).max(0.0);
        let steps = duration / step;
        let wavenumbers = (self.blocks() * LANES) as f64;
        let work = steps * wavenumbers * self.mesh.elements() as f64;
        if steps > STEPS_MAX || steps.is_nan() {
            return Err(too_large(format!(
                "{steps:.1e} time steps of {step:.3e} s are too many, allowed are {STEPS_MAX:.0e}"
            )));
        }
        budget.take(work)?;
        let rate = (SAMPLES_PER_PERIOD * setup.probe.band_unit()).max(BAND_SAMPLES * self.band);
        let spacing = 1.0 / rate;
        let ratio = ((spacing / step) as usize).max(1);
        let mut times = Times { step, ratio, samples: 0 };
        times.samples = (duration / times.sample()) as usize + SAMPLES_BEYOND;
        Ok(times)
    }
}

/// Returns how much thinner the plate is than the limit of thin plates; at least 1.
pub(super) fn thinness(setup: &Setup) -> f64 {
    let thickness = setup.layers.bone_thickness * setup.probe.center_frequency;
    (THIN_PLATE / thickness).clamp(1.0, THINNESS_MAX)
}

/// Returns the factor by which wavenumbers extend beyond the setup's limit, for elements `finer`
/// times as fine.
///
/// A limit of wavenumbers cuts off the slow waves of each frequency first, but the picked waves are
/// fast. Therefore, beyond the setup's limit, wavenumbers grow only as the root of the fineness, and
/// of the thinness.
fn wavenumber_fineness(setup: &Setup, finer: f64) -> f64 {
    let usual = setup.solver.refinement.sqrt();
    let over = finer / usual;
    usual * over.min((over * thinness(setup)).sqrt())
}

/// Returns the failure of a computation that would exceed its limits.
fn too_large(what: String) -> Failure {
    Failure {
        kind: FailureKind::NoConvergence,
        detail: format!(
            "{what}: give larger solver.element_size or time_step, lower solver.refinement or \
             probe.center_frequency, bring receivers and source nearer to each other, or set \
             solver.method = \"exact\""
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wavenumbers_grow_with_fineness_and_thinness_by_the_root() {
        for (thickness, refinement, finer, expected) in [
            (4e-3, 1.0, 0.75, 0.75),
            (4e-3, 1.0, 1.44, 1.2),
            (4e-3, 4.0, 2.88, 2.4),
            (1e-3, 1.0, 2.0, 2.0),
            (1e-3, 1.0, 4.5, 3.0),
            (1e-4, 1.0, 4.0, 3.0),
        ] {
            let mut setup = Setup::default();
            setup.layers.bone_thickness = thickness;
            setup.solver.refinement = refinement;
            let found = wavenumber_fineness(&setup, finer);
            assert!(
                (found - expected).abs() < 1e-12,
                "{thickness} m, {refinement}, {finer}: {found}"
            );
        }
    }
}
