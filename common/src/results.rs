//! Output of a job: the result and the history of its evaluations.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::conclusions::Conclusions;
use crate::job::{Objective, Sampling, Search};
use crate::moments::{FormTests, KolmogorovTest, MomentIntervals, OrderTest, Outlier};
use crate::observables::ObservableValues;
use crate::outcome::{FailureCounts, Outcome};
use crate::parameters::{Parameter, Point};
use crate::posterior::PosteriorDraw;
use crate::sampling::NominalSampling;
use crate::settings::{Picking, SolverSettings};
use crate::version::Program;

pub use crate::moments::{
    ComparedMoments, Estimate, EstimatedError, Moments, ObservableEstimate, ObservableEstimates,
};

/// Final status of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The search met a tolerance, or the propagation is complete.
    Converged,
    /// The search has ended, and its best point misses the data by more than their noise.
    NotMatched,
    /// The search reached its maximum number of evaluations.
    MaxEvaluations,
    /// A user cancelled the job.
    Cancelled,
    /// The job has no reliable result.
    Failed,
}

impl Status {
    /// All statuses.
    pub const ALL: [Self; 5] =
        [Self::Converged, Self::NotMatched, Self::MaxEvaluations, Self::Cancelled, Self::Failed];

    /// Returns whether it is the ending of a search or propagation that was completed.
    pub fn is_complete(self) -> bool {
        matches!(self, Self::Converged | Self::NotMatched | Self::MaxEvaluations)
    }

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::NotMatched => "not_matched",
            Self::MaxEvaluations => "max_evaluations",
            Self::Cancelled => "cancelled",
            Self::Failed => "failed",
        }
    }
}

/// Kind of a job's failure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobFailure {
    /// No evaluated point is feasible: at each, too many realizations failed, or there is no cost.
    NoFeasiblePoint,
    /// Workers gave different answers for one realization, and no further worker was available to
    /// decide.
    IntegrityError,
    /// Workers were lost repeatedly over one realization.
    PoisonRealization,
    /// The store's data of the job differ from what was written.
    Store,
}

impl JobFailure {
    /// All kinds.
    pub const ALL: [Self; 4] =
        [Self::NoFeasiblePoint, Self::IntegrityError, Self::PoisonRealization, Self::Store];

    /// Returns the name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoFeasiblePoint => "no_feasible_point",
            Self::IntegrityError => "integrity_error",
            Self::PoisonRealization => "poison_realization",
            Self::Store => "store",
        }
    }

    /// Returns whether the machines that the job ran on caused the failure, so that running the job
    /// again may succeed.
    pub fn is_retryable(self) -> bool {
        match self {
            Self::NoFeasiblePoint => false,
            Self::IntegrityError | Self::PoisonRealization | Self::Store => true,
        }
    }
}

/// Purpose of an evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EvaluationRole {
    /// Number of its set of data, from 0.
    pub group: u32,
    /// Number of the start of its search, from 0; 0 is the job's own start.
    pub start: u32,
    /// The parameter in which it differs from the best point, to measure a derivative; `None` for
    /// other evaluations.
    pub varied: Option<Parameter>,
    /// Whether it measures what a quantity of the setup moves, by which the point is shifted.
    pub shifted: bool,
    /// Whether it serves the posterior.
    pub posterior: bool,
}

impl EvaluationRole {
    /// Returns whether it is an evaluation of the search itself.
    pub fn is_of_search(&self) -> bool {
        !self.is_beside_best() && !self.posterior
    }

    /// Returns whether it only measures what a change moves from the best point.
    pub fn is_beside_best(&self) -> bool {
        self.varied.is_some() || self.shifted
    }
}

/// One evaluation; those of the search are the rows of `history.csv`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evaluation {
    /// Number of the evaluation, from 0.
    pub number: u64,
    /// Its purpose.
    pub role: EvaluationRole,
    /// The evaluated point.
    pub point: Point,
    /// Moments over the successes, unless there are none. For an evaluation that measures a
    /// derivative, also `None` if other realizations failed than at the best point.
    pub moments: Option<Moments>,
    /// Means over the successes of the observables that were measured, where there are moments.
    pub observables: ObservableValues,
    /// Cost; infinite at an infeasible point; `None` for a propagation.
    pub cost: Option<f64>,
    /// Failed realizations by kind.
    pub failures: FailureCounts,
    /// Estimated errors of the successes, unless there are none, or the errors are unknown.
    pub estimated_error: Option<EstimatedError>,
}

