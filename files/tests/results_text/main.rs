//! The text of results: exact keys, columns and digits.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

mod groups;
mod posterior;

use std::path::Path;

use osteon_common::case::Setup;
use osteon_common::inference::{
    Conclusions, DerivedQuantity, Inference, NoiseErrors, Uncertainty, meaning,
};
use osteon_common::job::{
    Data, Group, JobKind, JobSpecification, Objective, Range, Sampling, Search, SearchMethod,
};
use osteon_common::moments::KolmogorovTest;
use osteon_common::outcome::{FailureCounts, FailureKind, Outcome};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::results::{
    BestPoint, DataSummary, Estimate, EstimatedError, Evaluation, EvaluationRole, GroupResult,
    JobFailure, JobResult, Moments, Status,
};
use osteon_common::sampling::NominalSampling;
use osteon_common::settings::{Extremum, Method, Picking, SolverSettings};
use osteon_common::version::Program;
use osteon_files::document::Format;
use osteon_files::report::{Group as ResultGroup, MeanModel, ReadError, ResultFile, Solver};
use osteon_files::{job_file, results_csv};

const POINT: Point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);

fn moments(mean: f64, coefficient_of_variation: f64) -> Moments {
    Moments { mean, coefficient_of_variation }
}

fn outcomes() -> Vec<Outcome> {
    vec![Ok(3908.25), Err(FailureKind::DirectWaveFirst), Ok(1e4 / 3.0), Err(FailureKind::NoArrival)]
}

fn result() -> JobResult {
    JobResult {
        status: Status::Converged,
        failure: None,
        reason: None,
        digest: "0123abcd".to_owned(),
        best: Some(BestPoint {
            observables: osteon_common::observables::PerObservable::default(),
            point: POINT,
            meaning: None,
            cost: Some(4.5e-11),
            cost_error: None,
            penalty: None,
            below_noise_from: None,
            velocity: Some(Estimate {
                moments: moments(3906.27, 0.027083),
                standard_error: moments(2.0, 3.6e-4),
                controlled: true,
            }),
            failure_bias: Some(moments(-12.5, 2.5e-4)),
            kolmogorov: Some(KolmogorovTest { distance: 0.25, p_value: 0.75 }),
            form: None,
            failures: FailureCounts::from_outcomes(&outcomes()),
            estimated_error: Some(EstimatedError { median: 2.5e-5, largest: 1e-4 / 3.0 }),
            outcomes: outcomes(),
        }),
        data: Some(DataSummary {
            observables: osteon_common::observables::PerObservable::default(),
            moments: moments(3906.3, 0.02709),
            count: None,
            intervals: None,
            outliers: Vec::new(),
            rounding: None,
            order: None,
            outlier_count: 0,
        }),
        conclusions: Conclusions::default(),
        groups: Vec::new(),
        pooled: false,
        objective: Objective::Moments,
        search: Search::default(),
        evaluations: 123,
        realizations: 4,
        seed: 9_223_372_036_854_775_807,
        sampling: Sampling::Sobol,
        scrambles: 2,
        control_variate: true,
        solver: SolverSettings::default(),
        integrity: None,
        nominal: NominalSampling::from_setup(&Setup::default()),
        picking: Picking::default(),
        program: Program {
            version: "0.1.0".to_owned(),
            numerics: 4,
            commit: Some("c0ffee".to_owned()),
        },
    }
}

fn identification_text(result: &JobResult) -> String {
    ResultFile::from_job(JobKind::Identification, result).to_json()
}

fn groups_of(result: &JobResult) -> Vec<ResultGroup> {
    ResultFile::from_job(JobKind::Identification, result).groups().to_vec()
}

fn propagation_text(result: &JobResult) -> String {
    ResultFile::from_job(JobKind::Propagation, result).to_json()
}

/// With every default.
fn specification() -> JobSpecification {
    let fixed = Parameter::OF_BONE
        .map(|name| format!("{} = {{ fixed = {:?} }}", name.name(), POINT.get(name)));
    let fixed =
        fixed.join("\n").replace("{ fixed = 0.1029 }", "{ start = 0.1, bounds = [0.02, 0.3] }");
    let text = format!(
        "[data]\nmean = 3906.3\ncoefficient_of_variation = 0.02709\n[parameters]\n{fixed}\n"
    );
    job_file::parse(&text, Format::Toml, Path::new(""), JobKind::Identification).unwrap()
}

