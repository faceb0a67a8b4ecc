//! The types behind `result.json` and the output of `--json`. Writing, reading and the published schema
//! all follow from these definitions.
//!
//! Keys are written in the order of the struct's fields. A number that is not finite, or that is not
//! known, is null; every other one is the shortest decimal that reads back to the same bits.

mod conclusions;
mod error;
mod identification;
mod integrity;
mod moments;
mod point;
mod pooling;
mod posterior;
mod propagation;
mod schema;
mod simulation;
mod solver;

use osteon_common::job::JobKind;
use osteon_common::parameters::Point;
use osteon_common::results::{JobFailure, JobResult, Status};
use osteon_common::version::{Program, RESULT_SCHEMA};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize};

pub use self::conclusions::{
    Contribution, Direction, Identified, Noise, ParameterProfile, QuantityBudget, QuantityEstimate,
    Solution, Solutions, Spreads,
};
pub use self::error::{BestPointError, ReadError, listed};
pub use self::identification::{Group, Identification, SearchSettings};
pub use self::integrity::IntegrityReport;
pub use self::moments::{Data, Moment, MomentIntervals, MomentSlopes, Moments, Velocity};
pub use self::point::MeanModel;
pub(crate) use self::pooling::PooledGroups;
pub use self::pooling::{GroupPooling, PooledEstimate, PooledValue, ScaledErrors, SharedQuantity};
pub use self::posterior::{PosteriorReport, QuantityPosterior};
pub use self::propagation::Propagation;
pub use self::schema::schema;
pub use self::simulation::{
    CheckedSolution, FirstSignalReport, GuidedWaveReport, GuidedWavesReport, Receiver, Simulation,
};
pub use self::solver::{EstimatedErrors, Solver};

/// The result of a job.
#[derive(Debug, Clone, PartialEq)]
pub enum ResultFile {
    /// The result of `identify`.
    Identification(Box<Identification>),
    /// The result of `propagate`.
    Propagation(Box<Propagation>),
}

impl ResultFile {
    /// The file of a job of this kind.
    pub fn from_job(kind: JobKind, result: &JobResult) -> Self {
        match kind {
            JobKind::Identification => Self::Identification(Box::new(result.into())),
            JobKind::Propagation => Self::Propagation(Box::new(result.into())),
        }
    }

    /// Reads the text of a `result.json`. Unknown keys are ignored.
    ///
    /// # Errors
    /// If the text is not JSON, is not the result of a job, or has another schema revision.
    pub fn from_json(text: &str) -> Result<Self, ReadError> {
        let Head { schema, kind } = parse(text)?;
        if schema != u64::from(RESULT_SCHEMA) {
            return Err(ReadError::Schema { found: schema });
        }
        match kind.as_str() {
            "identification" => Ok(Self::Identification(parse(text)?)),
            "propagation" => Ok(Self::Propagation(parse(text)?)),
            _ => Err(ReadError::unknown_kind(&kind, "identification or propagation")),
        }
    }

    /// The text of the file, with a final newline.
    pub fn to_json(&self) -> String {
        document(match self {
            Self::Identification(result) => DocumentContent::Identification(result),
            Self::Propagation(result) => DocumentContent::Propagation(result),
        })
    }

    /// The kind of the job.
    pub fn kind(&self) -> JobKind {
        match self {
            Self::Identification(_) => JobKind::Identification,
            Self::Propagation(_) => JobKind::Propagation,
        }
    }

    /// How the search ended; `None` for a propagation, which does not search.
    pub fn status(&self) -> Option<Status> {
        match self {
            Self::Identification(result) => Some(result.status),
            Self::Propagation(_) => None,
        }
    }

    /// The kind of failure and the reason in words; `None` if the job did not fail.
    pub fn failure(&self) -> Option<(JobFailure, Option<&str>)> {
        match self {
            Self::Identification(result) => Some((result.failure?, result.reason.as_deref())),
            Self::Propagation(_) => None,
        }
    }

    /// Moments of the model's velocities at the best point of the job.
    pub fn velocity(&self) -> &Velocity {
        match self {
            Self::Identification(result) => &result.velocity,
            Self::Propagation(result) => &result.velocity,
        }
    }

    /// BLAKE3 digest of the evaluations.
    pub fn digest(&self) -> &str {
        match self {
            Self::Identification(result) => &result.digest,
            Self::Propagation(result) => &result.digest,
        }
    }

