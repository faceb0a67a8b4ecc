//! Tests of the assessment of outcomes, and of replay.

use osteon_common::case::Setup;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{
    Group, MonteCarlo, Objective, Prior, Range, Sampling, Search as SearchSettings, SearchMethod,
};
use osteon_common::outcome::FailureKind;
use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::Parameter;
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::realization::Ensemble;
use osteon_common::results::Moments;
use osteon_common::systematic::Systematic;

use super::*;

mod advice;
mod branch;
mod chi_square;
mod likelihood;
mod reasons;
mod sets;

/// Only e_L and the dispersion are free.
fn specification(max_evaluations: u64) -> JobSpecification {
    let mut parameters =
        Range::of_bone([1598.8, 0.0, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.0].map(Range::Fixed));
    parameters[1] = Range::Free { start: 15e9, lower: 12e9, upper: 25e9 };
    parameters[6] = Range::Free { start: 0.12, lower: 0.02, upper: 0.3 };
    JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(Data::from_moments(3900.0, 0.03)),
        parameters,
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo { realizations: 4, ..MonteCarlo::default() },
        objective: Objective::default(),
        search: SearchSettings { max_evaluations, ..SearchSettings::default() },
        posterior: None,
    }
}

const ERRORS: Option<EstimatedError> = Some(EstimatedError { median: 2e-5, largest: 3e-5 });

/// Four velocities whose moments follow from e_L and the dispersion.
fn outcomes(point: &Point) -> Outcomes {
    let mean = 3900.0 * (point.0[1] / 17.7e9);
    let spread = mean * point.dispersion() / 4.0;
    [-1.0, 1.0, -1.0, 1.0].map(|sign| Ok(mean + sign * spread)).into()
}

/// Points with their outcomes.
type Told = Vec<(Point, Outcomes)>;

/// Runs the search to its end; returns it with all points and outcomes passed to it.
fn run(specification: &JobSpecification) -> (Search, Told) {
    let mut search = Search::new(Arc::new(specification.clone()));
    let mut told = Vec::new();
    while let Step::Evaluate(point) = search.ask() {
        told.push((point, outcomes(&point)));
        search.tell(outcomes(&point), ERRORS);
    }
    (search, told)
}

fn ending(search: &Search) -> Ending {
    match search.ask() {
        Step::Done(ending) => ending,
        Step::Evaluate(point) => panic!("not done, wants {point:?}"),
    }
}

#[test]
fn an_identification_finds_what_made_the_data() {
    let (search, _) = run(&specification(400));
    let ending = ending(&search);
    assert_eq!(ending, Ending::from_search(Status::Converged, None));
    let result = search.result(&ending, &Program::current(None));
    let best = result.best.unwrap();
    assert!(best.cost.unwrap() <= 1e-10);
    assert!((best.point.0[1] / 17.7e9 - 1.0).abs() < 1e-4, "{best:?}");
    assert!((best.point.dispersion() / 0.12 - 1.0).abs() < 1e-3, "{best:?}");
    assert_eq!(best.outcomes, outcomes(&best.point).to_vec());
    // Two more evaluations measure the derivatives.
    assert_eq!(result.evaluations + 2, search.history().len() as u64);
}

/// The same job with the method `newton`.
fn by_newton(max_evaluations: u64) -> JobSpecification {
    let search = SearchSettings { max_evaluations, ..SearchSettings::by(SearchMethod::Newton) };
    JobSpecification { search, ..specification(max_evaluations) }
}

#[test]
fn newton_finds_what_made_the_data() {
    let (search, _) = run(&by_newton(400));
    let ending = ending(&search);
    assert_eq!(ending, Ending::from_search(Status::Converged, None));
    let best = search.best().unwrap();
    assert!(best.cost.unwrap() <= 1e-12);
    assert!((best.point.0[1] / 17.7e9 - 1.0).abs() < 1e-5, "{best:?}");
    assert!((best.point.dispersion() / 0.12 - 1.0).abs() < 1e-5, "{best:?}");
    assert!(search.evaluations() < 12, "{}", search.evaluations());
}

