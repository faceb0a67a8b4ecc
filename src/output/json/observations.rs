//! The observables of a job's realizations as JSON.

use osteon_common::version::Program;
use serde_json::{Map, Value, json};

use crate::output::ShownObservations;
use crate::program;
use osteon_local::observations::{ObservableMoments, ObservationSummary};

/// Returns the object; what no realization has is null.
pub(super) fn value(shown: &ShownObservations<'_>) -> Value {
    let ShownObservations { point, summary, .. } = *shown;
    let ObservationSummary { other_extremum, realizations, failures, velocity, observables } =
        summary;
    let parameters: Map<String, Value> =
        point.given().map(|(name, value)| (name.name().to_owned(), value.into())).collect();
    let failures: Map<String, Value> =
        failures.iter().map(|(kind, count)| (kind.name().to_owned(), count.into())).collect();
    let Program { version, numerics, commit } = program::current();
    let mut value = json!({
        "point": parameters,
        "realizations": realizations,
        "failures": failures,
        "velocity": column(*velocity),
        "other_extremum": other_extremum.name(),
        "version": version,
        "numerics": numerics,
        "commit": commit,
    });
    for (observable, moments) in observables.iter() {
        value[observable.name()] = column(*moments);
    }
    value
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
