//! Results of groups.

use std::collections::BTreeMap;

use super::*;

fn group(name: &str, status: Status, best: Option<BestPoint>) -> GroupResult {
    let velocities = vec![3850.0, 3900.0, 3918.75, 3925.0, 4000.0];
    let data = DataSummary::from_data(&Data::from_velocities(velocities), 0);
    let (name, conclusions) = (name.to_owned(), Conclusions::default());
    GroupResult { name, status, reason: None, best, data, conclusions }
}

/// Every row of a table by the names of its columns.
fn rows(text: &str) -> Vec<BTreeMap<String, String>> {
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        // The last column, which may hold a comma, is in quotes then.
        let fields = line.splitn(names.len(), ',').map(|field| field.trim_matches('"').to_owned());
        names.iter().map(|name| (*name).to_owned()).zip(fields).collect()
    };
    lines.map(row).collect()
}

/// Returns the inference from a group's data if e_L and δ are free; it has intervals if they are
/// `known`.
fn found(known: bool) -> Inference {
    let quantity = |value: f64, interval: [f64; 2]| {
        let known = known.then_some(Uncertainty { standard_error: 1.0, interval, free_share: 0.0 });
        DerivedQuantity { value, known }
    };
    let modulus = quantity(17.717e9, [17e9, 18.5e9]);
    Inference {
        matched: known,
        level: 0.95,
        noise: NoiseErrors { data: None, sampling: moments(5e-4, 0.01) },
        free: vec![Parameter::LongitudinalYoungModulus, Parameter::Dispersion],
        sensitivities: Vec::new(),
        fixed: Vec::new(),
        undetermined: Vec::new(),
        bulk_velocity: quantity(3960.5, [3950.25, 3970.75]),
        dispersion: quantity(0.1029, [0.1, 0.11]),
        parameters: vec![(Parameter::LongitudinalYoungModulus, modulus)],
        budget: Vec::new(),
        errors: Vec::new(),
    }
}

/// Group a is known, b does not match, c has no point.
fn grouped() -> (JobSpecification, JobResult, Vec<Evaluation>) {
    let mut job = specification();
    job.parameters[Parameter::LongitudinalYoungModulus as usize] =
        Range::Free { start: 18e9, lower: 12e9, upper: 25e9 };
    let best = result().best.unwrap();
    let mut a = group("a", Status::Converged, Some(best.clone()));
    let mut b = group("b", Status::Converged, Some(best));
    let mut c = group("c", Status::Failed, None);
    (a.conclusions.inference, b.conclusions.inference) = (Some(found(true)), Some(found(false)));
    b.status = Status::NotMatched;
    b.reason = Some("no nearby point fits better: the best cost is 7.644e-1".to_owned());
    c.reason = Some("only one velocity, and no more".to_owned());
    let row = |group, varied| Evaluation {
        number: 0,
        role: EvaluationRole { group, varied, ..EvaluationRole::default() },
        point: POINT,
        moments: None,
        observables: osteon_common::observables::PerObservable::default(),
        cost: None,
        failures: FailureCounts::default(),
        estimated_error: None,
    };
    let varied = Some(Parameter::Dispersion);
    let history = vec![row(0, None), row(0, None), row(0, varied), row(1, None)];
    (job, JobResult { best: None, data: None, groups: vec![a, b, c], ..result() }, history)
}