impl Evaluation {
    /// Returns the moments that are compared with the data, where there are any.
    pub fn compared(&self) -> Option<ComparedMoments> {
        Some(ComparedMoments { velocities: self.moments?, observables: self.observables })
    }

    /// Whether it belongs to a search for this set of data.
    pub fn belongs_to(&self, set: usize) -> bool {
        self.role.group as usize == set
    }
}

/// Meaning of the best point of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum PointMeaning {
    /// The evaluated point with the lowest cost.
    #[serde(rename = "of the points evaluated, the one with the least cost")]
    LeastCost,
    /// One of the points that match the data: that at which the simplex ended.
    #[serde(rename = "of the points that match the data, the one where the simplex ended")]
    SimplexEnd,
    /// One of the points that match the data: that nearest to the start.
    #[serde(rename = "of the points that match the data, the one nearest to the start")]
    NearestToStart,
}

impl PointMeaning {
    /// All meanings.
    pub const ALL: [Self; 3] = [Self::LeastCost, Self::SimplexEnd, Self::NearestToStart];
}

/// Summary of the data of one search.
#[derive(Debug, Clone, PartialEq)]
pub struct DataSummary {
    /// Moments of the data.
    pub moments: Moments,
    /// The measured observables, with the error of each mean by their scatter.
    pub observables: ObservableEstimates,
    /// Number of velocities; `None` if only their moments are known.
    pub count: Option<u64>,
    /// Confidence intervals of the moments of their law; `None` if only the moments are known, or
    /// if the velocities give no interval.
    pub intervals: Option<MomentIntervals>,
    /// The velocities far from the others, in their order; at most
    /// [`crate::limits::OUTLIERS_LISTED_MAX`].
    pub outliers: Vec<Outlier>,
    /// Step to which the velocities are rounded, m/s; `None` if none is seen.
    pub rounding: Option<f64>,
    /// Test of whether the velocities are independent of their order; `None` if only the moments are known, and
    /// for few or sorted ones and those of named subjects.
    pub order: Option<OrderTest>,
    /// Number of all velocities far from the others.
    pub outlier_count: u64,
}

/// Ending of the search for one group.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupEnding {
    /// Final status.
    pub status: Status,
    /// Reason as a sentence, where the status needs one.
    pub reason: Option<String>,
    /// Number of its best evaluation, if a point was feasible.
    pub best: Option<u64>,
}

/// Result for one group of the data. A failed group has no feasible point.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupResult {
    /// Name of the group.
    pub name: String,
    /// Final status of its search.
    pub status: Status,
    /// Reason as a sentence, where the status needs one.
    pub reason: Option<String>,
    /// Its best feasible evaluation.
    pub best: Option<BestPoint>,
    /// Its data.
    pub data: DataSummary,
    /// Conclusions from its data.
    pub conclusions: Conclusions,
}

/// Result of a job. It contains no wall times, so that one job always gives the same bytes.
#[derive(Debug, Clone, PartialEq)]
pub struct JobResult {
    /// Final status.
    pub status: Status,
    /// Kind of the failure; `None` unless the status is failed.
    pub failure: Option<JobFailure>,
    /// Reason as a sentence, where the status needs one.
    pub reason: Option<String>,
    /// BLAKE3 digest of the evaluations of the path, 64 hexadecimal digits.
    pub digest: String,
    /// The best feasible evaluation (for a propagation: its only one), if any was complete; `None`
    /// if the data are groups.
    pub best: Option<BestPoint>,
    /// The data; `None` for a propagation, and if the data are groups.
    pub data: Option<DataSummary>,
    /// Conclusions from the data; empty for a propagation, and if the data are groups.
    pub conclusions: Conclusions,
    /// Result for each group of the data; empty if there are no groups.
    pub groups: Vec<GroupResult>,
    /// Whether the groups share a mean and a scatter.
    pub pooled: bool,
    /// The function that was minimised; unused by a propagation.
    pub objective: Objective,
    /// Settings of the search; unused by a propagation.
    pub search: Search,
    /// Number of points evaluated by the search, without those that measure derivatives.
    pub evaluations: u64,
    /// Realizations of each evaluation.
    pub realizations: u64,
    /// Seed of the germs.
    pub seed: u64,
    /// Method of drawing the germs.
    pub sampling: Sampling,
    /// Number of scrambles among which the realizations were divided.
    pub scrambles: u64,
    /// Whether the control variate was requested.
    pub control_variate: bool,
    /// The solver settings used.
    pub solver: SolverSettings,
    /// The exact method's sampling of the usual bone; `None` for other methods.
    pub nominal: Option<NominalSampling>,
    /// The criterion used.
    pub picking: Picking,
    /// The program that computed it.
    pub program: Program,
    /// Set if a host that computed a part of the result was banned after the job had ended.
    pub integrity: Option<Integrity>,
}

