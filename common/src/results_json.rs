//! Results as JSON: the object of `result.json` and of `--json`.
//!
//! Keys stand in a fixed order; a number that is not finite, or that there is none of, is null;
//! every other one is the shortest decimal that reads back to the same bits.

use serde_json::{Map, Value, json};
use thiserror::Error;

use crate::case::Setup;
use crate::job::{Data, JobSpecification, Objective, SearchMethod};
use crate::outcome::FailureCounts;
use crate::parameters::{Parameter, Point};
use crate::results::{Estimate, EstimatedError, JobResult, Moments};
use crate::sampling;
use crate::settings::Method;

mod measured;

/// Why a text is no `result.json` with a best point.
#[derive(Debug, Error)]
pub enum ResultError {
    /// It is no JSON.
    #[error("not valid JSON: {0}")]
    Malformed(serde_json::Error),
    /// A number of the point is not there: another kind of file, or the job found no point.
    #[error(
        "`{key}` is {found}; it must be a number (the result of an identification that found a point)"
    )]
    NoNumber {
        /// The key.
        key: String,
        /// What is there instead.
        found: &'static str,
    },
}

/// The object of the identification that `specification` asks for, with a final newline.
pub fn identification(result: &JobResult, specification: &JobSpecification) -> String {
    let JobSpecification { setup, objective, .. } = specification;
    let best = result.best.as_ref();
    let point = best.map(|best| best.point);
    let of_point = |parameter| json!(point.map(|point| point.get(parameter)));
    let mut object = Map::new();
    let mut put = |key: &str, value: Value| object.insert(key.to_owned(), value);
    put("status", json!(result.status.name()));
    if let Some(reason) = &result.reason {
        put("reason", json!(reason));
    }
    put("digest", json!(result.digest));
    put("objective", json!(objective.name()));
    put("cost", json!(best.and_then(|best| best.cost)));
    if *objective == Objective::Likelihood {
        put("cost_standard_error", json!(best.and_then(|best| best.cost_error)));
    }
    let mean_model = Parameter::ALL.into_iter().filter(|&name| name != Parameter::Dispersion);
    let parameters = mean_model.map(|name| (name.name().to_owned(), of_point(name)));
    put("parameters", Value::Object(parameters.collect()));
    put("dispersion", of_point(Parameter::Dispersion));
    put("velocity", measured::model(best));
    let velocities = match &specification.data {
        Some(Data::Velocities(velocities)) => Some(velocities.as_slice()),
        Some(Data::Moments { .. }) | None => None,
    };
    put("data", measured::data(result.data, velocities, best));
    put("evaluations", json!(result.evaluations));
    put("realizations", json!(result.realizations));
    put("failures", failures(best.map(|best| best.failures)));
    put("seed", json!(result.seed));
    sampling(&mut put, result);
    put("search", search(specification, best.and_then(|best| best.cost)));
    let picking = &result.picking;
    put("solver", solver(setup, errors(best.and_then(|best| best.estimated_error))));
    put("picking", json!({"extremum": picking.extremum.name(), "threshold": picking.threshold}));
    put("version", json!(result.version));
    text(object)
}

/// The object of a propagation in this setup, with a final newline.
pub fn propagation(result: &JobResult, setup: &Setup) -> String {
    let best = result.best.as_ref();
    let mut object = Map::new();
    let mut put = |key: &str, value: Value| object.insert(key.to_owned(), value);
    put("realizations", json!(result.realizations));
    sampling(&mut put, result);
    put("failures", failures(best.map(|best| best.failures)));
    put("velocity", measured::model(best));
    put("solver", solver(setup, errors(best.and_then(|best| best.estimated_error))));
    put("digest", json!(result.digest));
    text(object)
}

/// How velocities of a setup are computed: method, refinement, the method's sampling, and an
/// estimate of their relative error.
///
/// Of the exact method: highest frequency (`band`, Hz), `period` (s) and (frequency, wavenumber)
/// `pairs` at the usual speeds of bone; a realization with faster waves may use others.
pub fn solver(setup: &Setup, estimated_error: Value) -> Value {
    let settings = &setup.solver;
    let mut object = Map::new();
    let mut put = |key: &str, value: Value| object.insert(key.to_owned(), value);
    put("method", json!(settings.method.name()));
    put("refinement", json!(settings.refinement));
    match settings.method {
        Method::Exact => {
            let sampling = sampling::nominal(setup);
            put("band", json!(sampling.first_band));
            put("period", json!(sampling.period));
            put("pairs", json!(sampling.pairs(sampling.first_band).round() as u64));
        }
        Method::Hybrid => {
            put("element_size", json!(settings.element_size));
            put("element_order", json!(settings.element_order));
            put("time_step", json!(settings.time_step));
        }
    }
    put("estimated_error", estimated_error);
    Value::Object(object)
}

