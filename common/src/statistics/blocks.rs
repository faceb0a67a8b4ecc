//! Standard errors of means over scrambled Sobol' points.
//!
//! Each power-of-two block of consecutive points of one scramble is an evenly distributed set
//! itself, and different scrambles are independent. Therefore the contributions to a moment, to
//! first order, are summed for each part of the sample, and the error of the moment is estimated
//! from the scatter of these sums. Failed realizations contribute nothing to their part.

use super::sum::Sum;
use crate::job::MonteCarlo;
use crate::results::Moments;

/// Errors are extrapolated from blocks of which one scramble has at least 2 to this power.
const BLOCKS_DIGITS: usize = 3;
/// Minimum number of points of one scramble for extrapolation.
const POINTS_MIN: u64 = 16;

/// Factor by which doubling a block beyond the measured ones changes the variance of its sum, for
/// the mean and for the coefficient of variation: 1 if the error of the mean over n points falls as
/// 1/n, 2^(2-2p) if as 1/nᵖ.
///
/// Measured over 64 seeds each at dispersions from 0.05 to 0.3 and 256 to 4096 points: p is 1.1 for
/// the plain mean, most of which is a smooth function of one germ, and 1 for its remainder after
/// the control variate, and for both coefficients of variation. `osteon-study variance` shows the
/// resulting errors.
#[derive(Debug, Clone, Copy)]
pub(super) struct DoublingFactors([f64; 2]);

impl DoublingFactors {
    /// Factors for the velocities.
    pub(super) const PLAIN: Self = Self([0.87, 1.0]);
    /// Factors for the remainder after the control variate.
    pub(super) const CONTROLLED: Self = Self([1.0, 1.0]);
}

/// Returns the standard errors of both moments, given the contribution of each realization to N
/// times the moments, in index order, and the number N of successes.
pub(super) fn standard_error(
    influences: impl Iterator<Item = [f64; 2]>,
    doubling: DoublingFactors,
    monte_carlo: &MonteCarlo,
    successes: f64,
) -> Moments {
    let points = monte_carlo.points().max(1);
    let variances = if monte_carlo.scrambles > 1 {
        variance_over_scrambles(influences, points)
    } else {
        variance_over_blocks(influences, doubling)
    };
    let [mean, coefficient_of_variation] = variances.map(|variance| variance.sqrt() / successes);
    Moments { mean, coefficient_of_variation }
}

/// Returns the variances of the sums over all scrambles, which have this many points each.
fn variance_over_scrambles(influences: impl Iterator<Item = [f64; 2]>, points: u64) -> [f64; 2] {
    let mut scatter = PairVariance::default();
    let mut sums = [Sum::default(); 2];
    let mut filled = 0;
    for influence in influences {
        for (sum, value) in sums.iter_mut().zip(influence) {
            sum.add(value);
        }
        filled += 1;
        if filled == points {
            scatter.add(sums.map(Sum::total));
            sums = [Sum::default(); 2];
            filled = 0;
        }
    }
    scatter.variances().map(|variance| variance * scatter.count)
}

/// Returns the variances of the sums over all points of one scramble.
///
/// A sum over n points is one over blocks that are added and subtracted, by the fewest digits 1 and
/// -1 that write n in base 2 (G. W. Reitwiesner, Advances in Computers 1 (1960)); these blocks are
/// treated as independent. Small ones have the scatter of blocks of their size. Larger ones have
/// that of the largest blocks of which there are enough, averaged with the next smaller and the
/// next larger.
fn variance_over_blocks(
    influences: impl Iterator<Item = [f64; 2]>,
    doubling: DoublingFactors,
) -> [f64; 2] {
    let levels = Levels::from_influences(influences);
    if levels.count < POINTS_MIN {
        return levels.variances(0).map(|variance| variance * levels.count as f64);
    }
    let largest = (u64::BITS - 1 - levels.count.leading_zeros()) as usize;
    let measured = largest - BLOCKS_DIGITS;
    let around = [measured - 1, measured, measured + 1].map(|level| levels.variances(level));
    let mut total = [0.0; 2];
    for level in signed_digits(levels.count) {
        let variances = levels.variances(level.min(measured));
        for (i, total) in total.iter_mut().enumerate() {
            *total += if level <= measured {
                variances[i]
            } else {
                let average = around.iter().map(|variances| variances[i]).sum::<f64>() / 3.0;
                (measured..level).fold(average, |variance, _| variance * doubling.0[i])
            };
        }
    }
    total
}

/// Returns the positions, from the lowest, of the nonzero digits in the signed binary form of a
/// number that has the fewest of them.
fn signed_digits(number: u64) -> impl Iterator<Item = usize> {
    let mut rest = u128::from(number);
    (0..)
        .map_while(move |place| {
            let digit = match (rest, rest % 4) {
                (0, _) => return None,
                (_, 1) => Some(rest - 1),
                (_, 3) => Some(rest + 1),
                _ => None,
            };
            rest = digit.unwrap_or(rest) / 2;
            Some(digit.map(|_| place))
        })
        .flatten()
}

/// Scatter of the sums over consecutive blocks of 1, 2, 4, … values.
#[derive(Default)]
struct Levels {
    count: u64,
    scatters: Vec<PairVariance>,
}

