//! The result of `identify`.

use std::collections::BTreeMap;

use osteon_common::job::{Objective, Prior, Sampling, SearchMethod};
use osteon_common::moments::ObservableEstimates;
use osteon_common::outcome::FailureKind;
use osteon_common::parameters::{Parameter, Point};
use osteon_common::results::{BestPoint, GroupResult, JobFailure, JobResult, PointMeaning, Status};
use osteon_common::settings::Picking;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::conclusions::{
    Identified, ParameterProfile, QuantityBudget, Solutions, budget, profiles, sensitivities,
};
use super::pooling::{PooledEstimate, ScaledErrors, errors, pool};
use super::schema::{keyed_by_failure, keyed_by_parameter};
use super::{
    Data, EstimatedErrors, GroupPooling, IntegrityReport, MeanModel, MomentSlopes, PosteriorReport,
    ReadError, Solver, Velocity, absent_or_nullable, finite_or_null, parse, to_pretty_json,
};

/// The point that fits the data best, and what the data say of it. Where the data are groups, each
/// group has its own point, and the keys of the best point are null.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Identification {
    /// How the search ended.
    pub status: Status,
    /// The kind of the failure; only where the status is `failed`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<JobFailure>,
    /// Why the search ended so, in a sentence, where the status needs one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// BLAKE3 digest of the evaluations of the search, 64 hexadecimal digits.
    pub digest: String,
    /// The function that was minimised.
    pub objective: Objective,
    /// Cost of the best point.
    pub cost: Option<f64>,
    /// Standard error of the cost by sampling; only of a likelihood.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "absent_or_nullable"
    )]
    pub cost_standard_error: Option<Option<f64>>,
    /// The mean model at the best point.
    pub parameters: MeanModel,
    /// Dispersion of the elasticity at the best point.
    pub dispersion: Option<f64>,
    /// Moments of the model's velocities at the best point.
    pub velocity: Velocity,
    /// Other observables of the model's realizations, with the standard error of each mean by sampling.
    #[serde(flatten)]
    pub observables: ObservableEstimates,
    /// The data; not there where they are groups.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub data: Option<Data>,
    /// Number of evaluations of the search; those that measured derivatives are not counted.
    pub evaluations: u64,
    /// Number of realizations of each evaluation.
    pub realizations: u64,
    /// Number of failed realizations at the best point, by kind; kinds that did not occur are not there.
    #[schemars(transform = keyed_by_failure)]
    pub failures: BTreeMap<FailureKind, u64>,
    /// Seed of the germs.
    pub seed: u64,
    /// How the germs were drawn.
    pub sampling: Sampling,
    /// Number of scrambles among which the realizations were divided.
    pub scrambles: u64,
    /// Whether the job asked for the control variate.
    pub control_variate: bool,
    /// How the search was made.
    pub search: SearchSettings,
    /// Relative changes of the moments for a relative change of each free parameter; null where they
    /// were not measured, not there where the data are groups.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "absent_or_nullable"
    )]
    #[schemars(transform = keyed_by_parameter)]
    pub sensitivities: Option<Option<BTreeMap<Parameter, MomentSlopes>>>,
    /// The quantities that the data determine; null where the derivatives were not measured, absent if
    /// the data are groups.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "absent_or_nullable"
    )]
    pub identified: Option<Option<Identified>>,
    /// What makes the variance of each quantity that is known; only where the job names something that is the
    /// same for all data and not known exactly.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub budget: Vec<QuantityBudget>,
    /// For each free parameter the lowest cost with it held at values from bound to bound.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schemars(transform = keyed_by_parameter)]
    pub profiles: BTreeMap<Parameter, ParameterProfile>,
    /// The answers from all starts; only with several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solutions: Option<Solutions>,
    /// The posterior of the free parameters; null where the job did not ask for it, absent if the data
    /// are groups.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "absent_or_nullable"
    )]
    pub posterior: Option<Option<PosteriorReport>>,
    /// The result of each group; only where the data are groups.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub groups: Option<Vec<Group>>,
    /// What the groups share; only where the job asks for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pooling: Option<GroupPooling>,
    /// How the velocities were computed.
    pub solver: Solver<EstimatedErrors>,
    /// The criterion of the first arrival.
    pub picking: Picking,
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

impl Identification {
    /// Returns the quantities that the data determine, where the derivatives were measured.
    pub fn identified(&self) -> Option<&Identified> {
        self.identified.as_ref()?.as_ref()
    }

    /// Returns the posterior, if the job asked for it.
    pub fn posterior(&self) -> Option<&PosteriorReport> {
        self.posterior.as_ref()?.as_ref()
    }

