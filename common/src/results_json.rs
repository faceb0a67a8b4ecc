//! Results as JSON: the object of `result.json` and of `--json`.
//!
//! Keys stand in a fixed order; a number that is not finite, or that there is none of, is null;
//! every other one is the shortest decimal that reads back to the same bits.

use serde_json::{Map, Value, json};
use thiserror::Error;

use crate::job::JobKind;
use crate::outcome::FailureCounts;
use crate::parameters::{Parameter, Point};
use crate::results::{Estimate, EstimatedError, JobResult, Moments};
use crate::sampling::NominalSampling;
use crate::settings::{Method, Picking, SolverSettings};
use crate::version::{Program, RESULT_SCHEMA};

mod found;
mod measured;

/// Why a text is no `result.json` with a best point.
#[derive(Debug, Error)]
pub enum ResultError {
    /// It is no JSON.
    #[error("not valid JSON: {0}")]
    Malformed(serde_json::Error),
    /// There is no group of this name.
    #[error("there is no group {name:?}; the groups are {}", listed(.names))]
    NoGroup {
        /// The name.
        name: String,
        /// Those there are.
        names: Vec<String>,
    },
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

/// The object of an identification, with a final newline.
pub fn identification(result: &JobResult) -> String {
    let best = result.best.as_ref();
    let mut object = Map::new();
    let mut put = |key: &str, value: Value| object.insert(key.to_owned(), value);
    head(&mut put, JobKind::Identification.name());
    put("status", json!(result.status.name()));
    if let Some(failure) = result.failure {
        put("failure", json!(failure.name()));
    }
    if let Some(reason) = &result.reason {
        put("reason", json!(reason));
    }
    put("digest", json!(result.digest));
    put("objective", json!(result.objective.name()));
    found::point(&mut put, result.objective, best);
    if let Some(data) = &result.data {
        put("data", measured::data(data, best));
    }
    put("evaluations", json!(result.evaluations));
    put("realizations", json!(result.realizations));
    put("failures", failures(best.map(|best| best.failures)));
    put("seed", json!(result.seed));
    sampling(&mut put, result);
    put("search", found::search(result));
    // There are data, or groups of them.
    if result.data.is_some() {
        found::conclusions(&mut put, &result.conclusions);
    } else {
        let group = |group| found::group(result.objective, group);
        put("groups", result.groups.iter().map(group).collect());
    }
    put("solver", solver_of(result));
    put("picking", picking(&result.picking));
    program(&mut put, &result.program);
    text(object)
}

/// The object of a propagation, with a final newline.
pub fn propagation(result: &JobResult) -> String {
    let best = result.best.as_ref();
    let mut object = Map::new();
    let mut put = |key: &str, value: Value| object.insert(key.to_owned(), value);
    head(&mut put, JobKind::Propagation.name());
    put("realizations", json!(result.realizations));
    put("seed", json!(result.seed));
    sampling(&mut put, result);
    found::model(&mut put, best);
    put("failures", failures(best.map(|best| best.failures)));
    put("velocity", measured::model(best));
    put("solver", solver_of(result));
    put("picking", picking(&result.picking));
    put("digest", json!(result.digest));
    program(&mut put, &result.program);
    text(object)
}

/// What every result in JSON begins with: the revision of its keys, and of what it is the result.
pub fn head(put: &mut impl FnMut(&str, Value) -> Option<Value>, kind: &str) {
    put("schema", json!(RESULT_SCHEMA));
    put("kind", json!(kind));
}

/// What every result in JSON ends with: the program that computed it.
pub fn program(put: &mut impl FnMut(&str, Value) -> Option<Value>, program: &Program) {
    put("version", json!(program.version));
    put("numerics", json!(program.numerics));
    put("commit", json!(program.commit));
}

/// The criterion of a first arrival.
pub fn picking(picking: &Picking) -> Value {
    json!({"extremum": picking.extremum.name(), "threshold": picking.threshold})
}

fn solver_of(result: &JobResult) -> Value {
    let estimated_error = result.best.as_ref().and_then(|best| best.estimated_error);
    solver(&result.solver, result.nominal, errors(estimated_error))
}

/// How velocities are computed: method, refinement, the method's sampling, and an estimate of their
/// relative error.
///
/// Of the exact method: highest frequency (`band`, Hz), `period` (s) and (frequency, wavenumber)
/// `pairs` of its `nominal` sampling, at the usual speeds of bone; a realization with faster waves may
/// use others.
pub fn solver(
    settings: &SolverSettings,
    nominal: Option<NominalSampling>,
    estimated_error: Value,
) -> Value {
    let mut object = Map::new();
    let mut put = |key: &str, value: Value| object.insert(key.to_owned(), value);
    put("method", json!(settings.method.name()));
    put("refinement", json!(settings.refinement));
    match settings.method {
        Method::Exact => {
            put("band", json!(nominal.map(|nominal| nominal.band)));
            put("period", json!(nominal.map(|nominal| nominal.period)));
            put("pairs", json!(nominal.map(|nominal| nominal.pairs)));
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

/// The best point in the text of an identification's `result.json`.
///
/// # Errors
/// When the text is no JSON, or holds no point.
pub fn best_point(text: &str) -> Result<Point, ResultError> {
    point_of(&serde_json::from_str(text).map_err(ResultError::Malformed)?)
}

/// The best point of the group `name` in the text of an identification's `result.json`.
///
/// # Errors
/// When the text is no JSON, or holds no such group, or no point of it.
pub fn best_point_of_group(text: &str, name: &str) -> Result<Point, ResultError> {
    let result: Value = serde_json::from_str(text).map_err(ResultError::Malformed)?;
    let groups = result.get("groups").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    match groups.iter().find(|group| group["name"] == name) {
        Some(group) => point_of(group),
        None => Err(ResultError::NoGroup { name: name.to_owned(), names: names(groups) }),
    }
}

/// Names of the groups in the text of an identification's `result.json`; none where there are none.
///
/// # Errors
/// When the text is no JSON.
pub fn group_names(text: &str) -> Result<Vec<String>, ResultError> {
    let result: Value = serde_json::from_str(text).map_err(ResultError::Malformed)?;
    Ok(result
        .get("groups")
        .and_then(Value::as_array)
        .map(|groups| names(groups))
        .unwrap_or_default())
}

fn names(groups: &[Value]) -> Vec<String> {
    groups.iter().filter_map(|group| group["name"].as_str()).map(str::to_owned).collect()
}

/// The best point in the object of a job, or of a group.
fn point_of(result: &Value) -> Result<Point, ResultError> {
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

/// Most groups that a message lists.
const LISTED_MAX: usize = 20;

/// Names in a message.
pub fn listed(names: &[String]) -> String {
    let mut shown: Vec<String> =
        names.iter().take(LISTED_MAX).map(|name| format!("{name:?}")).collect();
    if names.len() > LISTED_MAX {
        shown.push(format!("and {} more", names.len() - LISTED_MAX));
    }
    if shown.is_empty() { "none".to_owned() } else { shown.join(", ") }
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
