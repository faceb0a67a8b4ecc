//! The request for a design, and its result.

use osteon_common::job::JobSpecification;
use osteon_common::parameters::{Parameter, Point};
use osteon_solver::Isa;

use super::measurement::MeasurementPlan;

/// The job, the point and the plans of a design.
#[derive(Debug)]
pub struct DesignRequest<'a> {
    /// The job.
    pub specification: &'a JobSpecification,
    /// Number of the set of its data.
    pub set: usize,
    /// The point about which its bones are.
    pub point: Point,
    /// Number of velocities; `None`: that of the data.
    pub velocities: Option<u64>,
    /// Plans to compare; `None`: the usual measurements, each by itself, as far as they fit the job.
    pub plans: Option<Vec<MeasurementPlan>>,
    /// Instruction set, which affects only the time.
    pub isa: Isa,
    /// Number of threads; they do not change the result.
    pub threads: usize,
}

/// For each quantity, the standard deviation that each plan would leave.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// Number of velocities of the job.
    pub velocities: u64,
    /// Each quantity that may be narrowed.
    pub quantities: Vec<DesignedQuantity>,
}

/// A quantity of which a design tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DesignTarget {
    /// √(c1111/ρ) of the mean solid, m/s.
    BulkVelocity,
    /// A parameter that the job searches.
    Parameter(Parameter),
}

/// How well a quantity is known, and would be.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignedQuantity {
    /// The quantity.
    pub target: DesignTarget,
    /// Its value at the point.
    pub value: f64,
    /// Its standard deviation before any measurement.
    pub prior: f64,
    /// Its standard deviation by what the job has.
    pub deviation: f64,
    /// What it would be with each plan, the best first.
    pub ranking: Vec<PredictedDeviation>,
}

/// The standard deviation that a plan would leave.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictedDeviation {
    /// What is measured, together with what the job has.
    pub plan: MeasurementPlan,
    /// The standard deviation that would be left.
    pub deviation: f64,
    /// Number of velocities, in all, that would tell as much by themselves; `None` if no number would.
    pub worth: Option<u64>,
}

impl DesignTarget {
    /// Returns the name in results and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::BulkVelocity => "bulk_velocity",
            Self::Parameter(parameter) => parameter.name(),
        }
    }
}
