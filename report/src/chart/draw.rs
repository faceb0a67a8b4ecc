//! Charts as SVG, with a title and a description for screen readers. In a page their colours follow the reader's
//! choice of light or dark.

use std::fmt::Write as _;

use super::frame::{Frame, coordinate};
use super::raster::{cells, colour_bar, key_width};
use super::scale::Tick;
use super::style::file_style;
use super::{Axis, AxisScale, Chart, ChartLayer, Ink, Shape};
use crate::text::{escape, shorten};

/// Width of a chart.
const WIDTH: f64 = 480.0;
/// Height of the usual plot, without axes and legend.
const PLOT_HEIGHT: f64 = 210.0;
/// Width of an average character of labels.
const CHARACTER: f64 = 6.6;
/// Width of an average character of the legend, whose font is larger.
const KEY_CHARACTER: f64 = 7.3;
/// Height of a line of text.
const LINE: f64 = 17.0;
/// Most characters of a category's name.
const CATEGORY_CHARACTERS: usize = 26;

impl Chart {
    /// Returns the chart as an element of a page; its colours come from [`STYLE`](super::style::STYLE).
    pub(crate) fn svg(&self) -> String {
        self.draw("")
    }

    /// Returns the chart as a file of its own.
    pub(crate) fn svg_file(&self) -> String {
        let style = format!("<style>{}</style>", file_style());
        format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}\n", self.draw(&style))
    }

    fn draw(&self, style: &str) -> String {
        let legend = legend(&self.layers);
        let frame = self.frame(legend.len());
        let height = frame.top + frame.height + 2.6 * LINE;
        let Self { name, title, description, .. } = self;
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"chart\" viewBox=\"0 0 {WIDTH} {}\" \
             role=\"img\" aria-labelledby=\"t-{name} d-{name}\" {}>\
             <title id=\"t-{name}\">{}</title><desc id=\"d-{name}\">{}</desc>{style}\
             <rect class=\"paper\" width=\"100%\" height=\"100%\"/>",
            coordinate(height),
            plot_data(&frame),
            escape(title),
            escape(description),
        );
        text(&mut out, "label", 2.0, LINE - 4.0, &self.y.label);
        for (row, entries) in legend.iter().enumerate() {
            legend_row(&mut out, entries, LINE * (row as f64 + 2.0) - 4.0);
        }
        self.axes(&mut out, &frame);
        // An inner element, because it cuts what lies outside of the plot.
        let [left, top, width, height] =
            [frame.left, frame.top, frame.width, frame.height].map(coordinate);
        let _infallible = write!(
            out,
            "<svg class=\"plot\" x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\">"
        );
        for layer in &self.layers {
            draw(&mut out, layer, &frame);
        }
        out.push_str("</svg></svg>");
        out
    }

    fn frame(&self, legend_rows: usize) -> Frame {
        let [x, y] = self.scales();
        let labels = axis_ticks(&self.y, &y, 5);
        let widest = labels.iter().map(|tick| tick.label.chars().count()).max().unwrap_or(0);
        let left = (widest as f64 * CHARACTER + 12.0).max(26.0);
        let last = axis_ticks(&self.x, &x, 5).last().map_or(0, |tick| tick.label.chars().count());
        let right = (last as f64 * CHARACTER / 2.0 + 4.0).max(14.0);
        let top = LINE * (legend_rows as f64 + 1.0) + 6.0;
        let (width, mut height) = (WIDTH - left - right, PLOT_HEIGHT * self.height);
        if self.to_scale {
            height = width * (y.high - y.low) / (x.high - x.low);
        }
        let downwards = !self.y.categories.is_empty();
        Frame { left, top, width, height, x, y, downwards }
    }

    /// Returns the scales of both axes, which hold all layers unless their ends are given.
    fn scales(&self) -> [AxisScale; 2] {
        let extents: Vec<[Vec<f64>; 2]> =
            self.layers.iter().map(|layer| layer.shape.extent()).collect();
        let bars = self.layers.iter().any(|layer| matches!(layer.shape, Shape::Bars(_)));
        let scale = |axis: &Axis, place: usize| match axis.range {
            Some([low, high]) if low < high => AxisScale { spacing: axis.spacing, low, high },
            _ => {
                let values = extents.iter().flat_map(|extent| extent[place].iter().copied());
                let mut found = AxisScale::around(values, axis.spacing, 0.04);
                // Bars stand on the axis.
                if bars && place == 1 && found.low < 0.0 && found.high > 0.0 {
                    found.low = 0.0;
                }
                found
            }
        };
        [scale(&self.x, 0), scale(&self.y, 1)]
    }

    fn axes(&self, out: &mut String, frame: &Frame) {
        let (bottom, right) = (frame.top + frame.height, frame.left + frame.width);
        let mut grid = String::new();
        for tick in axis_ticks(&self.x, &frame.x, 5) {
            let x = frame.left + frame.x(tick.value);
            let _infallible =
                write!(grid, "M{} {}V{}", coordinate(x), coordinate(frame.top), coordinate(bottom));
            text(out, "tick middle", x, bottom + LINE - 2.0, &tick.label);
        }
        for tick in axis_ticks(&self.y, &frame.y, 5) {
            let y = frame.top + frame.y(tick.value);
            let _infallible =
                write!(grid, "M{} {}H{}", coordinate(frame.left), coordinate(y), coordinate(right));
            text(out, "tick end", frame.left - 6.0, y + 4.0, &tick.label);
        }
        let _infallible = write!(out, "<path class=\"grid\" d=\"{grid}\"/>");
        let [left, top, right, bottom_text] =
            [frame.left, frame.top, right, bottom].map(coordinate);
        let _infallible =
            write!(out, "<path class=\"axis\" d=\"M{left} {top}V{bottom_text}H{right}\"/>");
        let center = frame.left + frame.width / 2.0;
        text(out, "label middle", center, bottom + 2.0 * LINE + 2.0, &self.x.label);
    }
}

