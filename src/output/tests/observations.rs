//! Output of `observe`.

use osteon_common::observables::PerObservable;
use osteon_common::outcome::FailureCounts;
use osteon_common::settings::Extremum;

use super::*;
use osteon_local::observations::{ObservableMoments, ObservationSummary};

fn column(count: u64, mean: f64, standard_deviation: f64, correlation: f64) -> ObservableMoments {
    ObservableMoments {
        count,
        mean: Some(mean),
        standard_deviation: Some(standard_deviation),
        correlation: Some(correlation),
    }
}

fn printed_summary(summary: &ObservationSummary) -> String {
    let specification = specification(JobKind::Propagation, &[]);
    let point = specification.start();
    let file = Some(Path::new("observed.csv"));
    let shown = ShownObservations { point: &point, summary, file };
    printed(OutputFormat::Text, |output| output.observations(&shown).unwrap())
}

#[test]
fn observables_are_a_table() {
    let mut failures = FailureCounts::default();
    failures.add(FailureKind::NoArrival, 4);
    let summary = ObservationSummary {
        other_extremum: Extremum::Second,
        realizations: 2747,
        failures,
        velocity: column(2743, 3907.69, 104.39, 1.0),
        observables: PerObservable([
            column(2740, 3877.87, 99.96, 0.998),
            column(2743, 4.6647, 0.4138, 0.232),
            column(2740, 1.0404e6, 13.7e3, -0.33),
            column(2743, 1580.12, 30.37, 0.412),
            column(2743, 1712.5, 41.8, 0.377),
        ]),
    };
    insta::assert_snapshot!(printed_summary(&summary));
}

#[test]
fn what_no_realization_has_is_left_out() {
    let nothing =
        ObservableMoments { count: 0, mean: None, standard_deviation: None, correlation: None };
    let mut failures = FailureCounts::default();
    failures.add(FailureKind::DirectWaveFirst, 1);
    let summary = ObservationSummary {
        other_extremum: Extremum::First,
        realizations: 1,
        failures,
        velocity: nothing,
        observables: PerObservable([nothing; 5]),
    };
    insta::assert_snapshot!(printed_summary(&summary));
}
