//! The values that fields accept: ranges of numbers, and their description in messages.

use std::fmt;

use crate::ensemble::DISPERSION_MAX;

/// An interval of finite numbers with its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    lower: Edge,
    upper: Edge,
    unit: &'static str,
}

/// End of an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Edge {
    /// No limit.
    None,
    /// The limit does not belong to the interval.
    Open(f64),
    /// The limit belongs to the interval.
    Closed(f64),
}

/// A range of whole numbers, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WholeRange {
    /// Smallest accepted number.
    pub min: u64,
    /// Largest accepted number.
    pub max: u64,
}

impl Interval {
    /// Accepts every finite number.
    pub(crate) const fn finite(unit: &'static str) -> Self {
        Self { lower: Edge::None, upper: Edge::None, unit }
    }

    /// Accepts numbers above `lower`.
    pub const fn above(lower: f64, unit: &'static str) -> Self {
        Self { lower: Edge::Open(lower), upper: Edge::None, unit }
    }

    /// Accepts numbers above `lower` and below `upper`.
    pub(crate) const fn between(lower: f64, upper: f64, unit: &'static str) -> Self {
        Self { lower: Edge::Open(lower), upper: Edge::Open(upper), unit }
    }

    /// Accepts numbers above `lower` and at most `upper`.
    pub(crate) const fn above_to(lower: f64, upper: f64, unit: &'static str) -> Self {
        Self { lower: Edge::Open(lower), upper: Edge::Closed(upper), unit }
    }

    /// Accepts numbers of at least `lower` and below `upper`.
    pub(crate) const fn from_below(lower: f64, upper: f64, unit: &'static str) -> Self {
        Self { lower: Edge::Closed(lower), upper: Edge::Open(upper), unit }
    }

    /// Accepts numbers of at least `lower`.
    pub(crate) const fn from(lower: f64, unit: &'static str) -> Self {
        Self { lower: Edge::Closed(lower), upper: Edge::None, unit }
    }

    /// Accepts numbers from `lower` to `upper`.
    pub(crate) const fn from_to(lower: f64, upper: f64, unit: &'static str) -> Self {
        Self { lower: Edge::Closed(lower), upper: Edge::Closed(upper), unit }
    }

    pub(crate) const fn at_least(lower: f64, unit: &'static str) -> Self {
        Self { lower: Edge::Closed(lower), upper: Edge::None, unit }
    }

    /// Returns the unit, or what the numbers are fractions of; empty for pure numbers.
    pub const fn unit(&self) -> &'static str {
        self.unit
    }

    /// Returns the lower and the upper end.
    pub const fn edges(&self) -> (Edge, Edge) {
        (self.lower, self.upper)
    }

    /// Returns the limits, infinite where there is none.
    pub fn limits(&self) -> [f64; 2] {
        let limit = |edge, none| match edge {
            Edge::None => none,
            Edge::Open(limit) | Edge::Closed(limit) => limit,
        };
        [limit(self.lower, f64::NEG_INFINITY), limit(self.upper, f64::INFINITY)]
    }

    /// Returns whether `value` is finite and inside the interval.
    pub fn contains(&self, value: f64) -> bool {
        let above = match self.lower {
            Edge::None => true,
            Edge::Open(lower) => value > lower,
            Edge::Closed(lower) => value >= lower,
        };
        let below = match self.upper {
            Edge::None => true,
            Edge::Open(upper) => value < upper,
            Edge::Closed(upper) => value <= upper,
        };
        value.is_finite() && above && below
    }

    /// Returns the message that refuses `value`.
    pub fn refusal(&self, value: f64) -> String {
        let finite = if value.is_finite() { "" } else { "finite and " };
        let (found, question) = (written(value), self.degrees(value));
        match (self.lower, self.upper) {
            (Edge::None, Edge::None) => format!("is {found}; it must be {self}"),
            _ => format!("is {found}; it must be {finite}{self}{question}"),
        }
    }

    /// Returns the question whether an angle is in degrees; empty if it can be no such angle.
    fn degrees(&self, value: f64) -> String {
        let radians = value * (std::f64::consts::PI / 180.0);
        // Smaller ones are more probably angles that are too large.
        if self.unit != "rad" || value.abs() < 0.5 || !self.contains(radians) {
            return String::new();
        }
        format!("; did you mean {value}° ({radians:.4})?")
    }
}

