//! The exact method away from the paper's optimum: random mean models within the bounds of a
//! search.

use osteon_common::case::Setup;
use osteon_common::parameters::Point;
use osteon_common::realization::{Ensemble, PointError};
use osteon_solver::Workspace;
use rayon::prelude::*;

use crate::accuracy::{Both, MeasuredDraw, SUMMARY, summary};
use crate::draws::{Draws, not_elastic_failure};
use crate::generator::Generator;
use crate::table::{MarkdownTable, millimetres};
use crate::{RowCallback, StudyError};

/// Thicknesses of the plates, m.
const THICKNESSES: [f64; 4] = [1e-3, 2e-3, 4e-3, 6e-3];
/// Default number of mean models of each row.
pub const REALIZATIONS: u64 = 1000;
/// Bounds of the seven parameters.
pub(crate) const BOUNDS: [(f64, f64); 7] = [
    (1500.0, 2000.0),
    (12e9, 25e9),
    (0.2, 0.45),
    (3e9, 6.5e9),
    (8e9, 16e9),
    (0.2, 0.5),
    (0.02, 0.3),
];
/// Maximum number of attempts to draw an admissible mean model.
const TRIES_MAX: usize = 1000;

/// Returns the relative errors of velocities at default settings compared to refinement 5, each for
/// a bone with its own random mean model and dispersion, in the paper's geometry, by thickness.
///
/// # Errors
/// If a mean model or dispersion has no ensemble.
pub fn table(draws: &Draws, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&[&["plate (mm)"][..], &SUMMARY].concat());
    for thickness in THICKNESSES {
        let mut row = vec![millimetres(thickness)];
        row.extend(summary(&measure_draws(thickness, draws)?));
        table.push(row);
        progress(&table.last_row());
    }
    Ok(table)
}

fn measure_draws(thickness: f64, draws: &Draws) -> Result<Vec<MeasuredDraw>, PointError> {
    let mut setup = Setup::default();
    setup.layers.bone_thickness = thickness;
    let both = Both::new(&setup, draws.isa);
    (0..draws.realizations)
        .into_par_iter()
        .map_init(Workspace::default, |workspace, index| {
            let bone = Ensemble::new(&mean_model(draws.seed, index), draws.seed)?.bone(index);
            Ok(both.measure(&bone.map_err(not_elastic_failure), workspace))
        })
        .collect()
}

/// Draws mean model and dispersion of one bone: uniform within the bounds, the first that is
/// admissible.
pub(crate) fn mean_model(seed: u64, index: u64) -> Point {
    let mut generator = Generator::for_index(seed, index);
    let mut draw = || Point::of_bone(BOUNDS.map(|(from, to)| generator.between(from, to)));
    for _ in 1..TRIES_MAX {
        let point = draw();
        if point.constants().elasticity().is_ok() {
            return point;
        }
    }
    draw()
}

#[cfg(test)]
mod tests {
    use osteon_solver::Isa;

    use super::*;

    #[test]
    fn mean_models_are_admissible_and_differ() {
        let points: Vec<Point> = (0..200).map(|index| mean_model(1, index)).collect();
        assert!(points.iter().all(|point| point.constants().elasticity().is_ok()));
        assert!(points.windows(2).all(|pair| pair[0] != pair[1]));
    }

    #[test]
    fn the_first_arrival_may_be_weak_and_is_right() {
        let draws = Draws { realizations: 40, seed: 1, isa: Isa::fastest() };
        let measured = measure_draws(4e-3, &draws).unwrap();
        let largest: f64 = summary(&measured)[2].parse().unwrap();
        assert!(largest < 1.5e-4, "{largest}");
    }
}