/// How a search went, and what its best point is, given the cost there.
fn search(specification: &JobSpecification, cost: Option<f64>) -> Value {
    let search = &specification.search;
    // A likelihood has no cost that is low enough.
    let by_moments = specification.objective == Objective::Moments;
    let tolerance = by_moments.then_some(search.cost_tolerance);
    let mut object = Map::new();
    let mut put = |key: &str, value: Value| object.insert(key.to_owned(), value);
    put("method", json!(search.method.name()));
    put("max_evaluations", json!(search.max_evaluations));
    put("cost_tolerance", json!(tolerance));
    put("size_tolerance", json!(search.size_tolerance));
    if search.method == SearchMethod::Simplex {
        put("initial_step", json!(search.initial_step));
    }
    put("point", json!(cost.map(|cost| meaning(search.method, cost, tolerance))));
    Value::Object(object)
}

/// What the best point of a search is, by its cost and what is low enough.
fn meaning(method: SearchMethod, cost: f64, tolerance: Option<f64>) -> &'static str {
    match method {
        _ if tolerance.is_none_or(|tolerance| cost > tolerance) => {
            "of the points evaluated, the one with the least cost"
        }
        SearchMethod::Simplex => {
            "of the points that match the data, the one where the simplex ended"
        }
        SearchMethod::Newton => "of the points that match the data, the one nearest to the start",
    }
}

/// The best point in the text of an identification's `result.json`.
///
/// # Errors
/// When the text is no JSON, or holds no point.
pub fn best_point(text: &str) -> Result<Point, ResultError> {
    let result: Value = serde_json::from_str(text).map_err(ResultError::Malformed)?;
    let mut point = Point([0.0; 7]);
    for (slot, parameter) in point.0.iter_mut().zip(Parameter::ALL) {
        let name = parameter.name();
        let (key, found) = match parameter {
            Parameter::Dispersion => (name.to_owned(), result.get(name)),
            _ => {
                let parameters = result.get("parameters");
                (format!("parameters.{name}"), parameters.and_then(|table| table.get(name)))
            }
        };
        *slot = match found.and_then(Value::as_f64) {
            Some(number) => number,
            None => return Err(ResultError::NoNumber { key, found: kind(found) }),
        };
    }
    Ok(point)
}

fn kind(found: Option<&Value>) -> &'static str {
    match found {
        None => "missing",
        Some(Value::Null) => "null",
        Some(Value::Bool(_)) => "a boolean",
        Some(Value::Number(_)) => "a number out of range",
        Some(Value::String(_)) => "a string",
        Some(Value::Array(_)) => "a list",
        Some(Value::Object(_)) => "an object",
    }
}

fn moments(moments: Option<Moments>) -> Value {
    json!({
        "mean": moments.map(|moments| moments.mean),
        "coefficient_of_variation": moments.map(|moments| moments.coefficient_of_variation),
    })
}

fn estimate(estimate: Option<Estimate>) -> Value {
    let mut value = moments(estimate.map(|estimate| estimate.moments));
    value["standard_error"] = moments(estimate.map(|estimate| estimate.standard_error));
    value["controlled"] = json!(estimate.map(|estimate| estimate.controlled));
    value
}

/// How the germs were drawn, and what was made of it.
fn sampling(put: &mut impl FnMut(&str, Value) -> Option<Value>, result: &JobResult) {
    put("sampling", json!(result.sampling.name()));
    put("scrambles", json!(result.scrambles));
    put("control_variate", json!(result.control_variate));
}

fn errors(errors: Option<EstimatedError>) -> Value {
    json!({
        "median": errors.map(|errors| errors.median),
        "largest": errors.map(|errors| errors.largest),
    })
}

fn failures(failures: Option<FailureCounts>) -> Value {
    let failures = failures.unwrap_or_default();
    Value::Object(
        failures.iter().map(|(kind, count)| (kind.name().to_owned(), json!(count))).collect(),
    )
}

fn text(object: Map<String, Value>) -> String {
    format!("{:#}\n", Value::Object(object))
}
