//! The result of `propagate`.

use std::collections::BTreeMap;

use osteon_common::job::Sampling;
use osteon_common::outcome::FailureKind;
use osteon_common::results::JobResult;
use osteon_common::settings::Picking;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::schema::keyed_by_failure;
use super::{EstimatedErrors, IntegrityReport, MeanModel, Solver, Velocity, finite_or_null};

/// The moments of the velocities at one point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Propagation {
    /// Number of realizations.
    pub realizations: u64,
    /// Seed of the germs.
    pub seed: u64,
    /// How the germs were drawn.
    pub sampling: Sampling,
    /// Number of scrambles among which the realizations were divided.
    pub scrambles: u64,
    /// Whether the job asked for the control variate.
    pub control_variate: bool,
    /// The mean model.
    pub parameters: MeanModel,
    /// Dispersion of the elasticity.
    pub dispersion: Option<f64>,
    /// Number of failed realizations, by kind; kinds that did not occur are not there.
    #[schemars(transform = keyed_by_failure)]
    pub failures: BTreeMap<FailureKind, u64>,
    /// Moments of the velocities.
    pub velocity: Velocity,
    /// How the velocities were computed.
    pub solver: Solver<EstimatedErrors>,
    /// The criterion of the first arrival.
    pub picking: Picking,
    /// BLAKE3 digest of the evaluation, 64 hexadecimal digits.
    pub digest: String,
    /// Version of the program.
    pub version: String,
    /// Revision of the numerics, which decides the bits of every velocity.
    pub numerics: u32,
    /// The commit that the program was built from, with `-dirty` behind it if the sources were
    /// modified; null if it was built outside a repository.
    pub commit: Option<String>,
    /// Only if a host that computed a part of the result was banned after the job had ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub integrity: Option<IntegrityReport>,
}

impl From<&JobResult> for Propagation {
    fn from(result: &JobResult) -> Self {
        let best = result.best.as_ref();
        let point = best.map(|best| best.point);
        let estimated_error = best.and_then(|best| best.estimated_error);
        Self {
            realizations: result.realizations,
            seed: result.seed,
            sampling: result.sampling,
            scrambles: result.scrambles,
            control_variate: result.control_variate,
            parameters: point.as_ref().map(MeanModel::from).unwrap_or_default(),
            dispersion: point.map(|point| point.dispersion()).and_then(finite_or_null),
            failures: best.map(|best| best.failures.iter().collect()).unwrap_or_default(),
            velocity: best.into(),
            solver: Solver::new(&result.solver, result.nominal, estimated_error.into()),
            picking: result.picking,
            digest: result.digest.clone(),
            version: result.program.version.clone(),
            numerics: result.program.numerics,
            commit: result.program.commit.clone(),
            integrity: IntegrityReport::from_result(result),
        }
    }
}
