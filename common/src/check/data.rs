//! Rules on measured data.

use std::collections::BTreeSet;

use crate::accepted::{Interval, WholeRange};
use crate::data::{Data, Group, Measurements, VelocitySet, numbered};
use crate::field_path::{element_path, entry_path};
use crate::limits;
use crate::observables::Observable;
use crate::origin::Origin;
use crate::plausible::{self, short};
use crate::quantile::quantile;
use crate::statistics;
use crate::violations::Violations;
use crate::visible;

use super::observables::observables;
use super::value::{REFUSED_MAX, elements, known_wrong, number, quantity, whole};

/// Accepted values of a measured velocity.
pub const VELOCITY: Interval = Interval::above(0.0, "m/s");
/// Accepted values of the data's coefficient of variation.
const VARIATION: Interval = Interval::above(0.0, "");
const MOMENTS_NEED: &str = "a coefficient of variation above 0 needs";
/// Minimum number of velocities that have a coefficient of variation.
pub const VELOCITIES_MIN: usize = 2;
/// Minimum number of subjects that differ.
const SUBJECTS_MIN: usize = 2;
/// Accepted values of the instrument's own standard deviation.
pub const REPEATABILITY: Interval = Interval::from(0.0, "m/s");
/// Accepted values of the error that all decays have in common.
pub const DECAY_ERROR: Interval = Interval::from_to(0.0, 100.0, "dB/cm");
/// Accepted numbers of velocities behind given moments.
pub const COUNT: WholeRange = WholeRange::new(VELOCITIES_MIN as u64, limits::DATA_COUNT_MAX);
/// The forms in which `[data]` may be given.
pub const DATA_FORMS: &str =
    "give either velocities, or groups, or mean and coefficient_of_variation";

/// Returns the message for an identification without data.
pub fn no_data() -> String {
    format!("is missing; an identification needs it: {DATA_FORMS}")
}

/// Records all violations of measured `data`.
pub fn data(data: &Data, violations: &mut Violations) {
    data_from(data, None, violations);
}

/// Same as [`data`], for velocities in the file `origin`.
pub(super) fn data_from(data: &Data, origin: Option<&Origin>, violations: &mut Violations) {
    match &data.measurements {
        Measurements::Velocities { velocities: measured, .. } => {
            velocities("data.velocities", measured, (origin, 0), violations);
        }
        Measurements::Groups(measured) => groups(measured, origin, violations),
        Measurements::Moments { mean, coefficient_of_variation, count } => {
            moments(*mean, *coefficient_of_variation, violations);
            if let Some(count) = *count {
                whole("data.count", count, COUNT, violations);
            }
        }
    }
    all_subjects(data, origin, violations);
    observables(data, origin, violations);
    repeatability(data, origin, violations);
    decay_error(data, violations);
}

fn moments(mean: f64, coefficient_of_variation: f64, violations: &mut Violations) {
    quantity("data.mean", mean, VELOCITY, &plausible::VELOCITY, violations);
    if !violations.has_at_or_below("data.mean")
        && let Some(refusal) = no_velocity(mean)
    {
        violations.add("data.mean", refusal);
    }
    let field = "data.coefficient_of_variation";
    quantity(field, coefficient_of_variation, VARIATION, &plausible::VARIATION, violations);
}

/// Checks the subjects of all sets, which have to be as many as there are velocities.
fn all_subjects(data: &Data, origin: Option<&Origin>, violations: &mut Violations) {
    let mut named = 0;
    for number in 0..data.sets() {
        let Some(set) = data.set(number) else { return };
        let Some(subjects) = set.subjects else { continue };
        named += subjects.len();
        let group = data.groups().get(number);
        let field = match (origin, group) {
            (Some(_), _) => "data.subject".to_owned(),
            (None, Some(group)) => entry_path(&entry_path("data.groups", &group.name), "subjects"),
            (None, None) => "data.subjects".to_owned(),
        };
        if known_wrong(&field, violations) {
            continue;
        }
        let is_searched = group.is_none_or(|group| group.no_variation().is_none());
        if let Some(refusal) = no_subjects(&set, subjects, is_searched) {
            let of = group.filter(|_| origin.is_some());
            let of = of.map(|group| format!("in the group {:?}: ", group.name)).unwrap_or_default();
            violations.add(field, format!("{of}{refusal}"));
        }
    }
    if named > limits::DATA_SUBJECTS_MAX && !violations.has_at_or_below("data") {
        let most = limits::DATA_SUBJECTS_MAX;
        violations.add("data", format!("has {named} velocities with subjects; at most {most}"));
    }
}