#[test]
fn newton_leaves_out_points_that_are_not_admissible() {
    let mut job = by_newton(60);
    job.parameters[1] = Range::Fixed(9e9);
    job.parameters[2] = Range::Free { start: 0.45, lower: 0.1, upper: 1.5 };
    let (search, told) = run(&job);
    assert!(told.iter().all(|(point, _)| point.constants().violated().is_empty()), "{told:?}");
    assert_eq!(ending(&search).status, Status::NotMatched);
    job.parameters[0] = Range::Fixed(-1.0);
    let search = Search::new(Arc::new(job));
    assert_eq!((ending(&search).status, search.evaluations()), (Status::Failed, 0));
}

#[test]
fn velocities_that_are_all_the_same_are_no_use_to_newton() {
    let mut search = Search::new(Arc::new(by_newton(60)));
    while let Step::Evaluate(_) = search.ask() {
        search.tell([Ok(3900.0); 4].into(), ERRORS);
    }
    let Ending { status, reason, .. } = ending(&search);
    assert_eq!(status, Status::Failed);
    assert!(reason.unwrap().contains("raise [monte_carlo] realizations"));
}

#[test]
fn the_best_evaluated_point_is_returned_and_not_the_last() {
    for max_evaluations in 2..30 {
        let (search, told) = run(&specification(max_evaluations));
        let searched = search.history().iter().filter(|row| row.role.varied.is_none());
        let costs: Vec<f64> = searched.map(|row| row.cost.unwrap()).collect();
        let lowest = costs.iter().copied().fold(f64::INFINITY, f64::min);
        let first = costs.iter().position(|cost| *cost == lowest).unwrap();
        let best = search.result(&ending(&search), &Program::current(None)).best.unwrap();
        assert_eq!((best.point, best.cost), (told[first].0, Some(lowest)));
        assert_eq!(search.best().unwrap().number, first as u64);
    }
}

#[test]
fn the_first_point_has_the_bits_of_the_start() {
    let specification = specification(10);
    let search = Search::new(Arc::new(specification.clone()));
    let Step::Evaluate(point) = search.ask() else { panic!("nothing asked") };
    assert_eq!(point.0.map(f64::to_bits), specification.start().0.map(f64::to_bits));
}

#[test]
fn a_replay_of_any_part_of_the_path_goes_on_the_same_way() {
    for specification in [specification(40), by_newton(40)] {
        replay_of_any_part(&specification);
    }
}

fn replay_of_any_part(specification: &JobSpecification) {
    let (full, told) = run(specification);
    for length in 0..=told.len() {
        let mut search = Search::new(Arc::new(specification.clone()));
        for (point, outcomes) in &told[..length] {
            search.replay(*point, outcomes.clone(), ERRORS).unwrap();
        }
        assert_eq!(search.evaluations(), length as u64);
        for (point, outcomes) in &told[length..] {
            assert_eq!(search.ask(), Step::Evaluate(*point));
            search.tell(outcomes.clone(), ERRORS);
        }
        assert_eq!(search.ask(), full.ask());
        assert_eq!(search.history(), full.history());
        let (ending, program) = (ending(&full), Program::current(None));
        assert_eq!(search.result(&ending, &program), full.result(&ending, &program));
    }
}

#[test]
fn a_replay_of_another_path_is_refused() {
    let specification = specification(40);
    let (_, mut told) = run(&specification);
    told[3].0.0[1] += 1.0;
    let mut search = Search::new(Arc::new(specification));
    let mut retold =
        told.into_iter().map(|(point, outcomes)| search.replay(point, outcomes, ERRORS));
    assert_eq!(retold.find_map(Result::err).unwrap().number, 3);
}

#[test]
fn the_digest_follows_the_order_of_the_path() {
    let (search, told) = run(&specification(20));
    let mut digest = PathDigest::new();
    // Points that measure a derivative are not on the path.
    for ((point, outcomes), row) in told.iter().zip(search.history()) {
        if row.role.varied.is_none() {
            digest.add_evaluation(point, outcomes);
        }
    }
    assert_eq!(search.result(&ending(&search), &Program::current(None)).digest, digest.finish());
}

