use std::path::Path;

use osteon_common::bone_structure::{MeanSolid, MeanSublayer};
use osteon_common::case::Setup;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::SearchMethod;
use osteon_common::settings::Method;
use osteon_files::document::Format;
use osteon_files::job_file;
use osteon_fuzz::properties;
use proptest::prelude::*;

use self::random_specifications::specification;
use super::*;

mod objective;
mod posterior;
mod random_specifications;

/// The paper's search box, with all parameters free.
const RANGES: [(f64, f64, f64); 7] = [
    (1700.0, 1500.0, 2000.0),
    (18e9, 12e9, 25e9),
    (0.35, 0.2, 0.45),
    (4.5e9, 3e9, 6.5e9),
    (10e9, 8e9, 16e9),
    (0.4, 0.2, 0.5),
    (0.1, 0.02, 0.3),
];

properties! {
    fn specifications_survive_the_wire(specification in specification()) {
        let message = to_message(&specification);
        prop_assert_eq!(from_message(&message), Ok(specification));
    }
}

fn message() -> v1::JobSpecification {
    let free = |i: usize| {
        let (start, lower, upper) = RANGES[i];
        Range::Free { start, lower, upper }
    };
    to_message(&JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(Data::from_moments(3906.0, 0.027)),
        parameters: Range::of_bone(std::array::from_fn(free)),
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo::default(),
        objective: Objective::default(),
        search: Search::default(),
        posterior: None,
    })
}

#[test]
fn absent_messages_take_the_defaults() {
    let sparse = v1::JobSpecification {
        kind: v1::JobKind::Identification.into(),
        data: message().data,
        parameters: message().parameters,
        ..v1::JobSpecification::default()
    };
    assert_eq!(from_message(&sparse), from_message(&message()));
    let with_empty_messages = v1::JobSpecification {
        layers: Some(v1::Layers { coupling: Some(v1::Fluid::default()), ..Default::default() }),
        probe: Some(v1::Probe { receivers: Some(v1::Receivers::default()), ..Default::default() }),
        picking: Some(v1::Picking::default()),
        solver: Some(v1::SolverSettings::default()),
        monte_carlo: Some(v1::MonteCarlo::default()),
        objective: Some(v1::Objective::default()),
        search: Some(v1::Search::default()),
        ..sparse
    };
    assert_eq!(from_message(&with_empty_messages), from_message(&message()));
}

#[test]
fn sublayers_of_their_own_solids_need_no_constants() {
    let solid = MeanSolid::Given(Box::new(BoneMatrix::default().bone().unwrap()));
    let mut specification = from_message(&message()).unwrap();
    specification.setup.structure.sublayers =
        vec![MeanSublayer { thickness: specification.setup.layers.bone_thickness, solid }];
    let of_matrix = Point::of_matrix(&BoneMatrix::default(), 0.0);
    for parameter in Parameter::OF_BONE.into_iter().filter(|one| *one != Parameter::Dispersion) {
        specification.parameters[parameter as usize] = Range::Fixed(of_matrix.get(parameter));
    }
    let mut message = to_message(&specification);
    let dispersion = message.parameters.take().unwrap().dispersion;
    message.parameters = Some(v1::Parameters { dispersion, ..v1::Parameters::default() });
    assert_eq!(from_message(&message), Ok(specification));
    message.bone = None;
    assert_eq!(from_message(&message).unwrap_err().iter().count(), 6);
}

#[test]
fn the_default_tolerance_is_that_of_the_method() {
    let mut message = message();
    let method = v1::SearchMethod::Newton.into();
    message.search = Some(v1::Search { method, ..Default::default() });
    let specification = from_message(&message).unwrap();
    assert_eq!(specification.search, Search::by(SearchMethod::Newton));
    assert_eq!(specification.search.cost_tolerance, 1e-12);
}

/// Returns the fields at fault after `change`, in the order in which they are reported.
fn faults(change: impl FnOnce(&mut v1::JobSpecification)) -> Vec<String> {
    let mut message = message();
    change(&mut message);
    let violations = from_message(&message).unwrap_err();
    violations.iter().map(|violation| violation.field.clone()).collect()
}

/// Switches to the hybrid method and sets everything that belongs to it.
fn of_hybrid(
    message: &mut v1::JobSpecification,
    method: i32,
    element_size: f64,
    element_order: u32,
    time_step: f64,
) {
    message.solver = Some(v1::SolverSettings {
        method,
        refinement: None,
        element_size: Some(element_size),
        element_order: Some(element_order),
        time_step: Some(time_step),
    });
}

