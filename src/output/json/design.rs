//! What further measurements would tell as JSON.

use osteon_common::version::Program;
use osteon_local::design::{DesignedQuantity, PredictedDeviation};
use serde_json::{Value, json};

use crate::output::ShownDesign;
use crate::program;

/// Returns the object. Deviations are standard deviations, in the unit of the quantity's key in a job file.
pub(super) fn value(shown: &ShownDesign<'_>) -> Value {
    let quantities: Vec<Value> = shown.design.quantities.iter().map(quantity).collect();
    let Program { version, numerics, commit } = program::current();
    json!({
        "velocities": shown.design.velocities,
        "quantities": quantities,
        "version": version,
        "numerics": numerics,
        "commit": commit,
    })
}

fn quantity(one: &DesignedQuantity) -> Value {
    let measurement = |found: &PredictedDeviation| {
        json!({
            "measurement": found.plan.key(),
            "standard_deviation": found.deviation,
            "prior_share": found.deviation / one.prior,
            "worth_velocities": found.worth,
        })
    };
    json!({
        "quantity": one.target.name(),
        "value": one.value,
        "prior_standard_deviation": one.prior,
        "standard_deviation": one.deviation,
        "prior_share": one.deviation / one.prior,
        "measurements": one.ranking.iter().map(measurement).collect::<Vec<Value>>(),
    })
}
