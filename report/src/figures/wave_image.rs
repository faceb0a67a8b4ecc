//! The image of guided waves over wavenumber and frequency, with the model's waves.

use std::f64::consts::TAU;

use crate::chart::{Axis, Chart, Ink, Raster, Shape};

/// Families that the pressure in a fluid does not show: they move along the faces and across the probe.
const UNSEEN: &str = "shear";

/// Returns a figure of an image as a file of SVG: frequencies (Hz) and wavenumbers (rad/m) in equal steps, and for
/// each frequency the values for each wavenumber, 0 to 1. Over it are points of frequency (Hz) and phase velocity
/// (m/s) of the model's waves, which belong to a family of this name, and of those that were found.
pub fn wave_image_figure(
    (frequencies, wavenumbers, values): (&[f64], &[f64], Vec<Vec<f64>>),
    families: &[(&'static str, Vec<[f64; 2]>)],
    found: &[[f64; 2]],
) -> String {
    let [x, y] = [ends(frequencies, 1e-6), ends(wavenumbers, 1e-3)];
    let axis = |label: &str, ends: [f64; 2]| Axis::linear(label).with_ends(ends[0], ends[1]);
    let title = "Guided waves that the array sees";
    let (f, k) = (axis("frequency (MHz)", x), axis("wavenumber (rad/mm)", y));
    let mut chart = Chart::new("image", title, f, k);
    chart.height = 1.5;
    let raster = Raster { x, y, columns: values };
    chart.layer("part of a plane wave in the signals, 0 to 1", Ink::First, Shape::Raster(raster));
    let place =
        |&[frequency, velocity]: &[f64; 2]| [1e-6 * frequency, 1e-3 * TAU * frequency / velocity];
    let seen = families.iter().filter(|(family, _)| !family.starts_with(UNSEEN));
    let mut count = 0;
    for (number, (family, points)) in seen.enumerate() {
        let dots: Vec<[f64; 2]> = points.iter().map(place).collect();
        count += dots.len();
        let name = format!("model, {}", family.replace('_', " "));
        chart.layer(name, Ink::nth(number + 1), Shape::Dots(dots));
    }
    chart.description = format!(
        "{} frequencies and {} wavenumbers; {count} points of waves of the model, {} that were found.",
        frequencies.len(),
        wavenumbers.len(),
        found.len()
    );
    if !found.is_empty() {
        let marks = found.iter().map(place).collect();
        chart.layer("found, in the mean", Ink::Muted, Shape::Points(marks));
    }
    chart.svg_file()
}

/// Returns the ends of the cells about values in equal steps, in a unit of which `scale` are one of theirs.
fn ends(values: &[f64], scale: f64) -> [f64; 2] {
    let (first, last) =
        (values.first().copied().unwrap_or(0.0), values.last().copied().unwrap_or(1.0));
    let half = 0.5 * (last - first) / (values.len().max(2) - 1) as f64;
    [scale * (first - half), scale * (last + half)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_has_shades_a_colour_bar_and_the_waves_that_a_fluid_shows() {
        let values = vec![vec![0.0, 1.0], vec![0.5, 0.5]];
        let families =
            [("symmetric", vec![[1e6, 2000.0]]), ("shear_symmetric", vec![[1e6, 1800.0]])];
        let svg =
            wave_image_figure((&[1e6, 2e6], &[1e3, 2e3], values), &families, &[[1e6, 2000.0]]);
        // Two shades are drawn, and the two equal cells above each other as one.
        assert_eq!(svg.matches("<path class=\"cells").count(), 2, "{svg}");
        let paths = svg.split("<path class=\"cells").skip(1);
        assert!(
            paths
                .clone()
                .all(|path| path.split("/>").next().unwrap_or("").matches('M').count() == 1)
        );
        assert_eq!(svg.matches("<rect class=\"cells").count(), 16, "{svg}");
        assert!(svg.contains(">model, symmetric<") && !svg.contains("model, shear"), "{svg}");
        assert!(svg.contains("1 points of waves of the model, 1 that were found"), "{svg}");
    }
}
