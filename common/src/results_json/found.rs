//! What an identification found for a set of data, and what the data say of it.

use serde_json::{Map, Value, json};

use super::{failures, measured, moments};
use crate::inference::{
    Conclusions, Direction, Inference, NoiseErrors, Profile, Quantity, Sensitivity, Solution,
    Solutions, Spread, Spreads,
};
use crate::job::{Objective, Prior, Search, SearchMethod};
use crate::parameters::{Parameter, Point};
use crate::results::{BestPoint, GroupResult, JobResult, Moments};

/// The best point: cost, parameters, dispersion, moments.
pub(super) fn point(
    put: &mut impl FnMut(&str, Value) -> Option<Value>,
    objective: Objective,
    best: Option<&BestPoint>,
) {
    put("cost", json!(best.and_then(|best| best.cost)));
    if objective == Objective::Likelihood {
        put("cost_standard_error", json!(best.and_then(|best| best.cost_error)));
    }
    model(put, best);
    put("velocity", measured::model(best));
}

/// Mean model and dispersion of the best point.
pub(super) fn model(put: &mut impl FnMut(&str, Value) -> Option<Value>, best: Option<&BestPoint>) {
    let point = best.map(|best| best.point);
    put("parameters", mean_model(point.as_ref()));
    put("dispersion", json!(point.map(|point| point.dispersion())));
}

/// What was found for a group.
pub(super) fn group(objective: Objective, group: &GroupResult) -> Value {
    let best = group.best.as_ref();
    let mut object = Map::new();
    let mut put = |key: &str, value: Value| object.insert(key.to_owned(), value);
    put("name", json!(group.name));
    put("status", json!(group.status.name()));
    if let Some(reason) = &group.reason {
        put("reason", json!(reason));
    }
    point(&mut put, objective, best);
    let mut data = measured::data(&group.data, best);
    data["count"] = json!(group.data.count);
    put("data", data);
    put("failures", failures(best.map(|best| best.failures)));
    conclusions(&mut put, &group.conclusions);
    Value::Object(object)
}

/// How a search went, and what its best point is.
pub(super) fn search(result: &JobResult) -> Value {
    let (search, best) = (&result.search, result.best.as_ref());
    let mut object = Map::new();
    let mut put = |key: &str, value: Value| object.insert(key.to_owned(), value);
    put("method", json!(search.method.name()));
    put("max_evaluations", json!(search.max_evaluations));
    // A likelihood has none.
    let by_moments = result.objective == Objective::Moments;
    put("cost_tolerance", json!(by_moments.then_some(search.cost_tolerance)));
    put("size_tolerance", json!(search.size_tolerance));
    if search.method == SearchMethod::Simplex {
        put("initial_step", json!(search.initial_step));
    }
    put("starts", json!(search.starts));
    put("sensitivities", json!(search.sensitivities));
    if search.priors.iter().any(Option::is_some) {
        put("priors", priors(search));
        put("penalty", json!(best.and_then(|best| best.penalty)));
    }
    let meaning = best.and_then(|best| best.meaning);
    put("point", json!(meaning.map(|meaning| meaning.words())));
    put("below_noise_from", json!(best.and_then(|best| best.below_noise_from)));
    Value::Object(object)
}

fn priors(search: &Search) -> Value {
    let of = |(parameter, prior): (&Parameter, &Option<Prior>)| {
        let Prior { value, weight } = (*prior)?;
        Some((parameter.name().to_owned(), json!({ "value": value, "weight": weight })))
    };
    Value::Object(Parameter::ALL.iter().zip(&search.priors).filter_map(of).collect())
}

