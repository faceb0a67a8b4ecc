//! Searches with the likelihood of measured velocities as objective.

use super::*;

/// Returns the speeds of the bones at a point, used as velocities.
fn speeds(monte_carlo: &MonteCarlo, point: &Point) -> Outcomes {
    let ensemble = Ensemble::drawn(point, monte_carlo.germs()).unwrap();
    let speed = |index| {
        let bone = ensemble.bone(index).unwrap();
        (bone.elasticity.rows()[0][0] / bone.density).sqrt()
    };
    (0..monte_carlo.realizations).map(|index| Ok(speed(index))).collect()
}

/// An identification by the likelihood of `count` speeds at `truth`, drawn with this seed.
pub(super) fn by_likelihood(truth: &Point, seed: u64, count: u64) -> JobSpecification {
    let drawn = MonteCarlo { realizations: count, seed, ..MonteCarlo::default() };
    let measured = speeds(&drawn, truth).iter().filter_map(|outcome| outcome.ok()).collect();
    JobSpecification {
        data: Some(Data::from_velocities(measured)),
        objective: Objective::Likelihood,
        monte_carlo: MonteCarlo {
            realizations: 256,
            sampling: Sampling::Sobol,
            ..MonteCarlo::default()
        },
        ..specification(400)
    }
}

/// Runs the search to its end with speeds as outcomes.
pub(super) fn run_on_speeds(specification: &JobSpecification) -> Search {
    let mut search = Search::new(Arc::new(specification.clone()));
    while let Step::Evaluate(point) = search.ask() {
        search.tell(speeds(&specification.monte_carlo, &point), ERRORS);
    }
    search
}

/// For 30 sets of 200 velocities, ln e_L is found with an error of 2 σ/√200 / (d ln v/d ln e_L) =
/// 0.7 %, and ln δ with one of 5 %. The average must be accurate to less than half of that, which
/// is 2.7 standard deviations of it.
#[test]
fn a_likelihood_finds_what_made_the_data() {
    let truth = Point::of_bone([1598.8, 17.7e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
    let (mut found, mut by_moments) = ([0.0; 2], [0.0; 2]);
    for seed in 0..30 {
        let job = by_likelihood(&truth, 100 + seed, 200);
        let moments = JobSpecification { objective: Objective::Moments, ..job.clone() };
        for (job, sums) in [(job, &mut found), (moments, &mut by_moments)] {
            let search = run_on_speeds(&job);
            assert_eq!(ending(&search), Ending::from_search(Status::Converged, None));
            assert!(search.evaluations() < 250, "{}", search.evaluations());
            let best = search.best().unwrap().point;
            sums[0] += (best.0[1] / truth.0[1] - 1.0) / 30.0;
            sums[1] += (best.dispersion() / truth.dispersion() - 1.0) / 30.0;
        }
    }
    assert!(found[0].abs() < 0.0035 && found[1].abs() < 0.025, "{found:?}");
    // For a nearly normal law the moments give the same result.
    assert!((found[1] - by_moments[1]).abs() < 0.01, "{found:?} {by_moments:?}");
}

#[test]
fn a_likelihood_reports_its_error_and_a_test_of_the_data() {
    let truth = Point::of_bone([1598.8, 17.7e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
    let job = by_likelihood(&truth, 5, 100);
    let search = run_on_speeds(&job);
    let best = search.result(&ending(&search), &Program::current(None)).best.unwrap();
    // ln(107 √(2πe)) = 6.09, by a sample of 100.
    assert!((5.9..6.3).contains(&best.cost.unwrap()), "{:?}", best.cost);
    assert!((1e-5..0.05).contains(&best.cost_error.unwrap()), "{:?}", best.cost_error);
    let test = best.kolmogorov.unwrap();
    assert!(test.distance < 0.15 && test.p_value > 0.05, "{test:?}");
    let none = Some(Moments { mean: 0.0, coefficient_of_variation: 0.0 });
    assert_eq!(best.failure_bias, none);
    // A replay takes the same path.
    let mut again = Search::new(Arc::new(job.clone()));
    for row in search.history() {
        again.replay(row.point, speeds(&job.monte_carlo, &row.point), ERRORS).unwrap();
    }
    assert_eq!(
        again.result(&ending(&again), &Program::current(None)),
        search.result(&ending(&search), &Program::current(None))
    );
}

/// Far from the data only the floor of the density indicates where they are.
#[test]
fn a_likelihood_comes_back_from_far_away() {
    let truth = Point::of_bone([1598.8, 17.7e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.04]);
    let mut job = by_likelihood(&truth, 5, 100);
    job.parameters[1] = Range::Free { start: 40e9, lower: 10e9, upper: 45e9 };
    job.parameters[6] = Range::Free { start: 0.03, lower: 0.02, upper: 0.3 };
    let search = run_on_speeds(&job);
    let best = search.best().unwrap().point;
    assert!((best.0[1] / truth.0[1] - 1.0).abs() < 0.02, "{best:?}");
    assert!((best.dispersion() / truth.dispersion() - 1.0).abs() < 0.3, "{best:?}");
}

/// Two of 200 velocities are wrong by half the velocity of sound: by its moments the law is twice
/// as wide.
#[test]
fn outliers_move_a_likelihood_less_than_moments() {
    let truth = Point::of_bone([1598.8, 17.7e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
    let mut job = by_likelihood(&truth, 5, 200);
    let found = |job: &JobSpecification| {
        let search = run_on_speeds(job);
        search.best().unwrap().point.dispersion()
    };
    let clean = found(&job);
    let mut measured = job.data.unwrap().velocities(0).unwrap().to_vec();
    measured[..2].copy_from_slice(&[2000.0, 6000.0]);
    job.data = Some(Data::from_velocities(measured));
    let moved = (found(&job) / clean - 1.0).abs();
    job.objective = Objective::Moments;
    let moved_moments = (found(&job) / clean - 1.0).abs();
    assert!(moved < 0.1 && moved_moments > 0.5, "{moved} {moved_moments}");
}

#[test]
fn velocities_that_are_all_the_same_have_no_likelihood() {
    let truth = Point::of_bone([1598.8, 17.7e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
    let mut search = Search::new(Arc::new(by_likelihood(&truth, 5, 10)));
    while let Step::Evaluate(_) = search.ask() {
        search.tell([Ok(3900.0); 4].into(), ERRORS);
    }
    let Ending { status, reason, .. } = ending(&search);
    assert_eq!(status, Status::Failed);
    assert!(reason.unwrap().contains("all velocities at the first point are equal"));
}