/// Neither a point nor anything finite, and a reason.
fn failed() -> JobResult {
    JobResult {
        status: Status::Failed,
        failure: Some(JobFailure::NoFeasiblePoint),
        reason: Some("no feasible point".to_owned()),
        best: None,
        ..result()
    }
}

/// The text of an identification by this specification, with these numbers of its result.
fn identified_by(specification: &JobSpecification, result: &JobResult) -> String {
    let best = result.best.clone().map(|best| {
        let cost = best.cost.unwrap();
        let penalty = specification.has_priors().then(|| specification.penalty(&best.point));
        BestPoint { meaning: Some(meaning(specification, cost)), penalty, ..best }
    });
    let moments = result.data.as_ref().unwrap().moments;
    identification_text(&JobResult {
        data: Some(DataSummary {
            moments,
            ..DataSummary::from_data(specification.data.as_ref().unwrap(), 0)
        }),
        conclusions: Conclusions::new(specification, 0, best.as_ref(), &[]),
        objective: specification.objective,
        search: specification.search,
        best,
        ..result.clone()
    })
}

fn identified(result: &JobResult) -> String {
    identified_by(&specification(), result)
}

fn check(name: &str, text: &str) {
    assert!(text.ends_with("}\n"));
    assert_eq!(ResultFile::from_json(text).unwrap().to_json(), text, "{name}");
    // The sampling's numbers are tested where they are chosen.
    let text = (["band", "period", "pairs"]).iter().fold(text.to_owned(), |text, key| {
        let lines = text.lines().map(|line| match line.split_once(&format!("\"{key}\": ")) {
            Some((indent, _)) => format!("{indent}\"{key}\": (a number),\n"),
            None => format!("{line}\n"),
        });
        lines.collect()
    });
    insta::with_settings!({
        snapshot_path => "../snapshots",
        prepend_module_to_snapshot => false,
        omit_expression => true,
    }, {
        insta::assert_snapshot!(name, text);
    });
}

#[test]
fn identification() {
    check("result_identification", &identified(&result()));
    check("result_identification_failed", &identified(&failed()));
}

#[test]
fn the_result_says_how_it_was_searched_and_what_its_point_is() {
    let check = |method: SearchMethod, cost: f64, expected: &str| {
        let mut result = result();
        result.best.as_mut().unwrap().cost = Some(cost);
        let search = Search { cost_tolerance: 1e-11, ..Search::by(method) };
        let specification = JobSpecification { search, ..specification() };
        let text = identified_by(&specification, &result);
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["search"]["method"], method.name());
        assert_eq!(value["search"]["cost_tolerance"], 1e-11);
        assert_eq!(value["search"]["initial_step"].is_number(), method == SearchMethod::Simplex);
        let point = value["search"]["point"].as_str().unwrap();
        assert!(point.contains(expected), "{point}");
    };
    check(SearchMethod::Newton, 1e-11, "that match the data, the one nearest to the start");
    check(SearchMethod::Newton, 2e-11, "the one with the least cost");
    check(SearchMethod::Simplex, 1e-12, "that match the data, the one where the simplex ended");
    check(SearchMethod::Simplex, 2e-11, "the one with the least cost");
    check(SearchMethod::Posterior, 1e-12, "the one with the least cost");
}

#[test]
fn a_likelihood_has_an_error_and_no_tolerance() {
    let mut result = result();
    let best = result.best.as_mut().unwrap();
    (best.cost, best.cost_error) = (Some(6.0625), Some(0.0025));
    let job = JobSpecification {
        objective: Objective::Likelihood,
        data: Some(Data::from_velocities(vec![3900.0, 3950.0, 3925.5, 3910.0, 3940.0])),
        ..specification()
    };
    check("result_likelihood", &identified_by(&job, &result));
    // Moments of measured velocities are searched with their tolerance, and the velocities are tested too.
    let job = JobSpecification { objective: Objective::Moments, ..job };
    let text = identified_by(&job, &result);
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(value.get("cost_standard_error").is_none());
    assert_eq!(value["search"]["cost_tolerance"], 1e-10);
    assert_eq!(value["data"]["kolmogorov"]["p_value"], 0.75);
    assert_eq!(value["data"]["interval"]["level"], 0.95);
}

#[test]
fn propagation() {
    check("result_propagation", &propagation_text(&result()));
    check("result_propagation_failed", &propagation_text(&failed()));
}

