//! Velocity of the first arriving signal of a fluid / anisotropic solid / fluid plate.
//!
//! Pure: no I/O, no clock, no thread.

use osteon_common::case::{Bone, Setup};
use osteon_common::outcome::{FailureKind, Outcome};

/// Solves cases of one setup; holds the tables that all its realizations share.
#[derive(Debug)]
pub struct Solver {
    setup: Setup,
}

/// Scratch memory of one thread.
#[derive(Debug, Default)]
pub struct Workspace {}

/// A picked first arrival.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// Velocity of the first arriving signal, m/s.
    pub velocity: f64,
    /// Time of the picked extremum at each receiver, s.
    pub times: Vec<f64>,
}

/// Why a case has no velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// Its kind.
    pub kind: FailureKind,
    /// In a sentence, with the receiver named where there is one.
    pub detail: String,
}

/// Pressures at the receivers.
#[derive(Debug, Clone, PartialEq)]
pub struct Traces {
    /// Times, s.
    pub times: Vec<f64>,
    /// Pressure per receiver and time, Pa, direct wave included.
    pub pressures: Vec<Vec<f64>>,
}

impl Solver {
    /// A solver for cases of `setup`, which has passed validation.
    pub fn new(setup: &Setup) -> Self {
        Self { setup: *setup }
    }
    /// The setup.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }
    /// The first arrival of one bone.
    ///
    /// # Errors
    /// A typed failure.
    pub fn arrival(&self, _bone: &Bone, _workspace: &mut Workspace) -> Result<Arrival, Failure> {
        Err(Failure { kind: FailureKind::NoConvergence, detail: String::new() })
    }
    /// The same, reduced to what a job keeps.
    pub fn outcome(&self, bone: &Bone, workspace: &mut Workspace) -> Outcome {
        self.arrival(bone, workspace).map(|a| a.velocity).map_err(|f| f.kind)
    }
    /// Pressure traces from 0 to `duration` (s), every `time_step` (s).
    pub fn traces(&self, _bone: &Bone, _duration: f64, _time_step: f64) -> Traces {
        Traces { times: vec![], pressures: vec![] }
    }
}
