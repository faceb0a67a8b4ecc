//! The result of `simulate`.

use osteon_common::outcome::FailureKind;
use osteon_common::settings::{Extremum, Picking};
use osteon_common::version::RESULT_SCHEMA;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{DocumentContent, Head, ReadError, Solver};

/// One case and its velocity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Simulation {
    /// Velocity of the first arriving signal, m/s; null where none was picked.
    pub velocity: Option<f64>,
    /// Velocities from the first source and from the second, m/s, of a bidirectional probe, of which
    /// `velocity` is the harmonic mean; null where there is none.
    pub directions: Option<[f64; 2]>,
    /// Why there is no velocity; null where there is one.
    pub failure: Option<FailureKind>,
    /// The reason in words; null where there is a velocity.
    pub detail: Option<String>,
    /// The receivers, in their order.
    pub receivers: Vec<Receiver>,
    /// Further observables of the first signal; null where there is no velocity.
    pub first_signal: Option<FirstSignalReport>,
    /// The fundamental guided waves of the bone.
    pub guided_waves: GuidedWavesReport,
    /// The criterion of the first arrival.
    pub picking: Picking,
    /// How the velocity was computed.
    pub solver: Solver<Option<f64>>,
    /// The case solved in other ways, with `--check`; only printed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub check: Option<Vec<CheckedSolution>>,
    /// Version of the program.
    pub version: String,
    /// Revision of the numerics, which decides the bits of every velocity.
    pub numerics: u32,
    /// The commit that the program was built from, with `-dirty` behind it if the sources were
    /// modified; null if it was built outside a repository.
    pub commit: Option<String>,
}

impl Simulation {
    /// The text of the file, with a final newline.
    pub fn to_json(&self) -> String {
        super::document(DocumentContent::Simulation(self))
    }

    /// Reads the text of a `result.json`. Unknown keys are ignored.
    ///
    /// # Errors
    /// If the text is not JSON, is not the result of a simulation, or has another schema revision.
    pub fn from_json(text: &str) -> Result<Self, ReadError> {
        let Head { schema, kind } = super::parse(text)?;
        if schema != u64::from(RESULT_SCHEMA) {
            return Err(ReadError::Schema { found: schema });
        }
        match kind.as_str() {
            "simulation" => super::parse(text),
            _ => Err(ReadError::unknown_kind(&kind, "simulation")),
        }
    }
}

/// One receiver.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Receiver {
    /// Position along the bone, m.
    pub x1: f64,
    /// Picked time of the first arrival, s; null where there is none.
    pub time: Option<f64>,
}

/// Observables of the first signal besides its velocity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FirstSignalReport {
    /// The extremum that `picking` does not name.
    pub other_extremum: Extremum,
    /// Velocity of that extremum, m/s: that of the case if it were picked; null where there is none.
    pub other_velocity: Option<f64>,
    /// Why that extremum has no velocity; null where it has one.
    pub other_failure: Option<FailureKind>,
    /// The reason in words; null where it has one.
    pub other_detail: Option<String>,
    /// Decay of the picked extremum along the array, dB/cm: minus the least-squares slope of 20 log10 |p|
    /// against the distance along the probe; negative where |p| grows.
    pub decay: f64,
    /// Frequency of the signal, Hz: 1/(2 T) with the mean T of the times from the first extremum to the
    /// second at all receivers; null where one of both has no velocity.
    pub center_frequency: Option<f64>,
}

/// The fundamental guided waves of the bone as a plate in a vacuum, without its attenuation; A0 with
/// `probe.a0_in_fluids` of the bone between its fluids.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GuidedWavesReport {
    /// The frequency at which they are computed, Hz: `probe.guided_wave_frequency`.
    pub frequency: f64,
    /// The wave that is flexural at low frequencies; null where it was not found.
    pub a0: Option<GuidedWaveReport>,
    /// The wave that is extensional along the bone at low frequencies; null where it was not found.
    pub s0: Option<GuidedWaveReport>,
    /// Why a wave was not found; null where both were.
    pub reason: Option<String>,
}

/// One guided wave.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GuidedWaveReport {
    /// Phase velocity, m/s.
    pub phase_velocity: f64,
    /// Group velocity, m/s.
    pub group_velocity: f64,
}

/// One solution of a check, and how it differs from the refined one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CheckedSolution {
    /// How it was computed.
    #[serde(flatten)]
    pub solver: Solver<Option<f64>>,
    /// Velocity, m/s; null where none was picked.
    pub velocity: Option<f64>,
    /// Why there is no velocity; null where there is one.
    pub failure: Option<FailureKind>,
    /// Whether the same extremum was picked.
    pub same_pick: bool,
    /// Largest difference of any picked time from that of the refined solution, s.
    pub time_difference: Option<f64>,
    /// Relative difference of the velocity from that of the refined solution.
    pub relative_difference: Option<f64>,
}
