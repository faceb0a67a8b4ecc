use osteon_common::case::Setup;
use osteon_common::job::{JobKind, Objective, Search, SearchMethod};
use osteon_common::outcome::FailureKind;
use osteon_common::parameters::Parameter;
use osteon_common::settings::Method;
use osteon_files::document::Format as FileFormat;
use osteon_files::job_file;
use osteon_proto::v1::{JobKind as KindMessage, JobState, JobStatus};
use osteon_solver::check::{Check, Difference, MethodSolution};
use osteon_solver::{Arrival, Failure, FirstSignal, GuidedWave, GuidedWaves, PassSummary, Sampled};

use super::*;
use crate::sample_result::{identification, propagation};

mod cost;
mod jobs;
mod observations;
mod posterior;
mod simulation;

fn printed(format: OutputFormat, print: impl FnOnce(&mut dyn Output)) -> String {
    let mut bytes = Vec::new();
    print(to_writer(format, Box::new(&mut bytes)).as_mut());
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
    let result = match kind {
        JobKind::Identification => identification(json),
        JobKind::Propagation => propagation(json),
    };
    let shown = ShownResult {
        specification: &specification,
        usual_shifts: &[],
        result: &result,
        directory,
        detail: Detail::Usual,
    };
    printed(OutputFormat::Text, |output| output.result(&shown).unwrap())
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

/// Only `newton` says what the other values mean, and only if it has matched the data.
#[test]
fn a_search_for_the_nearest_point_says_so() {
    let free = ["longitudinal_young_modulus", "transverse_young_modulus", "dispersion"];
    let mut specification = specification(JobKind::Identification, &free);
    specification.search = Search { cost_tolerance: 1e-10, ..Search::by(SearchMethod::Newton) };
    let shown = |json: &str| {
        let result = &identification(json);
        let shown = ShownResult {
            specification: &specification,
            usual_shifts: &[],
            result,
            directory: None,
            detail: Detail::Usual,
        };
        printed(OutputFormat::Text, |output| output.result(&shown).unwrap())
    };
    let nearest = "this is the one nearest to the start";
    let text = unwrapped(&shown(RESULT));
    assert!(text.contains(nearest), "{text}");
    // The fit is within the noise of its moments, but has not reached the tolerance.
    let settled = RESULT
        .replace("3.21e-11", "3.21e-7")
        .replace("\"status\": \"converged\"", "\"status\": \"converged\", \"reason\": \"settled\"");
    let text = unwrapped(&shown(&settled));
    assert!(text.starts_with("Converged: settled "), "{text}");
    assert!(!text.contains(nearest) && text.contains("this is one of them"), "{text}");
}

/// Joins the lines of a text.
fn unwrapped(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Shows the conclusions from measured velocities, and the possible effect of failures.
#[test]
fn a_likelihood_is_shown_with_its_error_and_what_the_data_say() {
    let free = ["longitudinal_young_modulus", "transverse_young_modulus", "dispersion"];
    let mut specification = specification(JobKind::Identification, &free);
    specification.objective = Objective::Likelihood;
    let result = &identification(&detailed());
    let shown = ShownResult {
        specification: &specification,
        usual_shifts: &[],
        result,
        directory: None,
        detail: Detail::Usual,
    };
    insta::assert_snapshot!(printed(OutputFormat::Text, |output| output.result(&shown).unwrap()));
}

/// `RESULT` with a likelihood, intervals of the data, a test, and the possible effect of failures.
fn detailed() -> String {
    RESULT
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
        )
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
    check(&[], &["Converged\n", "cannot determine 3 parameters."], &[]);
    let failed = status("\"status\": \"failed\", \"reason\": \"too dark\"");
    let no_cost = ("3.21e-11", "null");
    let point = ["cannot determine", "best point", "GPa", "mean velocity"];
    check(&[failed, no_cost], &["Failed: too dark\n", "no point was feasible"], &point);
    check(&[failed], &["Failed: too dark\n", "best point"], &["cannot determine"]);
    let used_up = "Not converged: reached the limit of 400 evaluations\n";
    check(&[status("\"status\": \"max_evaluations\"")], &[used_up], &[]);
    let early = status("\"status\": \"max_evaluations\", \"reason\": \"it collapsed\"");
    check(&[early], &["Not converged: it collapsed\n"], &["reached"]);
    let missed = status("\"status\": \"not_matched\", \"reason\": \"it is far off\"");
    let expected = ["Not matched: it is far off\n", "The model does not fit the data"];
    check(&[missed], &expected, &["cannot determine", "fit equally", "On their bounds"]);
}

#[test]
fn a_failed_propagation_says_why_whenever_it_is_shown() {
    let failed = RESULT.replace("\"no_arrival\": 2", "\"no_arrival\": 1200");
    let text = shown(JobKind::Propagation, &[], &failed);
    let expected = "Failed: 1201 of 2747 realizations failed; max_failed_fraction is 0.01\n";
    assert!(text.starts_with(expected), "{text}");
    let counts = "2747 realizations; 1201 failures (1200 no arrival, 1 not finite)\n";
    assert!(text.contains(counts), "{text}");
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
            let sentence = "Control variate not used: it requires at least three realizations and no \
                            failures (3 failed).";
            assert_eq!(unwrapped(&text).contains(sentence), told, "{text}");
        }
    };
    check("true", "false", true);
    check("true", "true", false);
    check("false", "false", false);
}

