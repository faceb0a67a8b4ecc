//! What a method of search wants, and why it is over.

/// What a search wants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ask<'a> {
    /// What is at this point, coordinates in `[0, 1]`.
    At(&'a [f64]),
    /// Nothing more.
    Stopped(Stop),
}

/// Why a search is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The best cost is at most the tolerance.
    CostReached,
    /// The method has done all it can and finds nothing better; also: nothing is free.
    Settled,
    /// As many points were evaluated as allowed.
    EvaluationsUsedUp,
    /// Every restart found something better, and there were as many as allowed.
    RestartsUsedUp,
    /// No point from which to go on has a finite cost.
    Infeasible,
}
