//! Distributions of measured and model velocities (the paper, Figs. 5 to 7).

use super::figure::Figure;
use crate::chart::{Axis, Chart, Ink, Shape};
use crate::finding::Finding;
use crate::number::digits;
use crate::sample::{NORMAL_95, VelocitySample};

const MODEL: &str = "model";
const MEASURED: &str = "measured";
const AXIS: &str = "velocity (m/s)";

/// Returns the figures of the velocities.
pub(super) fn figures(finding: &Finding<'_>) -> Vec<Figure> {
    let samples = ComparedSamples {
        model: finding.model.velocities.as_ref(),
        measured: finding.measured.as_ref(),
    };
    if samples.model.is_none() && samples.measured.is_none() {
        return Vec::new();
    }
    let name = |name: &str| format!("{}{name}", finding.prefix());
    let title = |title: &str| format!("{title}{}", finding.suffix());
    let mut figures = vec![
        samples.distribution(name("distribution"), title("Distribution functions")),
        samples.density(name("density"), title("Densities")),
        samples.logarithmic(name("density-log"), title("Densities, logarithmic")),
    ];
    figures.extend(samples.transform(name("pit"), title("Probability integral transform")));
    figures
}

/// Both samples, as far as they are known.
struct ComparedSamples<'a> {
    model: Option<&'a VelocitySample>,
    measured: Option<&'a VelocitySample>,
}

