use osteon_common::document::Format as FileFormat;
use osteon_common::job::{Objective, Search, SearchMethod};
use osteon_common::job_file;
use osteon_common::outcome::FailureKind;
use osteon_common::settings::Method;
use osteon_proto::v1::{JobKind as KindMessage, JobState, JobStatus};
use osteon_solver::{Looks, Sampled};
use osteon_study::Difference;
use osteon_study::check::Solution;

use super::*;

fn printed(format: Format, print: impl FnOnce(&mut dyn Output)) -> String {
    let mut bytes = Vec::new();
    print(on(format, Box::new(&mut bytes)).as_mut());
    String::from_utf8(bytes).unwrap()
}

fn specification(kind: JobKind, free: &[&str]) -> JobSpecification {
    let parameters = [
        ("density", "start = 1700.0", "bounds = [1500.0, 2000.0]", "fixed = 1598.8"),
        ("longitudinal_young_modulus", "start = 18e9", "bounds = [12e9, 25e9]", "fixed = 17.717e9"),
        ("longitudinal_poisson_ratio", "start = 0.35", "bounds = [0.2, 0.45]", "fixed = 0.3816"),
        ("longitudinal_shear_modulus", "start = 4e9", "bounds = [3e9, 6.5e9]", "fixed = 4.795e9"),
        ("transverse_young_modulus", "start = 10e9", "bounds = [8e9, 16e9]", "fixed = 9.8254e9"),
        ("transverse_poisson_ratio", "start = 0.4", "bounds = [0.2, 0.5]", "fixed = 0.4495"),
        ("dispersion", "start = 0.1", "bounds = [0.02, 0.3]", "fixed = 0.1029"),
    ];
    let mut text = "[data]\nmean = 3905.91\ncoefficient_of_variation = 0.02711\n".to_owned();
    for (name, start, bounds, fixed) in parameters {
        text.push_str(&format!("[parameters.{name}]\n"));
        if free.contains(&name) {
            text.push_str(&format!("{start}\n{bounds}\n"));
        } else {
            text.push_str(&format!("{fixed}\n"));
        }
    }
    job_file::parse(&text, FileFormat::Toml, Path::new(""), kind).unwrap()
}

const RESULT: &str = r#"{
  "status": "converged",
  "digest": "00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff",
  "cost": 3.21e-11,
  "parameters": {
    "density": 1598.8,
    "longitudinal_young_modulus": 17717000000.0,
    "longitudinal_poisson_ratio": 0.3816,
    "longitudinal_shear_modulus": 4795000000.0,
    "transverse_young_modulus": 9825400000.0,
    "transverse_poisson_ratio": 0.4495
  },
  "dispersion": 0.1029,
  "velocity": {
    "mean": 3905.9104,
    "coefficient_of_variation": 0.02711004,
    "standard_error": {"mean": 2.0203, "coefficient_of_variation": 0.000366}
  },
  "data": {"mean": 3905.91, "coefficient_of_variation": 0.02711},
  "evaluations": 181,
  "realizations": 2747,
  "failures": {"no_arrival": 2, "not_finite": 1}
}
"#;

fn shown(kind: JobKind, free: &[&str], json: &str) -> String {
    let specification = specification(kind, free);
    let directory = Some(Path::new("results"));
    let result = ShownResult { kind, specification: &specification, json, directory };
    printed(Format::Text, |output| output.result(&result).unwrap())
}

#[test]
fn a_search_says_what_the_data_determine() {
    let free = [
        "density",
        "longitudinal_young_modulus",
        "longitudinal_poisson_ratio",
        "longitudinal_shear_modulus",
        "transverse_young_modulus",
        "transverse_poisson_ratio",
        "dispersion",
    ];
    insta::assert_snapshot!(shown(JobKind::Identification, &free, RESULT));
}

#[test]
fn two_searched_parameters_are_determined() {
    let free = ["longitudinal_young_modulus", "dispersion"];
    insta::assert_snapshot!(shown(JobKind::Identification, &free, RESULT));
}

/// `newton` alone says what the other values are, and only where it has matched the data.
#[test]
fn a_search_for_the_nearest_point_says_so() {
    let free = ["longitudinal_young_modulus", "transverse_young_modulus", "dispersion"];
    let mut specification = specification(JobKind::Identification, &free);
    specification.search = Search { cost_tolerance: 1e-10, ..Search::by(SearchMethod::Newton) };
    let shown = |json: &str| {
        let kind = JobKind::Identification;
        let result = ShownResult { kind, specification: &specification, json, directory: None };
        printed(Format::Text, |output| output.result(&result).unwrap())
    };
    let nearest = "of the points that match the data, this is the one nearest to the start";
    assert!(shown(RESULT).contains(nearest), "{}", shown(RESULT));
    let settled = RESULT
        .replace("3.21e-11", "3.21e-3")
        .replace("\"status\": \"converged\"", "\"status\": \"converged\", \"reason\": \"settled\"");
    let text = shown(&settled);
    assert!(text.starts_with("Converged: settled\n"), "{text}");
    assert!(!text.contains(nearest) && text.contains("one of many sets"), "{text}");
}

