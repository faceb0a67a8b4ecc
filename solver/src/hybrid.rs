//! The paper's own solver: Fourier in x1, spectral elements in x3, time steps.
//!
//! One wavenumber at a time, the weak form of fluid, solid and fluid (`operator.rs`) is stepped
//! through time (`stepping.rs`) under the pressure of the source on the bone's face
//! (`incident.rs`), with all three components of the displacement; a cosine transform makes the
//! pressures at the receivers (`march.rs`), whose extrema (`samples.rs`) are picked by the same rule
//! as those of the exact method.
//!
//! What an element size, order and time step mean:
//!
//! - elements are at most `element_size`, and in a layer whose slowest wavelength across it, at the
//!   centre frequency, is below 1.5 mm smaller in that proportion: the mesh follows the bone;
//! - a time step above the bone's stability limit is a failure that names the limit; without one
//!   the step is the limit;
//! - `refinement` r divides element size and time step, and multiplies the limit of wavenumbers,
//!   by √r. For smooth pulses the error of elements of order n falls at least as r^(-(n+1)/2),
//!   that of time steps as r^(-2) ([`element_convergence`], [`time_step_convergence`]); the paper's
//!   pulse has a kink at t = 0, with which velocities converge more slowly.
//!
//! The estimated error is the change of the velocity when less is resolved, the taper of
//! wavenumbers ending at 0.8 of its limit (pressures are summed with both tapers) and frequencies
//! of four nodes per wavelength taken out, plus what was measured for the default elements against
//! the exact method, scaled by the square of the distance between nodes. It is an estimate of size,
//! not a bound.

mod convergence;
mod element;
mod incident;
mod march;
mod mesh;
mod operator;
mod plan;
mod samples;
mod stepping;

use osteon_common::case::{Bone, Setup};
use osteon_common::outcome::Outcome;
use osteon_common::sampling;

pub use self::convergence::{ConvergenceRow, element_convergence, time_step_convergence};
use self::incident::Incident;
use self::march::{Limit, March, Memory, Receiver};
use self::mesh::thin_plate;
use self::operator::Operator;
use self::plan::{Plan, Times};
use self::samples::{Samples, low_pass};
use crate::isa::Isa;
use crate::medium::Medium;
use crate::picking::{Pick, Window, pick};
use crate::solver::{check_direct_wave, not_finite};
use crate::{Arrival, Failure};

/// The second taper of wavenumbers, from which the error is estimated, ends at this share.
const NARROW: f64 = 0.8;
/// Typical relative error of velocities with [`USUAL_SPACING`], measured against the exact method.
const MESH_ERROR: f64 = 1e-5;
/// Mean distance between nodes, m, of elements of 0.5 mm and order 8.
const USUAL_SPACING: f64 = 0.5e-3 / 8.0;

/// Solves cases of one setup by the hybrid method.
#[derive(Debug)]
pub struct Hybrid {
    setup: Setup,
    distances: Vec<f64>,
    isa: Isa,
}

/// Scratch memory of one thread; its contents never reach a result.
#[derive(Debug, Default)]
pub struct HybridWorkspace {
    memory: Memory,
    windows: Vec<Window>,
}

impl Hybrid {
    /// A solver for cases of `setup`, which has passed validation.
    pub fn new(setup: &Setup) -> Self {
        Self::with_isa(setup, Isa::fastest())
    }

    /// The same, computing on one instruction set. The bits do not depend on it.
    pub fn with_isa(setup: &Setup, isa: Isa) -> Self {
        Self { setup: *setup, distances: sampling::distances(setup).collect(), isa }
    }

