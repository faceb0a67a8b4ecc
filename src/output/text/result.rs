//! The table of a result, made from the text of `result.json`: a result that was stored looks as
//! one that was just computed.

use osteon_common::job::{JobKind, JobSpecification, Objective, Range, SearchMethod};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::{results_json, visible};
use serde_json::Value;

use super::{aligned, groups, identified, significant, solver};
use crate::output::ShownResult;
use crate::verdict;

/// The table.
pub(super) fn table(shown: &ShownResult<'_>) -> String {
    let Ok(value) = serde_json::from_str::<Value>(shown.json) else {
        return format!("the stored result is no JSON:\n{}\n", visible::lines(shown.json));
    };
    let mut text = String::new();
    match shown.kind {
        JobKind::Identification => identification(&mut text, &value, shown),
        JobKind::Propagation => propagation(&mut text, &value, shown),
    }
    let solver = solver::line(&value["solver"]);
    if !solver.is_empty() {
        text.push_str(&format!("\n{solver}\n"));
    }
    if let Some(digest) = value["digest"].as_str() {
        text.push_str(&format!("\ndigest {}\n", visible::line(digest)));
    }
    if let Some(directory) = shown.directory {
        text.push_str(&format!("files in {}\n", visible::path(directory)));
    }
    text
}

fn identification(text: &mut String, value: &Value, shown: &ShownResult<'_>) {
    let status = value["status"].as_str().unwrap_or("unknown");
    let reason = value["reason"].as_str().filter(|reason| !reason.is_empty());
    let headline = match status {
        "converged" => "Converged",
        // A search that stops early says itself why.
        "max_evaluations" if reason.is_some() => "Not converged",
        "max_evaluations" => "Not converged: the evaluations are used up",
        "cancelled" => "Cancelled",
        _ => "Failed",
    };
    text.push_str(headline);
    if let Some(reason) = reason {
        text.push_str(&format!(": {}", visible::lines(reason)));
    }
    let (evaluations, realizations) = (&value["evaluations"], &value["realizations"]);
    text.push_str(&format!("\n{evaluations} evaluations of {realizations} realizations"));
    if let Some(groups) = value["groups"].as_array() {
        text.push_str(&groups::table(groups));
        return;
    }
    // Without a finite cost a point says nothing about the data.
    let feasible = value["cost"].is_number();
    let Some(point) = results_json::best_point(shown.json).ok().filter(|_| feasible) else {
        text.push_str("; no point was feasible\n");
        return;
    };
    text.push_str(&format!("; at the best point {}\n\n", failures(value)));
    text.push_str(&moments(value, true));
    text.push_str(uncontrolled(value));
    text.push_str(&failure_bias(value));
    text.push_str(&kolmogorov(value));
    text.push('\n');
    text.push_str(&parameters(&point, shown.specification));
    if status != "failed" {
        let cost = value["cost"].as_f64().unwrap_or(f64::INFINITY);
        let search = &shown.specification.search;
        let matches = !by_likelihood(value) && cost <= search.cost_tolerance;
        text.push_str(&uniqueness(&point, shown.specification, matches));
        text.push_str(&identified::text(value));
    }
}

fn propagation(text: &mut String, value: &Value, shown: &ShownResult<'_>) {
    if let Some(reason) = verdict::propagation_failure(shown.specification, value) {
        text.push_str(&format!("Failed: {}\n", visible::lines(&reason)));
    }
    text.push_str(&format!("{} realizations; {}\n\n", value["realizations"], failures(value)));
    text.push_str(&moments(value, false));
    text.push_str(uncontrolled(value));
    text.push_str(&failure_bias(value));
}

fn failures(value: &Value) -> String {
    let counts = value["failures"].as_object();
    let counts: Vec<String> =
        counts.into_iter().flatten().map(|(kind, count)| format!("{count} {kind}")).collect();
    if counts.is_empty() {
        "none failed".to_owned()
    } else {
        format!("failed: {}", counts.join(", "))
    }
}

/// Moments with their standard errors, against the data's.
fn moments(value: &Value, with_data: bool) -> String {
    let row = |name: &str, key: &str, unit: &str| {
        let error = &value["velocity"]["standard_error"][key];
        let model = match (value["velocity"][key].as_f64(), error.as_f64()) {
            (Some(number), Some(error)) => with_error(number, error, unit),
            (Some(number), None) => format!("{}{unit}", significant(number, 8)),
            _ => "none".to_owned(),
        };
        let data = value["data"][key].as_f64();
        let interval = interval(&value["data"]["interval"], key);
        let data = data.map(|number| format!("{}{unit}{interval}", significant(number, 7)));
        [name.to_owned(), model, data.unwrap_or_default()]
    };
    let mut rows = Vec::new();
    if with_data {
        rows.push(["".to_owned(), "model ± standard error".to_owned(), "data".to_owned()]);
    }
    rows.push(row("mean velocity", "mean", " m/s"));
    rows.push(row("coefficient of variation", "coefficient_of_variation", ""));
    if let Some(cost) = value["cost"].as_f64() {
        let shown = if by_likelihood(value) {
            with_error(cost, value["cost_standard_error"].as_f64().unwrap_or(f64::NAN), " nats")
        } else {
            significant(cost, 4)
        };
        rows.push(["cost".to_owned(), shown, String::new()]);
    }
    aligned(&rows)
}

