//! Jumps of the velocity under tiny changes of the elasticity.

use osteon_common::case::{Bone, Setup};
use osteon_common::elasticity::Elasticity;
use osteon_common::sampling;
use osteon_common::settings::SolverSettings;
use osteon_solver::check::{Difference, difference};
use osteon_solver::{Failure, fastest_wave};

use crate::draws::{Draws, arrival, cells, not_elastic_failure};
use crate::generator::Generator;
use crate::spread::DifferenceSummary;
use crate::table::{MarkdownTable, millimetres, two_digits};
use crate::{RowCallback, StudyError};

/// Thicknesses of the plates, m.
const THICKNESSES: [f64; 3] = [1e-3, 2e-3, 4e-3];
/// Dispersions.
const DISPERSIONS: [f64; 5] = [0.1, 0.2, 0.3, 0.45, 0.6];
/// Default number of realizations of each row.
pub const REALIZATIONS: u64 = 20_000;
/// Largest relative change of an entry of the elasticity.
const CHANGE: f64 = 1e-9;
/// Largest allowed relative jump of a velocity whose extremum stays the same.
const JUMP_MAX: f64 = 1e-5;

/// Compares pairs of bones whose entries differ by up to 1e-9, relative. Returns the largest jump
/// of a velocity whose extremum stays the same, how many such jumps are above 1e-5, and how many
/// pairs change their extremum or the kind of their failure.
///
/// Every second pair lies on the edge of a speed bin (the grid of speeds for which samplings are
/// made), where the method itself might jump.
///
/// # Errors
/// If there are no draws at a dispersion.
pub fn table(draws: &Draws, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&[
        "plate (mm)",
        "dispersion",
        "pairs",
        "largest jump",
        "jumps above 1e-5",
        "other extremum or failure",
    ]);
    for cell in cells(&THICKNESSES, &DISPERSIONS, draws)? {
        let setup = cell.setup(SolverSettings::default());
        let solver = cell.solver(setup.solver);
        let differences: Vec<Difference> = cell.each(|index, bone, workspace| {
            let mut bone = bone.clone();
            if let (Ok(bone), 1) = (&mut bone, index % 2) {
                bone.density = density_on_edge(bone, &setup);
            }
            let moved =
                bone.as_ref().map_err(Clone::clone).and_then(|bone| move_entries(bone, index));
            let first = arrival(&solver, &bone, workspace);
            difference(&setup, &arrival(&solver, &moved, workspace), &first)
        });
        let mut row = vec![millimetres(cell.thickness), cell.dispersion.to_string()];
        row.extend(summary(&differences));
        table.push(row);
        progress(&table.last_row());
    }
    Ok(table)
}

fn summary(differences: &[Difference]) -> Vec<String> {
    let spread = DifferenceSummary::new(differences);
    let jumps = differences.iter().filter_map(|difference| difference.velocity());
    vec![
        differences.len().to_string(),
        two_digits(spread.velocity(1.0)),
        jumps.filter(|&jump| jump > JUMP_MAX).count().to_string(),
        spread.different_picks.to_string(),
    ]
}

/// Returns the density, kg/m³, with which the bone's fastest wave has exactly the maximum speed of
/// its bin.
fn density_on_edge(bone: &Bone, setup: &Setup) -> f64 {
    let speed = fastest_wave(bone);
    let Some(bin) = sampling::speed_bin(setup, speed) else {
        return bone.density;
    };
    let ratio = speed / sampling::speed_bin_edge(setup, bin);
    bone.density * ratio * ratio
}

/// Returns the bone with each of its 21 entries changed by a fraction between ±[`CHANGE`] that is
/// derived from `index`.
fn move_entries(bone: &Bone, index: u64) -> Result<Bone, Failure> {
    let mut rows = *bone.elasticity.rows();
    let mut generator = Generator::new(index);
    for (i, j) in (0..6).flat_map(|i| (i..6).map(move |j| (i, j))) {
        rows[i][j] *= 1.0 + CHANGE * generator.between(-1.0, 1.0);
        rows[j][i] = rows[i][j];
    }
    let elasticity = Elasticity::new(rows).map_err(not_elastic_failure)?;
    Ok(Bone { density: bone.density, elasticity })
}

#[cfg(test)]
mod tests {
    use osteon_solver::Isa;

    use crate::OPTIMUM;

    use super::*;

    #[test]
    fn every_entry_moves_a_little_and_not_the_same_way() {
        let elasticity = OPTIMUM.constants().elasticity().unwrap();
        let bone = Bone { density: OPTIMUM.density(), elasticity };
        let (one, other) = (move_entries(&bone, 1).unwrap(), move_entries(&bone, 2).unwrap());
        assert_ne!(one, other);
        for i in 0..6 {
            for j in 0..6 {
                let (from, to) = (bone.elasticity.rows()[i][j], one.elasticity.rows()[i][j]);
                assert!((to - from).abs() <= 1.001 * CHANGE * from.abs(), "{i} {j}");
                assert!(from == 0.0 || to != from, "{i} {j}");
            }
        }
    }

    #[test]
    fn a_bone_is_put_on_the_edge_of_its_speed_bin() {
        let setup = Setup::default();
        let elasticity = OPTIMUM.constants().elasticity().unwrap();
        let mut bone = Bone { density: OPTIMUM.density(), elasticity };
        bone.density = density_on_edge(&bone, &setup);
        let bin = |factor: f64| {
            let bone = Bone { density: bone.density * factor, ..bone };
            sampling::speed_bin(&setup, fastest_wave(&bone)).unwrap()
        };
        assert_eq!(bin(1.0 - 1e-9), bin(1.0 + 1e-9) + 1);
    }

    #[test]
    fn jumps_are_counted_apart_from_changed_picks() {
        let numbers = |velocity| Difference::Numbers { velocity, time: 0.0 };
        let differences = [numbers(2e-5), Difference::Picks, numbers(1e-9), Difference::BothFailed];
        assert_eq!(summary(&differences), ["4", "2.0e-5", "1", "1"]);
    }

    #[test]
    fn few_draws_do_not_jump() {
        let draws = Draws { realizations: 20, seed: 1, isa: Isa::fastest() };
        for row in table(&draws, &|_| ()).unwrap().rows() {
            assert_eq!(row[4], "0", "{row:?}");
        }
    }
}