#[test]
fn too_many_failures_make_a_point_infeasible_and_the_job_say_why() {
    let mut search = Search::new(Arc::new(specification(400)));
    let mut failed = outcomes(&specification(400).start()).to_vec();
    failed[2] = Err(FailureKind::NoArrival);
    failed[3] = Err(FailureKind::NoArrival);
    while let Step::Evaluate(_) = search.ask() {
        search.tell(failed.clone().into(), ERRORS);
    }
    let Ending { status, reason, .. } = ending(&search);
    let reason = reason.unwrap();
    assert_eq!(status, Status::Failed);
    assert!(reason.contains("among the 3 evaluated"), "{reason}");
    assert!(reason.contains("2 of 4 realizations failed (2 no_arrival)"), "{reason}");
    assert_eq!(search.history()[0].cost, Some(f64::INFINITY));
    // A search whose points all failed has no best point, and the data determine nothing.
    assert_eq!(search.best(), None);
    assert_eq!(search.result(&ending(&search), &Program::current(None)).best, None);
}

#[test]
fn an_infeasible_point_is_not_best_even_while_nothing_else_is_known() {
    let mut search = Search::new(Arc::new(specification(400)));
    search.tell([Err(FailureKind::NoArrival); 4].into(), ERRORS);
    assert_eq!(search.best(), None);
    let Step::Evaluate(point) = search.ask() else { panic!("done") };
    search.tell(outcomes(&point), ERRORS);
    assert_eq!(search.best().unwrap().number, 1);
}

#[test]
fn failures_within_the_fraction_leave_a_finite_cost() {
    let mut job = specification(400);
    job.monte_carlo.max_failed_fraction = 0.25;
    let mut search = Search::new(Arc::new(job));
    let mut failed = outcomes(&specification(400).start()).to_vec();
    failed[2] = Err(FailureKind::NoArrival);
    search.tell(failed.into(), ERRORS);
    assert!(search.history()[0].cost.unwrap().is_finite());
    assert_eq!(search.history()[0].failures.total(), 1);
}

#[test]
fn a_propagation_is_one_evaluation_at_the_start() {
    let propagation =
        JobSpecification { kind: JobKind::Propagation, data: None, ..specification(400) };
    let (search, told) = run(&propagation);
    assert_eq!(told.len(), 1);
    assert_eq!(told[0].0, propagation.start());
    let result = search.result(&ending(&search), &Program::current(None));
    assert_eq!((result.status, result.data), (Status::Converged, None));
    let best = result.best.unwrap();
    assert_eq!((best.cost, best.estimated_error), (None, ERRORS));

    let mut search = Search::new(Arc::new(propagation));
    search.tell([Err(FailureKind::NotFinite); 4].into(), ERRORS);
    let Ending { status, reason, .. } = ending(&search);
    assert_eq!(status, Status::Failed);
    assert!(reason.unwrap().contains("4 of 4 realizations failed (4 not_finite)"));
    assert_eq!(search.best().unwrap().moments, None);
}

#[test]
fn inadmissible_points_are_not_evaluated() {
    // Above ν_L ≈ 0.48 the elasticity at the start is not positive definite.
    let mut job = specification(60);
    job.parameters[1] = Range::Fixed(9e9);
    job.parameters[2] = Range::Free { start: 0.45, lower: 0.1, upper: 1.5 };
    let mut search = Search::new(Arc::new(job));
    let mut evaluated = 0;
    while let Step::Evaluate(point) = search.ask() {
        assert!(point.constants().violated().is_empty(), "{point:?}");
        evaluated += 1;
        search.tell(outcomes(&point), ERRORS);
    }
    assert_eq!(search.evaluations(), evaluated);
}

#[test]
fn without_an_admissible_point_the_job_fails_without_an_evaluation() {
    let mut job = specification(60);
    job.parameters[0] = Range::Fixed(-1.0);
    let search = Search::new(Arc::new(job));
    let Ending { status, reason, .. } = ending(&search);
    assert_eq!(status, Status::Failed);
    assert!(reason.unwrap().contains("inadmissible"));
    assert!(search.result(&ending(&search), &Program::current(None)).best.is_none());
}