/// `RESULT` with the conclusions from the data, from five starts.
fn identified(matched: bool) -> String {
    let known = |value: f64, error: f64| {
        serde_json::json!({ "value": value, "standard_error": error,
            "interval": [value - 2.0 * error, value + 2.0 * error], "free_share": 0.1 })
    };
    let mut value: serde_json::Value = serde_json::from_str(RESULT).unwrap();
    let unknown = serde_json::json!({ "value": 1.0, "standard_error": null, "interval": null });
    let quantity = |known| if matched { known } else { unknown.clone() };
    value["identified"] = serde_json::json!({
        "matched": matched,
        "level": 0.95,
        "noise": { "data": { "mean": 5.1e-4, "coefficient_of_variation": 0.013 },
                   "sampling": { "mean": 1.94e-3, "coefficient_of_variation": 0.0452 } },
        "bulk_velocity": quantity(known(3964.41, 2.0311)),
        "dispersion": quantity(known(0.1029, 0.00412)),
        "parameters": { "density": null, "dispersion": null },
        "directions": [],
        "free_directions": [{ "density": 1.0 }],
    });
    let point = |density: f64, cost: f64| {
        let mut point = serde_json::json!({ "parameters": value["parameters"], "dispersion": 0.1,
            "cost": cost, "start": 0, "evaluations": 100 });
        point["parameters"]["density"] = density.into();
        point
    };
    // √(c1111/ρ) is 3960.13 m/s at 1598.8 kg/m³, and decreases with the root of the density.
    let points = [point(1598.8, 1e-13), point(1700.0, 1e-12), point(1900.0, 1e-3)];
    let spread = serde_json::json!({
        "density": { "smallest": 1598.8, "largest": 1700.0, "mean": 1650.0 } });
    value["solutions"] = serde_json::json!({
        "matching": 2, "spread": { "parameters": spread, "mandel": {} }, "points": points });
    value["search"] = serde_json::json!({ "cost_tolerance": 1e-10, "below_noise_from": 17 });
    value["sensitivities"] = serde_json::json!({ "density": {}, "dispersion": {} });
    value.to_string()
}

const THREE: [&str; 3] = ["density", "longitudinal_young_modulus", "dispersion"];

#[test]
fn what_the_data_say_is_shown_with_its_noise() {
    let text = shown(JobKind::Identification, &THREE, &identified(true));
    insta::assert_snapshot!(text);
}

#[test]
fn starts_that_end_at_one_point_are_said_to_do_so() {
    let mut value: serde_json::Value = serde_json::from_str(&identified(true)).unwrap();
    value["solutions"]["spread"]["parameters"]["density"]["largest"] = 1599.9.into();
    let text = unwrapped(&shown(JobKind::Identification, &THREE, &value.to_string()));
    let same = "The searches from 2 starts found the same parameter set, to a thousandth";
    assert!(text.contains(same) && !text.contains("different"), "{text}");
}

/// A model that misses the data determines nothing, whether or not derivatives were measured.
#[test]
fn a_model_that_misses_the_data_says_by_how_much_and_where() {
    let miss = |json: &str| {
        let json = json.replace("3905.9104", "3925.4").replace("1598.8", "2000.0");
        let json = json.replace("3.21e-11", "2.5e-5").replace("0.02711004", "0.0678");
        let text = unwrapped(&shown(JobKind::Identification, &THREE, &json));
        let expected = "The model does not fit the data, so no intervals can be given. Its mean \
                        velocity is 0.50 % above the data's, its coefficient of variation 2.5 times \
                        the data's. On their bounds: density (upper).";
        assert!(text.contains(expected), "{text}");
        for absent in ["determine", "cannot determine", "fit equally", "confidence", "starts"] {
            assert!(!text.contains(absent), "{absent}: {text}");
        }
    };
    miss(&identified(false));
    miss(RESULT);
}

#[test]
fn every_text_fits_a_terminal_of_80_columns() {
    let long = RESULT.replace(
        "\"status\": \"converged\"",
        "\"status\": \"not_matched\", \"reason\": \"no nearby point fits better: the best cost is \
         7.644e-1, cost_tolerance is 1e-12; the model's mean velocity is 2.1 % above the data's (41 \
         standard errors), its coefficient of variation 12 % below the data's (1.3 standard errors); \
         density is on its lower bound, dispersion is on its upper bound; widen the bounds, or free \
         more parameters\"",
    );
    let all = Parameter::ALL.map(Parameter::name);
    for json in [RESULT, &long, &identified(true), &identified(false), &detailed()] {
        for kind in [JobKind::Identification, JobKind::Propagation] {
            fits(&shown(kind, &all, json));
        }
    }
    let shown_jobs = printed(OutputFormat::Text, |output| {
        let mut failed = jobs::jobs();
        failed[1].reason = "the searches for 3 of 9 groups failed; ".repeat(5);
        output.jobs(&failed, &[]).unwrap();
        failed.iter().for_each(|job| output.snapshot(job).unwrap());
        let used_up = JobSnapshot {
            state: JobState::Ended.into(),
            status: JobStatus::MaxEvaluations.into(),
            best_mean: Some(4034.9),
            best_coefficient_of_variation: Some(0.02583),
            ..failed[0].clone()
        };
        output.snapshot(&used_up).unwrap();
    });
    fits(&shown_jobs);
}

fn fits(text: &str) {
    for line in text.lines() {
        assert!(line.chars().count() <= 80, "{line}\nin\n{text}");
    }
}

#[test]
fn a_propagation_shows_moments() {
    insta::assert_snapshot!(shown(JobKind::Propagation, &[], RESULT));
}

#[test]
fn json_is_what_stands_in_the_file() {
    let specification = specification(JobKind::Identification, &["dispersion"]);
    let file = include_str!("../../fuzz/corpus/results/identification.json");
    let result = &identification(file);
    let shown = ShownResult {
        specification: &specification,
        usual_shifts: &[],
        result,
        directory: None,
        detail: Detail::Usual,
    };
    assert_eq!(printed(OutputFormat::Json, |output| output.result(&shown).unwrap()), file);
}
