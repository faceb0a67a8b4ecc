//! Standard test functions, and functions on which other simplexes have failed.

use osteon_fuzz::properties;
use proptest::prelude::*;

use super::*;

const SETTINGS: Settings = Settings {
    max_evaluations: 2000,
    costs: Costs::Squares { tolerance: 1e-10 },
    size_tolerance: 1e-5,
    initial_step: 0.15,
};

/// Result of a finished search.
#[derive(Debug, PartialEq)]
struct Found {
    stop: StopReason,
    evaluations: u64,
    restarts: u32,
    best: f64,
    at: Vec<f64>,
    told: Vec<(Vec<f64>, f64)>,
}

fn minimise(start: &[f64], settings: Settings, cost: impl Fn(&[f64]) -> f64) -> Found {
    let mut simplex = Simplex::new(start, settings);
    let (mut best, mut at, mut told) = (f64::INFINITY, start.to_vec(), Vec::new());
    loop {
        let point = match simplex.ask() {
            Proposal::Evaluate(point) => point.to_vec(),
            Proposal::Stopped(stop) => {
                let (evaluations, restarts) = (simplex.evaluations(), simplex.restarts());
                assert_eq!(evaluations, told.len() as u64);
                return Found { stop, evaluations, restarts, best, at, told };
            }
        };
        assert!(point.iter().all(|u| (0.0..=1.0).contains(u)), "outside the box: {point:?}");
        let found = cost(&point);
        if found < best {
            best = found;
            at.clone_from(&point);
        }
        simplex.tell(found);
        told.push((point, found));
    }
}

fn sphere(at: &[f64]) -> f64 {
    at.iter().map(|u| (u - 0.3) * (u - 0.3)).sum()
}

/// Rosenbrock's valley, its minimum (1, 1) at (0.75, 0.75) of the box `[-2, 2]²`.
fn rosenbrock(at: &[f64]) -> f64 {
    let (x, y) = (4.0 * at[0] - 2.0, 4.0 * at[1] - 2.0);
    (1.0 - x) * (1.0 - x) + 100.0 * (y - x * x) * (y - x * x)
}

/// The landscape of an identification: ln v and ln D are nearly linear in the logarithms of seven
/// parameters, of which two combinations matter. The bounds are those of the bone literature.
fn flat_valley(at: &[f64]) -> f64 {
    const BOUNDS: [(f64, f64); 7] =
        [(1500., 2000.), (12., 25.), (0.2, 0.45), (3., 6.5), (8., 16.), (0.2, 0.5), (0.02, 0.3)];
    const OPTIMUM: [f64; 7] = [1598.8, 17.717, 0.3816, 4.795, 9.8254, 0.4495, 0.1029];
    const LN_V: [f64; 7] = [-0.4938, 0.2882, 0.4082, 0.0047, 0.1992, 0.1641, -0.0011];
    const LN_D: [f64; 7] = [0.020, -0.022, 0.021, -0.004, 0.008, 0.011, 1.001];
    let (mut ln_v, mut ln_d) = (0.0, 0.0);
    for i in 0..7 {
        let (lower, upper) = BOUNDS[i];
        let logarithm = libm::log((lower + at[i] * (upper - lower)) / OPTIMUM[i]);
        ln_v += LN_V[i] * logarithm;
        ln_d += LN_D[i] * logarithm;
    }
    let (v, d) = (libm::exp(ln_v) - 1.0, libm::exp(ln_d) - 1.0);
    v * v + d * d
}

// The counts are those of a second implementation, a plain loop that calls the function itself.
#[test]
fn the_sphere_is_found_with_a_pinned_number_of_evaluations() {
    for (dimension, evaluations) in [(1, 32), (2, 74), (3, 129), (5, 266), (7, 473)] {
        let found = minimise(&vec![0.8; dimension], SETTINGS, sphere);
        assert_eq!(found.stop, StopReason::CostReached);
        assert!(found.best <= 1e-10);
        assert_eq!(found.evaluations, evaluations, "{dimension} dimensions");
    }
}