#[test]
fn each_fault_is_named_by_its_path() {
    assert_eq!(faults(|m| m.kind = 0), ["kind"]);
    assert_eq!(faults(|m| m.kind = 17), ["kind"]);
    assert_eq!(faults(|m| m.data = Some(v1::Data::default())), ["data"]);
    assert_eq!(faults(|m| m.data.as_mut().unwrap().velocities = vec![1.0, 2.0]), ["data"]);
    assert_eq!(faults(|m| m.data.as_mut().unwrap().mean = None), ["data.mean"]);
    assert_eq!(
        faults(|m| m.data.as_mut().unwrap().coefficient_of_variation = None),
        ["data.coefficient_of_variation"]
    );
    assert_eq!(faults(|m| m.picking.as_mut().unwrap().extremum = 3), ["picking.extremum"]);
    assert_eq!(faults(|m| m.solver.as_mut().unwrap().method = 17), ["solver.method"]);
    let fields = ["solver.element_size", "solver.element_order", "solver.time_step"];
    assert_eq!(faults(|m| of_hybrid(m, 1, 0.5e-3, 8, 1e-8)), fields);
    assert_eq!(faults(|m| of_hybrid(m, 2, 1.0, 1, -1e-8)), fields);
    assert_eq!(faults(|m| of_hybrid(m, 17, 1.0, 1, -1e-8)), ["solver.method"]);
    assert_eq!(
        faults(|m| m.parameters.as_mut().unwrap().dispersion = None),
        ["parameters.dispersion"]
    );
    assert_eq!(
        faults(|m| m.parameters.as_mut().unwrap().density.as_mut().unwrap().range = None),
        ["parameters.density"]
    );
    assert_eq!(faults(|m| m.parameters = None).len(), 7);
    let (streams, sobol) = (v1::Sampling::MonteCarlo, v1::Sampling::Sobol);
    for (sampling, scrambles) in [(streams, 2), (sobol, 2), (sobol, 0), (sobol, 1025)] {
        let fields = faults(|m| {
            let monte_carlo = m.monte_carlo.as_mut().unwrap();
            monte_carlo.set_sampling(sampling);
            monte_carlo.scrambles = Some(scrambles);
        });
        assert_eq!(fields, ["monte_carlo.scrambles"], "{sampling:?} {scrambles} of 2747");
    }
}

/// Returns all messages about a specification after `change`.
fn refusal(change: impl FnOnce(&mut v1::JobSpecification)) -> Vec<String> {
    let mut message = message();
    change(&mut message);
    let violations = from_message(&message).unwrap_err();
    violations.iter().map(ToString::to_string).collect()
}

/// Replaces the data by these moments.
fn moments(message: &mut v1::JobSpecification, mean: f64, variation: f64) {
    message.data = Some(v1::Data {
        mean: Some(mean),
        coefficient_of_variation: Some(variation),
        ..v1::Data::default()
    });
}

/// Replaces the range of e_L.
fn modulus(message: &mut v1::JobSpecification, start: f64, lower: f64, upper: f64) {
    let range = v1::parameter_range::Range::Free(v1::FreeRange { start, lower, upper });
    let range = Some(v1::ParameterRange { range: Some(range) });
    message.parameters.as_mut().unwrap().longitudinal_young_modulus = range;
}

#[test]
fn other_units_are_asked_about() {
    assert_eq!(
        refusal(|m| moments(m, 3.8, 2.7)),
        [
            "data.mean: is 3.8; values are in m/s: did you mean 3.8 km/s (3.8e3)?",
            "data.coefficient_of_variation: is 2.7; values are pure numbers: did you mean 2.7 % (0.027)?",
        ]
    );
    let velocities = vec![3.8, 3.9, 4.0];
    assert_eq!(
        refusal(|m| m.data = Some(v1::Data { velocities, ..v1::Data::default() })),
        ["data.velocities: their median is 3.9; values are in m/s: did you mean 3.9 km/s (3.9e3)?"]
    );
    assert_eq!(
        refusal(|m| modulus(m, 20.0, 12.0, 25.0)),
        [
            "parameters.longitudinal_young_modulus.free.start: is 20.0; values are in Pa: did you mean 20 GPa \
             (20e9)?",
            "parameters.longitudinal_young_modulus.free: are 12.0 and 25.0; values are in Pa: did you \
             mean 12 and 25 GPa (12e9 and 25e9)?",
        ]
    );
    let bone = Some(v1::BoneLayer { thickness: Some(4.0), ..v1::BoneLayer::default() });
    assert_eq!(
        refusal(|m| m.layers = Some(v1::Layers { bone, ..v1::Layers::default() })),
        ["layers.bone.thickness: is 4.0; values are in m: did you mean 4 mm (4e-3)?"]
    );
    let center_frequency = Some(1.0);
    assert_eq!(
        refusal(|m| m.probe = Some(v1::Probe { center_frequency, ..v1::Probe::default() })),
        ["probe.center_frequency: is 1.0; values are in Hz: did you mean 1 MHz (1e6)?"]
    );
}

#[test]
fn data_out_of_reach_are_refused() {
    assert_eq!(
        refusal(|m| moments(m, 1100.0, 0.027)),
        [
            "data.mean: is 1100.0; the bounds of [parameters] allow mean velocities of about 2400 m/s and \
          more: check the units of data and parameters, or widen the bounds"
        ]
    );
    assert_eq!(
        refusal(|m| moments(m, 3906.0, 0.6)),
        [
            "data.coefficient_of_variation: is 0.6; the bounds of parameters.dispersion allow coefficients \
          of variation of about 0.0053 to 0.092: check the data, or widen the bounds"
        ]
    );
    let mut reachable = message();
    moments(&mut reachable, 3900.0, 0.12);
    assert!(from_message(&reachable).is_ok(), "the nearest point is a result, too");
}

