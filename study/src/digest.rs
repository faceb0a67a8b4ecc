//! The digest of an ensemble on every instruction set of the machine, which must always be the same.

use osteon_common::digest::PathDigest;
use osteon_common::outcome::Outcome;
use osteon_common::parameters::{Parameter, Point};
use osteon_common::settings::SolverSettings;
use osteon_solver::Isa;

use crate::draws::{Cell, Draws, OPTIMUM, arrival};
use crate::table::{MarkdownTable, millimetres};
use crate::{RowCallback, StudyError};

/// Thickness of the plate, m, and dispersion: those of the paper, and a more difficult case.
const ENSEMBLES: [(f64, f64); 2] = [(4e-3, 0.1029), (2e-3, 0.45)];
/// Default number of realizations of each row.
pub const REALIZATIONS: u64 = 2000;

/// Returns the digests of the paper's optimum and of a thinner plate with wide scatter, by
/// instruction set.
///
/// # Errors
/// If there are no draws at a dispersion.
pub fn table(draws: &Draws, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&["plate (mm)", "dispersion", "instruction set", "digest"]);
    for (thickness, dispersion) in ENSEMBLES {
        for isa in Isa::available() {
            let cell = Cell::new(thickness, dispersion, &Draws { isa, ..*draws })?;
            let mut row = vec![millimetres(thickness), dispersion.to_string()];
            row.extend([isa.name().to_owned(), digest(&cell)]);
            table.push(row);
            progress(&table.last_row());
        }
    }
    Ok(table)
}

fn digest(cell: &Cell) -> String {
    let solver = cell.solver(SolverSettings::default());
    let outcomes: Vec<Outcome> = cell.each(|_, bone, workspace| {
        let arrival = arrival(&solver, bone, workspace);
        arrival.map(|arrival| arrival.velocity).map_err(|failure| failure.kind)
    });
    let mut point: Point = OPTIMUM;
    point.0[Parameter::Dispersion as usize] = cell.dispersion;
    let mut digest = PathDigest::new();
    digest.add_evaluation(&point, &outcomes);
    digest.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_instruction_set_has_the_same_digest_and_every_batch_its_own() {
        let draws = Draws { realizations: 4, seed: 1, isa: Isa::fastest() };
        let table = table(&draws, &|_| ()).unwrap();
        let digests: Vec<&String> = table.rows().iter().map(|row| &row[3]).collect();
        let (paper, wide) = digests.split_at(Isa::available().len());
        assert!(paper.iter().all(|digest| *digest == paper[0]), "{paper:?}");
        assert!(wide.iter().all(|digest| *digest == wide[0]), "{wide:?}");
        assert_ne!(paper[0], wide[0]);
        let other = Draws { seed: 2, ..draws };
        assert_ne!(&digest(&Cell::new(4e-3, 0.1029, &other).unwrap()), paper[0]);
    }
}
