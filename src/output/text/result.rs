//! The table of a result, made from the text of `result.json`: a result that was stored looks as
//! one that was just computed.

use osteon_common::job::{JobKind, JobSpecification, Objective, Range};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::{results_json, visible};
use serde_json::Value;

use super::layout::{aligned, glued, wrapped};
use super::number::{DIGITS, Decimals, FREE_DIGITS, digits, measured, significant};
use super::{fit, groups, identified, solver};
use crate::output::ShownResult;
use crate::verdict;

/// The table.
pub(super) fn table(shown: &ShownResult<'_>) -> String {
    let Ok(value) = serde_json::from_str::<Value>(shown.json) else {
        return format!("the stored result is not valid JSON:\n{}\n", visible::lines(shown.json));
    };
    let mut text = String::new();
    match shown.kind {
        JobKind::Identification => identification(&mut text, &value, shown),
        JobKind::Propagation => propagation(&mut text, &value, shown),
    }
    let solver = solver::line(&value["solver"]);
    if !solver.is_empty() {
        text.push_str(&format!("\n{}", wrapped(&solver)));
    }
    if let Some(digest) = value["digest"].as_str() {
        text.push_str(&format!("\ndigest {}\n", visible::line(digest)));
    }
    if let Some(directory) = shown.directory {
        text.push_str(&wrapped(&format!("files in {}", visible::path(directory))));
    }
    text
}

fn identification(text: &mut String, value: &Value, shown: &ShownResult<'_>) {
    let specification = shown.specification;
    text.push_str(&headline(value, specification));
    let (evaluations, realizations) = (&value["evaluations"], &value["realizations"]);
    let mut count = format!("{evaluations} evaluations of {realizations} realizations");
    if let Some(measured) = value["sensitivities"].as_object() {
        count.push_str(&format!(" and {} for derivatives", measured.len()));
    }
    if let Some(groups) = value["groups"].as_array() {
        text.push_str(&count);
        text.push_str(&groups::table(groups));
        return;
    }
    // Without a finite cost a point says nothing about the data.
    let feasible = value["cost"].is_number();
    let Some(point) = results_json::best_point(shown.json).ok().filter(|_| feasible) else {
        text.push_str(&wrapped(&format!("{count}; no point was feasible")));
        return;
    };
    text.push_str(&wrapped(&format!("{count}; {} at the best point", failures(value))));
    text.push('\n');
    text.push_str(&moments(value, true));
    text.push_str(&notes(value));
    text.push('\n');
    text.push_str(&parameters(value, &point, specification));
    if value["status"] == "failed" {
        return;
    }
    if fit::fits(value, specification) {
        text.push_str(&fit::uniqueness(value, &point, specification));
        text.push_str(&identified::text(value));
    } else {
        text.push_str(&fit::misfit(value, &point, specification));
    }
}

/// How the search ended, and why.
fn headline(value: &Value, specification: &JobSpecification) -> String {
    let status = value["status"].as_str().unwrap_or("unknown");
    let reason = value["reason"].as_str().filter(|reason| !reason.is_empty());
    let headline = match status {
        "converged" => "Converged",
        "max_evaluations" => "Not converged",
        "cancelled" => "Cancelled",
        _ => "Failed",
    };
    let used_up = || {
        let search = &specification.search;
        let each = if search.starts > 1 { " from each start" } else { "" };
        format!("reached the limit of {} evaluations{each}", search.max_evaluations)
    };
    // A search that stops early says itself why.
    let reason = match reason {
        None if status == "max_evaluations" => Some(used_up()),
        reason => reason.map(str::to_owned),
    };
    let Some(reason) = reason else { return format!("{headline}\n") };
    // A case file may follow the first line of a reason; it must stay as it is.
    let (first, rest) = reason.split_once('\n').unwrap_or((&reason, ""));
    let first = wrapped(&format!("{headline}: {first}"));
    if rest.is_empty() { first } else { format!("{first}{}\n", visible::lines(rest.trim_end())) }
}

