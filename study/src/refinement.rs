//! Convergence of the exact method's error with refinement.

use osteon_common::limits::REFINEMENT_MAX;
use osteon_common::settings::SolverSettings;
use osteon_solver::check::{Difference, difference};

use crate::draws::{Cell, Draws, arrival, cells};
use crate::spread::DifferenceSummary;
use crate::table::{MarkdownTable, millimetres, two_digits};
use crate::{RowCallback, StudyError};

/// Thicknesses of the plates, m.
const THICKNESSES: [f64; 3] = [1e-3, 2e-3, 4e-3];
/// Dispersions.
const DISPERSIONS: [f64; 2] = [0.1029, 0.3];
/// Measured refinements; the reference is the largest possible one.
const REFINEMENTS: [f64; 5] = [0.5, 1.0, 2.0, 5.0, 10.0];
/// Default number of realizations of each row.
pub const REALIZATIONS: u64 = 100;

/// Returns the relative differences of velocities at increasing refinement compared to refinement
/// 16, by thickness and dispersion.
///
/// # Errors
/// If there are no draws at a dispersion.
pub fn table(draws: &Draws, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&[
        "plate (mm)",
        "dispersion",
        "refinement",
        "median difference",
        "90 %",
        "largest",
        "different picks",
    ]);
    for cell in cells(&THICKNESSES, &DISPERSIONS, draws)? {
        for (refinement, differences) in REFINEMENTS.iter().zip(differences(&cell)) {
            let mut row = vec![millimetres(cell.thickness), cell.dispersion.to_string()];
            row.push(refinement.to_string());
            row.extend(summary(&differences));
            table.push(row);
        }
        progress(&table.last_row());
    }
    Ok(table)
}

/// Returns the differences at each refinement.
fn differences(cell: &Cell) -> [Vec<Difference>; REFINEMENTS.len()] {
    let solver = |refinement| {
        let settings = SolverSettings { refinement, ..SolverSettings::default() };
        cell.solver(settings)
    };
    let setup = cell.setup(SolverSettings::default());
    let solvers = REFINEMENTS.map(solver);
    let reference = solver(REFINEMENT_MAX);
    let all = cell.each(|_, bone, workspace| {
        let reference = arrival(&reference, bone, workspace);
        solvers
            .each_ref()
            .map(|solver| difference(&setup, &arrival(solver, bone, workspace), &reference))
    });
    std::array::from_fn(|i| all.iter().map(|of_bone| of_bone[i]).collect())
}

fn summary(differences: &[Difference]) -> Vec<String> {
    let spread = DifferenceSummary::new(differences);
    let mut cells: Vec<_> = [0.5, 0.9, 1.0].map(|p| two_digits(spread.velocity(p))).into();
    cells.push(spread.different_picks.to_string());
    cells
}

#[cfg(test)]
mod tests {
    use osteon_solver::Isa;

    use super::*;

    #[test]
    fn errors_fall_with_refinement() {
        let draws = Draws { realizations: 3, seed: 2, isa: Isa::fastest() };
        let cell = Cell::new(4e-3, 0.1029, &draws).unwrap();
        let largest =
            differences(&cell).map(|at| DifferenceSummary::new(&at).velocity(1.0).unwrap());
        // From the quick sampling to those whose band grows, every error is far below the first.
        assert!(largest[0] < 1e-3, "{largest:?}");
        assert!(largest[2] < 0.2 * largest[0], "{largest:?}");
        assert!(largest[4] < 3e-6, "{largest:?}");
    }
}
