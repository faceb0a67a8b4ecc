use serde_json::{Value, json};

use super::*;
use crate::sample_result::{posterior, put};

/// Returns the table of groups with these keys; all other keys are those of an unknown uncertainty.
fn table(groups: &[Value]) -> String {
    let complete = json!({
        "cost": null,
        "parameters": {},
        "velocity": { "standard_error": {}, "failure_bias": {} },
        "failures": {},
    });
    let group = |partial: &Value| -> Group {
        let mut value = complete.clone();
        put(&mut value, partial);
        serde_json::from_value(value).unwrap()
    };
    super::table(&groups.iter().map(group).collect::<Vec<_>>(), None, true)
}

fn quantity(value: f64, interval: [f64; 2]) -> Value {
    json!({ "value": value, "interval": interval })
}

/// A group with two free parameters, both known.
fn known(name: &str, modulus: f64) -> Value {
    json!({
        "name": name,
        "status": "converged",
        "cost": 3.2145e-13,
        "data": {
            "mean": 3906.2514,
            "coefficient_of_variation": 0.027134,
            "interval": {
                "mean": [3895.21, 3916.64],
                "coefficient_of_variation": [0.02512, 0.02934],
                "level": 0.95,
            },
            "count": 62,
        },
        "sensitivities": { "longitudinal_young_modulus": {}, "dispersion": {} },
        "identified": {
            "matched": true,
            "level": 0.95,
            "noise": { "data": null, "sampling": {} },
            "bulk_velocity": quantity(3974.19, [3958.24, 3990.2]),
            "dispersion": quantity(0.0961, [0.0882, 0.1046]),
            "parameters": {
                "longitudinal_young_modulus": quantity(modulus, [modulus - 3e8, modulus + 3e8]),
                "dispersion": quantity(0.0961, [0.0882, 0.1046]),
            },
            "directions": [],
            "free_directions": [],
        },
    })
}

#[test]
fn a_table_of_groups_shows_intervals_and_reasons() {
    let mut outlier = known("P02", 2.5e10);
    outlier["status"] = json!("not_matched");
    outlier["reason"] = json!("no nearby point fits better: the best cost is 7.644e-1");
    let unknown = |value: f64| json!({ "value": value, "interval": null });
    let nothing = json!({
        "matched": false,
        "level": 0.95,
        "noise": { "data": null, "sampling": {} },
        "bulk_velocity": unknown(4256.31),
        "dispersion": unknown(0.3),
        "parameters": { "longitudinal_young_modulus": null, "dispersion": null },
        "directions": [],
        "free_directions": [],
    });
    outlier["identified"] = nothing.clone();
    let lonely = json!({
        "name": "P03",
        "status": "failed",
        "reason": "only one velocity: a coefficient of variation needs at least two different ones",
        "cost": null,
        "data": { "mean": 3911.5, "coefficient_of_variation": 0.0, "interval": null, "count": 1 },
    });
    let mut unmatched = known("P04", 2e10);
    unmatched["identified"] = nothing;
    insta::assert_snapshot!(table(&[known("P01", 1.7717e10), outlier, lonely, unmatched]));
}

#[test]
fn a_posterior_takes_the_place_of_the_intervals_of_a_group() {
    let with = |name: &str, change: &dyn Fn(&mut Value)| {
        let mut group = known(name, 1.7717e10);
        group["posterior"] = serde_json::to_value(posterior()).unwrap();
        change(&mut group);
        group
    };
    let vague = with("P02", &|group| {
        group["posterior"]["converged"] = json!(false);
        group["posterior"]["reason"] = json!("the evaluations are used up");
    });
    let unmatched = with("P03", &|group| group["identified"]["matched"] = json!(false));
    insta::assert_snapshot!(table(&[with("P01", &|_| {}), vague, unmatched]));
}

#[test]
fn what_limits_a_group_is_told_below_the_table() {
    let mut group = known("P01", 2e10);
    group["data"]["rounding"] = json!(25.0);
    group["posterior"] = serde_json::to_value(posterior()).unwrap();
    group["posterior"]["outlier_share"] = json!(0.021);
    group["velocity"] = json!({ "controlled": false });
    group["failures"] = json!({ "direct_wave_first": 2 });
    let text = table(&[group, known("P02", 2e10)]).replace("\n  ", " ");
    for expected in [
        "P01: The velocities are rounded to 25 m/s; test and posterior allow for that.",
        "P01: An estimated 2.1 % of the velocities are not from the model's law; they count",
        "P01: Control variate not used: it requires at least three realizations and no failures",
    ] {
        assert!(text.contains(expected), "{expected}\n{text}");
    }
    assert!(!text.contains("P02: "), "{text}");
}

#[test]
fn what_the_data_cannot_say_is_told_once() {
    let with = |names: &[&str]| {
        let mut group = known("P01", 2e10);
        let free = names.iter().map(|name| ((*name).to_owned(), json!({}))).collect();
        group["sensitivities"] = Value::Object(free);
        table(&[group.clone(), group])
    };
    let seven = Parameter::OF_BONE.map(Parameter::name);
    let text = with(&seven);
    assert_eq!(text.matches("Two moments cannot determine 7 parameters.").count(), 1, "{text}");
    assert!(text.contains("fix its mean velocity and its coefficient"), "{text}");
    let mut missed = known("P02", 2e10);
    missed["status"] = json!("not_matched");
    missed["sensitivities"] = json!({ "density": {}, "longitudinal_young_modulus": {} });
    assert!(!table(&[missed]).contains("cannot determine"));
    assert!(with(&seven[..3]).contains("3 parameters. The data of a group"));
    assert!(!with(&["longitudinal_young_modulus", "dispersion"]).contains("cannot determine"));
    assert!(!with(&["longitudinal_young_modulus"]).contains("cannot determine"));
}

#[test]
fn a_group_of_too_few_velocities_says_why_it_has_no_intervals() {
    let mut few = known("P01", 2e10);
    few["data"]["interval"] = json!(null);
    let text = table(&[few, known("P02", 2e10)]).replace("\n  ", " ");
    assert!(text.contains("P01: no intervals: they need at least five velocities"), "{text}");
    assert!(!text.contains("P02: "), "{text}");
}
