//! Phase velocities of guided waves over the frequency.

use crate::chart::{Axis, Chart, Ink, Shape};

/// The figure ends at this many times the lowest phase velocity: at cut-off frequencies they are infinite.
const HIGHEST: f64 = 5.0;

/// Returns a figure of the phase velocities of guided waves as a file of SVG: points of frequency (Hz) and
/// phase velocity (m/s), which belong to a family of this name.
pub fn dispersion_figure(families: &[(&'static str, Vec<[f64; 2]>)]) -> String {
    let velocities =
        || families.iter().flat_map(|(_, points)| points).map(|[_, velocity]| *velocity);
    let lowest = velocities().fold(f64::INFINITY, f64::min);
    let y = Axis::linear("phase velocity (m/s)").with_ends(0.0, HIGHEST * lowest);
    let title = "Guided waves of the bone";
    let mut chart = Chart::new("modes", title, Axis::linear("frequency (MHz)"), y);
    let beyond = velocities().filter(|velocity| *velocity > HIGHEST * lowest).count();
    chart.description = format!(
        "{} points of {} families of waves, {beyond} of them with higher phase velocities than are shown.",
        velocities().count(),
        families.len()
    );
    for (number, (family, points)) in families.iter().enumerate() {
        let dots = points.iter().map(|[frequency, velocity]| [1e-6 * frequency, *velocity]);
        let name = family.replace('_', " ");
        chart.layer(name, Ink::nth(number), Shape::Dots(dots.collect()));
    }
    chart.svg_file()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_family_is_in_the_legend_and_what_is_not_shown_is_counted() {
        let families = [
            ("symmetric", vec![[1e6, 1500.0], [2e6, 9000.0]]),
            ("shear_symmetric", vec![[1e6, 1800.0]]),
        ];
        let svg = dispersion_figure(&families);
        assert!(svg.contains(">symmetric<") && svg.contains(">shear symmetric<"), "{svg}");
        assert!(svg.contains("3 points of 2 families of waves, 1 of them"), "{svg}");
    }
}
