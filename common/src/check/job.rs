//! Rules on data, parameters, the Monte Carlo loop and the search.

use std::collections::BTreeSet;

use crate::accepted::{Interval, written};
use crate::attainable_moments;
use crate::field_path::{element_path, entry_path};
use crate::job::{
    Data, Group, JobKind, JobSpecification, MonteCarlo, Objective, Range, Sampling, Search,
    SearchMethod,
};
use crate::limits;
use crate::origin::Origin;
use crate::parameters::Parameter;
use crate::plausible::{self, PlausibleRange, short};
use crate::quantile::quantile;
use crate::statistics;
use crate::violations::Violations;
use crate::visible;

use super::posterior::posterior_of_job;
use super::priors::priors;
use super::section::section;
use super::setup::setup;
use super::value::{known_wrong, number, quantity};

/// Accepted values of a measured velocity.
pub const VELOCITY: Interval = Interval::above(0.0, "m/s");
/// Accepted values of the data's coefficient of variation.
const VARIATION: Interval = Interval::above(0.0, "");
const MOMENTS_NEED: &str = "a coefficient of variation above 0 needs";
/// Minimum number of velocities that have a coefficient of variation.
pub const VELOCITIES_MIN: usize = 2;
/// The forms in which `[data]` may be given.
pub const DATA_FORMS: &str =
    "give either velocities, or groups, or mean and coefficient_of_variation";

/// Maximum number of velocities that are refused individually.
const REFUSED_MAX: usize = 10;

/// Records all violations of `specification`.
///
/// Fields that already have an entry in `violations` are not reported again, so that a front end
/// can first record the fields that it could not read at all.
pub fn job(specification: &JobSpecification, violations: &mut Violations) {
    job_from(specification, None, violations);
}

/// Same as [`job`], for a job whose measured velocities are in the file `origin`.
pub fn job_from(
    specification: &JobSpecification,
    origin: Option<&Origin>,
    violations: &mut Violations,
) {
    setup(&specification.setup, violations);
    match (specification.kind, &specification.data) {
        (JobKind::Identification, Some(given)) => data_from(given, origin, violations),
        (JobKind::Identification, None) if !violations.has_at_or_below("data") => {
            violations.add("data", no_data());
        }
        (JobKind::Propagation, Some(_)) if !violations.has_at_or_below("data") => {
            violations.add("data", "a propagation has no data; leave it out");
        }
        _ => {}
    }
    for parameter in Parameter::ALL {
        range(parameter, specification.range(parameter), violations);
    }
    admissible_start(specification, violations);
    something_to_search(specification, violations);
    let (mut checked, mut default) = (specification.monte_carlo, MonteCarlo::default());
    section("monte_carlo", &mut checked, &mut default, violations);
    scrambles(&specification.monte_carlo, violations);
    let (mut checked, mut default) = (specification.search, Search::default());
    section("search", &mut checked, &mut default, violations);
    priors(specification, violations);
    enough_for_the_method(specification, violations);
    evaluations(specification, violations);
    likelihood(specification, violations);
    posterior_of_job(specification, violations);
    within_reach(specification, violations);
}

/// Returns the message for an identification without data.
pub fn no_data() -> String {
    format!("is missing; an identification needs it: {DATA_FORMS}")
}

/// Records all violations of measured `data`.
pub fn data(data: &Data, violations: &mut Violations) {
    data_from(data, None, violations);
}

