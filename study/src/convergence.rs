//! Convergence of the hybrid method's error with its elements and its time step.

use osteon_common::case::{Bone, Setup};
use osteon_common::settings::{Method, SolverSettings};
use osteon_solver::Failure;
use osteon_solver::Isa;
use osteon_solver::hybrid::{ConvergenceRow, element_convergence, time_step_convergence};
use rayon::prelude::*;

use crate::draws::{Cell, Draws};
use crate::table::{MarkdownTable, millimetres, two_digits};
use crate::{RowCallback, StudyError};

/// The bone: the first draw of this seed and dispersion, triclinic, in the paper's 4 mm plate.
const SEED: u64 = 1;
const DISPERSION: f64 = 0.1029;
const THICKNESS: f64 = 4e-3;
/// Orders of elements, each with falling sizes, m.
const SIZES: [(u32, [f64; 4]); 4] = [
    (2, [0.5e-3, 0.25e-3, 0.125e-3, 0.0625e-3]),
    (4, [1e-3, 0.5e-3, 0.25e-3, 0.125e-3]),
    (6, [2e-3, 1e-3, 0.5e-3, 0.25e-3]),
    (8, [2e-3, 1e-3, 0.5e-3, 0.25e-3]),
];
/// Number of halvings of the time step.
const HALVINGS: u32 = 3;

/// Rows of one study, in which one quantity decreases.
struct RefinementSeries {
    rows: Result<Vec<ConvergenceRow>, Failure>,
    varied: fn(&ConvergenceRow) -> f64,
}

/// Returns the errors of one bone's pressures, relative to the largest, by size and order of the
/// elements and then by time step, under a smooth load, with the order of convergence from row to
/// row.
///
/// # Errors
/// If the bone cannot be drawn.
pub fn table(isa: Isa, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let cell = Cell::new(THICKNESS, DISPERSION, &Draws { realizations: 1, seed: SEED, isa })?;
    let setup = cell.setup(SolverSettings { method: Method::Hybrid, ..SolverSettings::default() });
    let columns = ["elements of order", "size (mm)", "time step (ns)", "error", "falls with order"];
    let mut table = MarkdownTable::new(&columns);
    match cell.bone(0) {
        Ok(bone) => {
            for series in all_series(&setup, &bone) {
                add(&mut table, &series);
                progress(&table.last_row());
            }
        }
        Err(failure) => table.push(failure_row(&failure)),
    }
    Ok(table)
}

/// Returns the series of all orders, then that of the time step.
fn all_series(setup: &Setup, bone: &Bone) -> Vec<RefinementSeries> {
    let of_sizes = SIZES.par_iter().map(|(order, sizes)| RefinementSeries {
        rows: element_convergence(setup, bone, *order, sizes),
        varied: |row| row.element_size,
    });
    let mut series: Vec<RefinementSeries> = of_sizes.collect();
    series.push(RefinementSeries {
        rows: time_step_convergence(setup, bone, HALVINGS),
        varied: |row| row.time_step,
    });
    series
}

fn add(table: &mut MarkdownTable, series: &RefinementSeries) {
    let rows = match &series.rows {
        Ok(rows) => rows,
        Err(failure) => return table.push(failure_row(failure)),
    };
    let mut before: Option<(f64, f64)> = None;
    for row in rows {
        let now = ((series.varied)(row), row.error);
        table.push(vec![
            row.element_order.to_string(),
            millimetres(row.element_size),
            two_digits(Some(row.time_step * 1e9)),
            two_digits(Some(row.error)),
            two_digits(before.map(|before| order(before, now))),
        ]);
        before = Some(now);
    }
}

fn failure_row(failure: &Failure) -> Vec<String> {
    vec![failure.kind.name().to_owned()]
}

/// Returns p of an error C hᵖ, given two pairs (h, error).
fn order((h0, error0): (f64, f64), (h1, error1): (f64, f64)) -> f64 {
    (error0 / error1).ln() / (h0 / h1).ln()
}

#[cfg(test)]
mod tests {
    use osteon_common::outcome::FailureKind;

    use super::*;

    #[test]
    fn orders_are_those_of_powers() {
        let error = |h: f64| (h, 3.0 * h.powi(4));
        assert!((order(error(2e-3), error(0.7e-3)) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn a_series_says_its_order_from_the_second_row_on() {
        let row = |element_size, error| ConvergenceRow {
            element_size,
            element_order: 4,
            time_step: 2e-9,
            error,
        };
        let mut table = MarkdownTable::new(&["order", "size", "step", "error", "falls"]);
        let rows = Ok(vec![row(1e-3, 3.2e-3), row(0.5e-3, 1e-4)]);
        add(&mut table, &RefinementSeries { rows, varied: |row| row.element_size });
        let failure = Failure { kind: FailureKind::NotFinite, detail: String::new() };
        add(&mut table, &RefinementSeries { rows: Err(failure), varied: |row| row.time_step });
        assert_eq!(table.rows()[0], ["4", "1", "2.0", "3.2e-3", "–"]);
        assert_eq!(table.rows()[1], ["4", "0.5", "2.0", "1.0e-4", "5.0"]);
        assert_eq!(table.rows()[2], ["not_finite", "", "", "", ""]);
    }
}
