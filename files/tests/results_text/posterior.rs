//! The posterior in results.

use osteon_common::posterior::{Posterior, PosteriorDraw, PosteriorSummary};
use osteon_files::posterior_csv;
use serde_json::{Value, json};

use super::*;

fn summary(mean: f64) -> PosteriorSummary {
    PosteriorSummary {
        mean,
        standard_deviation: 0.25 * mean,
        quantiles: [0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0].map(|factor| factor * mean),
        prior_standard_deviation: 0.5 * mean,
    }
}

fn posterior() -> Posterior {
    let draw = |dispersion: f64| {
        let mut point = POINT;
        point.0[6] = dispersion;
        PosteriorDraw { point, log_density: -1.5, mean: 3906.5, coefficient_of_variation: 0.0271 }
    };
    Posterior {
        converged: false,
        reason: Some("the evaluations are used up".to_owned()),
        evaluations: 400,
        effective_draws: 1234.5,
        checked_draws: 40,
        model_error: 0.0625,
        check_efficiency: 0.75,
        pareto_k: None,
        sampling_error: f64::NAN,
        free: vec![Parameter::Density, Parameter::Dispersion],
        parameters: vec![summary(1600.0), summary(0.125)],
        correlation: vec![vec![1.0, -0.5], vec![-0.5, 1.0]],
        mean: summary(4000.0),
        coefficient_of_variation: summary(0.03125),
        bulk_velocity: summary(4096.0),
        entries: vec![(0, 0, summary(25e9)), (4, 5, summary(0.0))],
        predictive_p_value: Some(0.5),
        outlier_share: Some(0.0125),
        draws: vec![draw(0.1029), draw(0.125)],
    }
}

#[test]
fn the_posterior_of_a_job() {
    let mut result = result();
    let value: Value = serde_json::from_str(&identification_text(&result)).unwrap();
    assert_eq!(value["posterior"], Value::Null);
    assert!(value.as_object().unwrap().contains_key("posterior"));
    result.conclusions.posterior = Some(posterior());
    let text = identification_text(&result);
    assert_eq!(ResultFile::from_json(&text).unwrap().to_json(), text);
    let value: Value = serde_json::from_str(&text).unwrap();
    let quantity = |mean: f64| {
        json!({
            "mean": mean,
            "standard_deviation": 0.25 * mean,
            "median": mean,
            "interval_50": [0.75 * mean, 1.25 * mean],
            "interval_90": [0.5 * mean, 1.5 * mean],
            "interval_95": [0.25 * mean, 2.0 * mean],
            "prior_standard_deviation": 0.5 * mean,
            "explained": if mean > 0.0 { 0.75 } else { 0.0 },
        })
    };
    let expected = json!({
        "converged": false,
        "reason": "the evaluations are used up",
        "evaluations": 400,
        "draws": 2,
        "effective_draws": 1234.5,
        "checked_draws": 40,
        "model_error": 0.0625,
        "check_efficiency": 0.75,
        "pareto_k": null,
        "sampling_error": null,
        "parameters": { "density": quantity(1600.0), "dispersion": quantity(0.125) },
        "correlation": {
            "density": { "density": 1.0, "dispersion": -0.5 },
            "dispersion": { "density": -0.5, "dispersion": 1.0 },
        },
        "bulk_velocity": quantity(4096.0),
        "mean": quantity(4000.0),
        "coefficient_of_variation": quantity(0.03125),
        "mandel": { "11": quantity(25e9), "56": quantity(0.0) },
        "predictive_p_value": 0.5,
        "outlier_share": 0.0125,
    });
    assert_eq!(value["posterior"], expected);
}

/// A job with groups, of which the second has no posterior.
fn of_groups() -> JobResult {
    let group = |name: &str, posterior: Option<Posterior>| GroupResult {
        name: name.to_owned(),
        status: Status::Converged,
        reason: None,
        best: result().best,
        data: result().data.unwrap(),
        conclusions: Conclusions { posterior, ..Conclusions::default() },
    };
    let groups = vec![
        group("left", Some(posterior())),
        group("lonely", None),
        group("right, \"distal\"", Some(posterior())),
    ];
    JobResult { best: None, data: None, groups, ..result() }
}

#[test]
fn the_posterior_of_each_group() {
    let text = identification_text(&of_groups());
    assert_eq!(ResultFile::from_json(&text).unwrap().to_json(), text);
    let value: Value = serde_json::from_str(&text).unwrap();
    assert!(!value.as_object().unwrap().contains_key("posterior"));
    assert_eq!(value["groups"][0]["posterior"]["draws"], 2);
    assert_eq!(value["groups"][1]["posterior"], Value::Null);
}