/// If the control variate explains the velocities completely, their moments are those of the
/// ensemble's law for any germs. A search then finds the point that made the data from few
/// velocities.
#[test]
fn a_controlled_search_goes_by_the_moments_of_the_law() {
    let asked = MonteCarlo {
        realizations: 16,
        sampling: Sampling::Sobol,
        scrambles: 2,
        control_variate: true,
        ..MonteCarlo::default()
    };
    let explained = |monte_carlo: &MonteCarlo, point: &Point| -> Outcomes {
        let ensemble = Ensemble::drawn(point, monte_carlo.germs()).unwrap();
        let speed = |index| {
            let bone = ensemble.bone(index).unwrap();
            (bone.elasticity.rows()[0][0] / bone.density).sqrt()
        };
        (0..monte_carlo.realizations).map(|index| Ok(0.99 * speed(index))).collect()
    };
    let truth = Point::of_bone([1598.8, 17.7e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1]);
    let other = MonteCarlo { seed: 99, ..asked };
    let data = statistics::estimate(&other, &truth, &explained(&other, &truth)).unwrap().moments;
    let Moments { mean, coefficient_of_variation } = data;
    let specification = Arc::new(JobSpecification {
        data: Some(Data::from_moments(mean, coefficient_of_variation)),
        monte_carlo: asked,
        ..specification(400)
    });
    let mut search = Search::new(Arc::clone(&specification));
    let mut again = Search::new(specification);
    while let Step::Evaluate(point) = search.ask() {
        search.tell(explained(&asked, &point), ERRORS);
        again.replay(point, explained(&asked, &point), ERRORS).unwrap();
    }
    let result = search.result(&ending(&search), &Program::current(None));
    assert_eq!(result.status, Status::Converged);
    assert_eq!(result, again.result(&ending(&again), &Program::current(None)));
    assert_eq!((result.sampling, result.scrambles), (Sampling::Sobol, 2));
    let best = result.best.unwrap();
    assert!(best.velocity.unwrap().controlled);
    assert!((best.point.0[1] / truth.0[1] - 1.0).abs() < 1e-4, "{:?}", best.point);
    assert!((best.point.dispersion() / truth.dispersion() - 1.0).abs() < 1e-4, "{:?}", best.point);
}

#[test]
fn only_what_is_told_counts_whatever_was_looked_at_before() {
    let specification = Arc::new(specification(60));
    let (mut looked, mut plain) = (Search::new(specification.clone()), Search::new(specification));
    while let Step::Evaluate(point) = plain.ask() {
        let right = outcomes(&point);
        let wrong: Outcomes = right.iter().map(|v| v.map(|v| 1.1 * v)).collect();
        looked.candidates_after(&wrong, 3);
        looked.tell(right.clone(), ERRORS);
        plain.tell(right, ERRORS);
    }
    assert_eq!(looked.summary(), plain.summary());
}

#[test]
fn where_a_search_goes_is_known_before_it_is_told() {
    for specification in [specification(60), by_newton(60)] {
        let mut search = Search::new(Arc::new(specification));
        let mut foreseen = 0;
        while let Step::Evaluate(point) = search.ask() {
            let candidates = search.candidates(8);
            let outcomes = outcomes(&point);
            let after = search.candidates_after(&outcomes, 8);
            assert!(candidates.len() <= 8 && after.len() <= 8);
            assert!(candidates.iter().all(|at| !same_point(at, &point)), "{point:?} is asked for");
            assert_eq!(search.ask(), Step::Evaluate(point), "a question changes nothing");
            search.tell(outcomes, ERRORS);
            match search.ask() {
                Step::Evaluate(next) => {
                    assert!(same_point(&after[0], &next), "{after:?} and not {next:?}");
                    foreseen += u32::from(candidates.iter().any(|at| same_point(at, &next)));
                }
                Step::Done(_) => assert_eq!(after, []),
            }
        }
        let by_simplex = search.specification.search.method == SearchMethod::Simplex;
        assert!(foreseen > 20 || !by_simplex, "{foreseen} points were foreseen");
        assert_eq!(search.candidates(8), []);
    }
}
