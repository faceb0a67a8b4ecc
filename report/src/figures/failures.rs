//! Failed realizations: how many of each kind, and where they sit among the indices.

use std::collections::BTreeMap;

use osteon_common::outcome::FailureKind;

use super::figure::Figure;
use crate::chart::{Axis, Chart, Ink, Shape};
use crate::finding::Finding;
use crate::quantity;

/// Number of places along the indices in which failures are counted.
const PLACES: usize = 50;

/// Returns the figures, if any realization failed.
pub(super) fn figures(finding: &Finding<'_>) -> Vec<Figure> {
    if finding.failed_realizations() == 0 {
        return Vec::new();
    }
    let failures = FailedRealizations {
        kinds: finding.failures.iter().map(|(kind, count)| (*kind, *count)).collect(),
        realizations: finding.realizations,
        prefix: finding.prefix(),
        suffix: finding.suffix(),
    };
    let mut figures = vec![failures_by_kind(&failures)];
    figures.extend(failures_along_indices(finding));
    figures
}

/// Failed realizations of one evaluation.
pub(crate) struct FailedRealizations {
    /// The kinds that occurred, with their counts.
    pub(crate) kinds: Vec<(FailureKind, u64)>,
    /// Number of all realizations.
    pub(crate) realizations: u64,
    /// Beginning of the name of the figure.
    pub(crate) prefix: String,
    /// End of its title.
    pub(crate) suffix: String,
}

pub(crate) fn failures_by_kind(failures: &FailedRealizations) -> Figure {
    let FailedRealizations { kinds, realizations, prefix, suffix } = failures;
    let names = kinds.iter().map(|(kind, _)| quantity::failure(kind.name())).collect();
    let y = Axis::with_categories("", names);
    let largest = kinds.iter().map(|(_, count)| *count).max().unwrap_or(1) as f64;
    let x = Axis::linear("failed realizations").with_ends(0.0, 1.08 * largest);
    let title = format!("Failures by kind{suffix}");
    let mut chart = Chart::new(format!("{prefix}failures"), title, x, y);
    let counts = kinds.iter();
    let counts = counts.map(|(kind, count)| format!("{count} {}", quantity::failure(kind.name())));
    chart.description = counts.collect::<Vec<_>>().join(", ");
    let bars = kinds
        .iter()
        .enumerate()
        .map(|(place, (_, count))| [0.0, *count as f64, place as f64 - 0.3, place as f64 + 0.3]);
    chart.height = (0.12 * kinds.len() as f64 + 0.1).max(0.3);
    chart.layer("", Ink::Second, Shape::Rectangles(bars.collect()));
    let failed: u64 = kinds.iter().map(|(_, count)| count).sum();
    let share = 100.0 * failed as f64 / (*realizations).max(1) as f64;
    let reading = format!(
        "{failed} of {realizations} realizations ({}) have no velocity and count in no moment. Mostly \
         slow bones fail, so that the mean is then too large and the variation too small; \
         velocity.failure_bias in result.json estimates by how much.",
        crate::number::digits(share, 2) + " %"
    );
    Figure { chart, reading }
}

fn failures_along_indices(finding: &Finding<'_>) -> Option<Figure> {
    let outcomes = &finding.model;
    if outcomes.failures.is_empty() || outcomes.count == 0 {
        return None;
    }
    let mut kinds: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for (index, kind) in &outcomes.failures {
        kinds.entry(kind).or_default().push(*index);
    }
    let width = (outcomes.count as f64 / PLACES as f64).max(1.0);
    let x = Axis::linear("index of the realization").with_ends(0.0, outcomes.count as f64);
    let y = Axis::linear(format!("failures among {} neighbours", width.ceil()));
    let title = format!("Where failures sit{}", finding.suffix());
    let name = format!("{}failures-by-index", finding.prefix());
    let mut chart = Chart::new(name, title, x, y);
    chart.description = format!("{} failures.", outcomes.failures.len());
    for (place, (kind, indices)) in kinds.into_iter().enumerate() {
        let mut counts = [0.0; PLACES];
        for index in indices {
            counts[((index / width) as usize).min(PLACES - 1)] += 1.0;
        }
        let used = (outcomes.count as f64 / width).ceil() as usize;
        let bars = counts
            .into_iter()
            .take(used)
            .enumerate()
            .map(|(place, count)| [place as f64 * width, (place as f64 + 1.0) * width, count]);
        let shown = quantity::failure(kind);
        chart.layer(shown, Ink::nth(place + 1), Shape::Bars(bars.collect()));
    }
    let reading = "Failures of independent realizations are spread evenly over the indices. Where they \
                   pile up at some place, look at those realizations with osteon draw.";
    Some(Figure { chart, reading: reading.to_owned() })
}