/// Returns the message that refuses the subjects of a set.
fn no_subjects(set: &VelocitySet<'_>, subjects: &[u32], is_searched: bool) -> Option<String> {
    let (found, expected) = (subjects.len(), set.velocities.len());
    if found != expected {
        return Some(format!(
            "has {found} subjects; it must have one for each of {expected} velocities"
        ));
    }
    if numbered(subjects) != subjects {
        return Some("is not numbered from 0 in the order of first appearance".to_owned());
    }
    (is_searched && set.independent_count() < SUBJECTS_MIN).then(|| {
        format!(
            "all {expected} velocities are of one subject; at least two subjects are needed to see by \
             how much they differ"
        )
    })
}

/// Refuses an error of decays that there are not.
fn decay_error(data: &Data, violations: &mut Violations) {
    number("data.decay_error", data.decay_error, DECAY_ERROR, violations);
    if data.decay_error != 0.0 && !data.observables()[Observable::Decay] {
        violations.add("data.decay_error", "is an error of measured decays, and there are none");
    }
}

/// Refuses a repeatability as large as the scatter of the data, of which it is a part.
fn repeatability(data: &Data, origin: Option<&Origin>, violations: &mut Violations) {
    let is_of_column = origin.is_some_and(|origin| origin.error_column.is_some());
    let (field, subject) = match is_of_column {
        true => ("data.error_column", "has errors whose root mean square is"),
        false => ("data.repeatability", "is"),
    };
    let repeatability = data.repeatability;
    number(field, repeatability, REPEATABILITY, violations);
    if repeatability == 0.0 || violations.has_at_or_below("data") {
        return;
    }
    for number in 0..data.sets() {
        let group = data.groups().get(number);
        if group.is_some_and(|group| group.no_variation().is_some()) {
            continue;
        }
        let deviation = standard_deviation(data, number);
        if repeatability < deviation {
            continue;
        }
        let of = group.map(|group| format!(" of the group {:?}", group.name)).unwrap_or_default();
        violations.add(
            field,
            format!(
                "{subject} {repeatability:?}; it must be below the standard deviation of the velocities{of}, \
                 {} m/s, of which it is a part",
                short(deviation)
            ),
        );
        return;
    }
}

/// Returns the standard deviation of a set's velocities, m/s, with the instrument's own scatter.
fn standard_deviation(data: &Data, set: usize) -> f64 {
    let measured = match data.measurements {
        Measurements::Moments { mean, coefficient_of_variation, .. } => {
            Some((mean, coefficient_of_variation))
        }
        _ => data
            .velocities(set)
            .and_then(statistics::moments)
            .map(|moments| (moments.mean, moments.coefficient_of_variation)),
    };
    measured.map_or(f64::NAN, |(mean, variation)| mean * variation)
}

/// Returns the message that refuses a number which cannot be a velocity of sound in bone.
fn no_velocity(value: f64) -> Option<String> {
    let (from, to) = plausible::VELOCITY.possible();
    plausible::VELOCITY.is_impossible(value).then(|| {
        let (from, to) = (short(from), short(to));
        format!("is {value:?}; no velocity of sound in bone is outside {from} to {to} (m/s)")
    })
}

