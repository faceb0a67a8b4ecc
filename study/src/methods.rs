//! Comparison of both methods with a refined solution.

use osteon_common::settings::{Method, SolverSettings};
use osteon_solver::check::{Difference, difference};

use crate::accuracy::REFERENCE;
use crate::draws::{Cell, Draws, arrival, cells};
use crate::spread::DifferenceSummary;
use crate::table::{MarkdownTable, millimetres, two_digits};
use crate::{RowCallback, StudyError};

/// Thicknesses of the plates, m.
const THICKNESSES: [f64; 4] = [1e-3, 2e-3, 4e-3, 6e-3];
/// Dispersions.
const DISPERSIONS: [f64; 3] = [0.1, 0.3, 0.6];
/// Default number of realizations of each row.
pub const REALIZATIONS: u64 = 50;

/// Returns relative differences of velocities, largest difference of times (ns) and number of
/// different picks of both methods at default settings compared to the exact one at refinement 5.
///
/// # Errors
/// If there are no draws at a dispersion.
pub fn table(draws: &Draws, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&[
        "plate (mm)",
        "dispersion",
        "method",
        "median difference",
        "largest",
        "largest of a time (ns)",
        "different picks",
    ]);
    for cell in cells(&THICKNESSES, &DISPERSIONS, draws)? {
        let [exact, hybrid] = differences(&cell);
        for (method, differences) in [(Method::Exact, exact), (Method::Hybrid, hybrid)] {
            let mut row = vec![millimetres(cell.thickness), cell.dispersion.to_string()];
            row.push(method.name().to_owned());
            row.extend(summary(&differences));
            table.push(row);
            progress(&table.last_row());
        }
    }
    Ok(table)
}

/// Returns the differences of the exact and of the hybrid method.
fn differences(cell: &Cell) -> [Vec<Difference>; 2] {
    let settings = SolverSettings::default();
    let setup = cell.setup(settings);
    let exact = cell.solver(settings);
    let hybrid = cell.solver(SolverSettings { method: Method::Hybrid, ..settings });
    let reference = cell.solver(SolverSettings { refinement: REFERENCE, ..settings });
    let both = cell.each(|_, bone, workspace| {
        let reference = arrival(&reference, bone, workspace);
        [&exact, &hybrid]
            .map(|solver| difference(&setup, &arrival(solver, bone, workspace), &reference))
    });
    [0, 1].map(|method| both.iter().map(|pair| pair[method]).collect())
}

fn summary(differences: &[Difference]) -> Vec<String> {
    let spread = DifferenceSummary::new(differences);
    vec![
        two_digits(spread.velocity(0.5)),
        two_digits(spread.velocity(1.0)),
        two_digits(spread.largest_time.map(|time| time * 1e9)),
        spread.different_picks.to_string(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_says_median_largest_time_and_picks() {
        let numbers = |velocity, time| Difference::Numbers { velocity, time };
        let differences = [numbers(1e-5, 2e-10), numbers(3e-5, 1e-10), Difference::Picks];
        assert_eq!(summary(&differences), ["2.0e-5", "3.0e-5", "0.20", "1"]);
        assert_eq!(summary(&[Difference::BothFailed]), ["–", "–", "–", "0"]);
    }
}
