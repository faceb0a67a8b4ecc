//! Rules on quantities of the setup that are known of each group of the data.

use crate::accepted::written;
use crate::case::Setup;
use crate::data::Group;
use crate::field_path::entry_path;
use crate::job::{JobSpecification, Range};
use crate::origin::Origin;
use crate::parameters::Parameter;
use crate::violations::{Violation, Violations};

use super::random_quantities::{SETUP_SECTIONS, random_quantities};
use super::setup::setup as check_setup;

/// Checks that every group has the same quantities, none of which is searched, and that their values
/// give valid setups, also with the quantities that are random.
pub(super) fn known_quantities(
    specification: &JobSpecification,
    origin: Option<&Origin>,
    violations: &mut Violations,
) {
    let Some(data) = &specification.data else { return };
    if violations.has_at_or_below("data")
        || data.groups().iter().all(|group| group.known.is_empty())
    {
        return;
    }
    let has = |parameter: Parameter| {
        parameter.of_setup().is_some_and(|one| one.value_in(&specification.setup).is_some())
    };
    for (set, group) in data.groups().iter().enumerate() {
        for parameter in Parameter::OF_SETUP {
            let field = field(parameter, group, origin);
            let known = group.known.get(parameter).is_some();
            if let Some(other) =
                data.groups().iter().find(|other| other.known.get(parameter).is_some())
                && !known
            {
                let message = format!(
                    "is missing, and known of the group {:?}; give it for every group, or for none",
                    other.name
                );
                violations.add(field, message);
            } else if known && matches!(specification.range(parameter), Range::Free { .. }) {
                let message = format!(
                    "is known of each group, and parameters.{} is searched; leave one of them out",
                    parameter.name()
                );
                return violations.add(field, message);
            } else if known && Parameter::OF_PORES.contains(&parameter) && !has(parameter) {
                let cure = match specification.setup.structure.is_layered() {
                    true => "leave it out, as each of bone.sublayers has a solid of its own",
                    false => "give one in `bone`",
                };
                let message = format!(
                    "is known of each group, and the job's bone has no such porosity; {cure}"
                );
                return violations.add(field, message);
            }
        }
        values(specification, (set, group), origin, violations);
    }
}

/// Checks that the values of a group give a valid setup.
fn values(
    specification: &JobSpecification,
    (set, group): (usize, &Group),
    origin: Option<&Origin>,
    violations: &mut Violations,
) {
    if SETUP_SECTIONS.iter().any(|section| violations.has_at_or_below(section))
        || violations.has_at_or_below("random")
    {
        return;
    }
    let speed = Parameter::CouplingSoundSpeed;
    if group.known.get(speed).is_some() && !specification.setup.layers.coupling.sublayers.is_empty()
    {
        let message =
            "is given, but each of layers.coupling.sublayers has its own; leave one of them out";
        return violations.add(field(speed, group, origin), message);
    }
    // Set directly and not through a `Point`, in which a known 0 would stand for the setup's value.
    let with = |setup: Setup, (parameter, value): (Parameter, f64)| {
        parameter.of_setup().map_or(setup.clone(), |quantity| quantity.with(value, setup))
    };
    let setup = group.known.given().fold(specification.start().setup(&specification.setup), with);
    let refused = Violations::first_of(|found| {
        check_setup(&setup, found);
        random_quantities(&specification.random, &setup, found);
    });
    let Some(Violation { field: refused, message, .. }) = refused else { return };
    let is_of = |(parameter, _): &(Parameter, f64)| {
        parameter.of_setup().is_some_and(|quantity| quantity.mean_key() == refused)
    };
    let known = group.known.given().find(is_of).or_else(|| group.known.given().next());
    let Some((parameter, value)) = known else { return };
    let line = origin.and_then(|origin| {
        let line = origin.line(set, 0)?;
        Some(format!("{}, line {line}: ", origin.path().display()))
    });
    let message = format!(
        "{}the value {} of the group {:?} is refused: {refused}: {message}",
        line.unwrap_or_default(),
        written(value),
        group.name
    );
    violations.add(field(parameter, group, origin), message);
}

/// Returns the field that gives a quantity of a group.
fn field(parameter: Parameter, group: &Group, origin: Option<&Origin>) -> String {
    let table = match origin {
        Some(_) => "data.known".to_owned(),
        None => entry_path("data.groups", &group.name),
    };
    entry_path(&table, parameter.name())
}