/// What the data say: derivatives, what is identified, what is not.
pub(super) fn conclusions(
    put: &mut impl FnMut(&str, Value) -> Option<Value>,
    conclusions: &Conclusions,
) {
    let Conclusions { inference, profiles, solutions } = conclusions;
    put("sensitivities", inference.as_ref().map_or(Value::Null, sensitivities));
    put("identified", inference.as_ref().map_or(Value::Null, identified));
    if !profiles.is_empty() {
        put("profiles", profiles.iter().map(profile).collect::<Map<_, _>>().into());
    }
    if let Some(solutions) = solutions {
        put("solutions", all_solutions(solutions));
    }
}

/// The six parameters of the mean model.
fn mean_model(point: Option<&Point>) -> Value {
    let names = Parameter::ALL.into_iter().filter(|&name| name != Parameter::Dispersion);
    let of = |name: Parameter| (name.name().to_owned(), json!(point.map(|point| point.get(name))));
    Value::Object(names.map(of).collect())
}

fn sensitivities(found: &Inference) -> Value {
    let of = |one: &Sensitivity| {
        let slopes =
            Moments { mean: one.mean, coefficient_of_variation: one.coefficient_of_variation };
        (one.parameter.name().to_owned(), moments(Some(slopes)))
    };
    Value::Object(found.sensitivities.iter().map(of).collect())
}

fn identified(found: &Inference) -> Value {
    let components = |components: &Vec<f64>| -> Value {
        let named = found.free.iter().zip(components);
        Value::Object(named.map(|(name, x)| (name.name().to_owned(), json!(x))).collect())
    };
    let direction = |direction: &Direction| {
        json!({
            "singular_value": direction.singular_value,
            "components": components(&direction.components),
        })
    };
    let parameters = found.parameters.iter().map(|(name, found)| {
        let known = found.known.map_or(Value::Null, |_| quantity(found));
        (name.name().to_owned(), known)
    });
    json!({
        "matched": found.matched,
        "level": found.level,
        "noise": noise(&found.noise),
        "bulk_velocity": quantity(&found.bulk_velocity),
        "dispersion": quantity(&found.dispersion),
        "parameters": Value::Object(parameters.collect()),
        "directions": found.fixed.iter().map(direction).collect::<Vec<_>>(),
        "free_directions": found.undetermined.iter().map(components).collect::<Vec<_>>(),
    })
}

fn noise(noise: &NoiseErrors) -> Value {
    let data = noise.data.map(|data| moments(Some(data)));
    json!({ "data": data, "sampling": moments(Some(noise.sampling)) })
}

fn quantity(quantity: &Quantity) -> Value {
    let known = quantity.known;
    json!({
        "value": quantity.value,
        "standard_error": known.map(|known| known.standard_error),
        "interval": known.map(|known| known.interval),
        "free_share": known.map(|known| known.free_share),
    })
}

fn profile(profile: &Profile) -> (String, Value) {
    let value = json!({ "values": profile.values, "costs": profile.costs });
    (profile.parameter.name().to_owned(), value)
}

/// The answers from all starts, and how far apart those are that match the data.
fn all_solutions(solutions: &Solutions) -> Value {
    let Solutions { points, matching, spread } = solutions;
    let point = |one: &Solution| {
        json!({
            "start": one.start,
            "cost": one.cost,
            "evaluations": one.evaluations,
            "parameters": mean_model(Some(&one.point)),
            "dispersion": one.point.dispersion(),
        })
    };
    let spread = spread.as_ref().map(|Spreads { parameters, entries }| {
        let parameters = Parameter::ALL.iter().zip(parameters);
        let parameters = parameters.map(|(name, over)| (name.name().to_owned(), range(over)));
        let entries =
            entries.iter().map(|(i, j, over)| (format!("{}{}", i + 1, j + 1), range(over)));
        json!({
            "parameters": Value::Object(parameters.collect()),
            "mandel": Value::Object(entries.collect()),
        })
    });
    json!({
        "matching": matching,
        "spread": spread,
        "points": points.iter().map(point).collect::<Vec<_>>(),
    })
}

fn range(spread: &Spread) -> Value {
    json!({ "smallest": spread.smallest, "largest": spread.largest, "mean": spread.mean })
}
