//! Solutions from several starts as parallel coordinates.

use super::figure::Figure;
use crate::chart::{Axis, Chart, Ink, Shape};
use crate::finding::Finding;

/// Most solutions that are drawn.
const DRAWN_MAX: usize = 60;

/// Returns the figure, if there were several starts.
pub(super) fn figures(finding: &Finding<'_>) -> Vec<Figure> {
    let (Some(solutions), free) = (finding.solutions, finding.free_parameters()) else {
        return Vec::new();
    };
    if free.len() < 2 || solutions.points.is_empty() {
        return Vec::new();
    }
    let names = free.iter().map(|parameter| parameter.row().symbol.to_owned()).collect();
    let x = Axis::with_categories("free parameter", names);
    let y = Axis::linear("place between the bounds (0: lower, 1: upper)").with_ends(0.0, 1.0);
    let title = format!("Solutions from {} starts{}", solutions.points.len(), finding.suffix());
    let mut chart = Chart::new(format!("{}solutions", finding.prefix()), title, x, y);
    let described = free.iter().map(|one| format!("{} ({})", one.row().symbol, one.row().title));
    chart.description = format!(
        "{} of {} solutions match the data. Parameters: {}.",
        solutions.matching,
        solutions.points.len(),
        described.collect::<Vec<_>>().join(", ")
    );
    let costs = solutions.points.iter().filter_map(|point| point.cost);
    let lowest = costs.fold(f64::INFINITY, f64::min);
    let mut named = [false; 2];
    for point in solutions.points.iter().take(DRAWN_MAX) {
        let Some(values) = point.parameters.point(point.dispersion) else { continue };
        let line = free.iter().enumerate().map(|(place, parameter)| {
            let within = finding.range(*parameter).coordinate(values.get(*parameter));
            [place as f64, within.unwrap_or(f64::NAN)]
        });
        let best = point.cost == Some(lowest);
        let name = match (best, named[usize::from(best)]) {
            (true, false) => "lowest cost",
            (false, false) => "others",
            _ => "",
        };
        named[usize::from(best)] = true;
        let ink = if best { Ink::First } else { Ink::Second };
        chart.layer(name, ink, Shape::Line(line.collect()));
    }
    let reading = format!(
        "Each line is the best point from one start; where lines meet the starts agree on a parameter, \
         where they spread the data leave it open. {} of {} solutions match the data as well as the \
         best one, or to the tolerance of the search.",
        solutions.matching,
        solutions.points.len()
    );
    vec![Figure { chart, reading }]
}