#[test]
fn a_group_has_its_intervals_its_data_and_a_reason() {
    let (job, mut result, history) = grouped();
    let text = results_csv::groups(&job, &groups_of(&result), &history);
    let rows = rows(&text);
    for (group, column, value) in [
        (0, "longitudinal_young_modulus", "17717000000.0"),
        (0, "longitudinal_young_modulus_lower", "17000000000.0"),
        (0, "longitudinal_young_modulus_upper", "18500000000.0"),
        (0, "dispersion_lower", "0.1"),
        (0, "data_mean", "3918.75"),
        (0, "data_mean_lower", "3851.5429646619364"),
        (0, "data_mean_upper", "3985.9570353380636"),
        (0, "data_coefficient_of_variation", "0.012354013863500532"),
        (0, "kolmogorov_distance", "0.25"),
        (0, "kolmogorov_p_value", "0.75"),
        (0, "failures", "2"),
        (0, "evaluations", "2"),
        (0, "reason", ""),
        (1, "longitudinal_young_modulus", ""),
        (1, "longitudinal_young_modulus_lower", ""),
        (1, "best_longitudinal_young_modulus", "17717000000.0"),
        (1, "evaluations", "1"),
        (1, "reason", "no nearby point fits better: the best cost is 7.644e-1"),
        (2, "best_density", ""),
        (2, "evaluations", "0"),
        (2, "reason", "only one velocity, and no more"),
    ] {
        assert_eq!(rows[group][column], value, "{column} of group {group}: {text}");
    }
    assert!(text.ends_with(",\"only one velocity, and no more\"\n"), "{text}");
    // Where nothing else is said, a blank is explained.
    result.groups[1].reason = None;
    let text = results_csv::groups(&job, &groups_of(&result), &history);
    assert!(text.contains(",the model does not match the data within their noise: no intervals\n"));
}

#[test]
fn realizations_of_groups_follow_each_other() {
    let outcomes = outcomes();
    let groups =
        [("left", outcomes.as_slice()), ("none", &[]), ("right, \"distal\"", &[Ok(3900.5)])];
    assert_eq!(
        results_csv::realizations_of_groups(groups),
        "index,velocity,failure,group\n0,3908.25,,left\n1,,direct_wave_first,left\n\
         2,3333.3333333333335,,left\n3,,no_arrival,left\n0,3900.5,,\"right, \"\"distal\"\"\"\n"
    );
}

#[test]
fn the_best_point_of_a_group_is_found_by_its_name() {
    let best = result().best.unwrap();
    let mut result = JobResult { best: None, data: None, ..result() };
    result.groups =
        vec![group("left", Status::Converged, Some(best)), group("none", Status::Failed, None)];
    let text = identification_text(&result);
    let read = ResultFile::from_json(&text).unwrap();
    let names: Vec<&str> = read.groups().iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["left", "none"]);
    assert_eq!(read.best_point(Some("left")).unwrap(), POINT);
    let refused = |name| read.best_point(Some(name)).unwrap_err().to_string();
    assert_eq!(refused("none"), "the result has no best point: no evaluated point was feasible");
    assert_eq!(refused("right"), "there is no group \"right\"; the groups are \"left\", \"none\"");
    assert!(ResultFile::from_json(&identified(&failed())).unwrap().groups().is_empty());
    assert_eq!(read.to_json(), text);
}

#[test]
fn velocities_far_from_the_others_are_listed() {
    let mut velocities: Vec<f64> = (0..200).map(|k| 3900.0 + f64::from(k % 11)).collect();
    let report = |velocities: &[f64]| {
        let data = DataSummary::from_data(&Data::from_velocities(velocities.to_vec()), 0);
        let result = JobResult { data: Some(data), ..result() };
        serde_json::from_str::<serde_json::Value>(&identification_text(&result)).unwrap()
    };
    let clean = report(&velocities);
    assert!(
        clean["data"].get("outliers").is_none() && clean["data"].get("outlier_count").is_none()
    );
    velocities[7] = 7800.0;
    let found = report(&velocities);
    assert_eq!(found["data"]["outlier_count"], 1);
    let outliers = found["data"]["outliers"].as_array().unwrap();
    assert_eq!((&outliers[0]["index"], &outliers[0]["velocity"]), (&7.into(), &7800.0.into()));
    assert!(outliers[0]["deviations"].as_f64().unwrap() > 100.0);
    // A million wrong velocities must not make a file of their own.
    velocities.resize(400, 5000.0);
    velocities.resize(1000, 3904.0);
    let found = report(&velocities);
    assert_eq!(found["data"]["outlier_count"], 201);
    assert_eq!(found["data"]["outliers"].as_array().unwrap().len(), 100);
}