#[test]
fn rosenbrocks_valley_is_followed_to_its_end() {
    let found = minimise(&[0.2, 0.75], SETTINGS, rosenbrock);
    assert_eq!((found.stop, found.restarts), (StopReason::CostReached, 0));
    assert!(found.at.iter().all(|u| (u - 0.75).abs() < 1e-5), "{found:?}");
}

#[test]
fn the_flat_valley_of_an_identification_is_found() {
    for start in [0.3, 0.5, 0.6] {
        let found = minimise(&[start; 7], SETTINGS, flat_valley);
        assert_eq!(found.stop, StopReason::CostReached, "{found:?}");
        assert!((30..400).contains(&found.evaluations), "{}", found.evaluations);
    }
}

#[test]
fn infinite_regions_are_walls() {
    // Only a band is feasible, the minimum lies on its edge.
    let band = |at: &[f64]| if at[0] + at[1] < 0.7 { f64::INFINITY } else { sphere(at) };
    let found = minimise(&[0.8, 0.6], SETTINGS, band);
    assert_eq!(found.stop, StopReason::Converged);
    assert!((found.at[0] - 0.35).abs() < 2e-3 && (found.at[1] - 0.35).abs() < 2e-3, "{found:?}");
    assert!((found.best - 0.005).abs() < 1e-5);
}

#[test]
fn an_optimum_on_a_bound_is_reached() {
    let tilted = |at: &[f64]| at[0] + 2.0 * at[1] + 0.5 * at[2] + 1.0;
    let found = minimise(&[0.5, 0.6, 0.7], SETTINGS, tilted);
    assert_eq!(found.stop, StopReason::Converged);
    assert!(found.best < 1.0 + 1e-3, "{found:?}");
    let corner = |at: &[f64]| at.iter().map(|u| (u - 1.0) * (u - 1.0)).sum();
    let found = minimise(&[0.5, 0.95], SETTINGS, corner);
    assert!(found.best < 1e-6, "{found:?}");
}

#[test]
fn a_simplex_pinned_to_a_bound_is_not_reported_as_converged() {
    // Steep against the bound of axis 0, gentle along it: the first simplex flattens on the bound
    // long before it is at the minimum.
    const FLOOR: f64 = 0.1;
    let pinned = |at: &[f64]| {
        let gentle = |(i, u): (usize, &f64)| {
            (i as f64 + 1.0) * (u - 0.9 + 0.2 * at[0]) * (u - 0.9 + 0.2 * at[0])
        };
        FLOOR + 1e4 * at[0] + at[1..].iter().enumerate().map(gentle).sum::<f64>()
    };
    let mut simplex = Simplex::new(&[0.01, 0.1, 0.1, 0.1], SETTINGS);
    let (mut best, mut at_first_collapse) = (f64::INFINITY, f64::NAN);
    while let Proposal::Evaluate(at) = simplex.ask() {
        let cost = pinned(at);
        best = best.min(cost);
        simplex.tell(cost);
        if simplex.restarts() == 0 {
            at_first_collapse = best - FLOOR;
        }
    }
    assert!(at_first_collapse > 0.01, "this simplex did not collapse: {at_first_collapse}");
    assert_eq!((simplex.ask(), simplex.restarts()), (Proposal::Stopped(StopReason::Converged), 3));
    assert!(best - FLOOR < 1e-6, "{best}");
}

#[test]
fn a_cost_that_cannot_be_lowered_ends_after_a_restart_without_progress() {
    let floor = |at: &[f64]| 0.5 + sphere(at);
    let found = minimise(&[0.8, 0.8], SETTINGS, floor);
    assert_eq!((found.stop, found.restarts), (StopReason::Converged, 1), "{found:?}");
    assert!(found.best < 0.5 + 1e-6);
}

#[test]
fn nothing_feasible_ends_after_the_first_simplex() {
    for bad in [f64::INFINITY, f64::NAN] {
        let found = minimise(&[0.5; 3], SETTINGS, |_| bad);
        assert_eq!((found.stop, found.evaluations), (StopReason::Infeasible, 4));
    }
}