    /// Sets the groups, which are sent one by one, and pools them if the job asks for it.
    pub fn set_groups(&mut self, mut groups: Vec<Group>) {
        if let Some(pooling) = &mut self.pooling {
            let errors: Vec<_> =
                groups.iter().map(|group| (group.name.as_str(), &group.errors)).collect();
            let (found, values) = pool(&errors);
            *pooling = found;
            groups.iter_mut().zip(values).for_each(|(group, pooled)| group.pooled = pooled);
        }
        self.groups = Some(groups);
    }

    /// The derivatives, where they were measured.
    pub fn sensitivities(&self) -> Option<&BTreeMap<Parameter, MomentSlopes>> {
        self.sensitivities.as_ref()?.as_ref()
    }
}

impl From<&JobResult> for Identification {
    fn from(result: &JobResult) -> Self {
        let best = result.best.as_ref();
        let found = BestPointKeys::new(result.objective, best);
        let conclusions = &result.conclusions;
        let inference = conclusions.inference.as_ref();
        // A job has one set of data, or groups of them.
        let single = result.data.as_ref();
        let group = |group| Group::new(result.objective, group);
        let estimated_error = best.and_then(|best| best.estimated_error);
        let groups = result.groups.iter().map(group).collect();
        let mut found = Self {
            status: result.status,
            failure: result.failure,
            reason: result.reason.clone(),
            digest: result.digest.clone(),
            objective: result.objective,
            cost: found.cost,
            cost_standard_error: found.cost_standard_error,
            parameters: found.parameters,
            dispersion: found.dispersion,
            velocity: best.into(),
            observables: best.map(|best| best.observables).unwrap_or_default(),
            data: single.map(|data| Data::of_job(data, best)),
            evaluations: result.evaluations,
            realizations: result.realizations,
            failures: found.failures,
            seed: result.seed,
            sampling: result.sampling,
            scrambles: result.scrambles,
            control_variate: result.control_variate,
            search: SearchSettings::from(result),
            sensitivities: single.map(|_| inference.map(sensitivities)),
            identified: single.map(|_| inference.map(Identified::from)),
            budget: single.and(inference).map(budget).unwrap_or_default(),
            profiles: single.map(|_| profiles(conclusions)).unwrap_or_default(),
            solutions: single.and(conclusions.solutions.as_ref()).map(Solutions::from),
            posterior: single.map(|_| conclusions.posterior.as_ref().map(PosteriorReport::from)),
            groups: None,
            pooling: result.pooled.then(GroupPooling::default),
            solver: Solver::new(&result.solver, result.nominal, estimated_error.into()),
            picking: result.picking,
            version: result.program.version.clone(),
            numerics: result.program.numerics,
            commit: result.program.commit.clone(),
            integrity: IntegrityReport::from_result(result),
        };
        if single.is_none() {
            found.set_groups(groups);
        }
        found
    }
}

/// The findings at the best point, for a job or for a group.
struct BestPointKeys {
    cost: Option<f64>,
    cost_standard_error: Option<Option<f64>>,
    parameters: MeanModel,
    dispersion: Option<f64>,
    failures: BTreeMap<FailureKind, u64>,
}

impl BestPointKeys {
    fn new(objective: Objective, best: Option<&BestPoint>) -> Self {
        let point: Option<Point> = best.map(|best| best.point);
        let error = || best.and_then(|best| best.cost_error).and_then(finite_or_null);
        Self {
            cost: best.and_then(|best| best.cost).and_then(finite_or_null),
            cost_standard_error: (objective == Objective::Likelihood).then(error),
            parameters: point.as_ref().map(MeanModel::from).unwrap_or_default(),
            dispersion: point.map(|point| point.dispersion()).and_then(finite_or_null),
            failures: best.map(|best| best.failures.iter().collect()).unwrap_or_default(),
        }
    }
}

/// The result of one group of the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Group {
    /// Name of the group.
    pub name: String,
    /// How its search ended.
    pub status: Status,
    /// Why the search ended so, in a sentence, where the status needs one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Cost of the best point.
    pub cost: Option<f64>,
    /// Standard error of the cost by sampling; only of a likelihood.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "absent_or_nullable"
    )]
    pub cost_standard_error: Option<Option<f64>>,
    /// The mean model at the best point.
    pub parameters: MeanModel,
    /// Dispersion of the elasticity at the best point.
    pub dispersion: Option<f64>,
    /// Moments of the model's velocities at the best point.
    pub velocity: Velocity,
    /// Other observables of the model's realizations, with the standard error of each mean by sampling.
    #[serde(flatten)]
    pub observables: ObservableEstimates,
    /// The data of the group.
    pub data: Data,
    /// Number of failed realizations at the best point, by kind; kinds that did not occur are not there.
    #[schemars(transform = keyed_by_failure)]
    pub failures: BTreeMap<FailureKind, u64>,
    /// Relative changes of the moments for a relative change of each free parameter; null where they
    /// were not measured.
    #[schemars(transform = keyed_by_parameter)]
    pub sensitivities: Option<BTreeMap<Parameter, MomentSlopes>>,
    /// The quantities that the data determine; null where the derivatives were not measured.
    pub identified: Option<Identified>,
    /// What makes the variance of each quantity that is known; only where the job names something that is the
    /// same for all data and not known exactly.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub budget: Vec<QuantityBudget>,
    /// Values of the quantities with an interval, found with the help of the other groups; only where the job
    /// asks for it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub pooled: BTreeMap<String, PooledEstimate>,
    /// Errors of these quantities by their sources.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub errors: BTreeMap<String, ScaledErrors>,
    /// For each free parameter the lowest cost with it held at values from bound to bound.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schemars(transform = keyed_by_parameter)]
    pub profiles: BTreeMap<Parameter, ParameterProfile>,
    /// The answers from all starts; only with several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solutions: Option<Solutions>,
    /// The posterior of the free parameters; null where the job did not ask for it.
    #[serde(default)]
    pub posterior: Option<PosteriorReport>,
}

