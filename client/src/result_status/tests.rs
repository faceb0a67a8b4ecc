use std::path::Path;

use osteon_files::document::Format;
use osteon_files::job_file;

use super::*;
use crate::sample_result::{identification, propagation};

fn specification(max_failed_fraction: f64) -> JobSpecification {
    let fixed = [
        ("density", 1598.8),
        ("longitudinal_young_modulus", 17.717e9),
        ("longitudinal_poisson_ratio", 0.3816),
        ("longitudinal_shear_modulus", 4.795e9),
        ("transverse_young_modulus", 9.8254e9),
        ("transverse_poisson_ratio", 0.4495),
        ("dispersion", 0.1029),
    ];
    let mut text = format!(
        "[monte_carlo]\nrealizations = 100\nmax_failed_fraction = {max_failed_fraction:?}\n"
    );
    for (name, value) in fixed {
        text.push_str(&format!("[parameters.{name}]\nfixed = {value:?}\n"));
    }
    job_file::parse(&text, Format::Toml, Path::new(""), JobKind::Propagation).unwrap()
}

#[test]
fn an_identification_ends_as_its_status_says() {
    let check = |status: &str, expected| {
        let result = identification(&format!("{{\"status\": \"{status}\"}}"));
        assert_eq!(is_complete(&specification(0.01), &result), expected, "{status}");
    };
    check("converged", true);
    check("not_matched", true);
    check("max_evaluations", true);
    check("cancelled", false);
    check("failed", false);
}

#[test]
fn a_propagation_fails_above_the_accepted_fraction() {
    let check = |json: &str, expected| {
        assert_eq!(is_complete(&specification(0.02), &propagation(json)), expected, "{json}");
    };
    check(r#"{"failures": {}, "velocity": {"mean": 3900.0}}"#, true);
    check(
        r#"{"failures": {"no_arrival": 1, "not_finite": 1}, "velocity": {"mean": 3900.0}}"#,
        true,
    );
    check(
        r#"{"failures": {"no_arrival": 2, "not_finite": 1}, "velocity": {"mean": 3900.0}}"#,
        false,
    );
    check(r#"{"failures": {}, "velocity": {"mean": null}}"#, false);
}

#[test]
fn only_a_search_that_somebody_ended_is_cancelled() {
    let check = |status: &str, expected| {
        let result = identification(&format!("{{\"status\": \"{status}\"}}"));
        assert_eq!(is_cancelled(&result), expected, "{status}");
    };
    check("cancelled", true);
    check("converged", false);
    check("failed", false);
    assert!(!is_cancelled(&propagation(r#"{"failures": {}, "velocity": {"mean": 3900.0}}"#)));
}

#[test]
fn what_lay_in_the_machines_may_end_otherwise() {
    // The kind of the failure is decisive, whatever the reason says.
    let reason = "integrity error: stored evaluation 3 was alone on workers that were lost";
    for (status, failure, expected) in [
        ("failed", "\"integrity_error\"", true),
        ("failed", "\"poison_realization\"", true),
        ("failed", "\"store\"", true),
        ("failed", "\"no_feasible_point\"", false),
        ("cancelled", "null", true),
        ("converged", "null", false),
        ("max_evaluations", "null", false),
    ] {
        let json = format!(
            "{{\"status\": \"{status}\", \"failure\": {failure}, \"reason\": \"{reason}\"}}"
        );
        let result = identification(&json);
        assert_eq!(is_worth_repeating(&result), expected, "{json}");
        let failure = (status == "failed" && expected).then_some(reason);
        assert_eq!(machine_failure(&result), failure, "{json}");
    }
}
