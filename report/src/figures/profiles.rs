//! Profiles: the lowest cost with one parameter held.

use super::figure::Figure;
use crate::chart::{Axis, Chart, Ink, Shape};
use crate::finding::Finding;
use crate::quantity::unit;

/// Returns a figure for each profile.
pub(super) fn figures(finding: &Finding<'_>) -> Vec<Figure> {
    let profiles = finding.profiles.into_iter().flatten();
    let figure = |(parameter, profile): (&_, &osteon_files::report::ParameterProfile)| {
        let parameter = *parameter;
        let unit = unit(parameter);
        let label =
            unit.axis_label(&format!("{} {}", parameter.row().title, parameter.row().symbol));
        let points = profile.values.iter().zip(&profile.costs);
        let points: Vec<[f64; 2]> =
            points.map(|(value, cost)| [value / unit.size, cost.unwrap_or(f64::NAN)]).collect();
        let file = format!("{}profile-{}", finding.prefix(), parameter.name().replace('_', "-"));
        let title = format!("Profile of the {}{}", parameter.row().title, finding.suffix());
        let y = Axis::linear("lowest cost");
        let mut chart = Chart::new(file, title, Axis::linear(label), y);
        chart.description = format!("{} values from bound to bound.", points.len());
        chart.layer("lowest cost", Ink::First, Shape::Line(points));
        if let Some(value) = finding.value(parameter).0 {
            chart.layer("best point", Ink::Third, Shape::Upright(value / unit.size));
        }
        let reading = "Where the line lies at 0 or nearly so, the parameter can have that value and the \
                       data are still matched: a level line says that they do not determine it. The \
                       costs are approximations that need no evaluation (to about one per cent).";
        Figure { chart, reading: reading.to_owned() }
    };
    profiles.map(figure).collect()
}