/// Returns the marks of an axis.
fn axis_ticks(axis: &Axis, scale: &AxisScale, count: usize) -> Vec<Tick> {
    if axis.categories.is_empty() {
        return scale.ticks(count);
    }
    let name = |(place, name): (usize, &String)| Tick {
        value: place as f64,
        label: shorten(name, CATEGORY_CHARACTERS),
    };
    axis.categories.iter().enumerate().map(name).collect()
}

/// Returns where the plot lies and what it spans, for a script that shows values under the pointer.
fn plot_data(frame: &Frame) -> String {
    let [left, top, width, height] =
        [frame.left, frame.top, frame.width, frame.height].map(coordinate);
    let describe_scale = |scale: &AxisScale| {
        let spacing = match scale.spacing {
            super::Spacing::Linear => "linear",
            super::Spacing::Logarithmic => "log",
        };
        format!("{spacing} {:e} {:e}", scale.low, scale.high)
    };
    let (x, y) = (describe_scale(&frame.x), describe_scale(&frame.y));
    format!("data-plot=\"{left} {top} {width} {height}\" data-x=\"{x}\" data-y=\"{y}\"")
}

/// Returns the rows of the legend: entries with their horizontal positions.
fn legend(layers: &[ChartLayer]) -> Vec<Vec<(f64, &ChartLayer)>> {
    let mut rows: Vec<Vec<(f64, &ChartLayer)>> = Vec::new();
    let mut free = f64::INFINITY;
    for layer in layers.iter().filter(|layer| !layer.name.is_empty()) {
        let width = key_width(is_raster(layer))
            + 8.0
            + layer.name.chars().count() as f64 * KEY_CHARACTER
            + 14.0;
        if free + width > WIDTH {
            rows.push(Vec::new());
            free = 2.0;
        }
        if let Some(row) = rows.last_mut() {
            row.push((free, layer));
        }
        free += width;
    }
    rows
}

fn legend_row(out: &mut String, entries: &[(f64, &ChartLayer)], y: f64) {
    for (x, layer) in entries {
        let (class, middle) = (class(layer.ink), y - 4.0);
        let [from, to, at] = [*x, *x + 22.0, middle].map(coordinate);
        let _infallible = match layer.shape {
            Shape::Raster(_) => colour_bar(out, class, *x, middle),
            Shape::Band(_) | Shape::Bars(_) | Shape::Rectangles(_) => {
                let (kind, top) = (area_class(&layer.shape), coordinate(middle - 5.0));
                write!(
                    out,
                    "<rect class=\"{kind} {class}\" x=\"{from}\" y=\"{top}\" width=\"22\" \
                     height=\"10\"/>"
                )
            }
            Shape::Points(_) | Shape::Dots(_) => {
                marker(out, layer.ink, *x + 11.0, middle);
                Ok(())
            }
            _ => write!(out, "<path class=\"line {class}\" d=\"M{from} {at}H{to}\"/>"),
        };
        text(out, "key", x + key_width(is_raster(layer)) + 6.0, y, &layer.name);
    }
}

