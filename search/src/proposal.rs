//! The next point of a search method, or the reason why it stopped.

/// Answer of a search method when it is asked for its next point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Proposal<'a> {
    /// Evaluate this point; its coordinates are in `[0, 1]`.
    Evaluate(&'a [f64]),
    /// The search has ended.
    Stopped(StopReason),
}

/// Reason why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The best cost is at most the tolerance.
    CostReached,
    /// The method can do no more and finds nothing better. Also used when no parameter is free.
    Converged,
    /// The maximum number of evaluations was reached.
    EvaluationsUsedUp,
    /// Every restart found something better, and the maximum number of restarts was reached.
    RestartsUsedUp,
    /// No point from which the search could continue has a finite cost.
    Infeasible,
}
