//! The tables of groups, made from the text of `result.json`: one below the other, so that each is
//! narrow, then why a group has no result or no intervals.

use osteon_common::parameters::Parameter;
use serde_json::Value;

use super::result::scale;
use super::{aligned, significant};

/// A column of numbers: its heading, and for each group a value with the ends of its interval.
struct Column {
    heading: String,
    cells: Vec<Cell>,
}

#[derive(Clone, Copy)]
struct Cell {
    value: Option<f64>,
    ends: Option<[f64; 2]>,
}

/// The tables, after the beginning of a line.
pub(super) fn table(groups: &[Value]) -> String {
    let mut text = "\n".to_owned();
    let measured = [
        data(groups, "mean", "DATA: MEAN VELOCITY (m/s)"),
        data(groups, "coefficient_of_variation", "COEFFICIENT OF VARIATION"),
    ];
    let identified = [
        quantities(groups, "√(c1111/ρ) (m/s)", 1.0, |group| &group["identified"]["bulk_velocity"]),
        quantities(groups, "DISPERSION", 1.0, |group| &group["identified"]["dispersion"]),
    ];
    text.push_str(&overview(groups));
    text.push_str(&side_by_side(groups, measured));
    text.push_str(&side_by_side(groups, identified));
    let known = known_parameters(groups);
    for pair in known.chunks(2) {
        let none = || Column { heading: String::new(), cells: Vec::new() };
        let column = |parameter: Option<&Parameter>| {
            parameter.map_or_else(none, |parameter| of_parameter(groups, *parameter))
        };
        text.push_str(&side_by_side(groups, [column(pair.first()), column(pair.get(1))]));
    }
    text.push_str("\nIn brackets: 95 % confidence intervals, each group by itself.\n");
    text.push_str(&notes(groups));
    text.push_str(&caveat(groups));
    text
}

fn overview(groups: &[Value]) -> String {
    let mut rows = vec![["GROUP", "VELOCITIES", "STATUS", "COST"].map(str::to_owned)];
    for group in groups {
        let mark = if note(group).is_some() { " *" } else { "" };
        let status = group["status"].as_str().unwrap_or_default();
        let cost = group["cost"].as_f64().map(|cost| significant(cost, 3));
        rows.push([
            name(group),
            group["data"]["count"].to_string(),
            format!("{status}{mark}"),
            cost.unwrap_or_default(),
        ]);
    }
    format!("\n{}", aligned(&rows))
}

fn side_by_side(groups: &[Value], columns: [Column; 2]) -> String {
    let mut rows =
        vec![["GROUP".to_owned(), columns[0].heading.clone(), columns[1].heading.clone()]];
    let [first, second] = columns.map(|column| shown(&column.cells));
    for (at, group) in groups.iter().enumerate() {
        let cell = |cells: &[String]| cells.get(at).cloned().unwrap_or_default();
        rows.push([name(group), cell(&first), cell(&second)]);
    }
    format!("\n{}", aligned(&rows))
}

fn name(group: &Value) -> String {
    group["name"].as_str().unwrap_or_default().to_owned()
}

/// A moment of the data of each group.
fn data(groups: &[Value], key: &str, heading: &str) -> Column {
    let cell = |group: &Value| Cell {
        value: group["data"][key].as_f64(),
        ends: ends(&group["data"]["interval"][key], 1.0),
    };
    Column { heading: heading.to_owned(), cells: groups.iter().map(cell).collect() }
}

/// A quantity that the data say something of, for each group, in a readable unit.
fn quantities<'a>(
    groups: &'a [Value],
    heading: &str,
    scale: f64,
    of: impl Fn(&'a Value) -> &'a Value,
) -> Column {
    let cell = |group| {
        let quantity = of(group);
        let value = quantity["value"].as_f64().map(|value| value * scale);
        Cell { value, ends: ends(&quantity["interval"], scale) }
    };
    Column { heading: heading.to_owned(), cells: groups.iter().map(cell).collect() }
}

