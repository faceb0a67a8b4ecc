//! Histogram of ranks.

use std::fmt;

/// Number of bins.
const BINS: usize = 10;

/// How many truths lie in each tenth of their posterior's draws.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Ranks([u64; BINS]);

impl Ranks {
    /// Adds a truth that exceeds `below` of the `draws` draws of its posterior.
    pub(super) fn add(&mut self, below: usize, draws: usize) {
        let bin = BINS * below / (draws + 1);
        self.0[bin.min(BINS - 1)] += 1;
    }

    /// Returns the largest deviation of a bin from its expected count, in standard deviations of the
    /// binomial law. Of ten bins that hold a tenth each it exceeds 3.3 in one histogram of a hundred.
    pub(super) fn largest_deviation(&self) -> f64 {
        let total = self.0.iter().sum::<u64>() as f64;
        let share = 1.0 / BINS as f64;
        let deviation = (total * share * (1.0 - share)).sqrt();
        let off = self.0.iter().map(|&count| (count as f64 - share * total).abs());
        if total == 0.0 { 0.0 } else { off.fold(0.0, f64::max) / deviation }
    }
}

impl fmt::Display for Ranks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts: Vec<String> = self.0.iter().map(u64::to_string).collect();
        f.write_str(&counts.join(" "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn truths_are_counted_by_tenths() {
        let mut ranks = Ranks::default();
        for below in [0, 199, 200, 1999, 2000] {
            ranks.add(below, 2000);
        }
        assert_eq!(ranks.to_string(), "3 0 0 0 0 0 0 0 0 2");
    }

    #[test]
    fn deviations_are_those_of_the_binomial_law() {
        let mut ranks = Ranks([10; BINS]);
        assert_eq!(ranks.largest_deviation(), 0.0);
        ranks.0[0] = 19;
        ranks.0[1] = 1;
        assert!((ranks.largest_deviation() - 3.0).abs() < 1e-12);
        assert_eq!(Ranks::default().largest_deviation(), 0.0);
    }
}
