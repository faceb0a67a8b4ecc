//! Where values lie within a chart.

use super::AxisScale;

/// The plot within the chart, and its scales.
pub(super) struct Frame {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) x: AxisScale,
    pub(super) y: AxisScale,
    /// Whether the vertical axis grows downwards, as lists do.
    pub(super) downwards: bool,
}

impl Frame {
    /// Returns the position of a value within the plot.
    pub(super) fn x(&self, value: f64) -> f64 {
        self.x.position(value) * self.width
    }

    /// Same as [`x`](Self::x) for the vertical axis.
    pub(super) fn y(&self, value: f64) -> f64 {
        let position = self.y.position(value);
        self.height * if self.downwards { position } else { 1.0 - position }
    }

    /// Returns a point as text; `None` where it is not finite, or so far outside that it is not drawn.
    pub(super) fn point(&self, x: f64, y: f64) -> Option<String> {
        let (x, y) = (self.x(x), self.y(y));
        // A logarithm of 0 lies far below.
        let y = if y == f64::INFINITY { 2.0 * self.height } else { y };
        let near = |value: f64| value.is_finite() && value.abs() < 1e5;
        (near(x) && near(y)).then(|| format!("{},{}", coordinate(x), coordinate(y)))
    }
}

/// Returns a coordinate to a tenth: a screen shows no less.
pub(super) fn coordinate(value: f64) -> String {
    let text = format!("{value:.1}");
    let text = text.strip_suffix(".0").unwrap_or(&text);
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}