#[test]
fn the_solver_states_its_method_and_sampling() {
    let keys = |setup: &Setup| -> Vec<String> {
        let nominal = NominalSampling::from_setup(setup);
        let solver = Solver::new(&setup.solver, nominal, Some(2e-5));
        let solver = serde_json::to_value(solver).unwrap();
        let numbers = ["refinement", "band", "period", "pairs", "element_size", "estimated_error"];
        for key in numbers.iter().filter(|key| solver.get(key).is_some()) {
            assert!(solver[key].as_f64().unwrap() > 0.0, "{key}: {solver}");
        }
        solver.as_object().unwrap().keys().cloned().collect()
    };
    let mut setup = Setup::default();
    let of_exact = ["method", "refinement", "band", "period", "pairs", "estimated_error"];
    assert_eq!(keys(&setup), of_exact);
    setup.solver.method = Method::Hybrid;
    let of_hybrid =
        ["method", "refinement", "element_size", "element_order", "time_step", "estimated_error"];
    assert_eq!(keys(&setup), of_hybrid);
}

#[test]
fn what_is_not_finite_is_null() {
    let mut result = result();
    let best = result.best.as_mut().unwrap();
    best.cost = Some(f64::INFINITY);
    best.velocity = Some(Estimate {
        moments: moments(f64::NAN, f64::NEG_INFINITY),
        standard_error: moments(f64::NAN, f64::NAN),
        controlled: false,
    });
    let value: serde_json::Value = serde_json::from_str(&identified(&result)).unwrap();
    assert!(value["cost"].is_null());
    assert!(value["velocity"]["mean"].is_null());
    assert!(value["velocity"]["coefficient_of_variation"].is_null());
    assert!(value["velocity"]["standard_error"]["mean"].is_null());
}

#[test]
fn the_best_point_is_read_back_to_the_bit() {
    let mut result = result();
    let odd =
        Point::of_bone([1.0 / 3.0, 1e10 / 7.0, -0.1, f64::MIN_POSITIVE, 1e300 / 3.0, 5e-324, 0.1]);
    for point in [POINT, odd] {
        result.best.as_mut().unwrap().point = point;
        let read = best_point(&identified(&result)).unwrap();
        assert_eq!(read.0.map(f64::to_bits), point.0.map(f64::to_bits));
        let read = best_point(&propagation_text(&result)).unwrap();
        assert_eq!(read.0.map(f64::to_bits), point.0.map(f64::to_bits));
    }
}

/// The best point in the text of a result; `None` where there is none.
fn best_point(text: &str) -> Option<Point> {
    ResultFile::from_json(text).unwrap().best_point(None).ok()
}

#[test]
fn a_result_without_a_point_gives_none() {
    assert_eq!(best_point(&identified(&failed())), None);
    assert_eq!(best_point(&propagation_text(&failed())), None);
    let text = identified(&result());
    assert_eq!(best_point(&text.replace("\"dispersion\": 0.1029", "\"dispersion\": null")), None);
}

#[test]
fn what_is_no_result_is_refused_with_the_key_and_the_line() {
    let check = |text: &str, expected: &str| {
        let message = ResultFile::from_json(text).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    };
    check("", "not valid JSON: EOF");
    check("{\"schema\": 1, \"kind\"", "not valid JSON: EOF");
    check("[]", "the object: invalid length 0, expected an object with `schema` and `kind`");
    check("{}", "the object: missing field `schema`");
    check("{\"schema\": 1, \"kind\": \"simulation\"}", "`kind` is \"simulation\"; it must be");
    let text = identified(&result());
    let changed = |old: &str, new: &str| {
        assert!(text.contains(old), "{old}");
        text.replace(old, new)
    };
    let of_density = "`parameters.density`: invalid type: string \"a\", expected f64 at line 9";
    check(&changed("1598.8", "\"a\""), of_density);
    check(&changed("\"converged\"", "\"merged\""), "`status`: unknown variant `merged`, expected");
    check(&changed("\"direct_wave_first\"", "\"late\""), "`failures`: unknown variant `late`");
    check(&changed("\"seed\"", "\"seeds\""), "missing field `seed`");
    check(&changed("3906.27", "[]"), "`velocity`: invalid type");
    let long = "x".repeat(100_000);
    let message = ResultFile::from_json(&changed("converged", &long)).unwrap_err().to_string();
    assert!(message.len() < 1000 && message.contains("at line 4"), "{message}");
}

