//! The paper's own method: Fourier in x1, spectral elements in x3, time steps.
//!
//! One wavenumber at a time, the weak form of fluid, solid and fluid (`operator.rs`) is stepped
//! through time (`stepping.rs`) under the pressure of the source on the bone's face
//! (`incident.rs`), with all three components of the displacement; a cosine transform gives the
//! pressures at the receivers (`march.rs`), whose extrema (`samples.rs`) are picked by the same
//! rule as those of the exact method.
//!
//! The paper's pulse has a kink at t = 0. If an extremum lies close to a wave of that kink its time
//! converges slowly, and the distance varies from bone to bone. Therefore every bone is computed in
//! passes, each finer than the one before, until two of them agree (`passes.rs`). The first pass
//! computes the whole window before the direct wave. The others, for which the picked extremum is
//! known, compute only the first packet, which requires far less time and depth of the fluids, and
//! a coarser grid of wavenumbers.
//!
//! The meaning of element size, order and time step:
//!
//! - in all passes but the first, elements are at most `element_size`, and smaller where waves at
//!   the centre frequency are shorter than 1.5 mm: in a fluid in proportion to its wavelength, in
//!   a sublayer of the bone to the geometric mean of its slowest wavelength across and the coupling's;
//! - a time step above the bone's stability limit in the first pass is a failure that names the
//!   limit; without a given time step the step is the limit. The other passes use the same fraction
//!   of their own limits;
//! - `refinement` r divides element size and time step, and multiplies the limit of wavenumbers, by
//!   √r. For smooth pulses the error of elements of order n falls at least as r^(-(n+1)/2), that of
//!   time steps as r^(-2) ([`element_convergence`], [`time_step_convergence`]).
//!
//! The estimated error is half the change of the velocity by the last pass, combined with half the
//! effect that the scatter of the changes of its times could have on it. It is not smaller than the
//! error of the waves' speed if the last mesh has fewer than five nodes per wavelength. It is an
//! estimate of the size, not a bound.

mod column_load;
#[cfg(feature = "measure")]
mod convergence;
mod element;
mod incident;
mod march;
mod mesh;
mod operator;
mod passes;
mod plan;
mod samples;
mod scope;
mod stepping;

use osteon_common::bone::BoneRef;
use osteon_common::case::Setup;
use osteon_common::outcome::Outcome;

#[cfg(feature = "measure")]
pub use self::convergence::{ConvergenceRow, element_convergence, time_step_convergence};
use self::incident::Incident;
use self::march::MarchWorkspace;
use self::passes::Passes;
use self::plan::WorkBudget;
use self::scope::Scope;
use crate::arrival::Arrival;
use crate::failure::{Failure, check_direct_wave, speed_not_finite};
use crate::isa::Isa;
use crate::medium::Medium;
use crate::picking::Window;

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
    memory: MarchWorkspace,
    windows: Vec<Window>,
}

impl Hybrid {
    /// Creates a solver for cases of `setup`, which has passed validation.
    pub fn new(setup: &Setup) -> Self {
        Self::with_isa(setup, Isa::fastest())
    }

    /// Creates a solver that computes on `isa`. The bits of its results do not depend on the instruction set.
    pub fn with_isa(setup: &Setup, isa: Isa) -> Self {
        Self { setup: setup.clone(), distances: setup.probe.distances().collect(), isa }
    }

    /// Returns the setup.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Computes the first arrival of one bone.
    ///
    /// # Errors
    /// The failure, if the case has no velocity; `NoConvergence` also if the time step is above
    /// the stability limit, or the computation exceeds its limits.
    pub fn arrival<'a>(
        &self,
        bone: impl Into<BoneRef<'a>>,
        workspace: &mut HybridWorkspace,
    ) -> Result<Arrival, Failure> {
        self.arrival_of(bone.into(), workspace)
    }

    fn arrival_of(
        &self,
        bone: BoneRef<'_>,
        workspace: &mut HybridWorkspace,
    ) -> Result<Arrival, Failure> {
        let bone = bone.sublayers(self.setup.layers.bone_thickness);
        let solids = bone.iter().map(|sublayer| Medium::new(&sublayer.solid).fastest);
        let mut speed = solids.fold(self.setup.layers.marrow.fastest(), f64::max);
        if Incident::is_stepped(&self.setup) {
            // Waves may run in a fluid on their way to the bone.
            speed = speed.max(self.setup.layers.coupling.fastest());
        }
        if !speed.is_finite() {
            return Err(speed_not_finite());
        }
        check_direct_wave(&self.setup, speed)?;
        let HybridWorkspace { memory, windows } = workspace;
        Passes {
            setup: &self.setup,
            distances: &self.distances,
            isa: self.isa,
            bone: &bone,
            whole: Scope::until_direct_wave(&self.setup, speed),
            memory,
            windows,
            share: None,
            budget: WorkBudget::default(),
        }
        .arrival()
    }

    /// Computes the velocity of one bone, m/s, or the kind of failure: what a job keeps of an arrival.
    pub fn outcome<'a>(
        &self,
        bone: impl Into<BoneRef<'a>>,
        workspace: &mut HybridWorkspace,
    ) -> Outcome {
        self.arrival(bone, workspace)
            .map(|arrival| arrival.velocity)
            .map_err(|failure| failure.kind)
    }
}
