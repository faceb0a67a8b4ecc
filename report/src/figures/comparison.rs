//! Several runs in one figure.

use super::figure::Figure;
use crate::chart::{Axis, Chart, Ink, Shape};
use crate::sample::VelocitySample;

/// Most runs in one figure: there are as many colours.
pub(crate) const OVERLAID_MAX: usize = 4;

/// Returns the figures that lay the velocities of several runs over each other: name and velocities of
/// each.
pub(crate) fn overlay(runs: &[(String, &VelocitySample)]) -> Vec<Figure> {
    if runs.len() < 2 {
        return Vec::new();
    }
    let shown = &runs[..runs.len().min(OVERLAID_MAX)];
    let chart = |name: &str, title: &str, label: &str| {
        let mut chart =
            Chart::new(name, title, Axis::linear("velocity (m/s)"), Axis::linear(label));
        let each =
            shown.iter().map(|(name, sample)| format!("{name}: {} velocities", sample.len()));
        chart.description = each.collect::<Vec<_>>().join("; ");
        chart
    };
    let mut distributions = chart(
        "overlay-distribution",
        "Distribution functions of all runs",
        "share of velocities up to this one",
    );
    let mut densities = chart("overlay-density", "Densities of all runs", "density (1/(m/s))");
    let mut logarithmic = chart("overlay-density-log", "Densities of all runs, logarithmic", "");
    let lowest = shown.iter().map(|(_, sample)| sample.lowest_density());
    let lowest = lowest.fold(f64::INFINITY, f64::min);
    let mut highest = 0.0_f64;
    for (place, (name, sample)) in shown.iter().enumerate() {
        let ink = Ink::nth(place);
        distributions.layer(name.clone(), ink, Shape::Line(sample.distribution()));
        let density = sample.density();
        highest = density.iter().map(|[_, height]| *height).fold(highest, f64::max);
        densities.layer(name.clone(), ink, Shape::Line(density.clone()));
        let seen = density.into_iter().map(|[x, y]| [x, if y >= lowest { y } else { f64::NAN }]);
        logarithmic.layer(name.clone(), ink, Shape::Line(seen.collect()));
    }
    distributions.y = distributions.y.with_ends(0.0, 1.0);
    logarithmic.y =
        Axis::logarithmic("density (1/(m/s)), logarithmic").with_ends(lowest, 2.0 * highest);
    let left_out = match runs.len() - shown.len() {
        0 => String::new(),
        more => format!(" The last {more} runs are not drawn."),
    };
    let readings = [
        "Each line is the distribution function of one run’s model velocities at its best point. Lines \
         that lie on each other mean equal distributions, one to the right means faster bones.",
        "The area below each line is 1, whatever its number of velocities. Each line is smoothed by a \
         normal kernel, so that narrow features are not seen.",
        "The same densities on a logarithmic scale, which shows the tails. Near the ends each line is \
         made by one or two velocities.",
    ];
    let charts = [distributions, densities, logarithmic];
    let figure =
        |(chart, reading): (Chart, &str)| Figure { chart, reading: format!("{reading}{left_out}") };
    charts.into_iter().zip(readings).map(figure).collect()
}
