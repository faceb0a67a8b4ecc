//! Rules on measured observables besides the velocity.

use crate::data::{Data, Group, VelocitySet};
use crate::field_path::entry_path;
use crate::inference::{MomentWeights, OBSERVED_PARTS_MIN};
use crate::job::{JobKind, JobSpecification};
use crate::limits::DATA_VELOCITIES_MAX;
use crate::observables::{Observable, ObservableRow};
use crate::origin::Origin;
use crate::statistics::measured_observables;
use crate::violations::Violations;

use super::value::{elements, known_wrong};

/// Checks the observables of all sets, of each of which there have to be as many as velocities.
pub(super) fn observables(data: &Data, origin: Option<&Origin>, violations: &mut Violations) {
    let numbers = |set: VelocitySet<'_>| {
        let values: usize = set.observables.present().map(|(_, values)| values.len()).sum();
        (values > 0).then(|| set.velocities.len() + values + set.subjects.map_or(0, <[u32]>::len))
    };
    let all: usize = (0..data.sets()).filter_map(|set| data.set(set).and_then(numbers)).sum();
    if all > DATA_VELOCITIES_MAX && !violations.has_at_or_below("data") {
        let most = DATA_VELOCITIES_MAX;
        let what = "velocities, other observables and subjects together";
        violations.add("data", format!("has {all} {what}; at most {most}"));
        return;
    }
    for observable in Observable::ALL {
        if has_all_or_none(data, observable, violations) {
            (0..data.sets())
                .for_each(|set| values_of_set(data, origin, (set, observable), violations));
        }
    }
}

/// Checks the values of an observable of one set, if it has some.
fn values_of_set(
    data: &Data,
    origin: Option<&Origin>,
    (number, observable): (usize, Observable),
    violations: &mut Violations,
) {
    let Some(set) = data.set(number) else { return };
    let Some(values) = set.observables[observable] else { return };
    let field = field(data, origin, (number, observable));
    if known_wrong(&field, violations) {
        return;
    }
    let ObservableRow { accepted, plural, .. } = observable.row();
    let (found, expected) = (values.len(), set.velocities.len());
    if found != expected {
        let needed = format!("it must have one for each of {expected} velocities");
        violations.add(field, format!("has {found} {plural}; {needed}"));
        return;
    }
    elements(&field, values, (*accepted, plural), violations);
}

/// Checks that the observables of an identification tell their noise.
pub(super) fn observables_of_job(
    specification: &JobSpecification,
    origin: Option<&Origin>,
    violations: &mut Violations,
) {
    let measured = specification.observables();
    let Some(data) = specification.data.as_ref().filter(|_| !violations.has_at_or_below("data"))
    else {
        return;
    };
    if specification.kind != JobKind::Identification || measured.is_empty() {
        return;
    }
    for number in data.searchable_sets() {
        let of_one = measured.members().find_map(|one| Some((one, unusable(data, number, one)?)));
        let of_all = || Some((measured.members().last()?, noiseless(data, number)?));
        let Some((observable, refusal)) = of_one.or_else(of_all) else { continue };
        let name = data.names().nth(number);
        let of = name.map_or_else(String::new, |name| format!("of the group {name:?}: "));
        let field = match origin {
            Some(_) => format!("data.{}", observable.name()),
            None => format!("data.{}", observable.row().plural),
        };
        violations.add(field, format!("{of}{refusal}"));
        return;
    }
}

/// Returns the message that refuses an observable of a set that cannot be compared with a model.
fn unusable(data: &Data, number: usize, observable: Observable) -> Option<String> {
    let set = data.set(number)?;
    let ObservableRow { plural, unit, above_zero, .. } = observable.row();
    let parts = set.independent_count();
    if parts < OBSERVED_PARTS_MIN {
        let of = if set.subjects.is_some() { "subjects" } else { "velocities" };
        return Some(format!(
            "there are {parts} {of}; with {plural} at least {OBSERVED_PARTS_MIN} are needed, whose scatter \
             weights all moments"
        ));
    }
    let mean = measured_observables(&set)[observable]?.mean;
    (mean <= 0.0)
        .then(|| format!("their mean is {mean:?} {unit}; it must be above 0: {above_zero}"))
}

/// Returns the message that refuses observables whose noise nothing tells.
fn noiseless(data: &Data, number: usize) -> Option<String> {
    MomentWeights::of_data(data, number).is_none().then(|| {
        "they, or the velocities, do not scatter by themselves, so that nothing tells their noise: all \
         are equal, or they follow from the velocities"
            .to_owned()
    })
}

/// Checks that either all groups have an observable, or none has.
fn has_all_or_none(data: &Data, observable: Observable, violations: &mut Violations) -> bool {
    let has = |group: &Group| group.observables[observable].is_some();
    let without = data.groups().iter().find(|group| !has(group));
    match without {
        Some(group) if data.groups().iter().any(has) => {
            let plural = observable.row().plural;
            violations.add(
                entry_path("data.groups", &group.name),
                format!(
                    "has no {plural}, and other groups have; give the {plural} of all groups, or of none"
                ),
            );
            false
        }
        _ => true,
    }
}

/// Returns the field that holds the values of an observable of a set.
fn field(data: &Data, origin: Option<&Origin>, (number, one): (usize, Observable)) -> String {
    let ObservableRow { name, plural, .. } = one.row();
    match (origin, data.groups().get(number)) {
        (Some(_), _) => format!("data.{name}"),
        (None, Some(group)) => entry_path(&entry_path("data.groups", &group.name), plural),
        (None, None) => format!("data.{plural}"),
    }
}
