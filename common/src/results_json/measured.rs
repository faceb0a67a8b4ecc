//! The objects `velocity` and `data`: moments of the model and of the data, and what is known of them.

use serde_json::{Value, json};

use super::{estimate, moments};
use crate::data_statistics::{Interval, MomentIntervals};
use crate::results::{BestPoint, DataSummary};

/// Moments at the best point, and what failures may have done to them.
pub(super) fn model(best: Option<&BestPoint>) -> Value {
    let mut value = estimate(best.and_then(|best| best.velocity));
    value["failure_bias"] = moments(best.and_then(|best| best.failure_bias));
    value
}

/// Moments of the data, and where velocities were measured what they say of themselves and of the
/// model at its best point.
pub(super) fn data(data: &DataSummary, best: Option<&BestPoint>) -> Value {
    let mut value = moments(Some(data.moments));
    if data.count.is_some() {
        value["interval"] = json!(data.intervals.map(intervals));
        let test = best.and_then(|best| best.kolmogorov);
        let test = test.map(|test| json!({"distance": test.distance, "p_value": test.p_value}));
        value["kolmogorov"] = json!(test);
    }
    value
}

fn intervals(found: MomentIntervals) -> Value {
    let ends = |interval: Interval| json!([interval.low, interval.high]);
    json!({
        "mean": ends(found.mean),
        "coefficient_of_variation": ends(found.coefficient_of_variation),
        "level": found.level,
    })
}