fn is_raster(layer: &ChartLayer) -> bool {
    matches!(layer.shape, Shape::Raster(_))
}

fn draw(out: &mut String, layer: &ChartLayer, frame: &Frame) {
    let class = class(layer.ink);
    let _infallible = match &layer.shape {
        Shape::Line(points) => {
            let name = escape(&layer.name);
            for piece in pieces(points, frame) {
                let _infallible = write!(
                    out,
                    "<polyline class=\"line {class}\" data-name=\"{name}\" points=\"{piece}\"/>"
                );
            }
            Ok(())
        }
        Shape::Band(band) => {
            let lower = band.iter().filter_map(|&[x, low, _]| frame.point(x, low));
            let upper = band.iter().rev().filter_map(|&[x, _, high]| frame.point(x, high));
            let points = lower.chain(upper).collect::<Vec<_>>().join(" ");
            write!(out, "<polygon class=\"band {class}\" points=\"{points}\"/>")
        }
        Shape::Bars(bars) => {
            let bottom = if frame.y.low > 0.0 { frame.y.low } else { 0.0 };
            let all: Vec<[f64; 4]> =
                bars.iter().map(|&[from, to, height]| [from, to, bottom, height]).collect();
            rectangles(out, &format!("bar {class}"), &all, frame)
        }
        Shape::Rectangles(all) => rectangles(out, &format!("area {class}"), all, frame),
        Shape::Points(points) => {
            for &[x, y] in points.iter().filter(|point| point.iter().all(|at| at.is_finite())) {
                marker(out, layer.ink, frame.x(x), frame.y(y));
            }
            Ok(())
        }
        Shape::Dots(points) => {
            let mut path = String::new();
            for point in points.iter().filter_map(|&[x, y]| frame.point(x, y)) {
                let _infallible = write!(path, "M{point}h0");
            }
            write!(out, "<path class=\"dots {class}\" d=\"{path}\"/>")
        }
        Shape::Intervals(intervals) => {
            let mut path = String::new();
            for &[low, high, y] in intervals {
                let [from, to, y, a, b] =
                    [frame.x(low), frame.x(high), frame.y(y), frame.y(y) - 4.0, frame.y(y) + 4.0]
                        .map(coordinate);
                let _infallible = write!(path, "M{from} {y}H{to}M{from} {a}V{b}M{to} {a}V{b}");
            }
            write!(out, "<path class=\"interval {class}\" d=\"{path}\"/>")
        }
        Shape::Level(y) => {
            let (y, right) = (coordinate(frame.y(*y)), coordinate(frame.width));
            write!(out, "<path class=\"line {class}\" d=\"M0 {y}H{right}\"/>")
        }
        Shape::Upright(x) => {
            let (x, bottom) = (coordinate(frame.x(*x)), coordinate(frame.height));
            write!(out, "<path class=\"line {class}\" d=\"M{x} 0V{bottom}\"/>")
        }
        Shape::Raster(raster) => cells(out, class, raster, frame),
        Shape::Texts(texts) => {
            for ([x, y], words) in texts {
                text(out, "note", frame.x(*x), frame.y(*y), words);
            }
            Ok(())
        }
    };
}

fn rectangles(out: &mut String, class: &str, all: &[[f64; 4]], frame: &Frame) -> std::fmt::Result {
    let mut path = String::new();
    for &[from, to, bottom, top] in all {
        let [from, to, bottom, top] =
            [frame.x(from), frame.x(to), frame.y(bottom), frame.y(top)].map(coordinate);
        write!(path, "M{from} {bottom}V{top}H{to}V{bottom}z")?;
    }
    write!(out, "<path class=\"{class}\" d=\"{path}\"/>")
}