#[test]
fn all_faults_are_reported_at_once() {
    let fields = faults(|m| {
        m.search.as_mut().unwrap().method = 17;
        m.monte_carlo.as_mut().unwrap().sampling = -1;
        m.objective.as_mut().unwrap().kind = 17;
        m.data.as_mut().unwrap().mean = None;
    });
    for field in ["search.method", "monte_carlo.sampling", "objective.kind", "data.mean"] {
        assert!(fields.iter().any(|found| found == field), "{field} in {fields:?}");
    }
    assert_eq!(fields.len(), 4);
}

#[test]
fn a_message_names_the_fields_that_it_has() {
    let refusal = |change: fn(&mut v1::JobSpecification)| {
        let mut message = message();
        change(&mut message);
        from_message(&message).unwrap_err().to_string()
    };
    assert_eq!(
        refusal(|m| m.parameters.as_mut().unwrap().density = None),
        "parameters.density: is missing; give `fixed`, or `free` with `start`, `lower` and `upper`"
    );
    let density = |m: &mut v1::JobSpecification, start, lower, upper| {
        let free = v1::parameter_range::Range::Free(v1::FreeRange { start, lower, upper });
        let range = v1::ParameterRange { range: Some(free) };
        m.parameters.as_mut().unwrap().density = Some(range);
    };
    let fault = faults(|m| density(m, 1.0, 1500.0, 2000.0));
    assert_eq!(fault, ["parameters.density.free.start"]);
    let fault = faults(|m| density(m, 1700.0, 2000.0, 1500.0));
    assert_eq!(fault, ["parameters.density.free"]);
    let unknown = refusal(|m| {
        let prior = v1::Prior { parameter: 0, value: 1.0, weight: 1.0 };
        m.search.as_mut().unwrap().priors.push(prior);
    });
    assert!(unknown.starts_with("search.priors: `parameter` is 0"), "{unknown}");
    assert!(unknown.contains("PARAMETER_DENSITY or "), "{unknown}");
}

/// Returns the minimal specification, read from a job file and from a message, with these methods.
fn minimal(kind: JobKind, search: SearchMethod, solver: Method) -> [JobSpecification; 2] {
    let free = |parameter| kind == JobKind::Identification && parameter == Parameter::Dispersion;
    let mut text = String::new();
    let mut message =
        v1::JobSpecification { kind: JOB_KIND.number(kind), ..v1::JobSpecification::default() };
    // The default method is left out.
    if search != SearchMethod::default() {
        text.push_str(&format!("[search]\nmethod = \"{}\"\n", search.name()));
        let mut search_message = v1::Search::default();
        search_message.set_method(match search {
            SearchMethod::Simplex => v1::SearchMethod::Simplex,
            SearchMethod::Newton => v1::SearchMethod::Newton,
            SearchMethod::Posterior => v1::SearchMethod::Posterior,
        });
        message.search = Some(search_message);
    }
    if solver != Method::default() {
        text.push_str(&format!("[solver]\nmethod = \"{}\"\n", solver.name()));
        let mut solver_message = v1::SolverSettings::default();
        solver_message.set_method(match solver {
            Method::Exact => v1::SolverMethod::Exact,
            Method::Hybrid => v1::SolverMethod::Hybrid,
        });
        message.solver = Some(solver_message);
    }
    if kind == JobKind::Identification {
        text.push_str("[data]\nmean = 3906.0\ncoefficient_of_variation = 0.027\ncount = 9\n");
        let (mean, coefficient_of_variation) = (Some(3906.0), Some(0.027));
        let count = Some(9);
        message.data =
            Some(v1::Data { mean, coefficient_of_variation, count, ..v1::Data::default() });
    }
    text.push_str("[parameters]\n");
    let ranges = Range::of_bone(Parameter::OF_BONE.map(|parameter| {
        let (name, (start, lower, upper)) = (parameter.name(), RANGES[parameter as usize]);
        if free(parameter) {
            text.push_str(&format!(
                "{name} = {{ start = {start:?}, bounds = [{lower:?}, {upper:?}] }}\n"
            ));
            Range::Free { start, lower, upper }
        } else {
            text.push_str(&format!("{name} = {{ fixed = {start:?} }}\n"));
            Range::Fixed(start)
        }
    }));
    message.parameters = Some(parameters_to_message(&ranges));
    let of_file = job_file::parse(&text, Format::Toml, Path::new(""), kind).unwrap();
    [of_file, from_message(&message).unwrap()]
}

/// Compares whole specifications, so that no key is forgotten, including keys added later.
#[test]
fn what_is_left_out_of_a_message_is_what_is_left_out_of_a_file() {
    for kind in [JobKind::Identification, JobKind::Propagation] {
        for search in SearchMethod::ALL {
            for solver in Method::ALL {
                let [of_file, of_message] = minimal(kind, search, solver);
                assert_eq!(of_message, of_file);
                assert_eq!((of_file.search.method, of_file.setup.solver.method), (search, solver));
            }
        }
    }
}
