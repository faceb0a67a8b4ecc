//! Comparison of both methods with one solution of a case by the exact method at higher refinement.

mod difference;

use osteon_common::case::{Case, Setup};
use osteon_common::limits::REFINEMENT_MAX;
use osteon_common::settings::{Method, SolverSettings};

pub use self::difference::{Difference, difference, error_max};
use crate::arrival::Arrival;
use crate::failure::Failure;
use crate::isa::Isa;
use crate::solver::{Solver, Workspace};

/// Factor of the reference's refinement to the case's.
const REFERENCE: f64 = 5.0;

/// One solution of the case.
#[derive(Debug, Clone)]
pub struct MethodSolution {
    /// The setup, with the settings used.
    pub setup: Setup,
    /// The picked arrival, or the failure.
    pub arrival: Result<Arrival, Failure>,
    /// Difference from the refined solution.
    pub difference: Difference,
}

/// The solutions of one case.
#[derive(Debug, Clone)]
pub struct Check {
    /// The exact method at the case's refinement.
    pub exact: MethodSolution,
    /// The hybrid method with the case's discretisation; none of a case with attenuation or tilt, which
    /// that method does not compute.
    pub hybrid: Option<MethodSolution>,
    /// The exact method at five times the case's refinement, at most 16.
    pub refined: MethodSolution,
}

impl Check {
    /// Solves `case` in every way, on `isa`.
    pub fn run(case: &Case, isa: Isa) -> Self {
        let mut workspace = Workspace::default();
        let mut solve = |solver| {
            let setup = Setup { solver, ..case.setup.clone() };
            let arrival = Solver::with_isa(&setup, isa).arrival(&case.bone, &mut workspace);
            (setup, arrival)
        };
        let [exact, hybrid, refined] = settings(&case.setup.solver);
        let hybrid = case.setup.only_exact().is_none().then(|| solve(hybrid));
        let [exact, refined] = [exact, refined].map(&mut solve);
        let reference = refined.1.clone();
        let solution = |(setup, arrival): (Setup, _)| {
            let difference = difference(&setup, &arrival, &reference);
            MethodSolution { setup, arrival, difference }
        };
        Self { exact: solution(exact), hybrid: hybrid.map(solution), refined: solution(refined) }
    }

    /// Returns all solutions, the reference last.
    pub fn solutions(&self) -> impl Iterator<Item = &MethodSolution> {
        [&self.exact].into_iter().chain(&self.hybrid).chain([&self.refined])
    }

    /// Returns the largest accepted relative difference of a velocity from the refined one.
    pub fn error_max(&self) -> f64 {
        error_max(&self.exact.setup)
    }

    /// Returns whether all picked the same extremum, and both velocities are within the limit.
    pub fn passed(&self) -> bool {
        self.same_picks() && self.outside_limit().next().is_none()
    }

    /// Returns whether all picked the same extremum.
    pub fn same_picks(&self) -> bool {
        self.solutions().all(|one| one.difference != Difference::Picks)
    }

    /// Returns the solutions whose velocity is outside the limit.
    pub fn outside_limit(&self) -> impl Iterator<Item = &MethodSolution> {
        let is_off = |one: &&MethodSolution| {
            one.difference.velocity().is_some_and(|error| error > self.error_max())
        };
        [&self.exact].into_iter().chain(&self.hybrid).filter(is_off)
    }
}

/// Returns exact, hybrid and refined settings for a case with `given` ones.
fn settings(given: &SolverSettings) -> [SolverSettings; 3] {
    let default = SolverSettings::default();
    let exact = SolverSettings { refinement: given.refinement, ..default };
    let refinement = (REFERENCE * given.refinement).min(REFINEMENT_MAX);
    let hybrid = match given.method {
        Method::Hybrid => *given,
        Method::Exact => SolverSettings { method: Method::Hybrid, ..exact },
    };
    [exact, hybrid, SolverSettings { refinement, ..exact }]
}

#[cfg(test)]
mod tests {
    use osteon_common::bone::Bone;
    use osteon_common::parameters::Point;

    use super::*;

    /// The optimum of the paper.
    const OPTIMUM: Point =
        Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);

    #[test]
    fn settings_follow_the_cases() {
        let hybrid = SolverSettings {
            method: Method::Hybrid,
            refinement: 4.0,
            element_order: 6,
            ..SolverSettings::default()
        };
        let [exact, second, refined] = settings(&hybrid);
        assert_eq!(second, hybrid);
        assert_eq!((exact.method, exact.refinement, exact.element_order), (Method::Exact, 4.0, 8));
        assert_eq!((refined.method, refined.refinement), (Method::Exact, 16.0));
        let [_, hybrid, refined] = settings(&SolverSettings::default());
        assert_eq!((hybrid.method, refined.refinement), (Method::Hybrid, 5.0));
    }

    fn check(thickness: f64) -> Check {
        let elasticity = OPTIMUM.constants().elasticity().unwrap();
        let mut case = Case {
            setup: Setup::default(),
            bone: Bone { density: OPTIMUM.density(), elasticity }.into(),
        };
        case.setup.layers.bone_thickness = thickness;
        Check::run(&case, Isa::fastest())
    }

    #[test]
    fn the_papers_optimum_passes_and_errors_are_judged_by_thickness() {
        let mut thick = check(4e-3);
        assert!(thick.passed(), "{thick:?}");
        assert_eq!(thick.refined.difference, Difference::Numbers { velocity: 0.0, time: 0.0 });
        let error = thick.exact.difference.velocity().unwrap();
        assert!(error > 0.0, "the default is not the refined one");
        thick.exact.difference = Difference::Numbers { velocity: 2e-4, time: 0.0 };
        assert!(!thick.passed());
        let mut thin = thick.clone();
        thin.exact.setup.layers.bone_thickness = 1e-3;
        assert!(thin.passed());
        let hybrid = |check: &mut Check, found| check.hybrid.as_mut().unwrap().difference = found;
        hybrid(&mut thin, Difference::Numbers { velocity: 3.1e-4, time: 0.0 });
        assert!(!thin.passed(), "the hybrid method is judged, too");
        hybrid(&mut thin, Difference::Picks);
        assert!(!thin.passed());
    }
}
