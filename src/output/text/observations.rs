//! The observables of a job's realizations.

use osteon_common::observables::{Observable, ObservableRow};
use osteon_common::outcome::FailureKind;
use osteon_common::visible;

use super::layout::{aligned, wrapped};
use super::number::{Decimals, digits};
use crate::output::ShownObservations;
use osteon_local::observations::{ObservableMoments, ObservationSummary};

/// Digits of a standard deviation.
const DEVIATION_DIGITS: usize = 4;
/// Digits of a mean without a standard deviation.
const MEAN_DIGITS: usize = 5;

/// Returns a row for each observable, the failures, and the file.
pub(super) fn table(shown: &ShownObservations<'_>) -> String {
    let ObservationSummary { other_extremum, realizations, failures, velocity, observables } =
        shown.summary;
    let heading = ["", "count", "mean", "std. dev.", "correlation"];
    let mut rows = vec![heading.map(str::to_owned), row("velocity (m/s)", 1.0, velocity)];
    for (observable, column) in observables.iter() {
        let ObservableRow { title, short, unit, .. } = observable.row();
        let title = match observable {
            Observable::OtherVelocity => {
                format!("velocity of the {} extremum", other_extremum.name())
            }
            Observable::CenterFrequency => (*short).to_owned(),
            _ => (*title).to_owned(),
        };
        let (unit, scale) = if *unit == "Hz" { ("MHz", 1e-6) } else { (*unit, 1.0) };
        rows.push(row(&format!("{title} ({unit})"), scale, column));
    }
    let mut text = aligned(&rows);
    text.push_str(&wrapped("correlation: with the velocity, over the realizations that have both"));
    let counts: Vec<String> =
        failures.iter().map(|(kind, count)| format!("{count} {}", name(kind))).collect();
    if !counts.is_empty() {
        let counts = counts.join(", ");
        text.push_str(&wrapped(&format!(
            "{} of {realizations} realizations have no velocity: {counts}",
            failures.total()
        )));
    }
    if let Some(file) = shown.file {
        text.push_str(&wrapped(&format!("a row for each in {}", visible::path(file))));
    }
    text
}

fn name(kind: FailureKind) -> String {
    kind.name().replace('_', " ")
}

fn row(name: &str, unit: f64, column: &ObservableMoments) -> [String; 5] {
    let deviation = column.standard_deviation.map(|deviation| unit * deviation);
    let decimals = deviation.and_then(|deviation| Decimals::new(deviation, DEVIATION_DIGITS));
    let shown = |value: f64| {
        decimals.map_or_else(|| digits(value, MEAN_DIGITS), |decimals| decimals.show(value))
    };
    let cell = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), &shown);
    [
        name.to_owned(),
        column.count.to_string(),
        cell(column.mean.map(|mean| unit * mean)),
        cell(deviation),
        column.correlation.map_or_else(|| "-".to_owned(), |found| format!("{found:.3}")),
    ]
}
