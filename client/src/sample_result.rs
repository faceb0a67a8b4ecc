//! Complete results for tests, in which a test sets only the keys that matter to it. The tests of the
//! program `osteon` compile this file too.

use osteon_common::parameters::{Parameter, Point};
use osteon_common::posterior::{Posterior, PosteriorDraw, PosteriorSummary};
use osteon_files::report::{PosteriorReport, ResultFile};
use serde_json::Value;

/// Returns a complete result of an identification, with the keys of `partial`, a text in JSON, set in it.
pub(crate) fn identification(partial: &str) -> ResultFile {
    filled(include_str!("../../fuzz/corpus/results/identification.json"), partial)
}

/// Returns a complete result of a propagation, with the keys of `partial`, a text in JSON, set in it.
pub(crate) fn propagation(partial: &str) -> ResultFile {
    filled(include_str!("../../fuzz/corpus/results/propagation.json"), partial)
}

/// Returns a posterior as a result has it.
pub(crate) fn posterior() -> PosteriorReport {
    (&drawn_posterior()).into()
}

/// Returns a posterior of two free parameters, with two draws.
pub(crate) fn drawn_posterior() -> Posterior {
    let summary = |mean: f64, deviation: f64, prior: f64| PosteriorSummary {
        mean,
        standard_deviation: deviation,
        quantiles: [-1.96, -1.64, -0.67, 0.0, 0.67, 1.64, 1.96].map(|z| mean + z * deviation),
        prior_standard_deviation: prior,
    };
    let draw = |modulus: f64, log_density: f64| PosteriorDraw {
        point: Point::of_bone([1598.8, modulus, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]),
        log_density,
        mean: 3905.5,
        coefficient_of_variation: 0.0271,
    };
    Posterior {
        converged: true,
        reason: None,
        evaluations: 84,
        effective_draws: 1830.4,
        checked_draws: 24,
        model_error: 0.031,
        check_efficiency: 0.98,
        pareto_k: Some(0.21),
        sampling_error: 0.012,
        free: vec![Parameter::LongitudinalYoungModulus, Parameter::Dispersion],
        parameters: vec![summary(17.74e9, 0.21e9, 3.75e9), summary(0.1031, 0.0094, 0.081)],
        correlation: vec![vec![1.0, -0.125], vec![-0.125, 1.0]],
        mean: summary(3906.2, 3.1, 240.0),
        coefficient_of_variation: summary(0.0271, 0.0004, 0.012),
        bulk_velocity: summary(3975.3, 12.4, 310.0),
        entries: vec![(0, 0, summary(25.3e9, 0.2e9, 4.0e9)), (3, 3, summary(6.8e9, 0.0, 0.0))],
        predictive_p_value: Some(0.43),
        outlier_share: Some(0.0123),
        draws: vec![draw(17.7e9, -3.25), draw(17.9e9, -4.5)],
    }
}

fn filled(complete: &str, partial: &str) -> ResultFile {
    let mut value: Value = serde_json::from_str(complete).unwrap();
    put(&mut value, &serde_json::from_str(partial).unwrap());
    ResultFile::from_json(&value.to_string()).unwrap()
}

/// Sets keys of an object and of nested objects; `failures` is replaced as a whole.
pub(crate) fn put(into: &mut Value, partial: &Value) {
    let (Some(entries), Value::Object(new)) = (into.as_object_mut(), partial) else {
        *into = partial.clone();
        return;
    };
    for (key, value) in new {
        match entries.get_mut(key) {
            Some(old) if key != "failures" => put(old, value),
            _ => _ = entries.insert(key.clone(), value.clone()),
        }
    }
}