fn propagation(text: &mut String, value: &Value, shown: &ShownResult<'_>) {
    if let Some(reason) = verdict::propagation_failure(shown.specification, value) {
        text.push_str(&wrapped(&format!("Failed: {reason}")));
    }
    text.push_str(&wrapped(&format!(
        "{} realizations; {}",
        value["realizations"],
        failures(value)
    )));
    text.push('\n');
    text.push_str(&moments(value, false));
    text.push_str(&notes(value));
}

/// How many realizations failed, by kind, by its name.
fn failures(value: &Value) -> String {
    let failures = value["failures"].as_object().into_iter().flatten();
    let named = failures.map(|(kind, count)| (kind.replace('_', " "), count.as_u64().unwrap_or(0)));
    let counts: Vec<(String, u64)> = named.collect();
    let all = failure_count(value);
    match counts.as_slice() {
        [] => "no failures".to_owned(),
        [(kind, 1)] => format!("1 failure ({kind})"),
        [(kind, _)] => format!("{all} failures ({kind})"),
        counts => {
            let counts: Vec<String> =
                counts.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
            format!("{all} failures ({})", counts.join(", "))
        }
    }
}

fn failure_count(value: &Value) -> u64 {
    let counts = value["failures"].as_object().into_iter().flatten();
    // A file may say anything.
    counts.filter_map(|(_, count)| count.as_u64()).fold(0, u64::saturating_add)
}

/// Moments with their standard errors, against the data's.
fn moments(value: &Value, with_data: bool) -> String {
    let row = |name: &str, key: &str| {
        let error = value["velocity"]["standard_error"][key].as_f64().unwrap_or(f64::NAN);
        let model = value["velocity"][key].as_f64();
        let [data, interval] = of_data(value, key, error);
        let model = model.map_or("none".to_owned(), |number| measured(number, error));
        [name.to_owned(), model, data, interval]
    };
    let mut rows = Vec::new();
    if with_data {
        let level = value["data"]["interval"]["level"].as_f64();
        let interval = level.map(|level| format!("{} % interval", significant(100.0 * level, 3)));
        let header = ["", "model ± standard error", "data", &interval.unwrap_or_default()];
        rows.push(header.map(str::to_owned));
    }
    rows.push(row("mean velocity (m/s)", "mean"));
    rows.push(row("coefficient of variation", "coefficient_of_variation"));
    if let Some(cost) = value["cost"].as_f64() {
        let error = value["cost_standard_error"].as_f64().unwrap_or(f64::NAN);
        let (name, shown) = if by_likelihood(value) {
            ("cost (nats)", measured(cost, error))
        } else {
            ("cost", digits(cost, 3))
        };
        rows.push([name.to_owned(), shown, String::new(), String::new()]);
    }
    aligned(&rows)
}

/// A moment of the data and its interval: to the decimal that the interval leaves, or where there
/// is none, to that of the model's error.
fn of_data(value: &Value, key: &str, error_of_model: f64) -> [String; 2] {
    let Some(number) = value["data"][key].as_f64() else { return [String::new(), String::new()] };
    let ends = &value["data"]["interval"][key];
    let (Some(low), Some(high)) = (ends[0].as_f64(), ends[1].as_f64()) else {
        let shown = Decimals::of_error(error_of_model).map(|decimals| decimals.show(number));
        return [shown.unwrap_or_else(|| digits(number, DIGITS)), String::new()];
    };
    // An interval of 95 % reaches two standard errors to each side.
    match Decimals::of_error((high - low) / 4.0) {
        Some(decimals) => {
            [decimals.show(number), format!("{} to {}", decimals.show(low), decimals.show(high))]
        }
        None => [digits(number, DIGITS), String::new()],
    }
}

/// What is to be known of the moments besides.
fn notes(value: &Value) -> String {
    let notes = [uncontrolled(value), effect_of_failures(value), kolmogorov(value)];
    notes.into_iter().flatten().map(|note| wrapped(&note)).collect()
}

