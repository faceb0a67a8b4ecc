//! What the data say, made from the text of `result.json`.

use osteon_common::parameters::Parameter;
use serde_json::Value;

use super::result::scale;
use super::{aligned, significant};

/// Intervals of what is identified, and what is left open; empty where nothing is known.
pub(super) fn text(value: &Value) -> String {
    let identified = &value["identified"];
    if !identified.is_object() {
        return String::new();
    }
    if identified["matched"] == false {
        return "\nThe model does not match the data within their noise: no intervals.\n"
            .to_owned();
    }
    let mut rows = Vec::new();
    rows.extend(row("√(c1111/ρ)", &identified["bulk_velocity"], 1.0, " m/s"));
    rows.extend(row("dispersion", &identified["dispersion"], 1.0, ""));
    for parameter in Parameter::ALL {
        let known = &identified["parameters"][parameter.name()];
        if parameter != Parameter::Dispersion {
            let (scale, unit) = scale(parameter);
            rows.extend(row(&parameter.name().replace('_', " "), known, scale, unit));
        }
    }
    if rows.is_empty() {
        return String::new();
    }
    let level = identified["level"].as_f64().unwrap_or_default() * 100.0;
    let mut text = format!("\nIntervals of {level} %, {}:\n{}", noise(identified), aligned(&rows));
    text.push_str(&solutions(&value["solutions"]));
    if let Some(from) = value["search"]["below_noise_from"].as_u64() {
        text.push_str(&format!(
            "From evaluation {from} on the search was within the sampling noise of its moments.\n"
        ));
    }
    text
}

/// Name, value and interval of what is known.
fn row(name: &str, quantity: &Value, scale: f64, unit: &str) -> Option<[String; 3]> {
    let shown = |number: f64| significant(number * scale, 6);
    let ends = quantity["interval"].as_array()?;
    let [lower, upper] = [ends.first()?.as_f64()?, ends.get(1)?.as_f64()?];
    Some([
        name.to_owned(),
        format!("{}{unit}", shown(quantity["value"].as_f64()?)),
        format!("{} to {}{unit}", shown(lower), shown(upper)),
    ])
}

/// What the intervals count.
fn noise(identified: &Value) -> String {
    let percent = |error: &Value| {
        error.as_f64().map_or("?".to_owned(), |error| significant(100.0 * error, 2))
    };
    let of = |noise: &Value| {
        format!("{} and {} %", percent(&noise["mean"]), percent(&noise["coefficient_of_variation"]))
    };
    let noise = &identified["noise"];
    let sampling = of(&noise["sampling"]);
    if noise["data"].is_object() {
        format!(
            "for noise of the data's moments ({}) and of sampling ({sampling})",
            of(&noise["data"])
        )
    } else {
        format!(
            "for noise of sampling ({sampling}); of the data only moments are known, not how well"
        )
    }
}

/// How far apart the answers of several starts are.
fn solutions(solutions: &Value) -> String {
    let Some(matching) = solutions["matching"].as_u64().filter(|count| *count > 1) else {
        return String::new();
    };
    let row = |parameter: Parameter| {
        let spread = &solutions["spread"]["parameters"][parameter.name()];
        let (scale, unit) = scale(parameter);
        let shown = |key: &str| Some(significant(spread[key].as_f64()? * scale, 4));
        let range = format!("{} to {}{unit}", shown("smallest")?, shown("largest")?);
        Some([parameter.name().replace('_', " "), range])
    };
    let rows: Vec<[String; 2]> = Parameter::ALL.into_iter().filter_map(row).collect();
    format!("\n{matching} starts led to points that match the data:\n{}", aligned(&rows))
}