fn groups(groups: &[Group], origin: Option<&Origin>, violations: &mut Violations) {
    const FIELD: &str = "data.groups";
    let count = groups.len();
    if count == 0 || count > limits::GROUPS_MAX {
        let most = limits::GROUPS_MAX;
        violations.add(FIELD, format!("has {count} groups; 1 to {most} are allowed"));
        return;
    }
    let all: usize = groups.iter().map(|group| group.velocities.len()).sum();
    if all > limits::DATA_VELOCITIES_MAX {
        let most = limits::DATA_VELOCITIES_MAX;
        violations.add(FIELD, format!("has {all} velocities in all groups; at most {most}"));
        return;
    }
    let mut names = BTreeSet::new();
    for (set, group) in groups.iter().enumerate() {
        let Group { name, velocities: measured, .. } = group;
        let field = entry_path(FIELD, name);
        if name.is_empty() || name.len() > limits::NAME_BYTES_MAX {
            let most = limits::NAME_BYTES_MAX;
            violations
                .add(&field, format!("is not a valid group name: it must have 1 to {most} bytes"));
        } else if let Some(c) = name.chars().find(|&c| visible::is_hidden(c)) {
            let code = u32::from(c);
            violations.add(
                &field,
                format!(
                    "has the character U+{code:04X}, which is not seen or changes how others are: two \
                     names could look the same; leave it out"
                ),
            );
        } else if !names.insert(name) {
            violations.add(&field, "is the name of two groups");
        }
        match group.no_variation() {
            // A group that cannot be searched is accepted: the job is run for the others.
            Some(_) if !each_velocity(&field, measured, violations) => {}
            Some(_) => impossible(&field, measured, (origin, set), violations),
            None => velocities(&field, measured, (origin, set), violations),
        }
    }
    if !violations.has_at_or_below("data")
        && groups.iter().all(|group| group.no_variation().is_some())
    {
        violations.add(
            FIELD,
            format!("none of the {count} has two velocities that differ, which {MOMENTS_NEED}"),
        );
    }
}

/// Checks velocities individually, and their number. Returns whether all are valid.
fn each_velocity(field: &str, measured: &[f64], violations: &mut Violations) -> bool {
    if known_wrong(field, violations) {
        return false;
    }
    let count = measured.len();
    if count > limits::DATA_VELOCITIES_MAX {
        let max = limits::DATA_VELOCITIES_MAX;
        violations.add(field, format!("has {count} velocities; at most {max}"));
        return false;
    }
    elements(field, measured, (VELOCITY, "velocities"), violations);
    !violations.has_at_or_below(field)
}

/// Checks the velocities of one set, given its number in the file that they come from.
fn velocities(
    field: &str,
    measured: &[f64],
    (origin, set): (Option<&Origin>, usize),
    violations: &mut Violations,
) {
    if !each_velocity(field, measured, violations) {
        return;
    }
    let count = measured.len();
    if count < VELOCITIES_MIN {
        let contains = if count == 0 { "no velocity" } else { "only one velocity" };
        violations
            .add(field, format!("contains {contains}; {MOMENTS_NEED} at least two velocities"));
    } else if measured.iter().all(|velocity| velocity == &measured[0]) {
        let velocity = measured[0];
        violations.add(
            field,
            format!("all {count} are {velocity:?} m/s; {MOMENTS_NEED} different velocities"),
        );
    } else {
        impossible(field, measured, (origin, set), violations);
    }
    if violations.has_at_or_below(field) {
        return;
    }
    if let Some(moments) = statistics::moments(measured) {
        // Extreme numbers overflow or underflow when they are squared.
        let variation = moments.coefficient_of_variation;
        if !VARIATION.contains(variation) {
            let message =
                format!("their coefficient of variation {}", VARIATION.refusal(variation));
            violations.add(field, message);
        }
    }
}

/// Refuses velocities that no bone has: all of them if their median is impossible, with the unit that would
/// explain it if there is one, or else each.
fn impossible(
    field: &str,
    measured: &[f64],
    (origin, set): (Option<&Origin>, usize),
    violations: &mut Violations,
) {
    let mut ascending = measured.to_vec();
    ascending.sort_unstable_by(f64::total_cmp);
    let median = quantile(&ascending, 0.5).unwrap_or(f64::NAN);
    if let Some(refusal) = no_velocity(median) {
        let rounded = short(median).parse().unwrap_or(median);
        let question = plausible::VELOCITY.question(&[rounded], VELOCITY);
        let asked_for = plausible::VELOCITY.asked_for();
        let refusal = question
            .map_or(refusal, |question| format!("is {}; {asked_for}: {question}", short(median)));
        violations.add(field, format!("their median {refusal}"));
        return;
    }
    let refused = measured
        .iter()
        .enumerate()
        .filter_map(|(index, &velocity)| Some((index, no_velocity(velocity)?)));
    for (refusals, (index, refusal)) in refused.enumerate() {
        if refusals == REFUSED_MAX {
            violations.add_more(field, "more velocities out of range are not listed");
            return;
        }
        let (element, place) = (element_path(field, index), Origin::place(origin, set, index));
        violations.add(element, format!("{place}{refusal}; their median is {}", short(median)));
    }
}