#[test]
fn one_feasible_vertex_is_enough_to_go_on() {
    let start = [0.9, 0.9];
    // The start is the only infeasible vertex.
    let found = minimise(&start, SETTINGS, |at| if at == start { f64::NAN } else { sphere(at) });
    assert_eq!(found.stop, StopReason::CostReached);
    // Only the start is feasible, and the simplex falls on it.
    let found = minimise(&start, SETTINGS, |at| if at == start { 1.0 } else { f64::INFINITY });
    assert_eq!((found.stop, found.at), (StopReason::Converged, start.to_vec()));
}

#[test]
fn without_a_free_parameter_there_is_one_evaluation() {
    let found = minimise(&[], SETTINGS, |_| 0.5);
    assert_eq!((found.stop, found.evaluations), (StopReason::Converged, 1));
    let found = minimise(&[], SETTINGS, |_| f64::INFINITY);
    assert_eq!((found.stop, found.evaluations), (StopReason::Infeasible, 1));
    let found = minimise(&[], SETTINGS, |_| 0.0);
    assert_eq!((found.stop, found.evaluations), (StopReason::CostReached, 1));
}

#[test]
fn evaluations_are_bounded() {
    for max_evaluations in 1..40 {
        let found = minimise(&[0.2, 0.75], Settings { max_evaluations, ..SETTINGS }, rosenbrock);
        assert_eq!(
            (found.stop, found.evaluations),
            (StopReason::EvaluationsUsedUp, max_evaluations)
        );
    }
}

#[test]
fn a_cost_at_the_tolerance_stops_at_once() {
    let found = minimise(&[0.3, 0.3], SETTINGS, sphere);
    assert_eq!((found.stop, found.evaluations), (StopReason::CostReached, 1));
}

#[test]
fn refused_points_are_not_counted_and_end_the_search() {
    let mut simplex = Simplex::new(&[0.5; 7], SETTINGS);
    simplex.tell(1.0);
    let mut refusals = 0;
    while let Proposal::Evaluate(_) = simplex.ask() {
        simplex.refuse();
        refusals += 1;
        assert!(refusals < 10_000, "refusing never ends");
    }
    assert_eq!(
        (simplex.ask(), simplex.evaluations()),
        (Proposal::Stopped(StopReason::Converged), 1)
    );
}

#[test]
fn the_first_simplex_has_edges_of_the_initial_step_and_turns_at_the_bound() {
    let found = minimise(&[0.5, 0.95, 1.0], Settings { max_evaluations: 4, ..SETTINGS }, sphere);
    let points: Vec<Vec<f64>> = found.told.into_iter().map(|(at, _)| at).collect();
    assert_eq!(
        points,
        [
            vec![0.5, 0.95, 1.0],
            vec![0.65, 0.95, 1.0],
            vec![0.5, 0.95 - 0.15, 1.0],
            vec![0.5, 0.95, 1.0 - 0.15]
        ]
    );
}

#[test]
fn equal_costs_keep_the_order_of_their_making() {
    let plateau = |at: &[f64]| if at[0] < 0.1 { 0.0 } else { 1.0 };
    let twice = [(); 2].map(|()| minimise(&[0.5, 0.5, 0.5], SETTINGS, plateau));
    assert_eq!(twice[0], twice[1]);
    assert_eq!(twice[0].stop, StopReason::Converged);
}

properties! {
    /// Points stay in the box, the search ends, and replaying the same costs leads to the same
    /// state.
    fn any_costs_lead_to_an_end(
        start in proptest::collection::vec(0.0..=1.0, 0..8),
        costs in proptest::collection::vec(
            prop_oneof![0.0..2.0, Just(f64::INFINITY), Just(f64::NAN), Just(1.0)], 1..300),
    ) {
        let mut simplex = Simplex::new(&start, Settings { max_evaluations: 250, ..SETTINGS });
        let mut again = simplex.clone();
        for (number, cost) in costs.iter().cycle().take(1000).enumerate() {
            if let Proposal::Evaluate(at) = simplex.ask() {
                prop_assert!(at.iter().all(|u| (0.0..=1.0).contains(u)), "{:?}", at);
            }
            let refuse = number % 7 == 3;
            for simplex in [&mut simplex, &mut again] {
                if refuse { simplex.refuse() } else { simplex.tell(*cost) }
            }
            prop_assert_eq!(&simplex, &again);
        }
        prop_assert!(matches!(simplex.ask(), Proposal::Stopped(_)));
        prop_assert!(simplex.evaluations() <= 250);
    }
}