/// That the control variate which was asked for could not be used.
fn uncontrolled(value: &Value) -> &'static str {
    match (value["control_variate"].as_bool(), value["velocity"]["controlled"].as_bool()) {
        (Some(true), Some(false)) => {
            "moments without the control variate: it takes three realizations or more, and none failed\n"
        }
        _ => "",
    }
}

/// The confidence interval of a moment of the data, if it is known.
fn interval(interval: &Value, key: &str) -> String {
    let ends = (interval[key][0].as_f64(), interval[key][1].as_f64(), interval["level"].as_f64());
    let (Some(low), Some(high), Some(level)) = ends else { return String::new() };
    let [low, high] = [low, high].map(|end| significant(end, 5));
    format!(" ({} %: {low} to {high})", significant(100.0 * level, 3))
}

/// How large a bias the failed realizations may have left, if there are any.
fn failure_bias(value: &Value) -> String {
    if value["failures"].as_object().is_none_or(serde_json::Map::is_empty) {
        return String::new();
    }
    let bias = &value["velocity"]["failure_bias"];
    let (Some(mean), Some(variation)) =
        (bias["mean"].as_f64(), bias["coefficient_of_variation"].as_f64())
    else {
        return String::new();
    };
    let signed = |number: f64, digits| {
        format!("{}{}", if number < 0.0 { "-" } else { "+" }, significant(number.abs(), digits))
    };
    format!(
        "with velocities as expected of their tensors the failed realizations would add {} m/s to the mean\n\
         and {} to the coefficient of variation\n",
        signed(mean, 2),
        signed(variation, 2)
    )
}

/// Whether the data can be of the model's law, if that was tested.
fn kolmogorov(value: &Value) -> String {
    let test = &value["data"]["kolmogorov"];
    match (test["distance"].as_f64(), test["p_value"].as_f64()) {
        (Some(distance), Some(p)) => format!(
            "Kolmogorov's distance of data and model {}, p {} (too large, as the model was fitted)\n",
            significant(distance, 2),
            significant(p, 2)
        ),
        _ => String::new(),
    }
}

fn by_likelihood(value: &Value) -> bool {
    value["objective"].as_str() == Some(Objective::Likelihood.name())
}

/// A number with enough digits to compare it with the data's, and two digits of its standard
/// error.
fn with_error(number: f64, error: f64, unit: &str) -> String {
    format!("{} ± {}{unit}", significant(number, 7), significant(error, 2))
}

fn parameters(point: &Point, specification: &JobSpecification) -> String {
    let mut rows = Vec::new();
    for parameter in Parameter::ALL {
        let (scale, unit) = scale(parameter);
        let shown = |value: f64| significant(value * scale, 6);
        let range = match specification.range(parameter) {
            Range::Fixed(_) => "fixed".to_owned(),
            Range::Free { lower, upper, .. } => {
                format!("searched in {} to {}", shown(lower), shown(upper))
            }
        };
        let name = parameter.name().replace('_', " ");
        rows.push([name, format!("{}{unit}", shown(point.get(parameter))), range]);
    }
    aligned(&rows)
}

/// Factor and unit that make a parameter readable.
pub(super) fn scale(parameter: Parameter) -> (f64, &'static str) {
    match parameter.unit() {
        "Pa" => (1e-9, " GPa"),
        "" => (1.0, ""),
        _ => (1.0, " kg/m³"),
    }
}

/// Which of the found numbers the data determine, and what the others are.
fn uniqueness(point: &Point, specification: &JobSpecification, matches: bool) -> String {
    let free = |parameter| matches!(specification.range(parameter), Range::Free { .. });
    let searched = Parameter::ALL.into_iter().filter(|&parameter| free(parameter)).count();
    let dispersion = free(Parameter::Dispersion);
    let elastic = searched - usize::from(dispersion);
    let Ok(elasticity) = point.constants().elasticity() else { return String::new() };
    let speed = (elasticity.rows()[0][0] / point.density()).sqrt();
    let speed = format!("√(c1111/ρ) = {} m/s", significant(speed, 6));
    if elastic < 2 {
        return format!("\n{speed} at this point.\n");
    }
    let dispersion = if dispersion {
        format!(" and the dispersion {}", significant(point.dispersion(), 4))
    } else {
        String::new()
    };
    let known = match specification.objective {
        Objective::Moments => "Two moments",
        Objective::Likelihood => "The law of one velocity",
    };
    let others = if matches && specification.search.method == SearchMethod::Newton {
        "of the points that match the data, this is the one nearest to the start\n\
         (distances in units of the bounds)."
    } else {
        "the other values are one of many sets that match the data equally well."
    };
    format!(
        "\n{known} cannot fix {searched} parameters. The data determine only\n    \
         {speed}{dispersion};\n\
         {others}\n\
         Fix what is known from elsewhere (`fixed = …`) to narrow them down.\n"
    )
}
