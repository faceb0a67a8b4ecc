//! Searches with the noise of the data as weights.

use osteon_common::inference::{MomentWeights, data_noise};
use osteon_common::job::Measurements;

use super::*;

const REALIZATIONS: u32 = 20_000;

/// The mean is known to 0.05 %, the coefficient of variation to 1.3 %.
fn data(mean: f64, coefficient_of_variation: f64) -> Data {
    let measurements = Measurements::Moments { mean, coefficient_of_variation, count: Some(2958) };
    Data { measurements, repeatability: 0.0, decay_error: 0.0 }
}

/// Velocities whose mean is proportional to e_L, and whose coefficient of variation, a quarter of
/// the dispersion, falls as the square of e_L grows. There are so many that sampling adds little.
fn coupled(point: &Point) -> Outcomes {
    let ratio = point.0[1] / 17.7e9;
    let (mean, variation) = (3900.0 * ratio, point.dispersion() / 4.0 / (ratio * ratio));
    let sign = |k: u32| if k.is_multiple_of(2) { -1.0 } else { 1.0 };
    (0..REALIZATIONS).map(|k| Ok(mean * (1.0 + sign(k) * variation))).collect()
}

/// Returns the ending and the best evaluation of a search with these outcomes.
fn best(job: &JobSpecification, of: impl Fn(&Point) -> Outcomes) -> (Ending, Evaluation) {
    let mut search = Search::new(Arc::new(job.clone()));
    while let Step::Evaluate(point) = search.ask() {
        search.tell(of(&point), ERRORS);
    }
    (ending(&search), *search.best().unwrap())
}

fn by(method: SearchMethod, objective: Objective, data: Data) -> JobSpecification {
    let tolerance = SearchSettings::default_tolerance(method, objective);
    let search = SearchSettings { cost_tolerance: tolerance, ..SearchSettings::by(method) };
    let mut job = JobSpecification { search, objective, data: Some(data), ..specification(400) };
    job.monte_carlo.realizations = REALIZATIONS.into();
    job
}

/// No dispersion within the bounds is large enough: the cost decides which moment is missed.
#[test]
fn what_is_known_best_is_missed_least() {
    let wanted = data(3900.0, 0.0788);
    let noise = data_noise(&wanted, 0).unwrap().covariance;
    let mut ends = Vec::new();
    for method in [SearchMethod::Newton, SearchMethod::Simplex] {
        for (objective, smallest, largest) in
            [(Objective::ChiSquare, 0.0, 1.0), (Objective::Moments, 10.0, 100.0)]
        {
            let job = by(method, objective, wanted.clone());
            let (ending, best) = best(&job, coupled);
            assert_eq!(ending.status, Status::NotMatched, "{ending:?}");
            let moments = best.moments.unwrap();
            let off = libm::log(moments.mean / 3900.0).abs() / noise[0][0].sqrt();
            assert!((smallest..largest).contains(&off), "{method:?} {objective:?}: {off} errors");
            if objective == Objective::ChiSquare {
                let weights = MomentWeights::of_data(&wanted, 0).unwrap();
                let expected = weights.cost(&wanted.compared(0), &moments.into());
                assert_eq!(best.cost.unwrap(), expected);
                let reason = ending.reason.unwrap();
                assert!(reason.contains("best χ² (of at most 2 degrees of freedom)"), "{reason}");
                ends.push(best.point);
            }
        }
    }
    // Both methods end at the same point.
    let [newton, simplex] = &ends[..] else { panic!("two ends") };
    assert!((newton.0[1] / simplex.0[1] - 1.0).abs() < 2e-5, "{ends:?}");
    assert!((newton.0[6] - simplex.0[6]).abs() < 1e-4, "{ends:?}");
}

/// Where both moments can be matched, a hundredth of a standard error is enough.
#[test]
fn a_search_ends_well_within_the_noise() {
    for method in [SearchMethod::Newton, SearchMethod::Simplex] {
        let job = by(method, Objective::ChiSquare, data(3900.0, 0.03));
        let (ending, found) = best(&job, coupled);
        assert_eq!(ending, Ending::from_search(Status::Converged, None));
        let cost = found.cost.unwrap();
        assert!(cost <= 1e-4, "{cost}");
        let moments = found.moments.unwrap();
        assert!((moments.mean / 3900.0 - 1.0).abs() < 1e-5, "{moments:?}");
    }
}

/// For small differences the model is linear, and the lowest cost with the weight (edge/s)² is the
/// mode of the posterior with a normal prior of standard deviation s: the mean of data and prior,
/// weighted by their variances. The dispersion is free and adjusts to the coefficient of variation.
#[test]
fn a_prior_gives_the_mode_of_the_posterior() {
    let data = data(3900.0, 0.03);
    let noise = data_noise(&data, 0).unwrap().covariance;
    let mut job = by(SearchMethod::Simplex, Objective::ChiSquare, data);
    let (deviation, expected) = (1e-3 * 17.7e9, 17.7e9 * 1.001);
    let edge = job.range(Parameter::LongitudinalYoungModulus).edge();
    let weight = (edge / deviation) * (edge / deviation);
    job.search.priors[1] = Some(Prior { value: expected, weight });
    job.search.size_tolerance = 1e-8;
    let (ending, best) = best(&job, outcomes);
    assert_eq!(ending.status, Status::Converged);
    let weights = [1.0 / noise[0][0], 1.0 / 1e-6];
    let mode = 1e-3 * weights[1] / (weights[0] + weights[1]);
    let found = best.point.0[1] / 17.7e9 - 1.0;
    assert!((found / mode - 1.0).abs() < 0.02, "{found}, expected {mode}");
}