impl Group {
    /// Returns the result of a group of a job with this objective.
    pub fn new(objective: Objective, group: &GroupResult) -> Self {
        let best = group.best.as_ref();
        let found = BestPointKeys::new(objective, best);
        let inference = group.conclusions.inference.as_ref();
        Self {
            name: group.name.clone(),
            status: group.status,
            reason: group.reason.clone(),
            cost: found.cost,
            cost_standard_error: found.cost_standard_error,
            parameters: found.parameters,
            dispersion: found.dispersion,
            velocity: best.into(),
            observables: best.map(|best| best.observables).unwrap_or_default(),
            data: Data::of_group(&group.data, best),
            failures: found.failures,
            sensitivities: inference.map(sensitivities),
            identified: inference.map(Identified::from),
            budget: inference.map(budget).unwrap_or_default(),
            pooled: BTreeMap::new(),
            errors: inference.map(errors).unwrap_or_default(),
            profiles: profiles(&group.conclusions),
            solutions: group.conclusions.solutions.as_ref().map(Solutions::from),
            posterior: group.conclusions.posterior.as_ref().map(PosteriorReport::from),
        }
    }

    /// Returns the text of an entry of `groups` by itself.
    pub fn to_json(&self) -> String {
        to_pretty_json(self)
    }

    /// Reads an entry of `groups` by itself.
    ///
    /// # Errors
    /// If the text is not JSON, or a key is absent or wrong.
    pub fn from_json(text: &str) -> Result<Self, ReadError> {
        parse(text)
    }

    /// Returns the best point, if one was feasible.
    pub fn best_point(&self) -> Option<Point> {
        self.parameters.point(self.dispersion)
    }
}

/// How the search was made, and what its best point is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SearchSettings {
    /// The search method.
    pub method: SearchMethod,
    /// Most evaluations from each start.
    pub max_evaluations: u64,
    /// Cost at which the search ended; null of a likelihood, which has none.
    pub cost_tolerance: Option<f64>,
    /// Size at which the search ended, as a fraction of the bounds.
    pub size_tolerance: f64,
    /// Edge of the first simplex, as a fraction of the bounds; only of `simplex`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial_step: Option<f64>,
    /// Number of searches of each set of data.
    pub starts: u64,
    /// Whether the derivatives of both moments were to be measured.
    pub sensitivities: bool,
    /// Values expected from prior knowledge; only with priors.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schemars(transform = keyed_by_parameter)]
    pub priors: BTreeMap<Parameter, Prior>,
    /// Part of the cost that the priors have added; only with priors.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "absent_or_nullable"
    )]
    pub penalty: Option<Option<f64>>,
    /// The choice that made this point the best one; null if no point was feasible.
    pub point: Option<PointMeaning>,
    /// Number of the first evaluation whose cost is no larger than sampling noise alone makes it.
    pub below_noise_from: Option<u64>,
}

impl From<&JobResult> for SearchSettings {
    fn from(result: &JobResult) -> Self {
        let (search, best) = (&result.search, result.best.as_ref());
        let by_moments = result.objective.is_of_moments();
        let priors = Parameter::ALL.into_iter().zip(search.priors);
        let priors: BTreeMap<_, _> =
            priors.filter_map(|(parameter, prior)| Some((parameter, prior?))).collect();
        let penalty = || best.and_then(|best| best.penalty).and_then(finite_or_null);
        let stepped = search.method == SearchMethod::Simplex;
        Self {
            method: search.method,
            max_evaluations: search.max_evaluations,
            cost_tolerance: by_moments.then_some(search.cost_tolerance),
            size_tolerance: search.size_tolerance,
            initial_step: stepped.then_some(search.initial_step),
            starts: search.starts,
            sensitivities: search.sensitivities,
            penalty: (!priors.is_empty()).then(penalty),
            priors,
            point: best.and_then(|best| best.meaning),
            below_noise_from: best.and_then(|best| best.below_noise_from),
        }
    }
}