/// Keys of a later program are no reason to refuse a file, another meaning of keys is.
#[test]
fn other_keys_are_tolerated_and_other_schemas_are_refused() {
    let text = identified(&result());
    let more = text.replace("\"status\"", "\"later\": {\"a\": [1]},\n  \"status\"");
    assert_eq!(ResultFile::from_json(&more).unwrap().to_json(), text);
    let more = text.replace("\"controlled\"", "\"later\": null,\n  \"controlled\"");
    assert_eq!(ResultFile::from_json(&more).unwrap().to_json(), text);
    let other = text.replace("\"schema\": 1", "\"schema\": 7");
    let refused = ResultFile::from_json(&other).unwrap_err();
    assert!(matches!(refused, ReadError::Schema { found: 7 }));
    let expected =
        "`schema` is 7, and this program reads 1; use the version of osteon that wrote it";
    assert_eq!(refused.to_string(), expected);
}

#[test]
fn names_in_files_are_those_of_messages() {
    fn check<T: Copy + serde::Serialize>(all: &[T], name: impl Fn(T) -> &'static str) {
        for &one in all {
            assert_eq!(serde_json::to_value(one).unwrap(), name(one));
        }
    }
    check(&Status::ALL, Status::name);
    check(&JobFailure::ALL, JobFailure::name);
    check(&Objective::ALL, Objective::name);
    check(&SearchMethod::ALL, SearchMethod::name);
    check(&Sampling::ALL, Sampling::name);
    check(&Method::ALL, Method::name);
    check(&Extremum::ALL, Extremum::name);
    check(&Parameter::ALL, Parameter::name);
    check(&FailureKind::ALL, FailureKind::name);
    let model = serde_json::to_value(MeanModel::from(&POINT)).unwrap();
    let names = Parameter::ALL[..6].iter().map(|parameter| parameter.name());
    assert!(model.as_object().unwrap().keys().eq(names));
}

#[test]
fn history() {
    let row = |number, moments, cost, failures| Evaluation {
        number,
        role: EvaluationRole::default(),
        point: POINT,
        moments,
        observables: osteon_common::observables::PerObservable::default(),
        cost,
        failures,
        estimated_error: None,
    };
    let none = FailureCounts::default();
    let varied = EvaluationRole { varied: Some(Parameter::Density), ..EvaluationRole::default() };
    let beside = Evaluation { role: varied, ..row(3, None, None, none) };
    let rows = [
        row(0, Some(moments(3906.5, 0.0271)), Some(1e-3), none),
        row(
            1,
            Some(moments(3906.5, 0.0271)),
            Some(f64::INFINITY),
            FailureCounts::from_outcomes(&outcomes()),
        ),
        row(2, None, None, none),
        beside,
    ];
    assert_eq!(
        results_csv::history(&specification(), &rows),
        "evaluation,density,longitudinal_young_modulus,longitudinal_poisson_ratio,\
         longitudinal_shear_modulus,transverse_young_modulus,transverse_poisson_ratio,dispersion,\
         mean,coefficient_of_variation,cost,failures\n\
         0,1598.8,17717000000.0,0.3816,4795000000.0,9825400000.0,0.4495,0.1029,3906.5,0.0271,0.001,0\n\
         1,1598.8,17717000000.0,0.3816,4795000000.0,9825400000.0,0.4495,0.1029,3906.5,0.0271,inf,2\n\
         2,1598.8,17717000000.0,0.3816,4795000000.0,9825400000.0,0.4495,0.1029,,,,0\n"
    );
}

#[test]
fn the_history_names_start_and_group() {
    let mut specification = specification();
    let group = |name: &str| Group::new(name, vec![3900.0, 3950.0]);
    specification.data = Some(Data::from_groups(vec![group("left"), group("right, \"distal\"")]));
    specification.search.starts = 2;
    let row = Evaluation {
        number: 7,
        role: EvaluationRole { group: 1, start: 1, ..EvaluationRole::default() },
        point: POINT,
        moments: None,
        observables: osteon_common::observables::PerObservable::default(),
        cost: Some(0.5),
        failures: FailureCounts::default(),
        estimated_error: None,
    };
    let text = results_csv::history(&specification, &[row]);
    let (header, rows) = text.split_once('\n').unwrap();
    assert!(header.ends_with(",cost,failures,start,group"), "{header}");
    assert!(rows.ends_with(",0.5,0,1,\"right, \"\"distal\"\"\"\n"), "{rows}");
}

#[test]
fn realizations() {
    assert_eq!(
        results_csv::realizations(&outcomes()),
        "index,velocity,failure\n0,3908.25,\n1,,direct_wave_first\n2,3333.3333333333335,\n3,,no_arrival\n"
    );
    assert_eq!(results_csv::realizations(&[]), "index,velocity,failure\n");
}
