//! The table of groups, made from the text of `result.json`.

use serde_json::Value;

use super::{aligned, significant};

/// A row for each group, after the beginning of a line.
pub(super) fn table(groups: &[Value]) -> String {
    let header = ["GROUP", "VELOCITIES", "STATUS", "√(c1111/ρ) (m/s)", "DISPERSION"];
    let mut rows = vec![header.map(str::to_owned)];
    for group in groups {
        let text = |key: &str| group[key].as_str().unwrap_or_default().to_owned();
        rows.push([
            text("name"),
            group["data"]["count"].to_string(),
            text("status"),
            quantity(&group["identified"]["bulk_velocity"]),
            quantity(&group["identified"]["dispersion"]),
        ]);
    }
    format!("\n\n{}", aligned(&rows))
}

/// A value with its interval, as far as they are known.
fn quantity(quantity: &Value) -> String {
    let shown = |number: &Value| number.as_f64().map(|number| significant(number, 5));
    let Some(value) = shown(&quantity["value"]) else { return "unknown".to_owned() };
    match (shown(&quantity["interval"][0]), shown(&quantity["interval"][1])) {
        (Some(lower), Some(upper)) => format!("{value} ({lower} to {upper})"),
        _ => value,
    }
}
