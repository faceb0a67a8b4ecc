//! Frequency and kinds of realizations without a velocity.

use osteon_common::outcome::{FailureCounts, FailureKind, Outcome};
use osteon_common::settings::SolverSettings;

use crate::draws::{Draws, arrival, cells};
use crate::table::{MarkdownTable, millimetres, percent};
use crate::{RowCallback, StudyError};

/// Thicknesses of the plates, m.
const THICKNESSES: [f64; 3] = [1e-3, 2e-3, 4e-3];
/// Dispersions.
const DISPERSIONS: [f64; 5] = [0.1, 0.2, 0.3, 0.45, 0.6];
/// Default number of realizations of each row.
pub const REALIZATIONS: u64 = 100_000;

/// Returns the rate of each kind of failure (%), by thickness and dispersion.
///
/// # Errors
/// If there are no draws at a dispersion.
pub fn table(draws: &Draws, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut columns = vec!["plate (mm)", "dispersion", "failed (%)"];
    columns.extend(FailureKind::ALL.map(FailureKind::name));
    let mut table = MarkdownTable::new(&columns);
    for cell in cells(&THICKNESSES, &DISPERSIONS, draws)? {
        let solver = cell.solver(SolverSettings::default());
        let outcomes: Vec<Outcome> = cell.each(|_, bone, workspace| {
            let arrival = arrival(&solver, bone, workspace);
            arrival.map(|arrival| arrival.velocity).map_err(|failure| failure.kind)
        });
        let mut row = vec![millimetres(cell.thickness), cell.dispersion.to_string()];
        row.extend(rates(&outcomes));
        table.push(row);
        progress(&table.last_row());
    }
    Ok(table)
}

/// Returns the fraction of all failures, then of each kind.
fn rates(outcomes: &[Outcome]) -> Vec<String> {
    let counts = FailureCounts::from_outcomes(outcomes);
    let all = outcomes.len() as u64;
    let kinds = FailureKind::ALL.map(|kind| counts.get(kind));
    [counts.total()].into_iter().chain(kinds).map(|count| percent(count, all)).collect()
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use osteon_solver::Isa;

    use super::*;

    #[test]
    fn rates_are_of_all_realizations() {
        let outcomes =
            [Ok(3900.0), Err(FailureKind::NoArrival), Ok(3901.0), Err(FailureKind::NoConvergence)];
        assert_eq!(rates(&outcomes), ["50.000", "25.000", "0", "0", "0", "25.000"]);
    }

    #[test]
    fn there_is_a_row_for_each_plate_and_dispersion() {
        let rows = Cell::new(0);
        let draws = Draws { realizations: 4, seed: 1, isa: Isa::fastest() };
        let table = table(&draws, &|_| rows.set(rows.get() + 1)).unwrap();
        assert_eq!((table.rows().len(), rows.get()), (15, 15));
        assert_eq!(table.rows()[14][..2], ["4", "0.6"]);
    }
}
