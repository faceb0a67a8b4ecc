//! The table of a check: one case solved in several ways.

use osteon_solver::check::{Check, Difference, MethodSolution};

use super::layout::aligned;
use super::number::{VELOCITY_DIGITS, digits, significant};

/// Returns the table, and whether the check was passed.
pub(super) fn table(check: &Check) -> String {
    let header = ["solver", "velocity (m/s)", "difference", "in time (s)", "estimated error"];
    let mut rows = vec![header.map(str::to_owned)];
    rows.extend(check.solutions().map(row));
    let verdict = if check.passed() {
        match check.exact.setup.only_exact() {
            None => "the methods agree".to_owned(),
            Some((_, name)) => {
                format!("the solutions agree; the method hybrid computes no {name}")
            }
        }
    } else if !check.same_picks() {
        "THE PICKS DIFFER".to_owned()
    } else {
        let off = check.outside_limit().map(|one| one.setup.solver.method.name().to_uppercase());
        let methods = off.collect::<Vec<_>>().join(" AND ");
        format!("OFF by more than {:e}: {methods}", check.error_max())
    };
    let refined = significant(check.refined.setup.solver.refinement, 3);
    format!("against exact, refinement {refined}:\n{}{verdict}\n", aligned(&rows))
}

fn row(solution: &MethodSolution) -> [String; 5] {
    let settings = &solution.setup.solver;
    let name =
        format!("{}, refinement {}", settings.method.name(), significant(settings.refinement, 3));
    let number = |value: Option<f64>| value.map_or("–".to_owned(), |value| digits(value, 2));
    let (velocity, estimated) = match &solution.arrival {
        Ok(arrival) => (digits(arrival.velocity, VELOCITY_DIGITS), Some(arrival.estimated_error)),
        Err(failure) => (failure.kind.name().replace('_', " "), None),
    };
    let difference = match solution.difference {
        Difference::Picks => "other pick".to_owned(),
        Difference::BothFailed | Difference::Numbers { .. } => {
            number(solution.difference.velocity())
        }
    };
    [name, velocity, difference, number(solution.difference.time()), number(estimated)]
}
