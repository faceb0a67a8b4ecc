//! What failed realizations do to the moments, where it is known: of draws that have velocities, the slowest
//! are made failures.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

use osteon_common::case::Setup;
use osteon_common::job::{MonteCarlo, Sampling};
use osteon_common::outcome::{FailureKind, Outcome};
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_common::results::Moments;
use osteon_common::statistics::{failure_bias, moments};
use osteon_solver::{Solver, Workspace};

const MONTE_CARLO: MonteCarlo = MonteCarlo {
    realizations: 1000,
    seed: 1,
    sampling: Sampling::MonteCarlo,
    scrambles: 1,
    control_variate: false,
    max_failed_fraction: 1.0,
};

/// The paper's optimum with another dispersion.
fn optimum_with_dispersion(dispersion: f64) -> Point {
    Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion])
}

fn outcomes(point: &Point) -> Vec<Outcome> {
    let ensemble = Ensemble::drawn(point, MONTE_CARLO.germs()).unwrap();
    let solver = Solver::new(&Setup::default());
    let mut workspace = Workspace::default();
    (0..MONTE_CARLO.realizations)
        .map(|i| solver.outcome(&ensemble.bone(i).unwrap(), &mut workspace))
        .collect()
}

/// Without the slowest of those that have a velocity, a `part` of them.
fn drop_slowest(outcomes: &[Outcome], part: f64) -> Vec<Outcome> {
    let mut ascending = velocities(outcomes);
    ascending.sort_by(f64::total_cmp);
    let limit = ascending[(part * ascending.len() as f64) as usize];
    let is_slow = |outcome: &Outcome| outcome.is_ok_and(|velocity| velocity < limit);
    let cut = |outcome| if is_slow(outcome) { Err(FailureKind::NoArrival) } else { *outcome };
    outcomes.iter().map(cut).collect()
}

fn velocities(outcomes: &[Outcome]) -> Vec<f64> {
    outcomes.iter().filter_map(|outcome| outcome.ok()).collect()
}

fn difference(a: Moments, b: Moments) -> [f64; 2] {
    [a.mean - b.mean, a.coefficient_of_variation - b.coefficient_of_variation]
}

/// 4000 draws are right to 0.3 % of the bias at the dispersion 0.1, to 5 % at 0.3, and to 6 % at 0.6, where 2.6 %
/// fail by themselves: there the bias of all failures, less that of these, is compared.
#[test]
fn the_bias_of_failures_is_what_the_slowest_draws_make() {
    for (dispersion, parts) in [(0.1029, &[0.03][..]), (0.3, &[0.03, 0.1]), (0.6, &[0.03])] {
        let point = optimum_with_dispersion(dispersion);
        let all = outcomes(&point);
        let before = failure_bias(&MONTE_CARLO, &point, &all).unwrap();
        for &part in parts {
            let cut = drop_slowest(&all, part);
            let after = failure_bias(&MONTE_CARLO, &point, &cut).unwrap();
            let [whole, rest] =
                [&all, &cut].map(|outcomes| moments(&velocities(outcomes)).unwrap());
            let truth = difference(whole, rest);
            for (found, truth) in difference(after, before).into_iter().zip(truth) {
                let off = (found / truth - 1.0).abs();
                assert!(off < 0.1, "{dispersion}, {part}: {found}, in truth {truth}");
            }
        }
        let failed = all.iter().any(Result::is_err);
        assert_eq!(failed, dispersion == 0.6);
        let signs = (before.mean < 0.0, before.coefficient_of_variation > 0.0);
        assert_eq!(signs, (failed, failed), "{before:?}");
    }
}
