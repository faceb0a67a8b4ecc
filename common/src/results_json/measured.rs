//! The objects `velocity` and `data`: moments of the model and of the data, and what is known of them.

use serde_json::{Value, json};

use super::{estimate, moments};
use crate::data_statistics::{CONFIDENCE, Interval, moment_intervals};
use crate::results::{BestPoint, Moments};

/// Moments at the best point, and what failures may have done to them.
pub(super) fn model(best: Option<&BestPoint>) -> Value {
    let mut value = estimate(best.and_then(|best| best.velocity));
    value["failure_bias"] = moments(best.and_then(|best| best.failure_bias));
    value
}

/// Moments of the data, and where velocities were measured what they say of themselves and of the
/// model at its best point.
pub(super) fn data(
    of_data: Option<Moments>,
    velocities: Option<&[f64]>,
    best: Option<&BestPoint>,
) -> Value {
    let mut value = moments(of_data);
    if let Some(velocities) = velocities {
        value["interval"] = interval(velocities);
        let test = best.and_then(|best| best.kolmogorov);
        let test = test.map(|test| json!({"distance": test.distance, "p_value": test.p_value}));
        value["kolmogorov"] = json!(test);
    }
    value
}

fn interval(velocities: &[f64]) -> Value {
    let ends = |interval: Interval| json!([interval.low, interval.high]);
    let found = moment_intervals(velocities).map(|found| {
        json!({
            "mean": ends(found.mean),
            "coefficient_of_variation": ends(found.coefficient_of_variation),
            "level": CONFIDENCE,
        })
    });
    json!(found)
}
