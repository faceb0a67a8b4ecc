//! Errors of the exact method at default settings, and accuracy of its error estimates.

use osteon_common::case::{Bone, Setup};
use osteon_common::quantile::quantile;
use osteon_common::settings::SolverSettings;
use osteon_solver::check::{Difference, difference};
use osteon_solver::{Failure, Isa, Solver, Workspace};

use crate::draws::{Cell, Draws, arrival, cells};
use crate::spread::DifferenceSummary;
use crate::table::{MarkdownTable, millimetres, percent, two_digits};
use crate::{RowCallback, StudyError};

/// Thicknesses of the plates, m.
const THICKNESSES: [f64; 3] = [1e-3, 2e-3, 4e-3];
/// Dispersions.
const DISPERSIONS: [f64; 5] = [0.1, 0.2, 0.3, 0.45, 0.6];
/// Default number of realizations of each row.
pub const REALIZATIONS: u64 = 1000;
/// Columns of [`summary`].
pub(crate) const SUMMARY: [&str; 7] = [
    "median error",
    "99 %",
    "largest",
    "different picks (%)",
    "estimate / error 5 %",
    "median",
    "95 %",
];
/// Refinement of the reference.
pub(crate) const REFERENCE: f64 = 5.0;

/// Returns the relative errors of velocities compared to refinement 5, and the ratio of the
/// estimated error to the true one, by thickness and dispersion.
///
/// # Errors
/// If there are no draws at a dispersion.
pub fn table(draws: &Draws, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&[&["plate (mm)", "dispersion"][..], &SUMMARY].concat());
    for cell in cells(&THICKNESSES, &DISPERSIONS, draws)? {
        table.push(row(&cell));
        progress(&table.last_row());
    }
    Ok(table)
}

fn row(cell: &Cell) -> Vec<String> {
    let both = Both::new(&cell.setup(SolverSettings::default()), cell.isa());
    let measured: Vec<MeasuredDraw> = cell.each(|_, bone, workspace| both.measure(bone, workspace));
    let mut row = vec![millimetres(cell.thickness), cell.dispersion.to_string()];
    row.extend(summary(&measured));
    row
}

/// The exact method at default settings and at the reference's.
pub(crate) struct Both {
    setup: Setup,
    default: Solver,
    reference: Solver,
}

impl Both {
    pub(crate) fn new(setup: &Setup, isa: Isa) -> Self {
        let [default, reference] = [1.0, REFERENCE].map(|refinement| {
            let solver = SolverSettings { refinement, ..setup.solver };
            Solver::with_isa(&Setup { solver, ..setup.clone() }, isa)
        });
        Self { setup: setup.clone(), default, reference }
    }

    pub(crate) fn measure(
        &self,
        bone: &Result<Bone, Failure>,
        workspace: &mut Workspace,
    ) -> MeasuredDraw {
        let found = arrival(&self.default, bone, workspace);
        let reference = arrival(&self.reference, bone, workspace);
        MeasuredDraw {
            difference: difference(&self.setup, &found, &reference),
            estimated_error: found.map_or(0.0, |found| found.estimated_error),
        }
    }
}

/// One draw.
pub(crate) struct MeasuredDraw {
    difference: Difference,
    estimated_error: f64,
}

/// Returns median, 99 % and largest error, fraction of different picks (%), and three quantiles of
/// the ratio of the estimated to the true error, in the columns of [`SUMMARY`].
pub(crate) fn summary(measured: &[MeasuredDraw]) -> Vec<String> {
    let differences: Vec<_> = measured.iter().map(|draw| draw.difference).collect();
    let spread = DifferenceSummary::new(&differences);
    let mut cells: Vec<_> = [0.5, 0.99, 1.0].map(|p| two_digits(spread.velocity(p))).into();
    cells.push(percent(spread.different_picks as u64, measured.len() as u64));
    let ratios = ratios(measured);
    cells.extend([0.05, 0.5, 0.95].map(|p| two_digits(quantile(&ratios, p))));
    cells
}

/// Returns the ratios of the estimated to the true error, ascending, of the draws with the same
/// pick and a nonzero error.
fn ratios(measured: &[MeasuredDraw]) -> Vec<f64> {
    let mut ratios: Vec<f64> = measured
        .iter()
        .filter_map(|draw| {
            let error = draw.difference.velocity().filter(|&error| error > 0.0)?;
            Some(draw.estimated_error / error)
        })
        .collect();
    ratios.sort_unstable_by(f64::total_cmp);
    ratios
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimates_are_compared_where_there_is_an_error() {
        let same = |velocity, estimated_error| MeasuredDraw {
            difference: Difference::Numbers { velocity, time: 0.0 },
            estimated_error,
        };
        let measured = [
            same(1e-5, 4e-5),
            same(2e-5, 2e-5),
            same(0.0, 1e-5),
            MeasuredDraw { difference: Difference::Picks, estimated_error: 1e-5 },
        ];
        assert_eq!(ratios(&measured), [1.0, 4.0]);
        let cells = summary(&measured);
        assert_eq!(cells, ["1.0e-5", "2.0e-5", "2.0e-5", "25.000", "1.1", "2.5", "3.8"]);
    }

    #[test]
    fn default_settings_are_not_the_reference() {
        let draws = Draws { realizations: 4, seed: 1, isa: Isa::fastest() };
        let row = row(&Cell::new(4e-3, 0.1, &draws).unwrap());
        assert_eq!(row.len(), 9);
        let largest: f64 = row[4].parse().unwrap();
        assert!(largest > 0.0 && largest < 1e-3, "{row:?}");
    }
}
