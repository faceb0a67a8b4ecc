//! Frequencies in equal steps, as a user writes them.

use std::str::FromStr;

/// Maximum number of frequencies.
const FREQUENCIES_MAX: u32 = 10_000;

/// Frequencies in equal steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrequencyBand {
    /// The first and the last frequency, Hz.
    ends: [f64; 2],
    /// Number of frequencies.
    count: u32,
}

impl FrequencyBand {
    /// Returns one frequency, Hz.
    pub fn single(frequency: f64) -> Self {
        Self { ends: [frequency; 2], count: 1 }
    }

    /// Returns the frequencies, Hz.
    pub fn frequencies(self) -> Vec<f64> {
        let [first, last] = self.ends;
        let steps = f64::from(self.count.saturating_sub(1)).max(1.0);
        let at = |step: u32| (last - first).mul_add(f64::from(step) / steps, first);
        (0..self.count).map(at).collect()
    }
}

impl FromStr for FrequencyBand {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| {
            text.parse::<f64>().ok().filter(|number| *number > 0.0 && number.is_finite())
        };
        let parts: Vec<&str> = text.split(':').collect();
        let band = match *parts.as_slice() {
            [frequency] => number(frequency).map(Self::single),
            [first, last, count] => {
                let count =
                    count.parse().ok().filter(|count| (2..=FREQUENCIES_MAX).contains(count));
                number(first).zip(number(last)).zip(count).and_then(|((first, last), count)| {
                    (first < last).then_some(Self { ends: [first, last], count })
                })
            }
            _ => None,
        };
        band.ok_or_else(|| {
            format!(
                "it must be a frequency above 0 (Hz), or START:STOP:COUNT with 0 < START < STOP (Hz) and a \
                 COUNT from 2 to {FREQUENCIES_MAX}"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_is_a_frequency_or_equal_steps() {
        let check = |text: &str, expected: Option<Vec<f64>>| {
            let found = text.parse::<FrequencyBand>().ok().map(FrequencyBand::frequencies);
            assert_eq!(found, expected, "{text}");
        };
        check("1e6", Some(vec![1e6]));
        check("1e5:3e5:3", Some(vec![1e5, 2e5, 3e5]));
        check("1:2:2", Some(vec![1.0, 2.0]));
        for text in [
            "",
            "0",
            "-1",
            "nan",
            "inf",
            "1e6:2e6",
            "2:1:5",
            "1:1:5",
            "1:2:1",
            "1:2:10001",
            "1:2:3:4",
        ] {
            check(text, None);
        }
    }
}
