//! The estimated cost of a job as JSON.

use osteon_common::job::{Data, JobKind, JobSpecification};
use osteon_common::parameters::Parameter;
use serde_json::{Value, json};

use crate::output::ShownCost;
use osteon_local::cost::PlaceCost;

/// Returns the object; what could not be measured is null.
pub(super) fn value(shown: &ShownCost<'_>) -> Value {
    let ShownCost { specification, cost, isa } = *shown;
    let search = &specification.search;
    let searched = specification.kind == JobKind::Identification;
    let posterior = specification.posterior.map(|posterior| posterior.max_evaluations);
    let count =
        |places: &[PlaceCost], of: fn(&PlaceCost) -> usize| places.iter().map(of).sum::<usize>();
    json!({
        "kind": specification.kind.name(),
        "method": searched.then(|| search.method.name()),
        "objective": searched.then(|| specification.objective.name()),
        "free": specification.free().map(Parameter::name).collect::<Vec<_>>(),
        "sets": specification.data.as_ref().map_or(1, Data::searchable_count),
        "starts": search.starts,
        "posterior": posterior.is_some(),
        "realizations": specification.monte_carlo.realizations,
        "max_evaluations": specification.evaluations_max(),
        "evaluations": [cost.expected.fewest, cost.expected.most],
        "processor_s": cost.processor_s(),
        "wall_s": cost.wall_s(),
        "cores": cost.cores,
        "instruction_set": isa.name(),
        "start": cost.start.as_ref().map(|start| place(specification, start)),
        "box": {
            "points": cost.places.len(),
            "unmeasured": cost.unmeasured,
            "realizations": count(&cost.places, |place| place.measured),
            "failures": count(&cost.places, |place| place.failed),
            "median_ms": cost.median_s().map(milliseconds),
            "worst": cost.worst().map(|worst| place(specification, worst)),
        },
    })
}

fn place(specification: &JobSpecification, place: &PlaceCost) -> Value {
    let at = specification
        .free()
        .map(|parameter| (parameter.name().to_owned(), Value::from(place.point.get(parameter))));
    json!({
        "mean_ms": milliseconds(place.mean_s),
        "realizations": place.measured,
        "failures": place.failed,
        "parameters": at.collect::<serde_json::Map<_, _>>(),
    })
}

fn milliseconds(seconds: f64) -> f64 {
    seconds * 1e3
}
