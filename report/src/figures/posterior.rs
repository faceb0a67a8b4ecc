//! Marginal densities of the posterior.

use osteon_common::parameters::Parameter;

use super::figure::Figure;
use crate::chart::{Axis, Chart, Ink, Shape};
use crate::finding::Finding;
use crate::quantity::unit;
use crate::sample::VelocitySample;

/// Returns a figure for each free parameter.
pub(super) fn figures(finding: &Finding<'_>) -> Vec<Figure> {
    let Some(posterior) = finding.posterior else { return Vec::new() };
    let parameters = posterior.parameters.keys();
    parameters.filter_map(|parameter| figure(finding, *parameter)).collect()
}

fn figure(finding: &Finding<'_>, parameter: Parameter) -> Option<Figure> {
    let table = finding.context.posterior.as_ref()?;
    let found = finding.posterior?.parameters.get(&parameter)?;
    let (values, groups) = (table.numbers(parameter.name()).ok()??, table.texts("group"));
    let unit = unit(parameter);
    let draws = values.iter().enumerate().filter(|(row, _)| {
        groups.as_ref().is_none_or(|groups| Some(groups[*row]) == finding.group)
    });
    let draws = VelocitySample::new(draws.map(|(_, value)| value / unit.size).collect())?;
    let label = unit.axis_label(&format!("{} {}", parameter.row().title, parameter.row().symbol));
    let file = format!("{}posterior-{}", finding.prefix(), parameter.name().replace('_', "-"));
    let title = format!("Posterior of the {}{}", parameter.row().title, finding.suffix());
    let mut chart = Chart::new(file, title, Axis::linear(label), Axis::linear("density"));
    chart.description = format!("{} draws.", draws.len());
    chart.layer("draws", Ink::First, Shape::Bars(draws.histogram()));
    if let Some(ends) = found.ends() {
        for (place, end) in ends.into_iter().enumerate() {
            let name = if place == 0 { "95 % interval" } else { "" };
            chart.layer(name, Ink::Second, Shape::Upright(end / unit.size));
        }
    }
    if let Some(mean) = found.mean {
        chart.layer("mean", Ink::Third, Shape::Upright(mean / unit.size));
    }
    let share = (100.0 * found.explained).round();
    let reading = format!(
        "The height of a bar is the probability density of the parameter after the data, the priors \
         and the bounds. The data have removed {share} % of the prior variance: near 0 % the bars show \
         what was assumed, not what was measured."
    );
    Some(Figure { chart, reading })
}
