//! Charts: what is drawn, as numbers. [`Chart::svg`] draws it, and [`Chart::csv`] writes the numbers.

mod draw;
mod frame;
mod raster;
mod scale;
mod style;

use std::fmt::Write as _;

pub(crate) use self::scale::{AxisScale, Spacing};
pub(crate) use self::style::STYLE;

/// A chart with its texts.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chart {
    /// Name of its files, without the ending; unique in a report.
    pub(crate) name: String,
    /// Title, which says what is shown.
    pub(crate) title: String,
    /// What the chart shows, in words and numbers, for those who do not see it.
    pub(crate) description: String,
    /// The horizontal axis.
    pub(crate) x: Axis,
    /// The vertical axis.
    pub(crate) y: Axis,
    /// What is drawn, the last one on top.
    pub(crate) layers: Vec<ChartLayer>,
    /// Height relative to the usual one.
    pub(crate) height: f64,
    /// Whether a unit of both axes has the same length.
    pub(crate) to_scale: bool,
}

impl Chart {
    /// Creates a chart without layers.
    pub(crate) fn new(name: impl Into<String>, title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self {
            name: name.into(),
            title: title.into(),
            description: String::new(),
            x,
            y,
            layers: Vec::new(),
            height: 1.0,
            to_scale: false,
        }
    }

    /// Adds a layer on top.
    pub(crate) fn layer(&mut self, name: impl Into<String>, ink: Ink, shape: Shape) {
        self.layers.push(ChartLayer { name: name.into(), ink, shape });
    }

    /// Returns the numbers of all layers as CSV: `x` to `x_end` and `y` to `y_end`. An end is empty if there
    /// is only one value.
    pub(crate) fn csv(&self) -> String {
        let mut out = "series,label,x,x_end,y,y_end\n".to_owned();
        for layer in &self.layers {
            let series =
                if layer.name.is_empty() { layer.shape.series_name() } else { &layer.name };
            for ([x, x_end, y, y_end], label) in layer.shape.numbers() {
                let label = if label.is_empty() { self.category(y, x) } else { label };
                let [x, x_end, y, y_end] = [x, x_end, y, y_end].map(cell);
                let (series, label) = (field(series), field(label));
                // Writing to a string does not fail.
                let _infallible = writeln!(out, "{series},{label},{x},{x_end},{y},{y_end}");
            }
        }
        out
    }

    /// Returns the name of the category at a place, empty if no axis has categories.
    fn category(&self, y: f64, x: f64) -> &str {
        let index = |axis: &Axis, value: f64| -> Option<usize> {
            let place = value.round();
            (!axis.categories.is_empty() && place >= 0.0).then_some(place as usize)
        };
        let on_y = index(&self.y, y).and_then(|place| self.y.categories.get(place));
        let on_x = index(&self.x, x).and_then(|place| self.x.categories.get(place));
        on_y.or(on_x).map_or("", String::as_str)
    }
}

/// An axis: numbers, or categories at 0, 1, 2, ….
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axis {
    /// Name of the quantity, with its unit.
    pub(crate) label: String,
    /// How values become positions.
    pub(crate) spacing: Spacing,
    /// The ends; found from the layers if not given.
    pub(crate) range: Option<[f64; 2]>,
    /// Names of the categories; empty on an axis of numbers.
    pub(crate) categories: Vec<String>,
}

impl Axis {
    /// An axis of numbers in proportion to them.
    pub(crate) fn linear(label: impl Into<String>) -> Self {
        let (spacing, categories) = (Spacing::Linear, Vec::new());
        Self { label: label.into(), spacing, range: None, categories }
    }

    /// An axis of numbers above 0 in proportion to their logarithms.
    pub(crate) fn logarithmic(label: impl Into<String>) -> Self {
        Self { spacing: Spacing::Logarithmic, ..Self::linear(label) }
    }

    /// An axis with a place for each name.
    pub(crate) fn with_categories(label: impl Into<String>, names: Vec<String>) -> Self {
        let range = Some([-0.5, names.len().max(1) as f64 - 0.5]);
        Self { range, categories: names, ..Self::linear(label) }
    }

    /// The same axis with these ends.
    pub(crate) fn with_ends(self, low: f64, high: f64) -> Self {
        Self { range: Some([low, high]), ..self }
    }
}

/// Something drawn, with its name in the legend.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ChartLayer {
    /// Name in the legend; empty for none.
    pub(crate) name: String,
    /// Colour, with a dash pattern or a marker of its own.
    pub(crate) ink: Ink,
    /// What is drawn.
    pub(crate) shape: Shape,
}

/// Colours that remain different with any colour vision; each also has its own dashes and markers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ink {
    /// The model, or the first of several.
    First,
    /// The data, or the second.
    Second,
    /// The third.
    Third,
    /// The fourth.
    Fourth,
    /// What is only for orientation.
    Muted,
}

impl Ink {
    /// The colour of the `n`-th of several, from 0; they repeat after four.
    pub(crate) fn nth(n: usize) -> Self {
        [Self::First, Self::Second, Self::Third, Self::Fourth][n % 4]
    }
}