/// Costs of any sign, none of which is low enough to stop, down to differences that count as equal.
#[test]
fn logarithms_are_minimised_by_their_differences() {
    let costs = Costs::Logarithms { equal: 1e-9 };
    for offset in [-1000.0, 0.0, 1000.0] {
        let settings = Settings { costs, ..SETTINGS };
        let found = minimise(&[0.8, 0.9], settings, |at| sphere(at) + offset);
        assert_eq!(found.stop, StopReason::Converged, "{offset}");
        // With an offset of 1000, rounding leaves differences of 1e-13.
        assert!(found.at.iter().all(|u| (u - 0.3).abs() < 1e-5), "{offset}: {:?}", found.at);
    }
}

/// Returns the fraction of the points of a search for the lowest `cost`, after the first, that were
/// among the `most` candidates before.
fn foreseen(start: &[f64], most: usize, cost: impl Fn(&[f64]) -> f64) -> f64 {
    let mut simplex = Simplex::new(start, SETTINGS);
    let (mut asked, mut foreseen) = (0, 0);
    let mut candidates: Option<Vec<Vec<f64>>> = None;
    while let Proposal::Evaluate(point) = simplex.ask() {
        let point = point.to_vec();
        if let Some(candidates) = candidates {
            asked += 1;
            foreseen += u32::from(candidates.contains(&point));
        }
        let before = simplex.clone();
        let found = simplex.candidates(most);
        assert_eq!(simplex, before, "finding candidates changes nothing");
        assert!(found.len() <= most);
        for (i, at) in found.iter().enumerate() {
            assert!(at.iter().all(|u| (0.0..=1.0).contains(u)), "outside the box: {at:?}");
            assert!(*at != point && !found[..i].contains(at), "twice: {at:?}");
        }
        candidates = Some(found);
        simplex.tell(cost(&point));
    }
    f64::from(foreseen) / f64::from(asked)
}

#[test]
fn most_points_are_foreseen() {
    let check = |start: &[f64], most: usize, cost: fn(&[f64]) -> f64, least: f64| {
        let share = foreseen(start, most, cost);
        assert!(share >= least, "{share:.3} of {most} from {start:?}");
    };
    for start in [0.3, 0.5, 0.6] {
        check(&[start; 7], 3, flat_valley, 0.6);
        check(&[start; 7], 8, flat_valley, 0.75);
    }
    check(&[0.8; 2], 8, sphere, 0.9);
    check(&[0.8; 7], 8, sphere, 0.6);
    check(&[0.2, 0.75], 8, rosenbrock, 0.9);
}

properties! {
    // Excludes those after which a complete simplex is sorted.
    fn with_room_enough_every_point_of_a_step_is_foreseen(
        start in proptest::collection::vec(0.0_f64..=1.0, 1..4),
        seed in any::<u64>(),
    ) {
        // Any number at any point, including infinite ones.
        let cost = |at: &[f64]| {
            let noise = at.iter().fold(seed, |mixed, u| {
                (mixed ^ u.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
            });
            if noise % 5 == 0 { f64::INFINITY } else { 1.0 + (noise >> 40) as f64 }
        };
        let settings = Settings { max_evaluations: 60, ..SETTINGS };
        let mut simplex = Simplex::new(&start, settings);
        while let Proposal::Evaluate(point) = simplex.ask() {
            let made = matches!(simplex.purpose, Move::Build | Move::Shrink { .. });
            let found = simplex.candidates(60);
            let before = point.to_vec();
            let told = cost(point);
            simplex.tell(told);
            // Whether a restart is worthwhile depends on other conditions.
            if let Proposal::Evaluate(next) = simplex.ask() && !made && simplex.restarts == 0 {
                let known = next == before || found.iter().any(|at| at == next);
                prop_assert!(known, "after {told}: {next:?}");
            }
        }
    }
}
