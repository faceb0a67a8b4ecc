//! Rules on measured decays.

use crate::accepted::Interval;
use crate::data::{Data, VelocitySet};
use crate::field_path::{element_path, entry_path};
use crate::inference::{DECAY_PARTS_MIN, DecayWeights};
use crate::job::{JobKind, JobSpecification, Objective, SearchMethod};
use crate::limits::DATA_VELOCITIES_MAX;
use crate::origin::Origin;
use crate::statistics::measured_decay;
use crate::violations::Violations;

use super::value::known_wrong;

/// Accepted values of a measured decay.
pub const DECAY: Interval = Interval::from_to(-100.0, 100.0, "dB/cm");
/// Maximum number of decays that are refused individually.
const REFUSED_MAX: usize = 10;

/// Checks the decays of all sets, of which there have to be as many as velocities.
pub(super) fn all_decays(data: &Data, origin: Option<&Origin>, violations: &mut Violations) {
    let numbers = |set: VelocitySet<'_>| {
        let decays = set.decays.map_or(0, <[f64]>::len);
        (decays > 0).then(|| set.velocities.len() + decays + set.subjects.map_or(0, <[u32]>::len))
    };
    let all: usize = (0..data.sets()).filter_map(|set| data.set(set).and_then(numbers)).sum();
    if all > DATA_VELOCITIES_MAX && !violations.has_at_or_below("data") {
        let most = DATA_VELOCITIES_MAX;
        let what = "velocities, decays and subjects together";
        violations.add("data", format!("has {all} {what}; at most {most}"));
        return;
    }
    if data.is_grouped() && !has_all_or_none(data, violations) {
        return;
    }
    for number in 0..data.sets() {
        let Some(set) = data.set(number) else { return };
        let Some(decays) = set.decays else { continue };
        let field = field(data, origin, number);
        if known_wrong(&field, violations) {
            continue;
        }
        let (found, expected) = (decays.len(), set.velocities.len());
        if found != expected {
            let needed = format!("it must have one for each of {expected} velocities");
            violations.add(field, format!("has {found} decays; {needed}"));
            continue;
        }
        let refused = decays.iter().enumerate().filter(|&(_, &decay)| !DECAY.contains(decay));
        for (refusals, (index, &decay)) in refused.enumerate() {
            if refusals == REFUSED_MAX {
                violations.add_more(&field, "more decays out of range are not listed");
                return;
            }
            violations.add(element_path(&field, index), DECAY.refusal(decay));
        }
    }
}

/// Checks the requirements of decays on the rest of an identification.
pub(super) fn decays_of_job(
    specification: &JobSpecification,
    origin: Option<&Origin>,
    violations: &mut Violations,
) {
    if specification.kind != JobKind::Identification || !specification.has_decays() {
        return;
    }
    let refused = [
        (
            "objective.kind",
            specification.objective != Objective::ChiSquare,
            format!(
                "is {:?}; with decays in [data] it must be \"chi_square\", which weights the mean decay \
                 beside the moments of the velocities by the noise of the data",
                specification.objective.name()
            ),
        ),
        (
            "search.method",
            specification.search.method != SearchMethod::Simplex,
            format!(
                "is {:?}, which knows the moments of the velocities alone; with decays in [data] it must \
                 be \"simplex\"",
                specification.search.method.name()
            ),
        ),
        (
            "posterior",
            specification.posterior.is_some() && specification.is_searched(),
            "a posterior knows the moments of the velocities alone; leave out [posterior], or the decays \
             of [data]"
                .to_owned(),
        ),
    ];
    for (field, is_wrong, message) in refused {
        if is_wrong && !known_wrong(field, violations) {
            violations.add(field, message);
        }
    }
    let Some(data) = specification.data.as_ref().filter(|_| !violations.has_at_or_below("data"))
    else {
        return;
    };
    for number in data.searched_sets() {
        if let Some(refusal) = unusable(data, number) {
            let name = data.names().nth(number);
            let of = name.map_or_else(String::new, |name| format!("of the group {name:?}: "));
            let field = if origin.is_some() { "data.decay" } else { "data.decays" };
            violations.add(field, format!("{of}{refusal}"));
            return;
        }
    }
}

/// Returns the message that refuses the decays of a set that cannot be used in χ².
fn unusable(data: &Data, number: usize) -> Option<String> {
    let set = data.set(number)?;
    let parts = set.parts();
    if parts < DECAY_PARTS_MIN {
        let of = if set.subjects.is_some() { "subjects" } else { "velocities" };
        return Some(format!(
            "there are {parts} {of}; with decays at least {DECAY_PARTS_MIN} are needed, whose scatter \
             weights the three moments"
        ));
    }
    let mean = measured_decay(&set)?.mean;
    if mean <= 0.0 {
        return Some(format!(
            "their mean is {mean:?} dB/cm; it must be above 0: a decay is positive where the pressure \
             falls with the distance from the source"
        ));
    }
    DecayWeights::of_data(data, number).is_none().then(|| {
        "they, or the velocities, do not scatter by themselves, so that nothing tells their noise: all \
         are equal, or they follow from the velocities"
            .to_owned()
    })
}

/// Checks that either all groups have decays, or none has.
fn has_all_or_none(data: &Data, violations: &mut Violations) -> bool {
    let with = data.groups().iter().filter(|group| group.decays.is_some()).count();
    let without = data.groups().iter().find(|group| group.decays.is_none());
    match without {
        Some(group) if with > 0 => {
            violations.add(
                entry_path("data.groups", &group.name),
                "has no decays, and other groups have; give the decays of all groups, or of none",
            );
            false
        }
        _ => true,
    }
}

/// Returns the field that holds the decays of a set.
fn field(data: &Data, origin: Option<&Origin>, number: usize) -> String {
    match (origin, data.groups().get(number)) {
        (Some(_), _) => "data.decay".to_owned(),
        (None, Some(group)) => entry_path(&entry_path("data.groups", &group.name), "decays"),
        (None, None) => "data.decays".to_owned(),
    }
}
