//! What a job leaves: the result and the history of its evaluations.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::conclusions::Conclusions;
use crate::job::{Objective, Sampling, Search};
use crate::moments::{KolmogorovTest, MomentIntervals};
use crate::outcome::{FailureCounts, Outcome};
use crate::parameters::{Parameter, Point};
use crate::sampling::NominalSampling;
use crate::settings::{Picking, SolverSettings};
use crate::version::Program;

pub use crate::moments::{Estimate, EstimatedError, Moments};

/// How a job ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The search met a tolerance, or the propagation is complete.
    Converged,
    /// The search used up its evaluations.
    MaxEvaluations,
    /// A user cancelled the job.
    Cancelled,
    /// The job has no result to rely on.
    Failed,
}

impl Status {
    /// Every status.
    pub const ALL: [Self; 4] =
        [Self::Converged, Self::MaxEvaluations, Self::Cancelled, Self::Failed];

    /// Name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::MaxEvaluations => "max_evaluations",
            Self::Cancelled => "cancelled",
            Self::Failed => "failed",
        }
    }
}

/// The kind of a job's failure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobFailure {
    /// No point that was evaluated is feasible: too many realizations failed at each, or it has no
    /// cost.
    NoFeasiblePoint,
    /// Workers gave different answers for one realization, and none was left to decide.
    IntegrityError,
    /// Workers vanished over one realization, again and again.
    LostRealization,
    /// What the store holds of the job is not what was put there.
    Store,
}

impl JobFailure {
    /// Every kind.
    pub const ALL: [Self; 4] =
        [Self::NoFeasiblePoint, Self::IntegrityError, Self::LostRealization, Self::Store];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoFeasiblePoint => "no_feasible_point",
            Self::IntegrityError => "integrity_error",
            Self::LostRealization => "lost_realization",
            Self::Store => "store",
        }
    }

    /// Whether the machines that the job ran on caused the failure, so that running the job again may
    /// succeed.
    pub fn is_retryable(self) -> bool {
        match self {
            Self::NoFeasiblePoint => false,
            Self::IntegrityError | Self::LostRealization | Self::Store => true,
        }
    }
}

/// What an evaluation is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Role {
    /// Number of the set of data that it is for, from 0.
    pub group: u32,
    /// Number of the start of its search, from 0, the job's own.
    pub start: u32,
    /// The parameter in which it differs from the best point, to measure a derivative; `None` of a
    /// search.
    pub varied: Option<Parameter>,
}

/// One evaluation: of a search, a row of `history.csv`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evaluation {
    /// Number of the evaluation, from 0.
    pub number: u64,
    /// What it is for.
    pub role: Role,
    /// The point.
    pub point: Point,
    /// Moments over the successes, unless there are none; of one that measures a derivative, `None`
    /// too if other realizations failed than at the best point.
    pub moments: Option<Moments>,
    /// Cost; infinite at an infeasible point; `None` for a propagation.
    pub cost: Option<f64>,
    /// Failed realizations by kind.
    pub failures: FailureCounts,
    /// Estimated errors of the successes, unless there are none, or they are not known.
    pub estimated_error: Option<EstimatedError>,
}

impl Evaluation {
    /// Whether it belongs to a search for this set of data.
    pub fn is_for(&self, set: usize) -> bool {
        self.role.group as usize == set
    }
}

/// What the best point of a search is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum PointMeaning {
    /// Of the points that were evaluated, the one with the least cost.
    #[serde(rename = "of the points evaluated, the one with the least cost")]
    LeastCost,
    /// Of the points that match the data, the one where the simplex ended.
    #[serde(rename = "of the points that match the data, the one where the simplex ended")]
    SimplexEnd,
    /// Of the points that match the data, the one nearest to the start.
    #[serde(rename = "of the points that match the data, the one nearest to the start")]
    NearestToStart,
}

impl PointMeaning {
    /// Every meaning.
    pub const ALL: [Self; 3] = [Self::LeastCost, Self::SimplexEnd, Self::NearestToStart];
}

