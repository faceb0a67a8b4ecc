//! Scales of axes: positions of values, and ticks at round numbers.

use crate::number::{self, Decimals};

/// Most powers of ten that a logarithmic axis spans; what lies farther below the largest value is cut.
const DECADES_MAX: f64 = 24.0;

/// How the values of an axis become positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Spacing {
    /// In proportion to the values.
    Linear,
    /// In proportion to their logarithms.
    Logarithmic,
}

/// A scale: values from `low` to `high` fill an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale {
    /// How values become positions.
    pub(crate) spacing: Spacing,
    /// Smallest value.
    pub(crate) low: f64,
    /// Largest value, above the smallest.
    pub(crate) high: f64,
}

/// A mark of an axis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    /// The value at which it is.
    pub(crate) value: f64,
    /// The value as text; empty for a mark between labelled ones.
    pub(crate) label: String,
}

impl Scale {
    /// Returns the scale that holds these values with a margin of `margin` times their range at both
    /// ends. Values that are not finite, or not above 0 on a logarithmic scale, are ignored.
    pub(crate) fn around(
        values: impl IntoIterator<Item = f64>,
        spacing: Spacing,
        margin: f64,
    ) -> Self {
        let fits = |value: &f64| {
            value.is_finite() && (spacing == Spacing::Linear || *value > f64::MIN_POSITIVE)
        };
        let (low, high) = values
            .into_iter()
            .filter(fits)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            });
        if low > high {
            return Self { spacing, low: 0.1, high: 1.0 };
        }
        match spacing {
            Spacing::Linear => {
                let width = high - low;
                // A single value gets a range that shows its last digits.
                let room = if width > 1e-12 * high.abs() {
                    margin * width
                } else if high == 0.0 {
                    1.0
                } else {
                    0.05 * high.abs()
                };
                Self { spacing, low: low - room, high: high + room }
            }
            Spacing::Logarithmic => {
                let (top, bottom) = (libm::log10(high), libm::log10(low));
                let bottom = bottom.max(top - DECADES_MAX);
                let room = if top - bottom > 1e-9 { margin * (top - bottom) } else { 0.2 };
                let [low, high] = [bottom - room, top + room].map(|power| libm::pow(10.0, power));
                Self { spacing, low, high }
            }
        }
    }

    /// Returns the position of a value, 0 at the lower end and 1 at the upper.
    pub(crate) fn position(&self, value: f64) -> f64 {
        match self.spacing {
            Spacing::Linear => (value - self.low) / (self.high - self.low),
            Spacing::Logarithmic => {
                let low = libm::log10(self.low);
                (libm::log10(value) - low) / (libm::log10(self.high) - low)
            }
        }
    }

    /// Returns marks at round numbers, about `count` of them labelled.
    pub(crate) fn ticks(&self, count: usize) -> Vec<Tick> {
        match self.spacing {
            Spacing::Linear => self.linear_ticks(count),
            Spacing::Logarithmic => self.logarithmic_ticks(count),
        }
    }

    fn linear_ticks(&self, count: usize) -> Vec<Tick> {
        let step = round_step((self.high - self.low) / count.max(1) as f64);
        // The ends may miss a multiple of the step by rounding.
        let (first, last) = ((self.low / step - 1e-6).ceil(), (self.high / step + 1e-6).floor());
        let number = (last - first).clamp(0.0, 100.0) as u32;
        let values: Vec<f64> = (0..=number).map(|n| (first + f64::from(n)) * step).collect();
        let labels = number::with_equal_decimals(&values, step);
        let ticks = values.into_iter().zip(labels);
        ticks.map(|(value, label)| Tick { value, label }).collect()
    }

    fn logarithmic_ticks(&self, count: usize) -> Vec<Tick> {
        let (low, high) = (libm::log10(self.low), libm::log10(self.high));
        let (first, last) = (low.ceil(), high.floor());
        if last - first < 1.0 {
            return self.within_a_decade(low.floor());
        }
        let every = ((last - first + 1.0) / count.max(1) as f64).ceil().max(1.0);
        let powers = (0..=(last - first) as u32).map(|n| first + f64::from(n));
        let tick = |power: f64| {
            let labelled = (power / every).fract() == 0.0;
            let label = if labelled { number::power_of_ten(power as i32) } else { String::new() };
            Tick { value: libm::pow(10.0, power), label }
        };
        powers.map(tick).collect()
    }

    /// Returns marks at 1, 2 and 5 times powers of ten, for a scale that holds few powers.
    fn within_a_decade(&self, first: f64) -> Vec<Tick> {
        let multiples = [1.0, 2.0, 5.0];
        let values = (0..3).flat_map(|power| {
            let ten = libm::pow(10.0, first + f64::from(power));
            multiples.map(|multiple| multiple * ten)
        });
        let inside = values.filter(|value| (self.low..=self.high).contains(value));
        let label = |value: f64| {
            Decimals::new(value, 1)
                .filter(|_| (1e-4..1e6).contains(&value))
                .map_or_else(|| format!("{value:e}"), |decimals| decimals.show(value))
        };
        inside.map(|value| Tick { value, label: label(value) }).collect()
    }
}