impl fmt::Display for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.lower, self.upper) {
            (Edge::None, Edge::None) => f.write_str("a finite number")?,
            (Edge::Closed(lower), Edge::Closed(upper)) => {
                write!(f, "from {} to {}", shown(lower), shown(upper))?
            }
            (lower, upper) => {
                match lower {
                    Edge::None => {}
                    Edge::Open(lower) => write!(f, "above {}", shown(lower))?,
                    Edge::Closed(lower) => write!(f, "at least {}", shown(lower))?,
                }
                if lower != Edge::None && upper != Edge::None {
                    f.write_str(" and ")?;
                }
                match upper {
                    Edge::None => {}
                    Edge::Open(upper) => write!(f, "below {}", shown(upper))?,
                    Edge::Closed(upper) => write!(f, "at most {}", shown(upper))?,
                }
            }
        }
        if self.unit.is_empty() { Ok(()) } else { write!(f, " ({})", self.unit) }
    }
}

/// Numbers from here on are written with an exponent, because the zeros of 25000000000 are hard to
/// count.
const EXPONENT_FROM: f64 = 1e7;

/// Formats the edge of an interval for a message.
fn shown(edge: f64) -> String {
    if edge == DISPERSION_MAX {
        format!("{edge:.5}…")
    } else if edge.abs() >= EXPONENT_FROM {
        format!("{edge:e}")
    } else {
        edge.to_string()
    }
}

/// Formats a number from a file for a message.
pub(crate) fn written(value: f64) -> String {
    if value.abs() >= EXPONENT_FROM { format!("{value:e}") } else { format!("{value:?}") }
}

impl WholeRange {
    /// Accepts whole numbers from `min` to `max`.
    pub(crate) const fn new(min: u64, max: u64) -> Self {
        Self { min, max }
    }

    /// Returns whether `value` is inside the range.
    pub fn contains(&self, value: u64) -> bool {
        (self.min..=self.max).contains(&value)
    }

    /// Returns the message that refuses `value`.
    pub fn refusal(&self, value: &impl fmt::Display) -> String {
        format!("is {value}; it must be {self}")
    }
}

impl fmt::Display for WholeRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a whole number from {} to {}", self.min, self.max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_of_the_dispersion_is_the_square_root() {
        assert_eq!(DISPERSION_MAX.to_bits(), (7.0_f64 / 11.0).sqrt().to_bits());
    }

    #[test]
    fn edges_are_open_or_closed_as_they_say() {
        let below_one = 1.0_f64.next_down();
        for (interval, inside, outside, said) in [
            (
                Interval::finite("m"),
                [-1e300, 0.0],
                [f64::NAN, f64::INFINITY],
                "a finite number (m)",
            ),
            (Interval::above(0.0, "Pa"), [5e-324, 1e300], [0.0, f64::NAN], "above 0 (Pa)"),
            (
                Interval::between(0.0, 1.0, ""),
                [5e-324, below_one],
                [0.0, 1.0],
                "above 0 and below 1",
            ),
            (Interval::above_to(0.0, 1.0, ""), [0.5, 1.0], [0.0, 1.1], "above 0 and at most 1"),
            (Interval::from_below(0.0, 1.0, ""), [0.0, 0.5], [-0.1, 1.0], "at least 0 and below 1"),
            (Interval::from_to(0.5, 16.0, ""), [0.5, 16.0], [0.49, 16.1], "from 0.5 to 16"),
            (Interval::from(0.0, ""), [0.0, 1.0], [-1.0, f64::INFINITY], "at least 0"),
            (
                Interval::from_to(12e9, 25e9, "the bounds"),
                [12e9, 20e9],
                [20.0, 26e9],
                "from 1.2e10 to 2.5e10 (the bounds)",
            ),
            (
                Interval::between(0.0, DISPERSION_MAX, "that is √(7/11)"),
                [0.1, DISPERSION_MAX.next_down()],
                [0.0, DISPERSION_MAX],
                "above 0 and below 0.79772… (that is √(7/11))",
            ),
        ] {
            assert!(inside.iter().all(|&value| interval.contains(value)), "{said}");
            assert!(outside.iter().all(|&value| !interval.contains(value)), "{said}");
            assert_eq!(interval.to_string(), said);
        }
    }
}
