//! A job's specification as a message.

use osteon_common::bone_structure::BoneStructure;
use osteon_common::check;
use osteon_common::data::numbered;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{
    Data, Group, JobKind, JobSpecification, Measurements, MonteCarlo, Objective, Omitted, Prior,
    Range, Search,
};
use osteon_common::known_quantities::KnownQuantities;
use osteon_common::observables::ObservedColumns;
use osteon_common::parameters::{PARAMETERS, Parameter, Point};
use osteon_common::porosity::BoneMatrix;
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::systematic::Systematic;
use osteon_common::violations::Violations;

use crate::choice::{JOB_KIND, PARAMETER};
use crate::fields;
use crate::observed;
use crate::posterior_settings;
use crate::setup;
use crate::setup::{random_from_message, random_to_message};
use crate::v1;

/// Returns the complete message of a specification: every field is present.
pub fn to_message(specification: &JobSpecification) -> v1::JobSpecification {
    let messages = setup::to_messages(&specification.setup);
    v1::JobSpecification {
        kind: JOB_KIND.number(specification.kind),
        layers: Some(messages.layers),
        probe: Some(messages.probe),
        picking: Some(messages.picking),
        solver: Some(messages.solver),
        bone: messages.bone,
        data: specification.data.as_ref().map(data_to_message),
        parameters: Some(parameters_to_message(&specification.parameters)),
        random: random_to_message(&specification.random),
        systematic: (!specification.systematic.is_empty())
            .then(|| fields::to_message(&mut specification.systematic.clone())),
        groups: (specification.groups != GroupSettings::default())
            .then(|| fields::to_message(&mut specification.groups.clone())),
        monte_carlo: Some(fields::to_message(&mut specification.monte_carlo.clone())),
        objective: Some(fields::to_message(&mut specification.objective.clone())),
        search: Some(search_to_message(&specification.search)),
        posterior: specification.posterior.as_ref().map(posterior_settings::to_message),
    }
}

/// Returns the specification of a message, with defaults filled in and every rule checked.
///
/// # Errors
/// All violations, each with the field's path in the message.
pub fn from_message(message: &v1::JobSpecification) -> Result<JobSpecification, Violations> {
    let mut violations = Violations::new();
    let specification = read(message, &mut violations);
    check::job(&specification, &mut violations);
    violations.with_fields(field_of_message).into_result(specification)
}

/// Returns the path in the message of a field of a job file. They differ for the ranges of
/// parameters, and for the profile of a porosity.
fn field_of_message(field: &str) -> String {
    if let Some(of_profile) = field.strip_prefix("bone.porosity.") {
        return format!("bone.profile.{of_profile}");
    }
    let of_range = field.strip_prefix("parameters.").and_then(|rest| rest.split_once('.'));
    match of_range {
        Some((name, "start")) => format!("parameters.{name}.free.start"),
        Some((name, "bounds")) => format!("parameters.{name}.free"),
        _ => field.to_owned(),
    }
}

/// Reads all fields; a field that cannot be read is recorded as a violation and replaced by a
/// default.
fn read(message: &v1::JobSpecification, violations: &mut Violations) -> JobSpecification {
    let kind = JOB_KIND.value(message.kind).unwrap_or_else(|| {
        violations.add("kind", JOB_KIND.refusal(message.kind));
        JobKind::Identification
    });
    let (mut monte_carlo, mut objective) = (MonteCarlo::default(), Objective::default());
    let mut systematic = Systematic::default();
    if let Some(message) = &message.systematic {
        fields::from_message("systematic", message, &mut systematic, violations);
    }
    let mut groups = GroupSettings::default();
    if let Some(message) = &message.groups {
        fields::from_message(GroupSettings::KEY.name, message, &mut groups, violations);
    }
    let random = message.random.as_ref();
    let random = random
        .map_or_else(RandomQuantities::default, |message| random_from_message(message, violations));
    if let Some(message) = &message.monte_carlo {
        fields::from_message("monte_carlo", message, &mut monte_carlo, violations);
    }
    if let Some(message) = &message.objective {
        fields::from_message("objective", message, &mut objective, violations);
    }
    let setup = setup::from_messages(
        message.layers.as_ref(),
        message.probe.as_ref(),
        message.picking.as_ref(),
        message.solver.as_ref(),
        message.bone.as_ref(),
        violations,
    );
    let specification = JobSpecification {
        kind,
        data: message.data.as_ref().and_then(|data| data_from_message(data, violations)),
        parameters: parameters_from_message(
            message.parameters.as_ref(),
            &setup.structure,
            violations,
        ),
        setup,
        random,
        systematic,
        groups,
        monte_carlo,
        objective,
        search: message
            .search
            .as_ref()
            .map_or_else(Search::default, |message| search_from_message(message, violations)),
        posterior: message
            .posterior
            .as_ref()
            .map(|message| posterior_settings::from_message(message, violations)),
    };
    let unspecified = v1::ObjectiveKind::Unspecified as i32;
    let kind = message.objective.as_ref().map_or(unspecified, |objective| objective.kind);
    let tolerance = message.search.as_ref().and_then(|search| search.cost_tolerance);
    specification.with_implied(Omitted {
        objective: kind == unspecified,
        cost_tolerance: tolerance.is_none(),
    })
}

