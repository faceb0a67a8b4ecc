//! Rules on the parameters of the setup.

use crate::accepted::written;
use crate::job::{JobSpecification, Range};
use crate::parameters::{AS_IN_SETUP, Parameter};
use crate::setup_quantity::SetupQuantity;
use crate::violations::{Violation, Violations};

use super::random_quantities::{SETUP_SECTIONS, random_quantities};
use super::range::range;
use super::setup::setup as check_setup;
use super::value::known_wrong;

/// Checks the parameters of the setup, which not every job searches. Both bounds of each must give a valid
/// setup, also with the quantities that are random. One is checked at a time, with the others at their
/// starts: a rule that two of them break only together is not found here.
pub(super) fn setup_parameters(specification: &JobSpecification, violations: &mut Violations) {
    for parameter in Parameter::OF_SETUP {
        let Some(quantity) = parameter.of_setup() else { continue };
        let path = format!("parameters.{}", parameter.name());
        match specification.range(parameter) {
            Range::Fixed(value) if value.to_bits() == AS_IN_SETUP.to_bits() => {}
            Range::Fixed(_) if known_wrong(&path, violations) => {}
            Range::Fixed(_) => violations.add(
                path,
                format!("is fixed; leave it out, and set {} instead", quantity.mean_key()),
            ),
            Range::Free { .. } if quantity.value_in(&specification.setup).is_none() => {
                let lacking = quantity.lacking(&specification.setup);
                violations.add(path, format!("is searched, and {} {lacking}", quantity.mean_key()));
            }
            searched @ Range::Free { lower, upper, .. } => {
                range(parameter, searched, violations);
                let wrong = |field: &str| violations.has_at_or_below(field);
                if !SETUP_SECTIONS.iter().any(|field| wrong(field)) && !wrong(&path) {
                    ends(quantity, [lower, upper], &path, specification, violations);
                }
            }
        }
    }
}

/// Checks the random quantities, whose means are those of the setup at the start of the search, or those
/// of the job's own setup if a parameter of the setup is refused.
pub(super) fn random_setup(specification: &JobSpecification, violations: &mut Violations) {
    let JobSpecification { setup, random, .. } = specification;
    let is_wrong = |parameter: Parameter| {
        violations.has_at_or_below(&format!("parameters.{}", parameter.name()))
    };
    let means = match Parameter::OF_SETUP.into_iter().any(is_wrong) {
        true => setup.clone(),
        false => specification.start().setup(setup),
    };
    random_quantities(random, &means, violations);
}

/// Records the first violation of the setup in which `quantity` is at one of its `bounds`.
fn ends(
    quantity: SetupQuantity,
    bounds: [f64; 2],
    path: &str,
    specification: &JobSpecification,
    violations: &mut Violations,
) {
    let setup = specification.start().setup(&specification.setup);
    let refused = |bound| {
        let at_bound = quantity.with(bound, setup.clone());
        let violation = Violations::first_of(|found| {
            check_setup(&at_bound, found);
            random_quantities(&specification.random, &at_bound, found);
        })?;
        Some((bound, violation))
    };
    if let Some((bound, Violation { field, message, .. })) = bounds.into_iter().find_map(refused) {
        let bound = written(bound);
        violations.add(
            format!("{path}.bounds"),
            format!("the bound {bound} is refused: {field}: {message}"),
        );
    }
}
