//! Values over both axes as cells of one colour, the denser the larger the value.

use std::fmt::{self, Write as _};

use super::Raster;
use super::frame::{Frame, coordinate};

/// Number of shades, of which the first is not drawn.
const SHADES: usize = 16;
/// Width of the colour bar in a legend, of the keys of other layers, and of one shade.
const BAR_WIDTH: f64 = 60.0;
const KEY_WIDTH: f64 = 22.0;
const SHADE_WIDTH: f64 = BAR_WIDTH / SHADES as f64;

/// Returns the width of a layer's key in the legend.
pub(super) fn key_width(is_raster: bool) -> f64 {
    if is_raster { BAR_WIDTH } else { KEY_WIDTH }
}

/// Draws the cells: a path for each shade, in which cells above each other are one.
pub(super) fn cells(out: &mut String, class: &str, raster: &Raster, frame: &Frame) -> fmt::Result {
    let place = |ends: [f64; 2], index: usize, count: usize| {
        (ends[1] - ends[0]).mul_add(index as f64 / count.max(1) as f64, ends[0])
    };
    for shade in 1..SHADES {
        let mut path = String::new();
        for (i, column) in raster.columns.iter().enumerate() {
            let [left, right] =
                [i, i + 1].map(|i| coordinate(frame.x(place(raster.x, i, raster.columns.len()))));
            let mut from = 0;
            for run in column.chunk_by(|one, other| shade_of(*one) == shade_of(*other)) {
                let to = from + run.len();
                if shade_of(run[0]) == shade {
                    let [bottom, top] =
                        [from, to].map(|j| coordinate(frame.y(place(raster.y, j, column.len()))));
                    write!(path, "M{left} {bottom}V{top}H{right}V{bottom}z")?;
                }
                from = to;
            }
        }
        if !path.is_empty() {
            write!(
                out,
                "<path class=\"cells {class}\" fill-opacity=\"{}\" d=\"{path}\"/>",
                opacity(shade)
            )?;
        }
    }
    Ok(())
}

/// Draws the shades from 0 to 1 as a key of the legend, from `x` on.
pub(super) fn colour_bar(out: &mut String, class: &str, x: f64, middle: f64) -> fmt::Result {
    let top = coordinate(middle - 5.0);
    for shade in 0..SHADES {
        let left = coordinate(SHADE_WIDTH.mul_add(shade as f64, x));
        let (width, opacity) = (coordinate(SHADE_WIDTH), opacity(shade));
        write!(
            out,
            "<rect class=\"cells {class}\" fill-opacity=\"{opacity}\" x=\"{left}\" y=\"{top}\" \
             width=\"{width}\" height=\"10\"/>"
        )?;
    }
    Ok(())
}

fn shade_of(value: f64) -> usize {
    // What is not a number has no colour.
    ((value * SHADES as f64) as usize).min(SHADES - 1)
}

/// Returns the opacity of a shade, by the square of its value: what matters is near 1.
fn opacity(shade: usize) -> String {
    let value = shade as f64 / (SHADES - 1) as f64;
    format!("{:.3}", value * value)
}