impl Levels {
    fn from_influences(influences: impl Iterator<Item = [f64; 2]>) -> Self {
        let mut levels = Self::default();
        // For each level, the first of two blocks that make one of the next level.
        let mut firsts: Vec<Option<[f64; 2]>> = Vec::new();
        for influence in influences {
            levels.count += 1;
            let mut sum = influence;
            for level in 0.. {
                if level == firsts.len() {
                    firsts.push(None);
                    levels.scatters.push(PairVariance::default());
                }
                levels.scatters[level].add(sum);
                match firsts[level].take() {
                    Some([first, second]) => sum = [first + sum[0], second + sum[1]],
                    None => {
                        firsts[level] = Some(sum);
                        break;
                    }
                }
            }
        }
        levels
    }

    /// Returns the variances of sums over blocks of 2 to the power `level`.
    fn variances(&self, level: usize) -> [f64; 2] {
        self.scatters.get(level).map_or([f64::NAN; 2], PairVariance::variances)
    }
}

/// Variance of a set of pairs.
#[derive(Clone, Copy, Default)]
struct PairVariance {
    count: f64,
    sums: [Sum; 2],
    squares: [Sum; 2],
}

impl PairVariance {
    fn add(&mut self, pair: [f64; 2]) {
        self.count += 1.0;
        for ((sum, square), value) in self.sums.iter_mut().zip(&mut self.squares).zip(pair) {
            sum.add(value);
            square.add(value * value);
        }
    }

    /// Returns the variances with division by one less than the number of pairs; NaN for fewer than
    /// two. The means are near 0, so that hardly anything cancels.
    fn variances(&self) -> [f64; 2] {
        [0, 1].map(|i| {
            let sum = self.sums[i].total();
            let squares = self.squares[i].total() - sum * (sum / self.count);
            squares.max(0.0) / (self.count - 1.0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::Sampling;

    fn sobol(realizations: u64, scrambles: u64) -> MonteCarlo {
        let sampling = Sampling::Sobol;
        MonteCarlo { realizations, scrambles, sampling, ..MonteCarlo::default() }
    }

    fn errors(values: &[f64], scrambles: u64) -> [f64; 2] {
        let influences = values.iter().map(|&value| [value, 2.0 * value]);
        let count = values.len() as u64;
        let doubling = DoublingFactors([0.25, 1.0]);
        let Moments { mean, coefficient_of_variation } =
            standard_error(influences, doubling, &sobol(count, scrambles), count as f64);
        [mean, coefficient_of_variation]
    }

    fn close(found: [f64; 2], expected: [f64; 2]) {
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-14, "{found}, expected {expected}");
        }
    }

    #[test]
    fn signed_digits_are_the_fewest() {
        let check = |number: u64, places: &[usize]| {
            assert!(signed_digits(number).eq(places.iter().copied()), "{number}");
        };
        check(0, &[]);
        check(1, &[0]);
        check(7, &[0, 3]);
        check(1024, &[10]);
        check(2747, &[0, 2, 6, 8, 10, 12]);
        check(3000, &[3, 6, 10, 12]);
        check(u64::MAX, &[0, 64]);
    }

    #[test]
    fn errors_of_scrambles_are_those_of_their_sums() {
        // Sums 3, -1, -2 of two points each have the variance 7, and that of the sum of three is
        // 21.
        let values: [f64; 6] = [1.0, 2.0, -4.0, 3.0, 0.0, -2.0];
        let mean = 21.0_f64.sqrt() / 6.0;
        close(errors(&values, 3), [mean, 2.0 * mean]);
        // With one point per scramble the points count as independent.
        let scatter = (values.iter().map(|x| x * x).sum::<f64>() / 5.0 / 6.0).sqrt();
        close(errors(&values, 6), [scatter, 2.0 * scatter]);
        // Too few points to extrapolate: the same error.
        close(errors(&values, 1), [scatter, 2.0 * scatter]);
    }

    /// Blocks of 4, 8 and 16 of 64 points whose sums are ±1, ±2 and ±4, and all others 0.
    #[test]
    fn errors_of_one_scramble_are_extrapolated_from_its_blocks() {
        let mut values = [0.0; 64];
        for (block, sum) in
            [1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0].repeat(2).iter().enumerate()
        {
            values[4 * block] = *sum;
        }
        // 16, 8 and 4 blocks, with mean 0.
        let average = (16.0 / 15.0 + 4.0 * 8.0 / 7.0 + 16.0 * 4.0 / 3.0) / 3.0;
        let error = f64::sqrt(average) / 64.0;
        // Three doublings from 8 to 64.
        close(errors(&values, 1), [error / 8.0, 2.0 * error]);
        // 68 points: the same, and one block of 4, of 17 with mean 0.
        let more: Vec<f64> = values.into_iter().chain([0.0; 4]).collect();
        let average = (1.0 + 4.0 * 8.0 / 7.0 + 16.0 * 4.0 / 3.0) / 3.0;
        let variance: [f64; 2] = [average / 64.0 + 1.0, 4.0 * (average + 1.0)];
        close(errors(&more, 1), variance.map(|variance| variance.sqrt() / 68.0));
    }
}
