//! The methods of search behind one face.

use osteon_common::job::{JobSpecification, Objective, Search, SearchMethod};
use osteon_common::results::Moments;

use crate::ask::Ask;
use crate::newton::{self, Newton};
use crate::search_box::SearchBox;
use crate::simplex::{self, Costs, Simplex};

/// Log likelihoods of all data together that differ by this are equal: a thousandth of what a standard
/// error of a parameter makes.
const EQUAL_LIKELIHOODS: f64 = 5e-4;

/// A method under way.
#[derive(Debug, Clone)]
pub(super) enum Method {
    Simplex(Simplex),
    Newton(Box<Newton>),
}

impl Method {
    /// The method that the specification names, at the start of the box, for a set of data that has
    /// these moments and, where they are known, these velocities.
    pub(super) fn new(
        specification: &JobSpecification,
        data: Moments,
        measured: Option<&[f64]>,
        space: SearchBox,
    ) -> Self {
        let search = specification.search;
        let Search { max_evaluations, cost_tolerance, size_tolerance, initial_step, .. } = search;
        match search.method {
            SearchMethod::Simplex => {
                let settings = simplex::Settings {
                    max_evaluations,
                    costs: costs(specification, measured),
                    size_tolerance,
                    initial_step,
                };
                Self::Simplex(Simplex::new(&space.start(), settings))
            }
            SearchMethod::Newton => {
                let settings = newton::Settings { max_evaluations, cost_tolerance, size_tolerance };
                Self::Newton(Box::new(Newton::new(space, data, settings)))
            }
        }
    }

    /// The next point, or why there is none.
    pub(super) fn ask(&self) -> Ask<'_> {
        match self {
            Self::Simplex(simplex) => simplex.ask(),
            Self::Newton(newton) => newton.ask(),
        }
    }

    /// Takes cost and moments of the point asked for.
    pub(super) fn tell(&mut self, cost: f64, moments: Option<Moments>) {
        match self {
            Self::Simplex(simplex) => simplex.tell(cost),
            Self::Newton(newton) => newton.tell(cost, moments),
        }
    }

    /// Points that may be asked for after the present one, at most `most`, the likeliest first.
    pub(super) fn likely(&self, most: usize) -> Vec<Vec<f64>> {
        match self {
            Self::Simplex(simplex) => simplex.likely(most),
            Self::Newton(newton) => newton.likely(most),
        }
    }

    /// The point asked for is inadmissible.
    pub(super) fn refuse(&mut self) {
        match self {
            Self::Simplex(simplex) => simplex.refuse(),
            Self::Newton(newton) => newton.refuse(),
        }
    }
}

/// How costs compare. A likelihood has no value that is low enough, and differences of its logarithm,
/// which is an average over the data, count by their number.
fn costs(specification: &JobSpecification, measured: Option<&[f64]>) -> Costs {
    match (specification.objective, measured) {
        (Objective::Likelihood, Some(measured)) => {
            Costs::Logarithms { equal: EQUAL_LIKELIHOODS / measured.len() as f64 }
        }
        _ => Costs::Squares { tolerance: specification.search.cost_tolerance },
    }
}