/// States that hosts which computed a part of a result were banned for wrong answers after the job had ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Integrity {
    /// Hosts that computed a part of the job, and were banned for wrong answers after it had ended.
    pub banned_hosts: Vec<String>,
    /// Digest of the result before the job was computed again without these hosts; `None` if it was not.
    pub earlier_digest: Option<String>,
}

impl Integrity {
    /// Returns whether the result was computed again without the banned hosts.
    pub fn is_rechecked(&self) -> bool {
        self.earlier_digest.is_some()
    }

    /// Returns whether the result with this digest differs from the one before; `None` if it was not computed
    /// again.
    pub fn has_changed(&self, digest: &str) -> Option<bool> {
        self.earlier_digest.as_ref().map(|earlier| earlier != digest)
    }

    /// Describes it in a sentence, given the digest of the result.
    pub fn statement(&self, digest: &str) -> String {
        let hosts = self.banned_hosts.join(", ");
        let (host, was) = match self.banned_hosts.len() {
            1 => ("host", "was"),
            _ => ("hosts", "were"),
        };
        match self.has_changed(digest) {
            None => format!(
                "{host} {hosts} computed a part of this result and {was} banned for wrong answers after it \
                 had ended: do not rely on it before `osteon job recheck` has computed it again"
            ),
            Some(false) => format!(
                "computed again without {host} {hosts}, which {was} banned for wrong answers: not a bit has \
                 changed"
            ),
            Some(true) => format!(
                "computed again without {host} {hosts}, which {was} banned for wrong answers: the result has \
                 changed, and what was fetched before was wrong"
            ),
        }
    }
}

/// The best point of a job, with its realizations.
#[derive(Debug, Clone, PartialEq)]
pub struct BestPoint {
    /// The evaluated point.
    pub point: Point,
    /// Meaning of the point; `None` for a propagation.
    pub meaning: Option<PointMeaning>,
    /// Its cost; `None` for a propagation.
    pub cost: Option<f64>,
    /// Standard error of a likelihood's cost; `None` for other costs.
    pub cost_error: Option<f64>,
    /// Contribution of the priors to the cost; `None` if there is no prior.
    pub penalty: Option<f64>,
    /// Number of the first evaluation whose cost was within the range that sampling noise alone
    /// causes; `None` if there was none, and for costs that do not depend on the moments alone.
    pub below_noise_from: Option<u64>,
    /// Its moments with standard errors, unless every realization failed.
    pub velocity: Option<Estimate>,
    /// The observables that were measured, with the error of each mean by sampling; `None` if every
    /// realization failed.
    pub observables: ObservableEstimates,
    /// Change of the moments if the failed realizations had the velocities expected from their
    /// tensors; `None` if that is unknown.
    pub failure_bias: Option<Moments>,
    /// Test of whether the measured velocities can come from the model's law; `None` if only
    /// moments were measured, and for a propagation.
    pub kolmogorov: Option<KolmogorovTest>,
    /// Tests of their form; `None` where `kolmogorov` is, and for few velocities.
    pub form: Option<FormTests>,
    /// Failed realizations by kind.
    pub failures: FailureCounts,
    /// Estimated errors of the successes, unless there are none, or the errors are unknown.
    pub estimated_error: Option<EstimatedError>,
    /// Outcomes in index order.
    pub outcomes: Vec<Outcome>,
}

/// The samples of one set of data, which are sent in blocks beside its result.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SetSamples {
    /// Outcomes at its best point; empty if there is none, and for groups whose outcomes together with those
    /// before exceed the number that one evaluation may have.
    pub outcomes: Vec<Outcome>,
    /// Draws from its posterior.
    pub draws: Vec<PosteriorDraw>,
}

impl SetSamples {
    /// Takes them from the result for a set of data.
    pub fn new(best: Option<BestPoint>, conclusions: Conclusions) -> Self {
        Self {
            outcomes: best.map(|best| best.outcomes).unwrap_or_default(),
            draws: conclusions.posterior.map(|posterior| posterior.draws).unwrap_or_default(),
        }
    }
}