fn data_to_message(data: &Data) -> v1::Data {
    let message = v1::Data {
        repeatability: Some(data.repeatability),
        decay_error: Some(data.decay_error),
        ..v1::Data::default()
    };
    let numbers = |subjects: &Option<Vec<u32>>| subjects.clone().unwrap_or_default();
    match &data.measurements {
        Measurements::Velocities { velocities, subjects, observables } => v1::Data {
            velocities: velocities.clone(),
            subjects: numbers(subjects),
            observables: observed::columns_to_messages(observables),
            ..message
        },
        Measurements::Groups(groups) => {
            let group = |Group { name, velocities, subjects, observables, known }: &Group| {
                v1::VelocityGroup {
                    name: name.clone(),
                    velocities: velocities.clone(),
                    subjects: numbers(subjects),
                    observables: observed::columns_to_messages(observables),
                    bone_thickness: known.get(Parameter::BoneThickness),
                    bone_quality_factor: known.get(Parameter::BoneQualityFactor),
                    coupling_sound_speed: known.get(Parameter::CouplingSoundSpeed),
                    porosity: known.get(Parameter::Porosity),
                    surface_porosity: known.get(Parameter::SurfacePorosity),
                    marrow_porosity: known.get(Parameter::MarrowPorosity),
                }
            };
            v1::Data { groups: groups.iter().map(group).collect(), ..message }
        }
        Measurements::Moments { mean, coefficient_of_variation, count } => v1::Data {
            mean: Some(*mean),
            coefficient_of_variation: Some(*coefficient_of_variation),
            count: *count,
            ..message
        },
    }
}

fn data_from_message(message: &v1::Data, violations: &mut Violations) -> Option<Data> {
    let measurements = measurements(message, violations)?;
    let has_velocities = matches!(measurements, Measurements::Velocities { .. });
    if !message.subjects.is_empty() && !has_velocities {
        violations.add("data.subjects", "has no velocities beside it; leave it out");
    }
    if !message.observables.is_empty() && !has_velocities {
        violations.add("data.observables", "has no velocities beside it; leave it out");
    }
    if message.count.is_some() && !matches!(measurements, Measurements::Moments { .. }) {
        let message = "is the number of velocities behind `mean` and `coefficient_of_variation`, and \
                       they are not given; leave it out";
        violations.add("data.count", message);
    }
    let [repeatability, decay_error] =
        [message.repeatability, message.decay_error].map(Option::unwrap_or_default);
    Some(Data { measurements, repeatability, decay_error })
}

fn measurements(message: &v1::Data, violations: &mut Violations) -> Option<Measurements> {
    let v1::Data { velocities, mean, coefficient_of_variation, groups, .. } = message;
    let mut observables = |messages: &[v1::ObservedValues]| {
        observed::columns_from_messages(messages).unwrap_or_else(|malformed| {
            violations.add("data.observables", malformed.to_string());
            ObservedColumns::default()
        })
    };
    let numbers = |subjects: &[u32]| (!subjects.is_empty()).then(|| numbered(subjects));
    match (velocities.is_empty(), groups.is_empty(), (*mean, *coefficient_of_variation)) {
        (true, true, (Some(mean), Some(coefficient_of_variation))) => {
            let count = message.count;
            Some(Measurements::Moments { mean, coefficient_of_variation, count })
        }
        (false, true, (None, None)) => {
            let subjects = numbers(&message.subjects);
            let observables = observables(&message.observables);
            Some(Measurements::Velocities { velocities: velocities.clone(), subjects, observables })
        }
        (true, false, (None, None)) => {
            let mut group = |group: &v1::VelocityGroup| Group {
                name: group.name.clone(),
                velocities: group.velocities.clone(),
                subjects: numbers(&group.subjects),
                observables: observables(&group.observables),
                known: KnownQuantities::new([
                    group.porosity,
                    group.surface_porosity,
                    group.marrow_porosity,
                    group.bone_thickness,
                    group.bone_quality_factor,
                    group.coupling_sound_speed,
                ]),
            };
            Some(Measurements::Groups(groups.iter().map(&mut group).collect()))
        }
        (true, true, (None, None)) => {
            violations.add(
                "data",
                "is empty; give `velocities`, or `groups`, or `mean` and `coefficient_of_variation`",
            );
            None
        }
        (true, true, (mean, _)) => {
            let missing = if mean.is_none() { "mean" } else { "coefficient_of_variation" };
            violations.add(format!("data.{missing}"), "is missing; moments need both numbers");
            None
        }
        _ => {
            violations
                .add("data", "has two of velocities, groups and moments; give one of the three");
            None
        }
    }
}