/// As on the terminal: not those of the best point.
#[test]
fn tables_of_groups_have_the_means_and_intervals_of_the_posteriors() {
    let result = of_groups();
    let text = results_csv::groups(&specification(), &groups_of(&result), &[]);
    let rows: Vec<Vec<&str>> = text.lines().take(3).map(|line| line.split(',').collect()).collect();
    let cells = |row: usize, name: &str| {
        ["", "_lower", "_upper"].map(|end| {
            let column = format!("{name}{end}");
            rows[row][rows[0].iter().position(|found| *found == column).unwrap()]
        })
    };
    assert_eq!(cells(1, "bulk_velocity"), ["4096.0", "1024.0", "8192.0"]);
    assert_eq!(cells(1, "dispersion"), ["0.125", "0.03125", "0.25"]);
    assert_eq!(cells(2, "bulk_velocity"), ["", "", ""]);
    // Both ends are as far from the difference as those of both intervals together.
    let compared = results_csv::comparison(&groups_of(&result));
    let row = compared.lines().find(|line| line.starts_with("left,\"right")).unwrap();
    assert!(row.ends_with(",0.0,-5120.0,5120.0,0.0,-0.15625,0.15625"), "{row}");
}

/// Results of earlier programs of the same schema do not have the key.
#[test]
fn a_result_without_the_key_is_read() {
    for result in [result(), of_groups()] {
        let mut value: Value = serde_json::from_str(&identification_text(&result)).unwrap();
        let entries = value.as_object_mut().unwrap();
        entries.remove("posterior");
        for group in entries.get_mut("groups").and_then(Value::as_array_mut).into_iter().flatten() {
            group.as_object_mut().unwrap().remove("posterior").unwrap();
        }
        ResultFile::from_json(&value.to_string()).unwrap();
    }
}

const HEADER: &str = "draw,density,longitudinal_young_modulus,longitudinal_poisson_ratio,\
    longitudinal_shear_modulus,transverse_young_modulus,transverse_poisson_ratio,dispersion,\
    bulk_velocity,mean,coefficient_of_variation,log_density";
const ROWS: [&str; 2] = [
    "0,1598.8,17717000000.0,0.3816,4795000000.0,9825400000.0,0.4495,0.1029,3960.1259174704824,3906.5,\
     0.0271,-1.5",
    "1,1598.8,17717000000.0,0.3816,4795000000.0,9825400000.0,0.4495,0.125,3960.1259174704824,3906.5,\
     0.0271,-1.5",
];

#[test]
fn draws_are_rows() {
    let none: [&[PosteriorDraw]; 1] = [&[]];
    assert_eq!(posterior_csv::posterior(&specification(), none), format!("{HEADER}\n"));
    let draws = posterior().draws;
    assert_eq!(
        posterior_csv::posterior(&specification(), [draws.as_slice()]),
        format!("{HEADER}\n{}\n{}\n", ROWS[0], ROWS[1])
    );
}

#[test]
fn the_columns_are_documented() {
    let page = include_str!("../../../docs/results.md");
    let section = page.split("\n### ").find(|section| section.starts_with("`posterior.csv`\n"));
    let rows = section.unwrap().lines().filter(|line| line.starts_with("| `"));
    let cells: String = rows.filter_map(|line| line.split('|').nth(1)).collect();
    let told: Vec<&str> = cells.split('`').skip(1).step_by(2).collect();
    // Quantities of the setup are columns if they are searched.
    let groups = vec![Group::new("left", vec![3900.0, 3950.0])];
    let mut job = JobSpecification { data: Some(Data::from_groups(groups)), ..specification() };
    for parameter in Parameter::ALL.into_iter().filter(|one| one.of_setup().is_some()) {
        job.parameters[parameter as usize] = Range::Free { start: 1.0, lower: 0.5, upper: 2.0 };
    }
    let text = posterior_csv::posterior(&job, []);
    let real: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    assert_eq!(told, real);
}

#[test]
fn draws_of_groups_follow_each_other() {
    let groups = ["left", "lonely", "right, \"distal\""];
    let groups = groups.map(|name| Group::new(name, vec![3900.0, 3950.0])).to_vec();
    let job = JobSpecification { data: Some(Data::from_groups(groups)), ..specification() };
    let draws = posterior().draws;
    let rows = |name: &str| ROWS.map(|row| format!("{row},{name}\n")).concat();
    assert_eq!(
        posterior_csv::posterior(&job, [draws.as_slice(), &[], draws.as_slice()]),
        format!("{HEADER},group\n{}{}", rows("left"), rows("\"right, \"\"distal\"\"\""))
    );
}

#[test]
fn the_history_is_that_of_the_search() {
    let role = EvaluationRole { posterior: true, ..EvaluationRole::default() };
    let row = Evaluation {
        number: 3,
        role,
        point: POINT,
        moments: Some(moments(3906.5, 0.0271)),
        observables: osteon_common::observables::PerObservable::default(),
        cost: Some(1e-3),
        failures: FailureCounts::default(),
        estimated_error: None,
    };
    assert_eq!(results_csv::history(&specification(), &[row]).lines().count(), 1);
}
