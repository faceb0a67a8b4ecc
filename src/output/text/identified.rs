//! What the data say, made from the text of `result.json`.

use osteon_common::bulk_velocity::bulk_velocity;
use osteon_common::parameters::{Parameter, Point};
use serde_json::Value;

use super::layout::{aligned, glued, wrapped};
use super::number::{DIGITS, Decimals, digits, measured, significant};
use super::result::{readable, scale};

/// Name of √(c1111/ρ), which the data always determine where they determine anything.
const SPEED: &str = "√(c1111/ρ)";

/// Whether the data say anything of a number.
pub(super) fn has_intervals(value: &Value) -> bool {
    value["identified"]["matched"] == true && !rows(&value["identified"]).is_empty()
}

/// Intervals of what is identified, and what is left open; empty where nothing is known.
pub(super) fn text(value: &Value) -> String {
    let mut text = String::new();
    if has_intervals(value) {
        let identified = &value["identified"];
        text.push_str(&format!(
            "\n{}{}",
            wrapped(&heading(identified)),
            aligned(&rows(identified))
        ));
        text.push_str(&condition(value));
    }
    text.push_str(&solutions(value));
    if let Some(from) = value["search"]["below_noise_from"].as_u64() {
        text.push('\n');
        text.push_str(&wrapped(&format!(
            "After evaluation {from} all further improvement was below the sampling noise."
        )));
    }
    text
}

/// A row for each number of which the data say something.
fn rows(identified: &Value) -> Vec<[String; 3]> {
    let mut rows = Vec::new();
    rows.extend(row(SPEED, &identified["bulk_velocity"], 1.0, " m/s"));
    rows.extend(row("dispersion", &identified["dispersion"], 1.0, ""));
    for parameter in Parameter::ALL {
        let known = &identified["parameters"][parameter.name()];
        if parameter != Parameter::Dispersion {
            let (scale, unit) = scale(parameter);
            rows.extend(row(&readable(parameter), known, scale, unit));
        }
    }
    rows
}

/// Name, value and interval of what is known, to the same decimal.
fn row(name: &str, quantity: &Value, scale: f64, unit: &str) -> Option<[String; 3]> {
    let value = quantity["value"].as_f64()? * scale;
    let error = quantity["standard_error"].as_f64()? * scale;
    let ends = quantity["interval"].as_array()?;
    let [lower, upper] = [ends.first()?.as_f64()? * scale, ends.get(1)?.as_f64()? * scale];
    let shown = |number: f64| match Decimals::of_error(error) {
        Some(decimals) => decimals.show(number),
        None => digits(number, DIGITS),
    };
    Some([
        name.to_owned(),
        format!("{}{unit}", measured(value, error)),
        format!("{} to {}{unit}", shown(lower), shown(upper)),
    ])
}

/// What the intervals are, and which noise they count.
fn heading(identified: &Value) -> String {
    let percent = |error: &Value| {
        let error = error.as_f64().map_or("?".to_owned(), |error| digits(100.0 * error, 2));
        glued(&format!("{error} %"))
    };
    let of = |noise: &Value| {
        format!("{} and {}", percent(&noise["mean"]), percent(&noise["coefficient_of_variation"]))
    };
    let level = significant(100.0 * identified["level"].as_f64().unwrap_or_default(), 3);
    let given = if leaves_free(identified) { ", given the other parameters" } else { "" };
    let noise = &identified["noise"];
    let sampling = format!("sampling {}", of(&noise["sampling"]));
    let counted = if noise["data"].is_object() {
        format!(
            "(relative noise of mean and coefficient of variation: data {}, {sampling}):",
            of(&noise["data"])
        )
    } else {
        format!(
            "(relative noise of mean and coefficient of variation: {sampling}; only the data's \
             moments were given, so their uncertainty is not included: these intervals are too \
             narrow):"
        )
    };
    format!("{level} % confidence intervals{given} {counted}")
}

/// Whether parameters can be moved without changing the moments.
fn leaves_free(identified: &Value) -> bool {
    identified["free_directions"].as_array().is_some_and(|free| !free.is_empty())
}

/// What the intervals do not say.
fn condition(value: &Value) -> String {
    if !leaves_free(&value["identified"]) {
        return String::new();
    }
    let how_far = match value["solutions"]["matching"].as_u64() {
        Some(2..) => "the ranges below show how far",
        _ => "`[search] starts` shows how far",
    };
    wrapped(&format!(
        "These intervals hold the other parameters as found. In other parameter sets that fit, \
         {SPEED} may lie outside its interval; {how_far}."
    ))
}

/// How far apart the answers of several starts are.
fn solutions(value: &Value) -> String {
    let solutions = &value["solutions"];
    let Some(matching) = solutions["matching"].as_u64().filter(|count| *count > 1) else {
        return String::new();
    };
    let row = |parameter: Parameter| {
        let spread = &solutions["spread"]["parameters"][parameter.name()];
        let (scale, unit) = scale(parameter);
        let end = |key: &str| Some(spread[key].as_f64()? * scale);
        let ends = [end("smallest")?, end("largest")?];
        Some([readable(parameter), format!("{}{unit}", range(ends))])
    };
    let mut rows = Vec::new();
    rows.extend(speeds(value).map(|ends| [SPEED.to_owned(), format!("{} m/s", range(ends))]));
    rows.extend(Parameter::ALL.into_iter().filter_map(row));
    let heading = format!(
        "The searches from {matching} starts found different parameter sets that fit the data. \
         Their ranges:"
    );
    format!("\n{}{}", wrapped(&heading), aligned(&rows))
}

/// Both ends to the third digit of their distance.
fn range([smallest, largest]: [f64; 2]) -> String {
    let ends = [smallest, largest];
    let [smallest, largest] = match Decimals::of(largest - smallest, 3) {
        Some(decimals) => ends.map(|end| decimals.show(end)),
        None => ends.map(|end| digits(end, DIGITS)),
    };
    format!("{smallest} to {largest}")
}

/// The smallest and the largest √(c1111/ρ) of the points that match the data, m/s.
fn speeds(value: &Value) -> Option<[f64; 2]> {
    // As where the solutions are counted: a likelihood has no cost that is low enough.
    let best = value["cost"].as_f64()?;
    let most = value["search"]["cost_tolerance"].as_f64().map_or(best, |most| most.max(best));
    let points = value["solutions"]["points"].as_array()?;
    let matching =
        points.iter().filter(|one| one["cost"].as_f64().is_some_and(|cost| cost <= most));
    let speeds = matching.filter_map(|one| Some(bulk_velocity(&point(one)?).ok()?.logarithm.exp()));
    let ends = speeds.fold([f64::INFINITY, f64::NEG_INFINITY], |[smallest, largest], speed| {
        [speed.min(smallest), speed.max(largest)]
    });
    Some(ends).filter(|[smallest, largest]| smallest <= largest)
}

/// The point of a solution.
fn point(solution: &Value) -> Option<Point> {
    let mut point = Point([0.0; 7]);
    for (slot, parameter) in point.0.iter_mut().zip(Parameter::ALL) {
        let found = match parameter {
            Parameter::Dispersion => &solution["dispersion"],
            _ => &solution["parameters"][parameter.name()],
        };
        *slot = found.as_f64()?;
    }
    Some(point)
}