/// That the control variate which was asked for could not be used.
fn uncontrolled(value: &Value) -> Option<String> {
    let asked = value["control_variate"].as_bool()?;
    let used = value["velocity"]["controlled"].as_bool()?;
    let failed = match failure_count(value) {
        0 => String::new(),
        count => format!(" ({count} failed)"),
    };
    (asked && !used).then(|| {
        format!(
            "Control variate not used: it requires at least three realizations and no \
             failures{failed}."
        )
    })
}

/// How large a bias the failed realizations may have left, if there are any.
fn effect_of_failures(value: &Value) -> Option<String> {
    value["failures"].as_object().filter(|kinds| !kinds.is_empty())?;
    let bias = &value["velocity"]["failure_bias"];
    let signed = |key: &str| {
        let number = bias[key].as_f64()?;
        let sign = if number < 0.0 { "-" } else { "+" };
        Some(format!("{sign}{}", digits(number.abs(), 2)))
    };
    let mean = glued(&format!("{} m/s", signed("mean")?));
    let variation = signed("coefficient_of_variation")?;
    Some(format!(
        "Had the failed realizations succeeded, the mean would change by an estimated {mean} and \
         the coefficient of variation by {variation}."
    ))
}

/// Whether the data can be of the model's law, if that was tested.
fn kolmogorov(value: &Value) -> Option<String> {
    let test = &value["data"]["kolmogorov"];
    let (distance, p) = (test["distance"].as_f64()?, test["p_value"].as_f64()?);
    let numbers = glued(&format!("D = {}, p = {}", digits(distance, 2), digits(p, 2)));
    Some(format!(
        "Kolmogorov–Smirnov test, data vs model: {numbers} (optimistic: the model was fitted to \
         these data)"
    ))
}

/// Whether the cost is a likelihood's.
pub(super) fn by_likelihood(value: &Value) -> bool {
    value["objective"].as_str() == Some(Objective::Likelihood.name())
}

/// The best point, with the digits that the data leave each parameter.
fn parameters(value: &Value, point: &Point, specification: &JobSpecification) -> String {
    let identified = &value["identified"];
    let matched = identified["matched"] == true;
    let row = |parameter: Parameter| {
        let (scale, unit) = scale(parameter);
        let number = point.get(parameter) * scale;
        let known = match parameter {
            Parameter::Dispersion => &identified["dispersion"],
            _ => &identified["parameters"][parameter.name()],
        };
        let error = known["standard_error"].as_f64().map(|error| error * scale);
        let (shown, bounds, note) = match (specification.range(parameter), error) {
            (Range::Fixed(_), _) => (significant(number, 6), None, "fixed"),
            (Range::Free { lower, upper, .. }, Some(error)) => {
                (measured(number, error), Some([lower, upper]), "")
            }
            (Range::Free { lower, upper, .. }, None) if matched => {
                (digits(number, FREE_DIGITS), Some([lower, upper]), "not determined")
            }
            (Range::Free { lower, upper, .. }, None) => {
                (digits(number, DIGITS), Some([lower, upper]), "")
            }
        };
        let bounds = bounds.map(|ends| ends.map(|end| significant(end * scale, 4)).join(" to "));
        let name = readable(parameter);
        [name, format!("{shown}{unit}"), bounds.unwrap_or_default(), note.to_owned()]
    };
    let mut rows = vec![["", "best point", "bounds", ""].map(str::to_owned)];
    rows.extend(Parameter::ALL.into_iter().map(row));
    aligned(&rows)
}

/// Name of a parameter.
pub(super) fn readable(parameter: Parameter) -> String {
    parameter.name().replace('_', " ").replace("young", "Young").replace("poisson", "Poisson")
}

/// Factor and unit that make a parameter readable.
pub(super) fn scale(parameter: Parameter) -> (f64, &'static str) {
    match parameter.unit() {
        "Pa" => (1e-9, " GPa"),
        "" => (1.0, ""),
        _ => (1.0, " kg/m³"),
    }
}