    /// The setup.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// The first arrival of one bone.
    ///
    /// # Errors
    /// A typed failure when the case has no velocity; `NoConvergence` also when the time step is
    /// above the stability limit, or the computation above its bounds.
    pub fn arrival(
        &self,
        bone: &Bone,
        workspace: &mut HybridWorkspace,
    ) -> Result<Arrival, Failure> {
        let speed = Medium::new(bone).fastest.max(self.setup.layers.marrow.sound_speed);
        if !speed.is_finite() {
            return Err(not_finite("the bone's wave speeds"));
        }
        check_direct_wave(&self.setup, speed)?;
        let plan = Plan::new(&self.setup, bone, speed)?;
        let operator = Operator::new(&self.setup, bone, &plan.mesh);
        let limit = self.isa.run(Limit {
            operator: &operator,
            wavenumber: plan.wavenumber_limit,
            state: &mut workspace.memory.state,
        });
        let onset = self.setup.probe.source.x3 / self.setup.layers.coupling.sound_speed;
        let times = plan.times(&self.setup, onset, limit)?;
        let mut incident = Incident::new(&self.setup, speed, times.sample());
        let receivers = self.receivers(speed, onset, times);
        let finite = self.isa.run(March {
            operator: &operator,
            plan: &plan,
            times,
            incident: &mut incident,
            receivers: &receivers,
            height: self.setup.probe.receivers.x3,
            narrow: NARROW,
            memory: &mut workspace.memory,
        });
        if !finite {
            return Err(not_finite("the pressure"));
        }
        let HybridWorkspace { memory, windows } = workspace;
        let pick = self.pick(speed, onset, times, &memory.full, windows)?;
        let rows = memory.narrow.chunks_exact(times.samples);
        for (row, out) in rows.zip(memory.full.chunks_exact_mut(times.samples)) {
            low_pass(row, times.half_period, out);
        }
        let narrow = self.pick(speed, onset, times, &memory.full, windows);
        let change = narrow.map_or(1.0, |narrow| (narrow.velocity / pick.velocity - 1.0).abs());
        let estimated_error = change + self.mesh_error();
        Ok(Arrival { velocity: pick.velocity, times: pick.times, estimated_error })
    }

    /// Estimate of the velocity's relative error by the elements.
    fn mesh_error(&self) -> f64 {
        let settings = &self.setup.solver;
        let spacing = settings.element_size / f64::from(settings.element_order);
        let coarse = spacing / USUAL_SPACING;
        MESH_ERROR * thin_plate(&self.setup) * coarse * coarse / settings.refinement
    }

    /// The same, reduced to what a job keeps.
    pub fn outcome(&self, bone: &Bone, workspace: &mut HybridWorkspace) -> Outcome {
        self.arrival(bone, workspace)
            .map(|arrival| arrival.velocity)
            .map_err(|failure| failure.kind)
    }

    /// Each receiver's samples.
    fn receivers(&self, speed: f64, onset: f64, times: Times) -> Vec<Receiver> {
        let sample = |t: f64| ((t - onset) / times.sample()).max(0.0) as usize;
        let receiver = |&distance: &f64| {
            let from = sample(sampling::earliest_arrival(&self.setup, distance, speed));
            let to = sample(sampling::direct_arrival(&self.setup, distance));
            Receiver {
                distance,
                first: from.saturating_sub(times.margin()),
                last: (to + times.margin()).min(times.samples - 1),
            }
        };
        self.distances.iter().map(receiver).collect()
    }

    /// Picks the first arrival among pressure samples.
    fn pick(
        &self,
        speed: f64,
        onset: f64,
        times: Times,
        pressures: &[f64],
        windows: &mut Vec<Window>,
    ) -> Result<Pick, Failure> {
        windows.resize_with(self.distances.len(), Window::default);
        let step = times.sample();
        let rows = pressures.chunks_exact(times.samples);
        for ((window, values), &x) in windows.iter_mut().zip(rows).zip(&self.distances) {
            let samples = Samples { start: onset, step, values };
            let from = sampling::earliest_arrival(&self.setup, x, speed);
            let to = sampling::direct_arrival(&self.setup, x);
            samples.extrema(from, to, &mut window.extrema);
            window.last = samples.at(to).abs();
            window.drop_noise();
        }
        pick(&self.setup.picking, self.setup.probe.center_frequency, &self.distances, windows)
    }
}