/// What is known of the data of one search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DataSummary {
    /// Their moments.
    pub moments: Moments,
    /// Number of the velocities; `None` where only their moments are known.
    pub count: Option<u64>,
    /// Confidence intervals of the moments of their law; `None` where only the moments are known, and
    /// where the velocities give no interval.
    pub intervals: Option<MomentIntervals>,
}

/// How the search for one group ended.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupEnding {
    /// How.
    pub status: Status,
    /// Why, in a sentence, where the status needs one.
    pub reason: Option<String>,
    /// Number of its best evaluation, if a point was feasible.
    pub best: Option<u64>,
}

/// What was found for one group of the data. One that failed has no feasible point.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupResult {
    /// Its name.
    pub name: String,
    /// How its search ended.
    pub status: Status,
    /// Why, in a sentence, where the status needs one.
    pub reason: Option<String>,
    /// Its best feasible evaluation.
    pub best: Option<BestPoint>,
    /// Its data.
    pub data: DataSummary,
    /// What its data say.
    pub conclusions: Conclusions,
}

/// The result of a job. No wall times in it: one job, the same bytes.
#[derive(Debug, Clone, PartialEq)]
pub struct JobResult {
    /// How it ended.
    pub status: Status,
    /// Of which kind the failure is; `None` with any other status than failed.
    pub failure: Option<JobFailure>,
    /// Why, in a sentence, where the status needs one (failed).
    pub reason: Option<String>,
    /// BLAKE3 digest of the evaluations of the path, 64 hexadecimal digits.
    pub digest: String,
    /// The best feasible evaluation (of a propagation: the only one), if any was complete; `None`
    /// where the data are groups.
    pub best: Option<BestPoint>,
    /// The data; `None` for a propagation, and where the data are groups.
    pub data: Option<DataSummary>,
    /// What the data say; nothing for a propagation, and where the data are groups.
    pub conclusions: Conclusions,
    /// What was found for each group of the data; empty where there are none.
    pub groups: Vec<GroupResult>,
    /// What was minimised; of no use to a propagation.
    pub objective: Objective,
    /// How it was searched; of no use to a propagation.
    pub search: Search,
    /// Points that the search went to, and whose realizations were run.
    pub evaluations: u64,
    /// Realizations of each evaluation.
    pub realizations: u64,
    /// Seed of the germs.
    pub seed: u64,
    /// How germs were drawn.
    pub sampling: Sampling,
    /// Scrambles among which the realizations were divided.
    pub scrambles: u64,
    /// Whether the control variate was asked for.
    pub control_variate: bool,
    /// Solver settings that were used.
    pub solver: SolverSettings,
    /// The exact method's sampling of the usual bone; `None` of other methods.
    pub nominal: Option<NominalSampling>,
    /// Criterion that was used.
    pub picking: Picking,
    /// The program that computed it.
    pub program: Program,
}

/// The best point of a job, with its realizations.
#[derive(Debug, Clone, PartialEq)]
pub struct BestPoint {
    /// The point.
    pub point: Point,
    /// What it is among the points that the search knows; `None` for a propagation.
    pub meaning: Option<PointMeaning>,
    /// Its cost; `None` for a propagation.
    pub cost: Option<f64>,
    /// Standard error of a likelihood's cost; `None` of other costs.
    pub cost_error: Option<f64>,
    /// What priors have added to the cost; `None` where there is no prior.
    pub penalty: Option<f64>,
    /// Number of the first evaluation whose cost was no larger than what sampling noise alone makes of
    /// it; `None` if there was none, and of costs that are no moments' alone.
    pub below_noise_from: Option<u64>,
    /// Its moments with standard errors, unless every realization failed.
    pub velocity: Option<Estimate>,
    /// What the failed realizations would change the moments by, had they the velocities that are
    /// expected of their tensors; `None` where that cannot be known.
    pub failure_bias: Option<Moments>,
    /// Whether the measured velocities can be of the model's law; `None` where only moments were measured,
    /// and for a propagation.
    pub kolmogorov: Option<KolmogorovTest>,
    /// Failed realizations by kind.
    pub failures: FailureCounts,
    /// Estimated errors of the successes, unless there are none, or they are not known.
    pub estimated_error: Option<EstimatedError>,
    /// Outcomes in index order.
    pub outcomes: Vec<Outcome>,
}
