//! Rules on what is the same for all data and not known exactly.

use crate::accepted::written;
use crate::case::Setup;
use crate::job::{JobSpecification, Range};
use crate::parameters::Parameter;
use crate::random_quantities::RandomDistribution;
use crate::systematic::{Shift, Systematic, SystematicLaw, SystematicQuantity, Uncertain};
use crate::violations::{Violation, Violations};

use super::random_quantities::SETUP_SECTIONS;
use super::section::section;
use super::setup::setup as check_setup;
use super::value::known_wrong;

/// Checks the laws by themselves, and that each quantity is one of the setup, not searched, and valid one
/// standard deviation about its value.
pub(super) fn systematic(specification: &JobSpecification, violations: &mut Violations) {
    let (mut checked, mut default) = (specification.systematic, Systematic::default());
    section(Systematic::KEY.name, &mut checked, &mut default, violations);
    if checked.is_empty() || known_wrong(Systematic::KEY.name, violations) {
        return;
    }
    if specification.posterior.is_some() && !specification.observables().is_empty() {
        let message = "is not regarded by a posterior of more than velocities; leave out [posterior], or the \
                       other columns of [data]";
        return violations.add(Systematic::KEY.name, message);
    }
    if !specification.is_searched() {
        let message = "needs the best point of a search, and search.method is \"posterior\"; set it to \"newton\"";
        return violations.add(Systematic::KEY.name, message);
    }
    if !specification.search.sensitivities {
        let message =
            "needs the derivatives, and search.sensitivities is false; leave one of them out";
        return violations.add(Systematic::KEY.name, message);
    }
    if SETUP_SECTIONS.iter().any(|section| violations.has_at_or_below(section)) {
        return;
    }
    let setup = specification.start_of(0).setup(&specification.setup);
    for quantity in SystematicQuantity::ALL {
        let table = format!("{}.{}", Systematic::KEY.name, quantity.name());
        let is_given = checked.law(quantity).spread.is_some_and(|spread| spread > 0.0);
        if is_given && !known_wrong(&table, violations) && !violations.has_at_or_below(&table) {
            law(quantity, specification, &setup, &table, violations);
        }
    }
    for uncertain in specification.uncertain(&setup) {
        let table = format!("{}.{}", Systematic::KEY.name, uncertain.quantity.name());
        if !violations.has_at_or_below(&table) {
            shifts(&uncertain, specification, &setup, &table, violations);
        }
    }
}

fn law(
    quantity: SystematicQuantity,
    specification: &JobSpecification,
    setup: &Setup,
    table: &str,
    violations: &mut Violations,
) {
    let searched = Parameter::ALL.into_iter().find(|one| one.name() == quantity.name());
    if let Some(parameter) =
        searched.filter(|one| !matches!(specification.range(*one), Range::Fixed(_)))
    {
        let message = format!(
            "is uncertain, and parameters.{} is searched; leave one of them out",
            parameter.name()
        );
        return violations.add(table, message);
    }
    let key = quantity.key();
    let Some(value) = quantity.value_in(setup) else {
        let message = format!(
            "is about {key}, of which the job has no such value; give one, or leave it out"
        );
        return violations.add(table, message);
    };
    let SystematicLaw { distribution, center, .. } = specification.systematic.law(quantity);
    if let Some(center) = center.filter(|center| *center != value) {
        let (center, value) = (written(center), written(value));
        let message = format!("is {center}, and {key} is {value}; set both alike, or leave it out");
        violations.add(format!("{table}.center"), message);
    }
    if distribution == RandomDistribution::LogNormal && value <= 0.0 {
        let value = written(value);
        let message = format!(
            "is \"log_normal\", which requires a value above 0, and {key} is {value}: set it to \"normal\" or \
             \"uniform\""
        );
        violations.add(format!("{table}.distribution"), message);
    }
}

/// Checks that the job is valid one standard deviation about its value.
fn shifts(
    uncertain: &Uncertain,
    specification: &JobSpecification,
    setup: &Setup,
    table: &str,
    violations: &mut Violations,
) {
    let mut refused = uncertain.shifts().filter_map(|Shift { quantity, value }| {
        Violations::first_of(|found| check_setup(&quantity.with(value, setup.clone()), found))
    });
    if let Some(Violation { field, message, .. }) = refused.next() {
        let what = match specification.systematic.law(uncertain.quantity).spread {
            Some(spread) => format!("is {}; lower it", written(spread)),
            None => "is the usual one, which is too large here; set a lower one, or 0".to_owned(),
        };
        let message = format!(
            "{what}: values one standard deviation from the job's are refused: {field}: {message}"
        );
        violations.add(format!("{table}.spread"), message);
    }
}
