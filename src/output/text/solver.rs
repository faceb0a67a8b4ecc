//! The line that says how velocities were computed, made from the object `solver` of the results.

use serde_json::Value;

use super::significant;

/// The line, without its end; empty if there is no such object.
pub(super) fn line(solver: &Value) -> String {
    let Some(method) = solver["method"].as_str() else { return String::new() };
    let mut parts = Vec::new();
    let mut number = |name: &str, key: &str, scale: f64, unit: &str| {
        if let Some(value) = solver[key].as_f64() {
            parts.push(format!("{name} {}{unit}", significant(value * scale, 4)));
        }
    };
    number("refinement", "refinement", 1.0, "");
    number("band to", "band", 1e-6, " MHz");
    number("period", "period", 1e6, " µs");
    number("elements of", "element_size", 1e3, " mm");
    number("order", "element_order", 1.0, "");
    number("time step", "time_step", 1e9, " ns");
    let text = format!("solver {method}: {}", parts.join(", "));
    match error(&solver["estimated_error"]) {
        Some(error) => format!("{text}; estimated relative error {error}"),
        None => text,
    }
}

/// Of one velocity, or of a set of them.
fn error(value: &Value) -> Option<String> {
    let number = |value: &Value| value.as_f64().map(|number| significant(number, 2));
    match (number(&value["median"]), number(&value["largest"])) {
        (Some(median), Some(largest)) => Some(format!("{median} (median), {largest} (largest)")),
        _ => number(value),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_is_known_is_said() {
        let exact = json!({"method": "exact", "refinement": 1.0, "band": 8e6, "period": 9.25e-6,
            "pairs": 1900.0, "estimated_error": {"median": 2.04e-5, "largest": 0.000123}});
        let hybrid = json!({"method": "hybrid", "refinement": 1.0, "element_size": 5e-4,
            "element_order": 8, "time_step": null, "estimated_error": 1e-4});
        let nothing = json!({"method": "exact", "refinement": 2.5,
            "estimated_error": {"median": null, "largest": null}});
        for (solver, expected) in [
            (
                exact,
                "solver exact: refinement 1, band to 8 MHz, period 9.25 µs; \
                 estimated relative error 2.0e-5 (median), 0.00012 (largest)",
            ),
            (
                hybrid,
                "solver hybrid: refinement 1, elements of 0.5 mm, order 8; \
                 estimated relative error 0.0001",
            ),
            (nothing, "solver exact: refinement 2.5"),
            (Value::Null, ""),
        ] {
            assert_eq!(line(&solver), expected);
        }
    }
}
