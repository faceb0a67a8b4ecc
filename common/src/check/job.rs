//! Rules on parameters, the Monte Carlo loop and the search.

use crate::attainable_moments;
use crate::inference::MomentWeights;
use crate::job::{
    Data, JobKind, JobSpecification, MonteCarlo, Objective, Range, Sampling, Search, SearchMethod,
};
use crate::limits;
use crate::origin::Origin;
use crate::parameters::Parameter;
use crate::violations::Violations;

use super::bone_structure::parameters_of_sublayers;
use super::data::{data_from, no_data};
use super::groups::pooled_groups;
use super::known_quantities::known_quantities;
use super::observables::observables_of_job;
use super::posterior::posterior_of_job;
use super::priors::priors;
use super::range::range;
use super::section::section;
use super::setup::setup;
use super::setup_parameters::{random_setup, setup_parameters};
use super::systematic::systematic;
use super::value::known_wrong;

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
    for parameter in Parameter::OF_BONE {
        range(parameter, specification.range(parameter), violations);
    }
    parameters_of_sublayers(specification, violations);
    setup_parameters(specification, violations);
    known_quantities(specification, origin, violations);
    admissible_start(specification, violations);
    something_to_search(specification, violations);
    random_setup(specification, violations);
    let (mut checked, mut default) = (specification.monte_carlo, MonteCarlo::default());
    section("monte_carlo", &mut checked, &mut default, violations);
    scrambles(&specification.monte_carlo, violations);
    let (mut checked, mut default) = (specification.search, Search::default());
    section("search", &mut checked, &mut default, violations);
    priors(specification, violations);
    enough_for_the_method(specification, violations);
    evaluations(specification, violations);
    likelihood(specification, violations);
    chi_square(specification, violations);
    observables_of_job(specification, origin, violations);
    posterior_of_job(specification, violations);
    systematic(specification, violations);
    pooled_groups(specification, violations);
    within_reach(specification, violations);
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
    let mut constants = Parameter::OF_BONE.iter().filter(|name| !independent.contains(name));
    if constants.any(wrong) {
        return;
    }
    let (start, structure) = (specification.start(), &specification.setup.structure);
    let is_known = !["bone", "parameters"].iter().any(|field| violations.has_at_or_below(field));
    let refused = match start.constants().elasticity() {
        Err(inadmissible) => Some(inadmissible.to_string()),
        Ok(_) if is_known => structure.mean_solid(&start).err().map(|none| none.to_string()),
        Ok(_) => None,
    };
    if let Some(refused) = refused {
        let message = format!("the point of starts and fixed values is not admissible: {refused}");
        violations.add("parameters", message);
    }
}

/// Refuses data that no point within the bounds can match even approximately, by the closed form of
/// √(c1111/ρ) and δ.
fn within_reach(specification: &JobSpecification, violations: &mut Violations) {
    let fields = ["data", "parameters", "layers", "probe", "bone"];
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
            "all are fixed; an identification searches at least one: give it start and bounds \
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

/// Checks that the noise of the data is known if it weights the cost.
fn chi_square(specification: &JobSpecification, violations: &mut Violations) {
    const FIELD: &str = "objective.kind";
    let asked = specification.kind == JobKind::Identification
        && specification.objective == Objective::ChiSquare;
    if !asked || known_wrong(FIELD, violations) || violations.has_at_or_below("data") {
        return;
    }
    let Some(data) = specification.data.as_ref() else { return };
    let unknown = |set: &usize| MomentWeights::of_data(data, *set).is_none();
    let Some(set) = data.searchable_sets().find(unknown) else { return };
    if data.has_only_moments() {
        violations.add(
            FIELD,
            "is \"chi_square\", which weights both moments by the noise of the data: give the number of \
             velocities behind data.mean and data.coefficient_of_variation as data.count, or the \
             velocities themselves as data.velocities; otherwise it must be \"moments\"",
        );
        return;
    }
    let name = data.names().nth(set).map_or_else(String::new, |name| format!(" of group {name:?}"));
    violations.add(
        FIELD,
        format!(
            "is \"chi_square\", which weights both moments by the noise of the data, and the \
             velocities{name} say nothing of it: they need a scatter beyond data.repeatability, over \
             at least two subjects if these are given; otherwise it must be \"moments\""
        ),
    );
}

/// Checks the requirements of a likelihood on the rest of an identification.
fn likelihood(specification: &JobSpecification, violations: &mut Violations) {
    const FIELD: &str = "objective.kind";
    let asked = specification.kind == JobKind::Identification
        && specification.objective == Objective::Likelihood;
    if !asked || known_wrong(FIELD, violations) {
        return;
    }
    let data = specification.data.as_ref().filter(|_| !violations.has_at_or_below("data"));
    if data.is_some_and(Data::has_only_moments) {
        violations.add(
            FIELD,
            "is \"likelihood\", which needs the measured velocities as data.velocities; with data.mean and \
             data.coefficient_of_variation alone it must be \"moments\"",
        );
    }
    if let Some(repeatability) = data.map(Data::repeatability).filter(|&found| found > 0.0) {
        violations.add(
            "data.repeatability",
            format!(
                "is {repeatability:?}; the objective.kind \"likelihood\" compares the velocities with \
                 the model's law, which does not contain it: it must be 0, or the kind \"moments\""
            ),
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
