//! Compensated summation.

/// Compensated sum (Neumaier's): the rounding error of each addition, which Knuth's TwoSum finds
/// exactly, is summed as well. There is no branch and only one addition between two sums, so that many
/// values take as long as in a plain sum.
#[derive(Clone, Copy, Default)]
pub(crate) struct Sum {
    sum: f64,
    lost: f64,
}

impl Sum {
    pub(crate) fn add(&mut self, value: f64) {
        let sum = self.sum + value;
        let added = sum - self.sum;
        self.lost += (self.sum - (sum - added)) + (value - added);
        self.sum = sum;
    }

    pub(crate) fn total(self) -> f64 {
        self.sum + self.lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_does_not_lose_what_is_small() {
        let mut sum = Sum::default();
        for value in [1.0, 1e100, 1.0, -1e100] {
            sum.add(value);
        }
        assert_eq!(sum.total(), 2.0);
    }

    /// The error of an addition as Neumaier finds it, by the order of the numbers.
    fn by_comparison(values: &[f64]) -> f64 {
        let (mut sum, mut lost) = (0.0_f64, 0.0);
        for &value in values {
            let next = sum + value;
            lost +=
                if sum.abs() >= value.abs() { (sum - next) + value } else { (value - next) + sum };
            sum = next;
        }
        sum + lost
    }

    #[test]
    fn the_bits_do_not_depend_on_how_the_error_is_found() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            // From 2^-60 to 2^59.
            let scale = f64::from_bits((963 + (state >> 40) % 120) << 52);
            scale * ((state >> 12) as f64 / (1_u64 << 52) as f64 - 0.5)
        };
        for length in 0..200 {
            let values: Vec<f64> = (0..length).map(|_| random()).collect();
            let mut sum = Sum::default();
            values.iter().for_each(|&value| sum.add(value));
            assert_eq!(sum.total().to_bits(), by_comparison(&values).to_bits(), "{values:?}");
        }
    }
}