fn parameters_to_message(ranges: &[Range; PARAMETERS]) -> v1::Parameters {
    let mut message = v1::Parameters::default();
    for (parameter, range) in Parameter::ALL.into_iter().zip(ranges) {
        let range = match *range {
            Range::AS_IN_SETUP if parameter.of_setup().is_some() => continue,
            Range::Fixed(value) => v1::parameter_range::Range::Fixed(value),
            Range::Free { start, lower, upper } => {
                v1::parameter_range::Range::Free(v1::FreeRange { start, lower, upper })
            }
        };
        *range_slot(&mut message, parameter) = Some(v1::ParameterRange { range: Some(range) });
    }
    message
}

/// Returns the ranges; parameters without effect may be left out.
fn parameters_from_message(
    message: Option<&v1::Parameters>,
    structure: &BoneStructure,
    violations: &mut Violations,
) -> [Range; PARAMETERS] {
    let mut message = message.cloned().unwrap_or_default();
    let unused = Point::of_matrix(&BoneMatrix::default(), 0.0);
    Parameter::ALL.map(|parameter| {
        let range = range_slot(&mut message, parameter).as_ref();
        match range.and_then(|range| range.range.as_ref()) {
            Some(v1::parameter_range::Range::Fixed(value)) => Range::Fixed(*value),
            Some(v1::parameter_range::Range::Free(free)) => {
                Range::Free { start: free.start, lower: free.lower, upper: free.upper }
            }
            None if range.is_none() && parameter.of_setup().is_some() => Range::AS_IN_SETUP,
            None if range.is_none() && structure.ignores(parameter) => {
                Range::Fixed(unused.get(parameter))
            }
            None => {
                violations.add(
                    format!("parameters.{}", parameter.name()),
                    "is missing; give `fixed`, or `free` with `start`, `lower` and `upper`",
                );
                Range::Fixed(f64::NAN)
            }
        }
    })
}

fn range_slot(
    message: &mut v1::Parameters,
    parameter: Parameter,
) -> &mut Option<v1::ParameterRange> {
    match parameter {
        Parameter::Density => &mut message.density,
        Parameter::LongitudinalYoungModulus => &mut message.longitudinal_young_modulus,
        Parameter::LongitudinalPoissonRatio => &mut message.longitudinal_poisson_ratio,
        Parameter::LongitudinalShearModulus => &mut message.longitudinal_shear_modulus,
        Parameter::TransverseYoungModulus => &mut message.transverse_young_modulus,
        Parameter::TransversePoissonRatio => &mut message.transverse_poisson_ratio,
        Parameter::Dispersion => &mut message.dispersion,
        Parameter::BoneThickness => &mut message.bone_thickness,
        Parameter::BoneQualityFactor => &mut message.bone_quality_factor,
        Parameter::CouplingSoundSpeed => &mut message.coupling_sound_speed,
        Parameter::Porosity => &mut message.porosity,
        Parameter::SurfacePorosity => &mut message.surface_porosity,
        Parameter::MarrowPorosity => &mut message.marrow_porosity,
    }
}

/// Returns the complete message of a search.
pub(crate) fn search_to_message(search: &Search) -> v1::Search {
    let message: v1::Search = fields::to_message(&mut search.clone());
    v1::Search { priors: priors_to_message(&search.priors), ..message }
}

/// Returns the search of a message, with defaults filled in.
pub(crate) fn search_from_message(message: &v1::Search, violations: &mut Violations) -> Search {
    let mut search = Search::default();
    fields::from_message("search", message, &mut search, violations);
    search.priors = priors_from_message(&message.priors, violations);
    search
}

fn priors_to_message(priors: &[Option<Prior>; PARAMETERS]) -> Vec<v1::Prior> {
    let message = |(parameter, prior): (&Parameter, &Option<Prior>)| {
        let Prior { value, weight } = (*prior)?;
        Some(v1::Prior { parameter: PARAMETER.number(*parameter), value, weight })
    };
    Parameter::ALL.iter().zip(priors).filter_map(message).collect()
}

fn priors_from_message(
    messages: &[v1::Prior],
    violations: &mut Violations,
) -> [Option<Prior>; PARAMETERS] {
    let mut priors = [None; PARAMETERS];
    for &v1::Prior { parameter, value, weight } in messages {
        let Some(known) = PARAMETER.value(parameter) else {
            violations
                .add("search.priors", format!("`parameter` {}", PARAMETER.refusal(parameter)));
            // Report only the first unknown parameter.
            return priors;
        };
        match &mut priors[known as usize] {
            slot @ None => *slot = Some(Prior { value, weight }),
            Some(_) => {
                violations.add(format!("search.priors.{}", known.name()), "is given twice");
            }
        }
    }
    priors
}

#[cfg(test)]
mod tests;