impl ComparedSamples<'_> {
    /// Returns which there are, with their names and colours.
    fn named_samples(&self) -> impl Iterator<Item = (&'static str, Ink, &VelocitySample)> {
        let model = self.model.map(|sample| (MODEL, Ink::First, sample));
        model.into_iter().chain(self.measured.map(|sample| (MEASURED, Ink::Second, sample)))
    }

    /// Returns what both are, in words.
    fn describe(&self) -> String {
        let one = |(name, _, sample): (&str, Ink, &VelocitySample)| {
            let [low, high] = sample.range().map(|velocity| digits(velocity, 5));
            format!("{} {name} velocities from {low} to {high} m/s.", sample.len())
        };
        self.named_samples().map(one).collect::<Vec<_>>().join(" ")
    }

    fn distribution(&self, name: String, title: String) -> Figure {
        let y = Axis::linear("share of velocities up to this one").with_ends(0.0, 1.0);
        let mut chart = Chart::new(name, title, Axis::linear(AXIS), y);
        chart.description = self.describe();
        if let Some(measured) = self.measured {
            chart.layer("measured, 95 % band", Ink::Second, Shape::Band(measured.band()));
        }
        for (name, ink, sample) in self.named_samples() {
            chart.layer(name, ink, Shape::Line(sample.distribution()));
        }
        let reading = match (self.model, self.measured) {
            (Some(_), Some(_)) => {
                "Where the model's line leaves the band around the measured one, the model does not \
                 describe the data. The band holds the whole distribution of independent velocities \
                 with a probability of 95 % (Dvoretzky, Kiefer, Wolfowitz); several velocities of one \
                 bone would need a wider one."
            }
            (Some(_), None) => {
                "The line rises by one step for each realization; where it is steep, velocities are \
                 frequent. Half of the velocities lie left of the place where it crosses 0.5."
            }
            _ => {
                "The line rises by one step for each measured velocity; its band holds the whole \
                 distribution of independent velocities with a probability of 95 %. There are no \
                 realizations of a model to compare it with."
            }
        };
        Figure { chart, reading: reading.to_owned() }
    }

    fn density(&self, name: String, title: String) -> Figure {
        let y = Axis::linear("density (1/(m/s))");
        let mut chart = Chart::new(name, title, Axis::linear(AXIS), y);
        chart.description = self.describe();
        let bars = self.measured.or(self.model);
        if let Some(bars) = bars {
            let (name, ink) = match self.measured {
                Some(_) => ("measured, counted", Ink::Second),
                None => ("model, counted", Ink::First),
            };
            chart.layer(name, ink, Shape::Bars(bars.histogram()));
        }
        for (name, ink, sample) in self.named_samples() {
            chart.layer(format!("{name}, smoothed"), ink, Shape::Line(sample.density()));
        }
        let widths = self
            .named_samples()
            .map(|(name, _, sample)| format!("{} m/s ({name})", digits(sample.bandwidth(), 3)));
        let widths = widths.collect::<Vec<_>>().join(" and ");
        let reading = format!(
            "The area below each line is 1, so that lines of different numbers of velocities can be \
             compared. Lines are smoothed by a normal kernel of standard deviation {widths}: narrower \
             features are not seen."
        );
        Figure { chart, reading }
    }

    fn logarithmic(&self, name: String, title: String) -> Figure {
        let lowest = self.named_samples().map(|(_, _, sample)| sample.lowest_density());
        let lowest = lowest.fold(f64::INFINITY, f64::min);
        let densities: Vec<(&str, Ink, Vec<[f64; 2]>)> =
            self.named_samples().map(|(name, ink, sample)| (name, ink, sample.density())).collect();
        let all = densities.iter().flat_map(|(_, _, line)| line.iter().map(|[_, height]| *height));
        let highest = all.fold(0.0, f64::max);
        let y =
            Axis::logarithmic("density (1/(m/s)), logarithmic").with_ends(lowest, 2.0 * highest);
        let mut chart = Chart::new(name, title, Axis::linear(AXIS), y);
        chart.description = self.describe();
        for (name, ink, line) in densities {
            // Farther out there is nothing but the kernel.
            let line = line.into_iter();
            let seen = line.map(|[x, y]| [x, if y >= lowest { y } else { f64::NAN }]).collect();
            chart.layer(name, ink, Shape::Line(seen));
        }
        let reading = "The same smoothed densities on a logarithmic scale, which shows how well the \
                       tails agree. Near the ends each line is made by one or two velocities, and its \
                       form there is that of the kernel.";
        Figure { chart, reading: reading.to_owned() }
    }

    /// Returns the histogram of the model's distribution function at the measured velocities.
    fn transform(&self, name: String, title: String) -> Option<Figure> {
        let (model, measured) = (self.model?, self.measured?);
        let count = measured.len();
        let bins = match count {
            0..50 => 5_u32,
            50..400 => 10,
            _ => 20,
        };
        let mut counts = vec![0.0; bins as usize];
        for velocity in measured.in_order() {
            let bin = (model.share_below(*velocity) * f64::from(bins)) as usize;
            counts[bin.min(bins as usize - 1)] += 1.0;
        }
        let width = 1.0 / f64::from(bins);
        let relative = |count_here: f64| count_here * f64::from(bins) / count as f64;
        let bars = counts
            .iter()
            .enumerate()
            .map(|(bin, here)| [bin as f64 * width, (bin as f64 + 1.0) * width, relative(*here)]);
        // Each count has a binomial law; the model's own sampling noise adds to it.
        let variance =
            (1.0 - width) * f64::from(bins) * (1.0 / count as f64 + 1.0 / model.len() as f64);
        let half = NORMAL_95 * libm::sqrt(variance);
        let x = Axis::linear("model's distribution function at a measured velocity");
        let y = Axis::linear("velocities relative to the expected number");
        let mut chart = Chart::new(name, title, x.with_ends(0.0, 1.0), y);
        chart.description = format!("{} {bins} bins of equal probability.", self.describe());
        let band = [0.0, 1.0].map(|x| [x, (1.0 - half).max(0.0), 1.0 + half]);
        chart.layer("expected, 95 % of the bars", Ink::Muted, Shape::Band(band.to_vec()));
        chart.layer("measured", Ink::Second, Shape::Bars(bars.collect()));
        chart.layer("", Ink::Muted, Shape::Level(1.0));
        let reading = format!(
            "If the data have the model's distribution all bars are equally high but for chance: of \
             {bins} bars about one in twenty leaves the band. Bars high at both ends mean that the \
             data scatter more than the model, high in the middle that they scatter less, a slope that \
             their mean differs."
        );
        Some(Figure { chart, reading })
    }
}