    /// Number of realizations of each evaluation.
    pub fn realizations(&self) -> u64 {
        match self {
            Self::Identification(result) => result.realizations,
            Self::Propagation(result) => result.realizations,
        }
    }

    /// Seed of the germs.
    pub fn seed(&self) -> u64 {
        match self {
            Self::Identification(result) => result.seed,
            Self::Propagation(result) => result.seed,
        }
    }

    /// The program that computed it.
    pub fn program(&self) -> Program {
        let (version, numerics, commit) = match self {
            Self::Identification(result) => (&result.version, result.numerics, &result.commit),
            Self::Propagation(result) => (&result.version, result.numerics, &result.commit),
        };
        Program { version: version.clone(), numerics, commit: commit.clone() }
    }

    /// Set if a host that computed a part of the result was banned after the job had ended.
    pub fn integrity(&self) -> Option<&IntegrityReport> {
        match self {
            Self::Identification(result) => result.integrity.as_ref(),
            Self::Propagation(result) => result.integrity.as_ref(),
        }
    }

    /// Returns the posterior of the job's one set of data, if it asked for it.
    pub fn posterior(&self) -> Option<&PosteriorReport> {
        match self {
            Self::Identification(result) => result.posterior(),
            Self::Propagation(_) => None,
        }
    }

    /// Returns the result of each group of the data; empty where the data are not grouped.
    pub fn groups(&self) -> &[Group] {
        match self {
            Self::Identification(result) => result.groups.as_deref().unwrap_or_default(),
            Self::Propagation(_) => &[],
        }
    }

    /// Returns the best point of the job, or that of the group named `group` if one is given.
    ///
    /// # Errors
    /// If there is no such group, or no point was found.
    pub fn best_point(&self, group: Option<&str>) -> Result<Point, BestPointError> {
        let (parameters, dispersion) = match (group, self) {
            (Some(name), _) => {
                let found = self.groups().iter().find(|group| group.name == name);
                let names = || self.groups().iter().map(|group| group.name.as_str());
                let found = found.ok_or_else(|| BestPointError::unknown_group(name, names()))?;
                (&found.parameters, found.dispersion)
            }
            (None, Self::Identification(result)) => (&result.parameters, result.dispersion),
            (None, Self::Propagation(result)) => (&result.parameters, result.dispersion),
        };
        parameters.point(dispersion).ok_or(BestPointError::NoPointFound)
    }
}

/// The result of an osteon run, as written to `result.json` and printed by `--json`. Units are SI: m, s,
/// kg/m³, Pa, Hz.
#[derive(Serialize, JsonSchema)]
#[schemars(title = "osteon result")]
struct Document<'a> {
    /// Schema revision. It does not change when keys are added, so a reader should ignore keys that it
    /// does not know.
    #[schemars(extend("const" = RESULT_SCHEMA))]
    schema: u32,
    #[serde(flatten)]
    content: DocumentContent<'a>,
}

#[derive(Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum DocumentContent<'a> {
    /// The result of `osteon identify`.
    Identification(&'a Identification),
    /// The result of `osteon propagate`.
    Propagation(&'a Propagation),
    /// The result of `osteon simulate`.
    Simulation(&'a Simulation),
}

fn document(content: DocumentContent<'_>) -> String {
    to_pretty_json(&Document { schema: RESULT_SCHEMA, content })
}

#[expect(clippy::expect_used, reason = "it fails only for map keys that are not strings")]
fn to_pretty_json(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect("keys are strings") + "\n"
}

/// The keys that decide how the others are read.
#[derive(Deserialize)]
#[serde(expecting = "an object with `schema` and `kind`")]
struct Head {
    schema: u64,
    kind: String,
}

fn parse<T: DeserializeOwned>(text: &str) -> Result<T, ReadError> {
    let mut deserializer = serde_json::Deserializer::from_str(text);
    let value = serde_path_to_error::deserialize(&mut deserializer).map_err(ReadError::from)?;
    deserializer.end().map_err(ReadError::Syntax)?;
    Ok(value)
}

/// Returns a number as it is written: null if it is not finite.
fn finite_or_null(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

/// Reads a key that may be absent (`None`) or null (`Some(None)`).
fn absent_or_nullable<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Option<Option<T>>, D::Error> {
    Option::deserialize(deserializer).map(Some)
}
