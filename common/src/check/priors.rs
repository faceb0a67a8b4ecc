//! Rules on the priors of a search.

use crate::accepted::Interval;
use crate::job::{JobSpecification, Prior, Range, SearchMethod};
use crate::parameters::Parameter;
use crate::violations::Violations;

use super::value::{known_wrong, number};

/// Checks the priors that weigh the cost of a search.
pub(super) fn priors(specification: &JobSpecification, violations: &mut Violations) {
    for parameter in Parameter::ALL {
        let Some(Prior { value, weight }) = specification.search.priors[parameter as usize] else {
            continue;
        };
        let path = format!("search.priors.{}", parameter.name());
        number(&format!("{path}.weight"), weight, Interval::above(0.0, ""), violations);
        match specification.range(parameter) {
            Range::Free { lower, upper, .. } => {
                let within = Interval::from_to(lower, upper, "the bounds");
                if !known_wrong(&format!("parameters.{}", parameter.name()), violations) {
                    number(&format!("{path}.value"), value, within, violations);
                }
            }
            Range::Fixed(_) if !violations.has_at_or_below(&path) => {
                violations
                    .add(path, "is for a parameter that is fixed; only free ones have priors");
            }
            Range::Fixed(_) => {}
        }
    }
    let message = match specification.search.method {
        SearchMethod::Simplex => return,
        SearchMethod::Newton => {
            "cannot be had with the method \"newton\", whose answer is nearest to the starts of \
             the parameters: make the prior values the starts, or use \"simplex\""
        }
        SearchMethod::Posterior => {
            "weigh the cost of a search, and the method \"posterior\" makes none: give \
             [posterior.priors], or use \"simplex\""
        }
    };
    if specification.has_priors() && !known_wrong("search.priors", violations) {
        violations.add("search.priors", message);
    }
}
