//! Bones for studies: draws around the paper's optimum, by dispersion and thickness of the plate.

use std::ops::Range;

use osteon_common::case::{Bone, Setup};
use osteon_common::elasticity::NotElastic;
use osteon_common::observables::ObservableSet;
use osteon_common::outcome::{FailureKind, RealizationResult};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::realization::{Ensemble, PointError};
use osteon_common::settings::SolverSettings;
use osteon_solver::{Arrival, Failure, Isa, Solver, Workspace};
use rayon::prelude::*;

/// The optimum of the paper.
pub const OPTIMUM: Point =
    Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);

/// Number of bones to draw, seed and instruction set.
#[derive(Debug, Clone, Copy)]
pub struct Draws {
    /// Realizations of each row.
    pub realizations: u64,
    /// Seed of the germs.
    pub seed: u64,
    /// Instruction set, which affects only the time.
    pub isa: Isa,
}

/// One row of a study: the paper's geometry with a plate of this thickness, bones of this
/// dispersion around the optimum's mean model.
#[derive(Debug, Clone)]
pub(crate) struct Cell {
    /// Thickness of the plate, m.
    pub(crate) thickness: f64,
    /// Dispersion of the ensemble.
    pub(crate) dispersion: f64,
    ensemble: Ensemble,
    draws: Draws,
}

impl Cell {
    /// Creates a cell of `draws`.
    ///
    /// # Errors
    /// If no bone has that dispersion.
    pub(crate) fn new(thickness: f64, dispersion: f64, draws: &Draws) -> Result<Self, PointError> {
        let mut point = OPTIMUM;
        point.0[Parameter::Dispersion as usize] = dispersion;
        let ensemble = Ensemble::new(&point, draws.seed)?;
        Ok(Self { thickness, dispersion, ensemble, draws: *draws })
    }

    /// Returns the setup with these settings.
    pub(crate) fn setup(&self, solver: SolverSettings) -> Setup {
        let mut setup = Setup { solver, ..Setup::default() };
        setup.layers.bone_thickness = self.thickness;
        setup
    }

    /// Returns the instruction set.
    pub(crate) fn isa(&self) -> Isa {
        self.draws.isa
    }

    /// Returns a solver with these settings.
    pub(crate) fn solver(&self, settings: SolverSettings) -> Solver {
        Solver::with_isa(&self.setup(settings), self.draws.isa)
    }

    /// Returns `measure` of the bone at every index, in index order. If a bone cannot be drawn,
    /// that is the failure of its index.
    pub(crate) fn each<T: Send>(
        &self,
        measure: impl Fn(u64, &Result<Bone, Failure>, &mut Workspace) -> T + Sync,
    ) -> Vec<T> {
        let indices: Range<u64> = 0..self.draws.realizations;
        indices
            .into_par_iter()
            .map_init(Workspace::default, |workspace, index| {
                measure(index, &self.bone(index), workspace)
            })
            .collect()
    }

    /// Returns the bone at `index`, or the failure if it cannot be drawn.
    pub(crate) fn bone(&self, index: u64) -> Result<Bone, Failure> {
        self.ensemble.bone(index).map_err(not_elastic_failure)
    }
}

/// Returns the failure of a bone whose matrix is not an elasticity.
pub(crate) fn not_elastic_failure(error: NotElastic) -> Failure {
    Failure { kind: FailureKind::NotFinite, detail: error.to_string() }
}

/// Returns the arrival of a bone, or the failure to draw it.
pub(crate) fn arrival(
    solver: &Solver,
    bone: &Result<Bone, Failure>,
    workspace: &mut Workspace,
) -> Result<Arrival, Failure> {
    bone.as_ref().map_err(Clone::clone).and_then(|bone| solver.arrival(bone, workspace))
}

/// Computes the first `count` realizations of an ensemble, in index order.
pub(crate) fn solve_realizations(
    solver: &Solver,
    ensemble: &Ensemble,
    count: u64,
) -> Vec<RealizationResult> {
    observed_realizations(solver, ObservableSet::NONE, ensemble, count)
}

/// As [`solve_realizations`], with these observables of each.
pub(crate) fn observed_realizations(
    solver: &Solver,
    observables: ObservableSet,
    ensemble: &Ensemble,
    count: u64,
) -> Vec<RealizationResult> {
    let realization = |workspace: &mut Workspace, index| {
        solver.realization_with(observables, ensemble, index, workspace)
    };
    (0..count).into_par_iter().map_init(Workspace::default, realization).collect()
}

/// Returns the cells of all thicknesses (m) and dispersions; the dispersion changes fastest.
pub(crate) fn cells(
    thicknesses: &[f64],
    dispersions: &[f64],
    draws: &Draws,
) -> Result<Vec<Cell>, PointError> {
    let of_thickness =
        |&thickness| dispersions.iter().map(move |&delta| Cell::new(thickness, delta, draws));
    thicknesses.iter().flat_map(of_thickness).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_do_not_depend_on_threads() {
        let draws = Draws { realizations: 40, seed: 3, isa: Isa::fastest() };
        let cell = Cell::new(4e-3, 0.3, &draws).unwrap();
        let solver = cell.solver(SolverSettings::default());
        let velocities = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                cell.each(|_, bone, workspace| {
                    arrival(&solver, bone, workspace).map(|arrival| arrival.velocity.to_bits())
                })
            })
        };
        let one = velocities(1);
        assert_eq!(velocities(3), one);
        assert_eq!(one.len(), 40);
    }

    #[test]
    fn cells_take_their_thickness_and_dispersion() {
        let draws = Draws { realizations: 1, seed: 1, isa: Isa::fastest() };
        let all = cells(&[1e-3, 2e-3], &[0.1, 0.2, 0.3], &draws).unwrap();
        let shapes: Vec<_> = all.iter().map(|cell| (cell.thickness, cell.dispersion)).collect();
        assert_eq!(shapes[..2], [(1e-3, 0.1), (1e-3, 0.2)]);
        assert_eq!((shapes.len(), shapes[3]), (6, (2e-3, 0.1)));
        assert_eq!(all[5].setup(SolverSettings::default()).layers.bone_thickness, 2e-3);
        assert!(cells(&[1e-3], &[0.8], &draws).is_err());
    }
}