/// What measured velocities say, and what failures may have done.
#[test]
fn a_likelihood_is_shown_with_its_error_and_what_the_data_say() {
    let free = ["longitudinal_young_modulus", "transverse_young_modulus", "dispersion"];
    let mut specification = specification(JobKind::Identification, &free);
    specification.objective = Objective::Likelihood;
    let json = RESULT
        .replace(
            "\"cost\": 3.21e-11",
            r#""objective": "likelihood", "cost": 6.071647, "cost_standard_error": 0.00234"#,
        )
        .replace(
            r#""coefficient_of_variation": 0.000366}"#,
            r#""coefficient_of_variation": 0.000366},
               "failure_bias": {"mean": -1.234, "coefficient_of_variation": 0.000321}"#,
        )
        .replace(
            r#""coefficient_of_variation": 0.02711}"#,
            r#""coefficient_of_variation": 0.02711,
               "interval": {"mean": [3895.21, 3916.64], "coefficient_of_variation": [0.02512, 0.02934],
                            "level": 0.95},
               "kolmogorov": {"distance": 0.0412, "p_value": 0.6543}}"#,
        );
    let kind = JobKind::Identification;
    let result = ShownResult { kind, specification: &specification, json: &json, directory: None };
    insta::assert_snapshot!(printed(Format::Text, |output| output.result(&result).unwrap()));
}

#[test]
fn a_failed_search_says_why() {
    let failed = r#"{"status": "failed", "reason": "no point was feasible", "digest": "00",
        "cost": null, "parameters": {"density": null}, "dispersion": null,
        "evaluations": 30, "realizations": 2747, "failures": {}}"#;
    insta::assert_snapshot!(shown(JobKind::Identification, &["dispersion"], failed));
}

#[test]
fn what_is_said_about_a_search_depends_on_how_it_ended() {
    let all = ["longitudinal_young_modulus", "transverse_young_modulus", "dispersion"];
    let check = |changes: &[(&str, &str)], expected: &[&str], absent: &[&str]| {
        let json = changes.iter().fold(RESULT.to_owned(), |json, (old, new)| {
            assert!(json.contains(old), "{old}");
            json.replace(old, new)
        });
        let text = shown(JobKind::Identification, &all, &json);
        expected.iter().for_each(|part| assert!(text.contains(part), "no `{part}` in\n{text}"));
        absent.iter().for_each(|part| assert!(!text.contains(part), "`{part}` in\n{text}"));
    };
    let status = |to: &'static str| ("\"status\": \"converged\"", to);
    check(&[], &["Converged\n", "data determine only"], &[]);
    let failed = status("\"status\": \"failed\", \"reason\": \"too dark\"");
    let no_cost = ("3.21e-11", "null");
    let point = ["data determine", "best point", "GPa", "mean velocity"];
    check(&[failed, no_cost], &["Failed: too dark\n", "no point was feasible"], &point);
    check(&[failed], &["Failed: too dark\n", "best point"], &["data determine"]);
    let used_up = "Not converged: the evaluations are used up\n";
    check(&[status("\"status\": \"max_evaluations\"")], &[used_up], &[]);
    let early = status("\"status\": \"max_evaluations\", \"reason\": \"it collapsed\"");
    check(&[early], &["Not converged: it collapsed\n"], &["used up"]);
}

#[test]
fn a_failed_propagation_says_why_whenever_it_is_shown() {
    let failed = RESULT.replace("\"no_arrival\": 2", "\"no_arrival\": 1200");
    let text = shown(JobKind::Propagation, &[], &failed);
    let expected = "Failed: 1201 of 2747 realizations failed; max_failed_fraction is 0.01\n";
    assert!(text.starts_with(expected), "{text}");
}

#[test]
fn a_control_variate_that_was_not_used_is_told() {
    let check = |asked: &str, used: &str, told: bool| {
        let json = RESULT
            .replace("\"seed\"", "\"_\"")
            .replace(
                "\"evaluations\"",
                &format!("\"control_variate\": {asked},\n  \"evaluations\""),
            )
            .replace(
                "\"mean\": 3905.9104",
                &format!("\"controlled\": {used}, \"mean\": 3905.9104"),
            );
        for kind in [JobKind::Identification, JobKind::Propagation] {
            let text = shown(kind, &["dispersion"], &json);
            assert_eq!(text.contains("moments without the control variate"), told, "{text}");
        }
    };
    check("true", "false", true);
    check("true", "true", false);
    check("false", "false", false);
}