fn of_parameter(groups: &[Value], parameter: Parameter) -> Column {
    let (scale, unit) = scale(parameter);
    let heading = parameter.name().replace('_', " ").to_uppercase();
    let unit = unit.trim();
    let heading = if unit.is_empty() { heading } else { format!("{heading} ({unit})") };
    let of = |group| &value(group, "parameters")[parameter.name()];
    quantities(groups, &heading, scale, of)
}

fn value<'a>(group: &'a Value, key: &str) -> &'a Value {
    &group["identified"][key]
}

/// The free parameters of the mean model that the data of some group fix.
fn known_parameters(groups: &[Value]) -> Vec<Parameter> {
    let known = |parameter: &Parameter| {
        let of = |group| value(group, "parameters")[parameter.name()]["interval"].is_array();
        groups.iter().any(of)
    };
    let elastic = Parameter::ALL.into_iter().filter(|name| *name != Parameter::Dispersion);
    elastic.filter(known).collect()
}

fn ends(interval: &Value, scale: f64) -> Option<[f64; 2]> {
    let end = |at: usize| interval[at].as_f64().map(|end| end * scale);
    Some([end(0)?, end(1)?])
}

/// The cells of a column, all with the decimals of its narrowest interval: two digits of half of it.
fn shown(cells: &[Cell]) -> Vec<String> {
    let halves = cells.iter().filter_map(|cell| cell.ends).map(|[low, high]| 0.5 * (high - low));
    let narrowest = halves.filter(|half| *half > 0.0).fold(f64::INFINITY, f64::min);
    let decimals = (1.0 - narrowest.log10().floor()).clamp(0.0, 9.0);
    let number = |value: f64| {
        if narrowest.is_finite() && value.abs() < 1e9 {
            format!("{value:.*}", decimals as usize)
        } else {
            significant(value, 5)
        }
    };
    let cell = |cell: &Cell| match (cell.value, cell.ends) {
        (Some(value), Some([low, high])) => {
            format!("{} ({} to {})", number(value), number(low), number(high))
        }
        (Some(value), None) => number(value),
        (None, _) => "unknown".to_owned(),
    };
    cells.iter().map(cell).collect()
}

/// Why a group has no result, or no intervals.
fn note(group: &Value) -> Option<String> {
    let reason = group["reason"].as_str().and_then(|reason| reason.lines().next());
    let unmatched = group["identified"]["matched"] == false;
    match (reason, group["status"].as_str()) {
        (Some(reason), _) => Some(reason.to_owned()),
        (None, Some("max_evaluations")) => Some("the evaluations are used up".to_owned()),
        (None, _) if unmatched => {
            Some("the model does not match the data within their noise: no intervals".to_owned())
        }
        _ => None,
    }
}

fn notes(groups: &[Value]) -> String {
    let note = |group: &Value| Some(format!("* {}: {}\n", name(group), note(group)?));
    let notes: String = groups.iter().filter_map(note).collect();
    if notes.is_empty() { notes } else { format!("\n{notes}") }
}

/// What so few data cannot say, where several parameters of the mean model are searched.
fn caveat(groups: &[Value]) -> String {
    let searched = groups.iter().find_map(|group| group["sensitivities"].as_object());
    let Some(searched) = searched else { return String::new() };
    let dispersion = searched.contains_key(Parameter::Dispersion.name());
    if searched.len() < 2 + usize::from(dispersion) {
        return String::new();
    }
    let by_likelihood = groups.iter().any(|group| group.get("cost_standard_error").is_some());
    let data = if by_likelihood { "The law of one velocity" } else { "Two moments" };
    let known = if dispersion { " and the dispersion are" } else { " is" };
    format!(
        "\n{data} cannot determine {} parameters. Only √(c1111/ρ){known} constrained in each\n\
         group; many other parameter sets fit equally well. Fix what is known from elsewhere\n\
         (`fixed = …`) to compare single parameters.\n",
        NUMBERS.get(searched.len()).unwrap_or(&"so many")
    )
}

const NUMBERS: [&str; 8] = ["no", "one", "two", "three", "four", "five", "six", "seven"];

#[cfg(test)]
mod tests;
