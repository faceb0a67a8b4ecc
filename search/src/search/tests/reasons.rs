//! Explanations of searches that end without a match.

use osteon_common::job::{Measurements, PosteriorSettings, SearchMethod};
use osteon_common::outcome::FailureKind;

use super::likelihood::{by_likelihood, run_on_speeds};
use super::*;

/// Returns the jobs of both methods.
fn both(change: impl Fn(&mut JobSpecification)) -> [JobSpecification; 2] {
    [specification(400), by_newton(400)].map(|mut job| {
        change(&mut job);
        job
    })
}

/// Runs a job whose realizations are those of `outcomes`, and returns how it ended.
fn ended(
    job: &JobSpecification,
    outcomes: impl Fn(&Point) -> Outcomes,
) -> (Status, String, JobResult) {
    let mut search = Search::new(Arc::new(job.clone()));
    while let Step::Evaluate(point) = search.ask() {
        search.tell(outcomes(&point), ERRORS);
    }
    let ending = ending(&search);
    let result = search.result(&ending, &Program::current(None));
    (ending.status, ending.reason.unwrap_or_default(), result)
}

fn check(reason: &str, parts: &[&str]) {
    for part in parts {
        assert!(reason.contains(part), "{part}: {reason}");
    }
}

#[test]
fn data_out_of_reach_are_not_matched_and_both_methods_say_how_far_off() {
    for job in both(|job| job.data = Some(Data::from_moments(2000.0, 0.03))) {
        let (status, reason, _) = ended(&job, outcomes);
        assert_eq!(status, Status::NotMatched);
        check(
            &reason,
            &[
                "no nearby point fits better",
                "the best cost is 1.037e-1",
                "mean velocity is 32 % above the data's,",
                "coefficient of variation ",
                "longitudinal_young_modulus is on its lower bound; widen the bounds",
            ],
        );
    }
}

/// With a known number of velocities the reason says how many standard errors the data are missed
/// by, and a point within the noise has converged.
#[test]
fn distances_are_in_standard_errors_where_these_are_known() {
    let counted = |mean: f64, count: u64| Data {
        measurements: Measurements::Moments {
            mean,
            coefficient_of_variation: 0.03,
            count: Some(count),
        },
        repeatability: 0.0,
        decay_error: 0.0,
    };
    // The smallest mean within the bounds is 2644 m/s; one standard error is 0.3 %.
    for (mean, expected) in [(2640.0, Status::Converged), (2600.0, Status::NotMatched)] {
        for mut job in both(|job| job.data = Some(counted(mean, 100))) {
            // Sampling errors would add to those of the data.
            job.monte_carlo.realizations = 400;
            let (status, reason, result) = ended(&job, |point| {
                let few = outcomes(point);
                (0..400).map(|k| few[k % 4]).collect()
            });
            assert_eq!(status, expected, "{mean}: {reason}");
            check(&reason, &[" standard errors)", "is on its lower bound"]);
            let held = "no interval is stated because a bound holds the point back";
            assert_eq!(reason.contains(held), status == Status::Converged, "{reason}");
            let found = result.conclusions.inference.unwrap();
            assert_eq!(found.matched, status == Status::Converged);
            assert_eq!(found.bulk_velocity.known, None);
        }
    }
}

#[test]
fn failed_realizations_that_stop_a_search_are_named() {
    let failing = |point: &Point| -> Outcomes {
        let mut found = outcomes(point).to_vec();
        if point.0[1] > 16e9 {
            found[0] = Err(FailureKind::NoArrival);
            found[1] = Err(FailureKind::NoArrival);
        }
        found.into()
    };
    for job in both(|_| {}) {
        let (status, reason, _) = ended(&job, failing);
        assert_eq!(status, Status::NotMatched, "{reason}");
        check(
            &reason,
            &[
                "stopped by failed realizations: ",
                "points had too many",
                "(at the last of them 2 of 4 realizations failed (2 no_arrival); \
                 max_failed_fraction is 0.01)",
                "% below the data's",
                "raise [monte_carlo] max_failed_fraction",
            ],
        );
    }
}

#[test]
fn used_up_evaluations_say_how_far_off_the_best_point_is() {
    for mut job in both(|_| {}) {
        job.search.max_evaluations = 1;
        let (status, reason, _) = ended(&job, outcomes);
        assert_eq!(status, Status::MaxEvaluations);
        check(&reason, &["reached the limit of 1 evaluations: ", "% below the data's"]);
    }
}

/// One of a hundred velocities is doubled. It makes the coefficient of variation larger than any
/// within the bounds, and its standard error by the influences of the velocities so large that the
/// difference would be within the noise.
#[test]
fn an_outlier_does_not_excuse_the_misfit_that_it_causes() {
    let mut velocities: Vec<f64> =
        (0..100).map(|k| 3900.0 * (1.0 + 0.03 * (f64::from(k) / 49.5 - 1.0))).collect();
    velocities[50] *= 2.0;
    for job in both(|job| job.data = Some(Data::from_velocities(velocities.clone()))) {
        let (status, reason, result) = ended(&job, outcomes);
        assert_eq!(status, Status::NotMatched, "{reason}");
        check(&reason, &["dispersion is on its upper bound"]);
        let found = result.conclusions.inference.unwrap();
        assert!(!found.matched && found.dispersion.known.is_none());
    }
}

