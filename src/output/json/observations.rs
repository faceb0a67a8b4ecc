//! The observables of a job's realizations as JSON.

use osteon_common::version::Program;
use serde_json::{Map, Value, json};

use crate::output::ShownObservations;
use crate::program;
use osteon_local::observations::{ObservableMoments, ObservationSummary};

/// Returns the object; what no realization has is null.
pub(super) fn value(shown: &ShownObservations<'_>) -> Value {
    let ShownObservations { point, summary, .. } = *shown;
    let ObservationSummary { other_extremum, realizations, failures, columns } = summary;
    let [velocity, other_velocity, decay, center_frequency] = columns.map(column);
    let parameters: Map<String, Value> =
        point.given().map(|(name, value)| (name.name().to_owned(), value.into())).collect();
    let failures: Map<String, Value> =
        failures.iter().map(|(kind, count)| (kind.name().to_owned(), count.into())).collect();
    let Program { version, numerics, commit } = program::current();
    json!({
        "point": parameters,
        "realizations": realizations,
        "failures": failures,
        "velocity": velocity,
        "other_extremum": other_extremum.name(),
        "other_velocity": other_velocity,
        "decay": decay,
        "center_frequency": center_frequency,
        "version": version,
        "numerics": numerics,
        "commit": commit,
    })
}

fn column(column: ObservableMoments) -> Value {
    let ObservableMoments { count, mean, standard_deviation, correlation } = column;
    json!({
        "realizations": count,
        "mean": mean,
        "standard_deviation": standard_deviation,
        "correlation": correlation,
    })
}