/// What is drawn, in the units of the axes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Shape {
    /// A line through points; a value that is not finite interrupts it.
    Line(Vec<[f64; 2]>),
    /// The area between a lower and an upper line: x, lower, upper.
    Band(Vec<[f64; 3]>),
    /// Bars from 0, or from the lower end of the axis: left, right, height.
    Bars(Vec<[f64; 3]>),
    /// Points.
    Points(Vec<[f64; 2]>),
    /// Points as small as possible, for thousands of them.
    Dots(Vec<[f64; 2]>),
    /// Horizontal intervals: lower end, upper end, place on the vertical axis.
    Intervals(Vec<[f64; 3]>),
    /// A horizontal line over the whole chart.
    Level(f64),
    /// A vertical line over the whole chart.
    Upright(f64),
    /// Filled rectangles: left, right, bottom, top.
    Rectangles(Vec<[f64; 4]>),
    /// Cells of equal size coloured by their values, 0 to 1.
    Raster(Raster),
    /// Texts, each beginning at a point.
    Texts(Vec<([f64; 2], String)>),
}

/// Values over both axes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Raster {
    /// Left and right end.
    pub(crate) x: [f64; 2],
    /// Lower and upper end.
    pub(crate) y: [f64; 2],
    /// Columns from left to right, each with its values from below.
    pub(crate) columns: Vec<Vec<f64>>,
}

impl Shape {
    /// Returns the name in the table of a layer without one of its own; empty for those whose elements
    /// have labels.
    fn series_name(&self) -> &'static str {
        match self {
            Self::Line(_) | Self::Level(_) | Self::Upright(_) => "line",
            Self::Points(_) | Self::Dots(_) => "points",
            Self::Band(_) => "band",
            Self::Bars(_) => "bars",
            Self::Intervals(_) => "intervals",
            Self::Rectangles(_) | Self::Raster(_) | Self::Texts(_) => "",
        }
    }

    /// Returns x, end of x, y and end of y of each element, NaN where there is none, and its text.
    fn numbers(&self) -> Vec<([f64; 4], &str)> {
        const NONE: f64 = f64::NAN;
        let without_text =
            |numbers: Vec<[f64; 4]>| numbers.into_iter().map(|one| (one, "")).collect();
        match self {
            Self::Line(points) | Self::Points(points) | Self::Dots(points) => {
                without_text(points.iter().map(|&[x, y]| [x, NONE, y, NONE]).collect())
            }
            Self::Band(band) => {
                without_text(band.iter().map(|&[x, a, b]| [x, NONE, a, b]).collect())
            }
            Self::Bars(extents) | Self::Intervals(extents) => {
                without_text(extents.iter().map(|&[a, b, y]| [a, b, y, NONE]).collect())
            }
            Self::Level(y) => without_text(vec![[NONE, NONE, *y, NONE]]),
            Self::Upright(x) => without_text(vec![[*x, NONE, NONE, NONE]]),
            Self::Rectangles(all) => without_text(all.clone()),
            Self::Raster(Raster { x, y, .. }) => without_text(vec![[x[0], x[1], y[0], y[1]]]),
            Self::Texts(texts) => {
                texts.iter().map(|([x, y], text)| ([*x, NONE, *y, NONE], text.as_str())).collect()
            }
        }
    }

    /// Returns the values that an axis must hold: along x, and along y.
    fn extent(&self) -> [Vec<f64>; 2] {
        let numbers = self.numbers();
        let along = |places: [usize; 2]| {
            let values = |(one, _): &([f64; 4], &str)| places.map(|place| one[place]);
            numbers.iter().flat_map(values).filter(|value| value.is_finite()).collect()
        };
        let mut y: Vec<f64> = along([2, 3]);
        if matches!(self, Self::Bars(_)) {
            y.push(0.0);
        }
        [along([0, 1]), y]
    }
}

/// Returns a number as a field; empty where there is none.
fn cell(number: f64) -> String {
    if number.is_finite() { format!("{number:?}") } else { String::new() }
}

/// Returns a text as a field that no spreadsheet takes for a formula.
fn field(text: &str) -> String {
    osteon_files::results_csv::field(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_a_chart_are_a_table() {
        let mut chart = Chart::new("a", "A", Axis::linear("x"), Axis::linear("y"));
        chart.layer("=model", Ink::First, Shape::Line(vec![[1.0, 2.5], [2.0, f64::NAN]]));
        chart.layer("band", Ink::First, Shape::Band(vec![[1.0, 2.0, 3.0]]));
        chart.layer("", Ink::Muted, Shape::Level(0.1));
        chart.layer("", Ink::Muted, Shape::Dots(vec![[3.0, 4.0]]));
        assert_eq!(
            chart.csv(),
            "series,label,x,x_end,y,y_end\n\"'=model\",,1.0,,2.5,\n\"'=model\",,2.0,,,\n\
             band,,1.0,,2.0,3.0\nline,,,,0.1,\npoints,,3.0,,4.0,\n"
        );
    }

    #[test]
    fn categories_are_named_in_the_table() {
        let names = vec!["a".to_owned(), "b, c".to_owned()];
        let y = Axis::with_categories("group", names);
        let mut chart = Chart::new("a", "A", Axis::linear("x"), y);
        chart.layer("95 %", Ink::First, Shape::Intervals(vec![[1.0, 2.0, 1.0]]));
        assert!(chart.csv().ends_with("95 %,\"b, c\",1.0,2.0,1.0,\n"), "{}", chart.csv());
    }
}