/// Returns the parts of a line between values that are not finite, each as points.
fn pieces(points: &[[f64; 2]], frame: &Frame) -> Vec<String> {
    let placed: Vec<Option<String>> = points.iter().map(|&[x, y]| frame.point(x, y)).collect();
    let parts = placed.split(Option::is_none);
    let join = |part: &[Option<String>]| part.iter().flatten().cloned().collect::<Vec<_>>();
    parts.map(join).filter(|part| !part.is_empty()).map(|part| part.join(" ")).collect()
}

/// Draws a point: each colour has a form of its own.
fn marker(out: &mut String, ink: Ink, x: f64, y: f64) {
    let class = class(ink);
    let [x, y, left, right, up, down] = [x, y, x - 4.0, x + 4.0, y - 4.0, y + 4.0].map(coordinate);
    let _infallible = match ink {
        Ink::First => {
            write!(out, "<circle class=\"mark {class}\" cx=\"{x}\" cy=\"{y}\" r=\"3.5\"/>")
        }
        Ink::Second | Ink::Muted => write!(
            out,
            "<path class=\"mark {class}\" d=\"M{left} {y}L{x} {up}L{right} {y}L{x} {down}z\"/>"
        ),
        Ink::Third => {
            write!(out, "<path class=\"mark {class}\" d=\"M{left} {up}H{right}V{down}H{left}z\"/>")
        }
        Ink::Fourth => {
            write!(
                out,
                "<path class=\"mark {class}\" d=\"M{left} {down}L{x} {up}L{right} {down}z\"/>"
            )
        }
    };
}

fn text(out: &mut String, class: &str, x: f64, y: f64, words: &str) {
    if !words.is_empty() {
        let (x, y, words) = (coordinate(x), coordinate(y), escape(words));
        let _infallible = write!(out, "<text class=\"{class}\" x=\"{x}\" y=\"{y}\">{words}</text>");
    }
}

fn area_class(shape: &Shape) -> &'static str {
    match shape {
        Shape::Band(_) => "band",
        Shape::Bars(_) => "bar",
        _ => "area",
    }
}

fn class(ink: Ink) -> &'static str {
    match ink {
        Ink::First => "c1",
        Ink::Second => "c2",
        Ink::Third => "c3",
        Ink::Fourth => "c4",
        Ink::Muted => "c0",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::Spacing;

    fn chart() -> Chart {
        let mut chart = Chart::new("n", "T <1>", Axis::linear("x (m)"), Axis::logarithmic("y & z"));
        chart.description = "D".to_owned();
        chart.layer("a < b", Ink::First, Shape::Line(vec![[0.0, 1.0], [1.0, 0.0], [2.0, 10.0]]));
        chart
    }

    #[test]
    fn a_chart_has_a_title_a_description_and_escaped_texts() {
        let svg = chart().svg();
        for part in [
            "role=\"img\" aria-labelledby=\"t-n d-n\"",
            "<title id=\"t-n\">T &lt;1&gt;</title><desc id=\"d-n\">D</desc>",
            ">x (m)</text>",
            ">y &amp; z</text>",
            "data-name=\"a &lt; b\"",
            ">a &lt; b</text>",
        ] {
            assert!(svg.contains(part), "{part}: {svg}");
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        assert_eq!(svg, chart().svg());
    }

    #[test]
    fn a_file_has_its_own_style() {
        let file = chart().svg_file();
        assert!(file.starts_with("<?xml") && file.contains("<style>.chart{font:"), "{file}");
    }

    #[test]
    fn lines_are_interrupted_where_there_is_no_value() {
        let scale = |high| AxisScale { spacing: Spacing::Linear, low: 0.0, high };
        let (x, y) = (scale(10.0), scale(1.0));
        let frame =
            Frame { left: 0.0, top: 0.0, width: 100.0, height: 10.0, x, y, downwards: false };
        for (points, expected) in [
            (vec![[0.0, 0.0], [5.0, 1.0]], vec!["0,10 50,0"]),
            (vec![[0.0, 0.0], [1.0, f64::NAN], [5.0, 1.0]], vec!["0,10", "50,0"]),
            (vec![[f64::NAN, 0.0]], vec![]),
        ] {
            assert_eq!(pieces(&points, &frame), expected, "{points:?}");
        }
    }
}