/// Returns the smallest of 1, 2, 5 times a power of ten that is at least `step`.
fn round_step(step: f64) -> f64 {
    if !(step.is_finite() && step > 0.0) {
        return 1.0;
    }
    let ten = libm::pow(10.0, libm::log10(step).floor());
    let multiples = [1.0, 2.0, 5.0, 10.0];
    let found = multiples.into_iter().find(|multiple| multiple * ten >= step * (1.0 - 1e-9));
    found.unwrap_or(10.0) * ten
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale) -> Vec<String> {
        let ticks = scale.ticks(5).into_iter().map(|tick| tick.label);
        ticks.filter(|label| !label.is_empty()).collect()
    }

    #[test]
    fn ticks_are_at_round_numbers() {
        for (low, high, expected) in [
            (0.0, 1.0, vec!["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]),
            (3500.0, 4300.0, vec!["3600", "3800", "4000", "4200"]),
            (-0.003, 0.006, vec!["-0.002", "0.000", "0.002", "0.004", "0.006"]),
            (17.71, 17.74, vec!["17.71", "17.72", "17.73", "17.74"]),
            (0.0, 2e-6, vec!["0", "5e-7", "1e-6", "1.5e-6", "2e-6"]),
        ] {
            let scale = Scale { spacing: Spacing::Linear, low, high };
            assert_eq!(labels(scale), expected, "{low} to {high}");
        }
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten_or_within_them() {
        for (low, high, expected) in [
            (0.5, 2000.0, vec!["1", "10", "100", "1000"]),
            (2.0, 30.0, vec!["2", "5", "10", "20"]),
            (1e-8, 1e-2, vec!["10⁻⁸", "10⁻⁶", "10⁻⁴", "0.01"]),
        ] {
            let scale = Scale { spacing: Spacing::Logarithmic, low, high };
            assert_eq!(labels(scale), expected, "{low} to {high}");
        }
    }

    #[test]
    fn every_set_of_values_has_a_scale() {
        for (values, spacing) in [
            (vec![], Spacing::Linear),
            (vec![f64::NAN], Spacing::Logarithmic),
            (vec![0.0, -1.0], Spacing::Logarithmic),
            (vec![5.0], Spacing::Linear),
            (vec![0.0], Spacing::Linear),
            (vec![1e-300, 1.0], Spacing::Logarithmic),
            (vec![4000.0, 4000.0], Spacing::Logarithmic),
        ] {
            let scale = Scale::around(values.clone(), spacing, 0.04);
            assert!(scale.low < scale.high, "{values:?}: {scale:?}");
            assert_eq!(scale.position(scale.low), 0.0, "{values:?}");
            assert!((scale.position(scale.high) - 1.0).abs() < 1e-12, "{values:?}");
            assert!(!scale.ticks(5).is_empty(), "{values:?}");
        }
    }
}