#[test]
fn a_propagation_shows_moments() {
    insta::assert_snapshot!(shown(JobKind::Propagation, &[], RESULT));
}

#[test]
fn json_is_what_stands_in_the_file() {
    let specification = specification(JobKind::Identification, &["dispersion"]);
    let result = ShownResult {
        kind: JobKind::Identification,
        specification: &specification,
        json: RESULT,
        directory: None,
    };
    assert_eq!(printed(Format::Json, |output| output.result(&result).unwrap()), RESULT);
}

fn arrival() -> Arrival {
    Arrival {
        velocity: 3908.75,
        times: vec![2.9e-6, 3.104_7e-6, 3.309_3e-6],
        estimated_error: 2e-5,
        looks: None,
    }
}

/// Three receivers. The exact method's sampling changes with every improvement; the hybrid
/// method's discretisation is the user's.
fn setup(method: Method) -> Setup {
    let mut setup = Setup::default();
    setup.probe.receivers.count = 3;
    setup.solver.method = method;
    setup
}

fn simulation(format: Format, arrival: &Result<Arrival, Failure>, check: Option<&Check>) -> String {
    let setup = setup(Method::Hybrid);
    let shown =
        ShownSimulation { setup: &setup, arrival, traces: Some(Path::new("d/traces.csv")), check };
    printed(format, |output| output.simulation(&shown).unwrap())
}

#[test]
fn a_simulation_shows_times_and_velocity() {
    insta::assert_snapshot!(simulation(Format::Text, &Ok(arrival()), None));
    insta::assert_snapshot!(simulation(Format::Json, &Ok(arrival()), None));
}

#[test]
fn a_simulation_without_velocity_says_why() {
    let failure = || Failure {
        kind: FailureKind::NoArrival,
        detail: "receiver 3 has no extremum".to_owned(),
    };
    insta::assert_snapshot!(simulation(Format::Text, &Err(failure()), None));
    insta::assert_snapshot!(simulation(Format::Json, &Err(failure()), None));
}

#[test]
fn the_sampling_that_decided_is_shown() {
    let last = Sampled { band: 12.5e6, period: 1.1e-5, pairs: 9000 };
    let looks = Some(Looks { count: 3, pairs_computed: 17_000, last });
    let arrival = Ok(Arrival { looks, ..arrival() });
    let setup = setup(Method::Exact);
    let shown = ShownSimulation { setup: &setup, arrival: &arrival, traces: None, check: None };
    let text = |format| printed(format, |output| output.simulation(&shown).unwrap());
    let line = "solver exact: refinement 1, band to 12.5 MHz, period 11 µs; estimated";
    assert!(text(Format::Text).contains(line), "{}", text(Format::Text));
    let value: serde_json::Value = serde_json::from_str(&text(Format::Json)).unwrap();
    let expected = [("pairs", 9000), ("pairs_computed", 17_000), ("looks", 3)];
    for (key, number) in expected {
        assert_eq!(value["solver"][key], number, "{value:#}");
    }
}

/// A check in which the hybrid method differs as given.
fn checked(hybrid: Difference) -> Check {
    let solution = |method, velocity, difference| Solution {
        setup: setup(method),
        arrival: Ok(Arrival { velocity, ..arrival() }),
        difference,
    };
    let numbers = |velocity, time| Difference::Numbers { velocity, time };
    let mut refined = setup(Method::Exact);
    refined.solver.refinement = 5.0;
    Check {
        exact: solution(Method::Exact, 3908.85, numbers(2.5e-5, 1.2e-10)),
        hybrid: solution(Method::Hybrid, 3908.9, hybrid),
        refined: Solution { setup: refined, ..solution(Method::Exact, 3908.75, numbers(0.0, 0.0)) },
    }
}

