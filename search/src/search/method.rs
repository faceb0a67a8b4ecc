//! The search methods behind a common interface.

use osteon_common::inference::MomentWeights;
use osteon_common::job::{JobSpecification, Objective, Search, SearchMethod};
use osteon_common::results::ComparedMoments;

use crate::newton::{self, Newton};
use crate::proposal::{Proposal, StopReason};
use crate::search_box::SearchBox;
use crate::simplex::{self, Costs, Simplex};

/// Log likelihoods of all data together that differ by at most this count as equal. It is a
/// thousandth of the difference caused by one standard error of a parameter.
const EQUAL_LIKELIHOODS: f64 = 5e-4;

/// State of a search method.
#[derive(Debug, Clone)]
pub(super) enum MethodState {
    Simplex(Simplex),
    Newton(Box<Newton>),
    /// No search is made.
    Posterior,
}

impl MethodState {
    /// Creates the method that the specification names, starting at the start of the box, for a set
    /// of data with these moments and, where they are known, these velocities; the weights are those
    /// of χ², if that is the cost. It ends at a cost of at most `cost_tolerance`.
    pub(super) fn new(
        specification: &JobSpecification,
        data: ComparedMoments,
        measured: Option<&[f64]>,
        weights: Option<MomentWeights>,
        space: SearchBox,
        cost_tolerance: f64,
    ) -> Self {
        let search = specification.search;
        let Search { max_evaluations, size_tolerance, initial_step, .. } = search;
        match search.method {
            SearchMethod::Simplex => {
                let settings = simplex::Settings {
                    max_evaluations,
                    costs: costs(specification, measured, cost_tolerance),
                    size_tolerance,
                    initial_step,
                };
                Self::Simplex(Simplex::new(&space.start(), settings))
            }
            SearchMethod::Newton => {
                let settings = newton::Settings { max_evaluations, cost_tolerance, size_tolerance };
                let newton = Newton::new(space, data, settings);
                let weights = weights.filter(|_| specification.objective == Objective::ChiSquare);
                Self::Newton(Box::new(match weights {
                    Some(weights) => newton.weighted_by(weights),
                    None => newton,
                }))
            }
            SearchMethod::Posterior => Self::Posterior,
        }
    }

    /// Begins near what matches the data, if the method can tell where that is, instead of at the
    /// start.
    pub(super) fn near_the_data(self) -> Self {
        match self {
            Self::Newton(newton) => Self::Newton(Box::new(newton.from_solution())),
            method => method,
        }
    }

    /// Returns the next point, or the reason why there is none.
    pub(super) fn ask(&self) -> Proposal<'_> {
        match self {
            Self::Simplex(simplex) => simplex.ask(),
            Self::Newton(newton) => newton.ask(),
            Self::Posterior => Proposal::Stopped(StopReason::Converged),
        }
    }

    /// Takes the cost and the moments of the pending point.
    pub(super) fn tell(&mut self, cost: f64, moments: Option<ComparedMoments>) {
        match self {
            Self::Simplex(simplex) => simplex.tell(cost),
            Self::Newton(newton) => newton.tell(cost, moments),
            Self::Posterior => {}
        }
    }

    /// Returns at most `most` points that the method may ask for after the pending one, the most
    /// probable first.
    pub(super) fn candidates(&self, most: usize) -> Vec<Vec<f64>> {
        match self {
            Self::Simplex(simplex) => simplex.candidates(most),
            Self::Newton(newton) => newton.candidates(most),
            Self::Posterior => Vec::new(),
        }
    }

    /// Reports that the pending point is inadmissible.
    pub(super) fn refuse(&mut self) {
        match self {
            Self::Simplex(simplex) => simplex.refuse(),
            Self::Newton(newton) => newton.refuse(),
            Self::Posterior => {}
        }
    }
}

/// Returns how costs compare. A likelihood has no target value. Its logarithm is an average over
/// the data, so the difference that counts as equal is divided by their number.
fn costs(specification: &JobSpecification, measured: Option<&[f64]>, tolerance: f64) -> Costs {
    match (specification.objective, measured) {
        (Objective::Likelihood, Some(measured)) => {
            Costs::Logarithms { equal: EQUAL_LIKELIHOODS / measured.len() as f64 }
        }
        _ => Costs::Squares { tolerance },
    }
}
