//! The line that describes how velocities were computed.

use osteon_common::settings::Method;
use osteon_files::report::{EstimatedErrors, Solver};

use super::significant;

/// Returns the line for a set of velocities, without line end.
pub(super) fn line(solver: &Solver<EstimatedErrors>) -> String {
    line_with(solver, |errors| match (errors.median, errors.largest) {
        (Some(median), Some(largest)) => {
            Some(format!("{} (median), {} (largest)", error(median), error(largest)))
        }
        _ => None,
    })
}

/// Returns the line for one velocity, without line end.
pub(super) fn single_velocity_line(solver: &Solver<Option<f64>>) -> String {
    line_with(solver, |found| found.map(error))
}

fn error(value: f64) -> String {
    significant(value, 2)
}

fn line_with<E>(solver: &Solver<E>, shown: impl Fn(&E) -> Option<String>) -> String {
    let number = |name: &str, value: Option<f64>, scale: f64, unit: &str| {
        value.map(|value| format!("{name} {}{unit}", significant(value * scale, 4)))
    };
    let (method, parts, error) = match solver {
        Solver::Exact { refinement, band, period, estimated_error, .. } => (
            Method::Exact,
            vec![
                number("refinement", Some(*refinement), 1.0, ""),
                number("band to", *band, 1e-6, " MHz"),
                number("period", *period, 1e6, " µs"),
            ],
            shown(estimated_error),
        ),
        Solver::Hybrid { refinement, element_size, element_order, time_step, estimated_error } => (
            Method::Hybrid,
            vec![
                number("refinement", Some(*refinement), 1.0, ""),
                number("elements of", Some(*element_size), 1e3, " mm"),
                number("order", Some(f64::from(*element_order)), 1.0, ""),
                number("time step", *time_step, 1e9, " ns"),
            ],
            shown(estimated_error),
        ),
    };
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    let text = format!("solver {}: {}", method.name(), parts.join(", "));
    match error {
        Some(error) => format!("{text}; estimated relative error {error}"),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_is_said() {
        let exact = |refinement, band, period, errors| Solver::Exact {
            refinement,
            band,
            period,
            pairs: Some(1900),
            estimated_error: errors,
            pairs_computed: None,
            passes: None,
        };
        let errors = EstimatedErrors { median: Some(2.04e-5), largest: Some(0.000123) };
        assert_eq!(
            line(&exact(1.0, Some(8e6), Some(9.25e-6), errors)),
            "solver exact: refinement 1, band to 8 MHz, period 9.25 µs; \
             estimated relative error 2.0e-5 (median), 0.00012 (largest)"
        );
        assert_eq!(
            line(&exact(2.5, None, None, EstimatedErrors::default())),
            "solver exact: refinement 2.5"
        );
        let hybrid = Solver::Hybrid {
            refinement: 1.0,
            element_size: 5e-4,
            element_order: 8,
            time_step: None,
            estimated_error: Some(1e-4),
        };
        assert_eq!(
            single_velocity_line(&hybrid),
            "solver hybrid: refinement 1, elements of 0.5 mm, order 8; \
             estimated relative error 0.0001"
        );
    }
}