#[test]
fn a_check_shows_every_solution_and_whether_it_passed() {
    let text = |check: &Check| simulation(Format::Text, &Ok(arrival()), Some(check));
    let same = checked(Difference::Numbers { velocity: 3.8e-5, time: 4e-10 });
    insta::assert_snapshot!(text(&same));
    assert!(text(&checked(Difference::Picks)).contains("THE PICKS DIFFER\n"));
    let mut off = same.clone();
    off.exact.difference = Difference::Numbers { velocity: 1.1e-4, time: 1e-9 };
    assert!(text(&off).contains("OFF by more than 1e-4: EXACT\n"), "{}", text(&off));
    off.hybrid.difference = Difference::Numbers { velocity: 2.7e-4, time: 1e-9 };
    assert!(text(&off).contains("OFF by more than 1e-4: EXACT AND HYBRID\n"), "{}", text(&off));
    let json = simulation(Format::Json, &Ok(arrival()), Some(&same));
    let check = &serde_json::from_str::<serde_json::Value>(&json).unwrap()["check"];
    assert_eq!(check.as_array().unwrap().len(), 3);
    assert_eq!(check[0]["velocity"], 3908.85);
    assert_eq!(check[1]["method"], "hybrid");
    assert_eq!(check[1]["relative_difference"], 3.8e-5);
    assert_eq!(check[1]["time_difference"], 4e-10);
    assert_eq!(check[2]["estimated_error"], 2e-5);
    assert_eq!(check[2]["same_pick"], true);
}

fn jobs() -> Vec<JobSnapshot> {
    let running = JobSnapshot {
        job: "1".to_owned(),
        kind: KindMessage::Identification.into(),
        state: JobState::Running.into(),
        evaluations: 41,
        max_evaluations: 400,
        realizations_done: 1747,
        realizations: 2747,
        best_cost: Some(1.25e-5),
        realizations_per_second: 1000.0,
        workers: 2,
        elapsed_s: 112.7,
        ..JobSnapshot::default()
    };
    let ended = JobSnapshot {
        job: "22".to_owned(),
        kind: KindMessage::Propagation.into(),
        state: JobState::Ended.into(),
        status: JobStatus::Failed.into(),
        reason: "3 of 100 realizations failed".to_owned(),
        realizations_done: 100,
        realizations: 100,
        best_cost: Some(f64::INFINITY),
        elapsed_s: 0.4,
        ..JobSnapshot::default()
    };
    vec![running, ended]
}

#[test]
fn jobs_are_a_table_or_a_list() {
    insta::assert_snapshot!(printed(Format::Text, |output| output.jobs(&jobs(), &[]).unwrap()));
    insta::assert_snapshot!(printed(Format::Json, |output| output.jobs(&jobs(), &[]).unwrap()));
    assert_eq!(printed(Format::Text, |output| output.jobs(&[], &[]).unwrap()), "no jobs\n");
    let none = printed(Format::Json, |output| output.jobs(&[], &[]).unwrap());
    assert_eq!(none, "{\n  \"jobs\": [],\n  \"expelled\": []\n}\n");
}

#[test]
fn a_snapshot_is_one_line() {
    let lines = printed(Format::Text, |output| {
        for job in jobs() {
            output.snapshot(&job).unwrap();
        }
    });
    insta::assert_snapshot!(lines);
    let [_, ended]: [JobSnapshot; 2] = jobs().try_into().unwrap();
    let cancelled = JobSnapshot {
        status: JobStatus::Cancelled.into(),
        reason: String::new(),
        best_cost: None,
        ..ended
    };
    let line = printed(Format::Text, |output| output.snapshot(&cancelled).unwrap());
    assert_eq!(line, "  0.4 s  cancelled\n");
}

#[test]
fn an_id_is_printed_alone() {
    assert_eq!(printed(Format::Text, |output| output.submitted("7").unwrap()), "7\n");
    let json = printed(Format::Json, |output| output.submitted("7").unwrap());
    assert_eq!(json, "{\n  \"job\": \"7\"\n}\n");
}

#[test]
fn expelled_workers_are_shown_and_forgotten_jobs_listed() {
    let expelled = osteon_proto::v1::ExpelledWorker {
        host: "node3".to_owned(),
        process: 42,
        job: "7".to_owned(),
        reason: "answered realization 5 of job 7 wrongly".to_owned(),
        elapsed_s: 90.0,
    };
    let expelled = [expelled];
    let shown = printed(Format::Text, |output| output.jobs(&[], &expelled).unwrap());
    let line = "node3 (process 42) answered realization 5 of job 7 wrongly\n";
    assert!(shown.starts_with("no jobs\nexpelled ") && shown.ends_with(line), "{shown}");
    let listed = printed(Format::Json, |output| output.jobs(&[], &expelled).unwrap());
    let listed: serde_json::Value = serde_json::from_str(&listed).unwrap();
    assert_eq!(listed["expelled"][0]["host"], "node3");
    assert_eq!(listed["expelled"][0]["job"], "7");
    let pruned = ["3".to_owned(), "5".to_owned()];
    assert_eq!(printed(Format::Text, |output| output.pruned(&pruned).unwrap()), "3\n5\n");
    let json = printed(Format::Json, |output| output.pruned(&pruned).unwrap());
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(value, serde_json::json!({ "pruned": ["3", "5"] }));
}