/// The status and the conclusions judge one misfit, that of the likelihood, whose maximum one wrong velocity of a
/// hundred hardly moves: the moments are far off, by the errors that count where a bound holds the point back.
#[test]
fn a_likelihood_with_an_outlier_on_a_bound_is_matched_in_status_and_conclusions() {
    let truth = Point::of_bone([1598.8, 17.7e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
    let mut job = by_likelihood(&truth, 3, 100);
    let data = job.data.as_ref().unwrap();
    let mut velocities = data.set(0).unwrap().velocities.to_vec();
    velocities[50] *= 2.0;
    job.data = Some(Data::from_velocities(velocities));
    job.parameters[6] = Range::Free { start: 0.08, lower: 0.05, upper: 0.1 };
    let search = run_on_speeds(&job);
    let Ending { status, reason, .. } = ending(&search);
    let result = search.result(&ending(&search), &Program::current(None));
    let found = result.conclusions.inference.unwrap();
    assert_eq!((status, found.matched), (Status::Converged, true), "{reason:?}");
    check(&reason.unwrap(), &["dispersion is on its upper bound", "no interval is stated"]);
}

#[test]
fn a_compromise_with_priors_has_converged() {
    let mut job = specification(400);
    job.search.priors[6] = Some(Prior { value: 0.2, weight: 1.0 });
    let (status, reason, _) = ended(&job, outcomes);
    assert_eq!((status, reason.as_str()), (Status::Converged, ""));
    // On a bound it has missed the data, and so it has with data whose noise is far smaller.
    job.data = Some(Data::from_moments(2000.0, 0.03));
    let (status, reason, _) = ended(&job, outcomes);
    assert_eq!(status, Status::NotMatched);
    check(&reason, &["longitudinal_young_modulus is on its lower bound", "widen the bounds"]);
    let velocities = (0..1000).map(|k| 3900.0 * (1.0 + 0.02 * (f64::from(k) / 499.5 - 1.0)));
    job.data = Some(Data::from_velocities(velocities.collect()));
    job.search.priors[6] = Some(Prior { value: 0.2, weight: 1e9 });
    let (status, reason, _) = ended(&job, outcomes);
    assert_eq!(status, Status::NotMatched);
    check(&reason, &["lower the weights of [search.priors]"]);
}

/// A job that asks for nothing but the posterior is judged by it.
#[test]
fn a_posterior_that_is_none_or_not_exact_has_not_converged() {
    let mut job = specification(400);
    job.search.method = SearchMethod::Posterior;
    job.posterior = Some(PosteriorSettings { max_evaluations: 20, ..PosteriorSettings::default() });
    let around = |mean: f64| {
        let velocities = (0..40).map(|k| mean * (1.0 + 0.05 * (f64::from(k) / 19.5 - 1.0)));
        Some(Data::from_velocities(velocities.collect()))
    };
    job.data = around(3900.0);
    let (status, reason, result) = ended(&job, outcomes);
    assert_eq!(status, Status::MaxEvaluations, "{reason}");
    check(&reason, &["checked at 20 draws", "[posterior] max_evaluations"]);
    assert!(result.conclusions.posterior.is_none_or(|found| !found.converged));
    // The best point is a mere draw, for which the test of a fitted model does not hold.
    assert!(result.best.is_some_and(|best| best.kolmogorov.is_none()));
    // Far beyond what the bounds allow.
    job.data = around(90_000.0);
    let (status, reason, result) = ended(&job, outcomes);
    assert_eq!(status, Status::NotMatched, "{reason}");
    check(&reason, &["there is no posterior", "widen them"]);
    assert!(result.conclusions.posterior.is_none());
}

/// The interpolation is right, but eight realizations are too few beside four thousand velocities.
#[test]
fn a_posterior_of_too_noisy_a_model_has_not_converged() {
    let truth = Point::of_bone([1598.8, 17.7e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
    let mut job = by_likelihood(&truth, 1, 4000);
    job.search.method = SearchMethod::Posterior;
    job.posterior = Some(PosteriorSettings::default());
    job.objective = Objective::default();
    job.monte_carlo.realizations = 8;
    job.parameters[0] = Range::Free { start: 1600.0, lower: 1500.0, upper: 1700.0 };
    let Ending { status, reason, .. } = ending(&run_on_speeds(&job));
    let reason = reason.unwrap_or_default();
    assert_eq!(status, Status::MaxEvaluations, "{reason}");
    check(&reason, &["sampling errors of the model's moments", "[monte_carlo] realizations"]);
}

/// The shear modulus starts on a bound, and no other value of it would bring the model nearer to the
/// data.
#[test]
fn only_bounds_that_hold_the_search_back_are_named() {
    let mut job = specification(400);
    job.parameters[0] = Range::Free { start: 1600.0, lower: 1500.0, upper: 1700.0 };
    job.parameters[3] = Range::Free { start: 3e9, lower: 3e9, upper: 6e9 };
    job.search.method = SearchMethod::Newton;
    job.data = Some(Data::from_moments(8000.0, 0.03));
    let corner = |point: &Point| -> Outcomes {
        let slower = (point.density() / 1600.0).sqrt() + point.0[3] / 1e12;
        outcomes(point).iter().map(|outcome| outcome.map(|velocity| velocity / slower)).collect()
    };
    let (status, reason, result) = ended(&job, corner);
    let best = result.best.unwrap().point;
    assert!(best.density() < 1501.0 && best.0[3] < 3.001e9, "{best:?}");
    assert_eq!(status, Status::NotMatched, "{reason}");
    check(&reason, &["density is on its lower bound, longitudinal_young_modulus is on its upper"]);
    assert!(!reason.contains("shear"), "{reason}");
}
