use osteon_common::observables::PerObservable;
use osteon_common::outcome::FailureKind;

use super::*;

fn observation(velocity: f64, other: Option<f64>, decay: f64) -> Observation {
    let mut observables = PerObservable::only(Observable::Decay, decay);
    observables[Observable::OtherVelocity] = other;
    observables[Observable::CenterFrequency] = other.map(|_| 0.8e6);
    Observation { outcome: Ok(velocity), observables }
}

fn observations() -> Observations {
    Observations {
        other_extremum: Extremum::Second,
        rows: vec![
            observation(3900.0, Some(3700.0), 5.0),
            Observation::failed(FailureKind::NoArrival),
            observation(3950.0, None, 4.0),
            observation(4000.0, Some(3720.0), 3.0),
        ],
    }
}

#[test]
fn what_is_unknown_is_an_empty_field() {
    let expected = "\
        index,velocity,other_velocity,decay,center_frequency,a0_velocity,s0_velocity,failure\n\
        0,3900.0,3700.0,5.0,800000.0,,,\n\
        1,,,,,,,no_arrival\n\
        2,3950.0,,4.0,,,,\n\
        3,4000.0,3720.0,3.0,800000.0,,,\n";
    assert_eq!(observations().to_csv(), expected);
}

#[test]
fn every_observable_is_summarized_over_those_that_have_it() {
    let summary = observations().summary();
    assert_eq!((summary.realizations, summary.failures.total()), (4, 1));
    let column = |count, mean, standard_deviation, correlation| ObservableMoments {
        count,
        mean: Some(mean),
        standard_deviation: Some(standard_deviation),
        correlation,
    };
    let expected = [
        column(3, 3950.0, 50.0, Some(1.0)),
        column(2, 3710.0, 200.0_f64.sqrt(), Some(1.0)),
        column(3, 4.0, 1.0, Some(-1.0)),
        // It does not vary.
        column(2, 0.8e6, 0.0, None),
    ];
    let found = [&summary.velocity].into_iter().chain(&summary.observables.0);
    for (found, expected) in found.zip(expected) {
        assert_eq!((found.count, found.mean), (expected.count, expected.mean));
        let [found_sd, sd] = [found, &expected].map(|column| column.standard_deviation.unwrap());
        assert!((found_sd - sd).abs() <= 1e-12 * sd, "{found:?}");
        assert_eq!(found.correlation.is_some(), expected.correlation.is_some());
        if let (Some(found), Some(expected)) = (found.correlation, expected.correlation) {
            assert!((found - expected).abs() < 1e-12, "{found}");
        }
    }
}