fn data_from(data: &Data, origin: Option<&Origin>, violations: &mut Violations) {
    match data {
        Data::Velocities(measured) => {
            velocities("data.velocities", measured, (origin, 0), violations);
        }
        Data::Groups(measured) => groups(measured, origin, violations),
        Data::Moments { mean, coefficient_of_variation } => {
            quantity("data.mean", *mean, VELOCITY, &plausible::VELOCITY, violations);
            if !violations.has_at_or_below("data.mean")
                && let Some(refusal) = no_velocity(*mean)
            {
                violations.add("data.mean", refusal);
            }
            quantity(
                "data.coefficient_of_variation",
                *coefficient_of_variation,
                VARIATION,
                &plausible::VARIATION,
                violations,
            );
        }
    }
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
        let Group { name, velocities: measured } = group;
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
    let refused =
        measured.iter().enumerate().filter(|&(_, &velocity)| !VELOCITY.contains(velocity));
    for (refusals, (index, &velocity)) in refused.enumerate() {
        if refusals == REFUSED_MAX {
            violations.add_more(field, "more velocities out of range are not listed");
            return false;
        }
        violations.add(element_path(field, index), VELOCITY.refusal(velocity));
    }
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

/// Refuses velocities that are in another unit, either all of them or some.
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

fn range(parameter: Parameter, range: Range, violations: &mut Violations) {
    let path = format!("parameters.{}", parameter.name());
    let (accepted, kind) = (Interval::of(parameter), PlausibleRange::of(parameter));
    match range {
        Range::Fixed(value) => {
            quantity(&format!("{path}.fixed"), value, accepted, &kind, violations);
        }
        Range::Free { start, lower, upper } => {
            let (start_path, bounds_path) = (format!("{path}.start"), format!("{path}.bounds"));
            quantity(&start_path, start, accepted, &kind, violations);
            bounds(&bounds_path, [lower, upper], accepted, &kind, violations);
            if !known_wrong(&bounds_path, violations) {
                let within = Interval::from_to(lower, upper, "the bounds");
                number(&start_path, start, within, violations);
            }
        }
    }
}

fn bounds(
    path: &str,
    [lower, upper]: [f64; 2],
    accepted: Interval,
    kind: &PlausibleRange,
    violations: &mut Violations,
) {
    if known_wrong(path, violations) {
        return;
    }
    for (name, value) in [("lower", lower), ("upper", upper)] {
        if !accepted.contains(value) {
            violations.add(path, format!("the {name} bound {}", accepted.refusal(value)));
        }
    }
    if violations.has_at_or_below(path) {
        return;
    }
    if lower >= upper {
        let [lower, upper] = [lower, upper].map(written);
        let message = format!("the lower bound {lower} must be below the upper {upper}");
        violations.add(path, message);
    } else if let Some(question) = kind.question(&[lower, upper], accepted) {
        let asked_for = kind.asked_for();
        violations.add(path, format!("are {lower:?} and {upper:?}; {asked_for}: {question}"));
    }
}

/// Checks that the mean model of the first point is admissible, if each of its constants is valid
/// by itself.
fn admissible_start(specification: &JobSpecification, violations: &mut Violations) {
    let wrong = |&parameter: &Parameter| {
        let key = match specification.range(parameter) {
            Range::Fixed(_) => "fixed",
            Range::Free { .. } => "start",
        };
        known_wrong(&format!("parameters.{}.{key}", parameter.name()), violations)
    };
    let independent = [Parameter::Density, Parameter::Dispersion];
    let mut constants = Parameter::ALL.iter().filter(|name| !independent.contains(name));
    if constants.any(wrong) {
        return;
    }
    if let Err(inadmissible) = specification.start().constants().elasticity() {
        violations.add(
            "parameters",
            format!("the point of starts and fixed values is not admissible: {inadmissible}"),
        );
    }
}

/// Refuses data that no point within the bounds can match even approximately, by the closed form of
/// √(c1111/ρ) and δ.
fn within_reach(specification: &JobSpecification, violations: &mut Violations) {
    let fields = ["data", "parameters", "layers", "probe"];
    if fields.iter().any(|field| known_wrong(field, violations)) {
        return;
    }
    if let Some((field, message)) = attainable_moments::unattainable_data(specification) {
        violations.add(field, message);
    }
}

fn something_to_search(specification: &JobSpecification, violations: &mut Violations) {
    let fixed = |range: &Range| matches!(range, Range::Fixed(_));
    if specification.kind == JobKind::Identification
        && specification.parameters.iter().all(fixed)
        && !violations.has_at_or_below("parameters")
    {
        violations.add(
            "parameters",
            "all seven are fixed; an identification searches at least one: give it start and bounds \
             (a run at fixed parameters is a propagation)",
        );
    }
}

fn scrambles(monte_carlo: &MonteCarlo, violations: &mut Violations) {
    const FIELD: &str = "monte_carlo.scrambles";
    let MonteCarlo { realizations, scrambles, .. } = *monte_carlo;
    let around = [FIELD, "monte_carlo.sampling", "monte_carlo.realizations"];
    if around.iter().any(|field| known_wrong(field, violations)) {
        return;
    }
    match monte_carlo.sampling {
        Sampling::MonteCarlo if scrambles != 1 => violations.add(
            FIELD,
            format!(
                "is {scrambles}; it must be 1 with the sampling \"monte_carlo\", as only the points \
                 of \"sobol\" are scrambled"
            ),
        ),
        Sampling::Sobol if realizations % scrambles != 0 => violations.add(
            FIELD,
            format!("is {scrambles}; it must divide the {realizations} realizations"),
        ),
        _ => {}
    }
}

/// Checks the number of evaluations of all searches of a job together, and of its posteriors.
fn evaluations(specification: &JobSpecification, violations: &mut Violations) {
    let fields = ["search.max_evaluations", "search.starts", "posterior", "data"];
    if fields.iter().any(|field| known_wrong(field, violations)) {
        return;
    }
    let (all, most) = (specification.evaluations_max(), limits::EVALUATIONS_MAX);
    let sets = specification.data.as_ref().map_or(1, Data::sets) as u64;
    let searches = specification.search.starts * sets;
    if searches <= 1 || all <= most {
        return;
    }
    let each = specification.search.max_evaluations;
    let together = format!("all together may have at most {most}");
    match specification.posterior {
        Some(posterior) if !specification.is_searched() => violations.add(
            "posterior.max_evaluations",
            format!("is {}, for each of {sets} sets of data; {together}", posterior.max_evaluations),
        ),
        Some(posterior) => violations.add(
            "search.max_evaluations",
            format!(
                "is {each}, of each of {searches} searches, and each of {sets} posteriors has up to \
                 {}; {together}",
                posterior.max_evaluations
            ),
        ),
        None => violations.add(
            "search.max_evaluations",
            format!("is {each}, of each of {searches} searches; {together}"),
        ),
    }
}

/// Checks that there are two velocities: a single one has the coefficient of variation 0, which has
/// no logarithm.
fn enough_for_the_method(specification: &JobSpecification, violations: &mut Violations) {
    let realizations = specification.monte_carlo.realizations;
    if specification.kind == JobKind::Identification
        && specification.search.method == SearchMethod::Newton
        && realizations == 1
        && !known_wrong("monte_carlo.realizations", violations)
        && !known_wrong("search.method", violations)
    {
        violations.add(
            "monte_carlo.realizations",
            "is 1; the search \"newton\" needs a coefficient of variation, so at least 2",
        );
    }
}

/// Checks the requirements of a likelihood on the rest of an identification.
fn likelihood(specification: &JobSpecification, violations: &mut Violations) {
    const FIELD: &str = "objective.kind";
    let asked = specification.kind == JobKind::Identification
        && specification.objective == Objective::Likelihood;
    if !asked || known_wrong(FIELD, violations) {
        return;
    }
    if matches!(specification.data, Some(Data::Moments { .. }))
        && !violations.has_at_or_below("data")
    {
        violations.add(
            FIELD,
            "is \"likelihood\", which needs the measured velocities as data.velocities; with data.mean and \
             data.coefficient_of_variation alone it must be \"moments\"",
        );
    }
    if specification.search.method == SearchMethod::Newton
        && !known_wrong("search.method", violations)
    {
        violations.add(
            "search.method",
            "is \"newton\", which solves for the moments; with the objective.kind \"likelihood\" it must be \
             \"simplex\"",
        );
    }
    if specification.monte_carlo.realizations == 1
        && !known_wrong("monte_carlo.realizations", violations)
    {
        violations.add(
            "monte_carlo.realizations",
            "is 1; the objective \"likelihood\" needs the law of velocities that differ, so at least 2",
        );
    }
}
