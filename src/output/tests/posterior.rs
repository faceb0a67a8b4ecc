//! Results with a posterior.

use super::*;
use crate::sample_result::posterior;

/// `RESULT` with its posterior, and with these keys.
fn with_posterior(more: &str) -> String {
    let mut value: serde_json::Value = serde_json::from_str(RESULT).unwrap();
    value["posterior"] = serde_json::to_value(posterior()).unwrap();
    let more: serde_json::Value = serde_json::from_str(more).unwrap();
    crate::sample_result::put(&mut value, &more);
    value.to_string()
}

const FREE: [&str; 2] = ["longitudinal_young_modulus", "dispersion"];

#[test]
fn the_posterior_takes_the_place_of_confidence_intervals() {
    let text = shown(JobKind::Identification, &FREE, &with_posterior("{}"));
    fits(&text);
    insta::assert_snapshot!(text);
}

#[test]
fn a_posterior_without_a_search_is_shown() {
    let point = r#"{ "cost": null, "dispersion": null, "parameters": { "density": null } }"#;
    let text = unwrapped(&shown(JobKind::Identification, &FREE, &with_posterior(point)));
    assert!(text.contains("and 84 for the posterior Posterior of the mean velocity"), "{text}");
    assert!(!text.contains("no point was feasible"), "{text}");
}

#[test]
fn a_model_that_misses_the_data_has_a_posterior_that_says_little() {
    let missed = r#"{ "cost": 0.01, "velocity": { "mean": 3700.5 } }"#;
    let text = unwrapped(&shown(JobKind::Identification, &FREE, &with_posterior(missed)));
    let expected = "The model does not fit the data, so the posterior below says little.";
    assert!(text.contains(expected) && text.contains("that comes closest:"), "{text}");
    assert!(!text.contains("which the data"), "{text}");
}

#[test]
fn a_posterior_holds_where_the_search_was_misled_by_a_wrong_velocity() {
    let misled = r#"{ "cost": 0.01, "velocity": { "mean": 3700.5 }, "data": {
        "outliers": [{ "index": 3, "velocity": 7800.0, "deviations": 37.0 }] } }"#;
    let text = unwrapped(&shown(JobKind::Identification, &FREE, &with_posterior(misled)));
    assert!(text.contains("the posterior below allows for them."), "{text}");
    assert!(text.contains("which the data"), "{text}");
}
