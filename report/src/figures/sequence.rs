//! Velocities in the order of their indices (the paper, Fig. 4).

use super::figure::Figure;
use crate::chart::{Axis, Chart, Ink, Shape};
use crate::finding::Finding;
use crate::sample::VelocitySample;

/// Largest number of velocities that are drawn one by one.
const DOTS_MAX: usize = 3000;
/// Largest number of groups of neighbours where there are more.
const BLOCKS: usize = 200;

/// Returns a figure of the measured velocities, and one of the model's.
pub(super) fn figures(finding: &Finding<'_>) -> Vec<Figure> {
    let measured = finding
        .measured
        .as_ref()
        .map(|sample| (sample, "measured", "Measured velocities in their order", Ink::Second));
    let model = finding.model.velocities.as_ref().map(|sample| {
        (sample, "realizations", "Realizations of the model in their order", Ink::First)
    });
    let figure = |(sample, name, title, ink): (&VelocitySample, &str, &str, Ink)| {
        let name = format!("{}{name}", finding.prefix());
        sequence(sample, name, format!("{title}{}", finding.suffix()), ink)
    };
    measured.into_iter().chain(model).map(figure).collect()
}

fn sequence(sample: &VelocitySample, name: String, title: String, ink: Ink) -> Figure {
    let velocities = sample.in_order();
    let x = Axis::linear("place in the order").with_ends(0.0, velocities.len() as f64);
    let mut chart = Chart::new(name, title, x, Axis::linear("velocity (m/s)"));
    chart.description = format!("{} velocities.", sample.len());
    let reading = if velocities.len() <= DOTS_MAX {
        let dot = |(index, velocity): (usize, &f64)| [index as f64, *velocity];
        chart.layer("", ink, Shape::Dots(velocities.iter().enumerate().map(dot).collect()));
        "Each dot is one velocity, in the order of the data or of the realizations' indices. \
         Independent velocities show no pattern along this order; drifts, steps and repeated values \
         would."
            .to_owned()
    } else {
        let size = velocities.len().div_ceil(BLOCKS);
        let blocks: Vec<[f64; 4]> = velocities
            .chunks(size)
            .enumerate()
            .map(|(place, block)| {
                let (low, high) =
                    block.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), one| {
                        (low.min(*one), high.max(*one))
                    });
                let mean = block.iter().sum::<f64>() / block.len() as f64;
                [(place * size) as f64 + block.len() as f64 / 2.0, low, mean, high]
            })
            .collect();
        let band = blocks.iter().map(|&[x, low, _, high]| [x, low, high]).collect();
        chart.layer("smallest to largest", ink, Shape::Band(band));
        let means = blocks.iter().map(|&[x, _, mean, _]| [x, mean]).collect();
        chart.layer("mean", ink, Shape::Line(means));
        format!(
            "There are too many velocities for one dot each: the band spans smallest and largest of \
             each {size} neighbours, the line is their mean. Independent velocities show no pattern \
             along this order; drifts and steps would."
        )
    };
    Figure { chart, reading }
}
