//! What an identification found for a set of data, and what the data say of it.

use serde_json::{Map, Value, json};

use super::{failures, measured, moments};
use crate::inference::{
    self, CONFIDENCE, Direction, Inference, Noise, Profile, Quantity, Sensitivity, Solution,
    Spread, Spreads,
};
use crate::job::{JobSpecification, Objective, Prior, Search, SearchMethod};
use crate::parameters::{Parameter, Point};
use crate::results::{BestPoint, Evaluation, GroupResult, Moments};

/// What was asked, and every evaluation that was made for it.
pub(super) struct Asked<'a> {
    pub(super) specification: &'a JobSpecification,
    pub(super) history: &'a [Evaluation],
}

/// The best point: cost, parameters, dispersion, moments.
pub(super) fn point(
    put: &mut impl FnMut(&str, Value) -> Option<Value>,
    specification: &JobSpecification,
    best: Option<&BestPoint>,
) {
    put("cost", json!(best.and_then(|best| best.cost)));
    if specification.objective == Objective::Likelihood {
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
pub(super) fn group(asked: &Asked<'_>, set: usize, group: &GroupResult) -> Value {
    let best = group.best.as_ref();
    let mut object = Map::new();
    let mut put = |key: &str, value: Value| object.insert(key.to_owned(), value);
    put("name", json!(group.name));
    put("status", json!(group.status.name()));
    if let Some(reason) = &group.reason {
        put("reason", json!(reason));
    }
    point(&mut put, asked.specification, best);
    let velocities = asked.specification.data.as_ref().and_then(|data| data.velocities(set));
    let mut data = measured::data(Some(group.data), velocities, best);
    data["count"] = json!(velocities.map(<[f64]>::len));
    put("data", data);
    put("failures", failures(best.map(|best| best.failures)));
    inference(&mut put, asked, set, best);
    Value::Object(object)
}

/// How a search went, and what its best point is.
pub(super) fn search(asked: &Asked<'_>, best: Option<&BestPoint>) -> Value {
    let search = &asked.specification.search;
    let mut object = Map::new();
    let mut put = |key: &str, value: Value| object.insert(key.to_owned(), value);
    put("method", json!(search.method.name()));
    put("max_evaluations", json!(search.max_evaluations));
    put("cost_tolerance", json!(tolerance(asked.specification)));
    put("size_tolerance", json!(search.size_tolerance));
    if search.method == SearchMethod::Simplex {
        put("initial_step", json!(search.initial_step));
    }
    put("starts", json!(search.starts));
    put("sensitivities", json!(search.sensitivities));
    if asked.specification.has_priors() {
        put("priors", priors(search));
        put("penalty", json!(best.map(|best| asked.specification.penalty(&best.point))));
    }
    let cost = best.and_then(|best| best.cost);
    put("point", json!(cost.map(|cost| meaning(asked.specification, cost))));
    let by_moments = asked.specification.objective == Objective::Moments;
    let below = best.filter(|_| by_moments && !asked.specification.has_priors());
    let below = below.and_then(|best| inference::first_below_noise(0, best, asked.history));
    put("below_noise_from", json!(below));
    Value::Object(object)
}

fn priors(search: &Search) -> Value {
    let of = |(parameter, prior): (&Parameter, &Option<Prior>)| {
        let Prior { value, weight } = (*prior)?;
        Some((parameter.name().to_owned(), json!({ "value": value, "weight": weight })))
    };
    Value::Object(Parameter::ALL.iter().zip(&search.priors).filter_map(of).collect())
}

/// The cost that is low enough; a likelihood has none.
fn tolerance(specification: &JobSpecification) -> Option<f64> {
    let by_moments = specification.objective == Objective::Moments;
    by_moments.then_some(specification.search.cost_tolerance)
}

/// What the data say: derivatives, what is identified, what is not.
pub(super) fn inference(
    put: &mut impl FnMut(&str, Value) -> Option<Value>,
    asked: &Asked<'_>,
    set: usize,
    best: Option<&BestPoint>,
) {
    let specification = asked.specification;
    let found = best.and_then(|best| inference::inference(specification, set, best, asked.history));
    put("sensitivities", found.as_ref().map_or(Value::Null, sensitivities));
    put("identified", found.as_ref().map_or(Value::Null, identified));
    // Those of a likelihood, or with priors, would be another matter.
    if let (Some(best), Some(data), Objective::Moments) =
        (best, &specification.data, specification.objective)
        && let Some(velocity) = best.velocity
        && !specification.has_priors()
    {
        let data = data.moments(set);
        let profiles = inference::profiles(specification, &best.point, velocity.moments, data);
        put("profiles", profiles.iter().map(profile).collect::<Map<_, _>>().into());
    }
    if specification.search.starts > 1 {
        put("solutions", solutions(asked, set, best));
    }
}

/// What the best point of a search is, by its cost.
fn meaning(specification: &JobSpecification, cost: f64) -> &'static str {
    match specification.search.method {
        _ if tolerance(specification).is_none_or(|tolerance| cost > tolerance) => {
            "of the points evaluated, the one with the least cost"
        }
        SearchMethod::Simplex => {
            "of the points that match the data, the one where the simplex ended"
        }
        SearchMethod::Newton => "of the points that match the data, the one nearest to the start",
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
        "level": CONFIDENCE,
        "noise": noise(&found.noise),
        "bulk_velocity": quantity(&found.bulk_velocity),
        "dispersion": quantity(&found.dispersion),
        "parameters": Value::Object(parameters.collect()),
        "directions": found.fixed.iter().map(direction).collect::<Vec<_>>(),
        "free_directions": found.undetermined.iter().map(components).collect::<Vec<_>>(),
    })
}

/// Standard errors of both moments, relative.
fn noise(noise: &Noise) -> Value {
    let errors = |variances: [f64; 2]| {
        let [mean, coefficient_of_variation] = variances.map(f64::sqrt);
        moments(Some(Moments { mean, coefficient_of_variation }))
    };
    let data = noise.data.map(|([[mean, _], [_, variation]], _)| errors([mean, variation]));
    json!({ "data": data, "sampling": errors(noise.model) })
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
fn solutions(asked: &Asked<'_>, set: usize, best: Option<&BestPoint>) -> Value {
    let solutions = inference::solutions(set, asked.history);
    let cost = best.and_then(|best| best.cost).unwrap_or(f64::INFINITY);
    let most = tolerance(asked.specification).map_or(cost, |tolerance| tolerance.max(cost));
    let matching: Vec<Point> =
        solutions.iter().filter(|one| one.cost <= most).map(|one| one.point).collect();
    let point = |one: &Solution| {
        json!({
            "start": one.start,
            "cost": one.cost,
            "evaluations": one.evaluations,
            "parameters": mean_model(Some(&one.point)),
            "dispersion": one.point.dispersion(),
        })
    };
    let spread = inference::spread(&matching).map(|Spreads { parameters, entries }| {
        let parameters = Parameter::ALL.iter().zip(&parameters);
        let parameters = parameters.map(|(name, over)| (name.name().to_owned(), range(over)));
        let entries =
            entries.iter().map(|(i, j, over)| (format!("{}{}", i + 1, j + 1), range(over)));
        json!({
            "parameters": Value::Object(parameters.collect()),
            "mandel": Value::Object(entries.collect()),
        })
    });
    json!({
        "matching": matching.len(),
        "spread": spread,
        "points": solutions.iter().map(point).collect::<Vec<_>>(),
    })
}

fn range(spread: &Spread) -> Value {
    json!({ "smallest": spread.smallest, "largest": spread.largest, "mean": spread.mean })
}
