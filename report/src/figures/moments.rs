//! Both moments of the first realizations against their number.

use osteon_common::job::Sampling;
use osteon_files::report::Moment;

use super::figure::Figure;
use crate::chart::{Axis, Chart, Ink, Shape};
use crate::finding::Finding;
use crate::sample::{NORMAL_95, Running};

/// About how many numbers of realizations are drawn.
const STEPS: u32 = 90;
/// Fewest realizations whose scatter is worth a band.
const FEWEST: f64 = 5.0;

/// Returns a figure for each moment.
pub(super) fn figures(finding: &Finding<'_>) -> Vec<Figure> {
    let Some(sample) = &finding.model.velocities else { return Vec::new() };
    let running: Vec<Running> =
        sample.running_moments(STEPS).into_iter().filter(|one| one.count >= FEWEST).collect();
    if running.len() < 2 {
        return Vec::new();
    }
    Moment::ALL.into_iter().map(|moment| figure(finding, moment, &running)).collect()
}

fn figure(finding: &Finding<'_>, moment: Moment, running: &[Running]) -> Figure {
    let (name, title, label) = match moment {
        Moment::Mean => ("mean-of-first", "Mean of the first realizations", "mean (m/s)"),
        Moment::CoefficientOfVariation => (
            "variation-of-first",
            "Coefficient of variation of the first realizations",
            "coefficient of variation",
        ),
    };
    let value = |one: &Running| match moment {
        Moment::Mean => one.mean,
        Moment::CoefficientOfVariation => one.variation,
    };
    let x = Axis::logarithmic("number of realizations with a velocity");
    let title = format!("{title}{}", finding.suffix());
    let mut chart =
        Chart::new(format!("{}{name}", finding.prefix()), title, x, Axis::linear(label));
    chart.description = format!("{} numbers of realizations.", running.len());
    let band = running.iter().map(|one| {
        let [value, error] = value(one);
        [one.count, value - NORMAL_95 * error, value + NORMAL_95 * error]
    });
    chart.layer("95 % interval", Ink::First, Shape::Band(band.collect()));
    let line = running.iter().map(|one| [one.count, value(one)[0]]).collect();
    chart.layer("model", Ink::First, Shape::Line(line));
    if let Some(data) = finding.data.and_then(|data| data.moments.get(moment)) {
        chart.layer("measured", Ink::Second, Shape::Level(data));
    }
    if let (Some(value), Some(last)) = (finding.velocity.moments.get(moment), running.last()) {
        let name = if finding.velocity.controlled == Some(true) {
            "result, by the control variate"
        } else {
            "result"
        };
        chart.layer(name, Ink::Third, Shape::Points(vec![[last.count, value]]));
    }
    let independent = match finding.specification().monte_carlo.sampling {
        Sampling::MonteCarlo => {
            "The band is the 95 % interval of that many independent realizations."
        }
        Sampling::Sobol => {
            "The band is the 95 % interval of that many independent realizations; Sobol’ points \
             converge faster, so the result’s own standard error is smaller."
        }
    };
    let reading = format!(
        "The line should become level well before its right end: then there are enough realizations. \
         {independent}"
    );
    Figure { chart, reading }
}
