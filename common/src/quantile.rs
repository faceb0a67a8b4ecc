//! Quantiles of a sample.

use crate::moments::EstimatedError;

/// Returns the quantile of probability `p` (0 to 1) of numbers in ascending order, linear between
/// neighbours (Hyndman and Fan's definition 7: the median of an even count is the mean of the two
/// middle values); `None` for no numbers.
pub fn quantile(ascending: &[f64], p: f64) -> Option<f64> {
    let last = ascending.len().checked_sub(1)?;
    let (below, fraction) = place(last, p);
    Some(between(ascending[below], ascending[(below + 1).min(last)], fraction))
}

/// Returns median and largest of the estimated errors of a set, in any order; `None` if there are
/// none.
pub fn estimated_error(errors: impl Iterator<Item = f64> + Clone) -> Option<EstimatedError> {
    let is_small = errors.size_hint().1.is_some_and(|most| most <= SMALL_MAX);
    let sifted = if is_small { Sifted::all(errors) } else { Sifted::around_median(errors) };
    let Sifted { mut numbers, before, count, largest } = sifted?;
    let (below, fraction) = place(count - 1, 0.5);
    let (_, &mut low, above) = numbers.select_nth_unstable_by(below - before, f64::total_cmp);
    let high = above.iter().copied().min_by(f64::total_cmp).unwrap_or(low);
    Some(EstimatedError { median: between(low, high, fraction), largest })
}

/// Size up to which a set is copied to find its median.
const SMALL_MAX: usize = 1 << 16;
/// First bits of a number that select its bin: sign, exponent and the first of the fraction.
const BIN_BITS: u32 = 16;

/// Some numbers of a set, among them the one or two in its middle, of which the median is computed. The others
/// are only counted: there may be millions of them.
struct Sifted {
    /// In any order.
    numbers: Vec<f64>,
    /// Number of smaller ones.
    before: usize,
    /// Size of the set.
    count: usize,
    /// Largest number of the set.
    largest: f64,
}

impl Sifted {
    fn all(numbers: impl Iterator<Item = f64>) -> Option<Self> {
        let numbers: Vec<f64> = numbers.collect();
        let largest = numbers.iter().copied().max_by(f64::total_cmp)?;
        Some(Self { before: 0, count: numbers.len(), largest, numbers })
    }

    fn around_median(numbers: impl Iterator<Item = f64> + Clone) -> Option<Self> {
        let mut counts = vec![0_usize; 1 << BIN_BITS];
        let mut largest = 0;
        for number in numbers.clone() {
            let ascending = ascending(number);
            counts[bin(ascending)] += 1;
            largest = largest.max(ascending);
        }
        let count: usize = counts.iter().sum();
        let (below, _) = place(count.checked_sub(1)?, 0.5);
        let (first, before) = bin_of(&counts, below);
        let (last, _) = bin_of(&counts, (below + 1).min(count - 1));
        let is_near = |number: &f64| (first..=last).contains(&bin(ascending(*number)));
        let mut near = Vec::with_capacity(counts[first..=last].iter().sum());
        near.extend(numbers.filter(is_near));
        Some(Self { numbers: near, before, count, largest: of_ascending(largest) })
    }
}

/// Returns an integer that is larger for a larger number.
fn ascending(number: f64) -> u64 {
    let bits = number.to_bits();
    // The bits of negative numbers, as an integer, are larger for a smaller number.
    if number.is_sign_negative() { !bits } else { bits | SIGN }
}

/// Returns the number of an integer from [`ascending`].
fn of_ascending(integer: u64) -> f64 {
    f64::from_bits(if integer < SIGN { !integer } else { integer & !SIGN })
}

/// The bit of the sign.
const SIGN: u64 = 1 << 63;

/// Returns the bin of a number, from its [`ascending`] integer: a larger one is in the same bin or in a later
/// one.
fn bin(ascending: u64) -> usize {
    (ascending >> (u64::BITS - BIN_BITS)) as usize
}

/// Returns the bin of the number with this index in ascending order, and the number of numbers in
/// earlier bins.
fn bin_of(counts: &[usize], index: usize) -> (usize, usize) {
    let mut before = 0;
    for (bin, count) in counts.iter().enumerate() {
        if before + count > index {
            return (bin, before);
        }
        before += count;
    }
    (counts.len(), before)
}

/// Returns the index below the quantile of probability `p`, given the last index, and how far the
/// quantile is from there to the next.
fn place(last: usize, p: f64) -> (usize, f64) {
    let position = p.clamp(0.0, 1.0) * last as f64;
    let below = (position.floor() as usize).min(last);
    (below, position - below as f64)
}

/// Returns the number at this fraction of the way from `low` to `high`.
fn between(low: f64, high: f64, fraction: f64) -> f64 {
    // The difference of infinite neighbours would be NaN, and is not needed.
    if fraction == 0.0 || low == high { low } else { fraction.mul_add(high - low, low) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_neighbours() {
        let four = [1.0, 2.0, 4.0, 8.0];
        for (ascending, p, expected) in [
            (&four[..], 0.0, Some(1.0)),
            (&four, 0.5, Some(3.0)),
            (&four, 0.75, Some(5.0)),
            (&four, 1.0, Some(8.0)),
            (&four, 2.0, Some(8.0)),
            (&four[..3], 0.5, Some(2.0)),
            (&four[..1], 0.99, Some(1.0)),
            (&[], 0.5, None),
            (&[1.0, f64::INFINITY], 0.0, Some(1.0)),
            (&[f64::INFINITY, f64::INFINITY], 0.5, Some(f64::INFINITY)),
        ] {
            assert_eq!(quantile(ascending, p), expected, "{p} of {ascending:?}");
        }
    }

    #[test]
    fn errors_need_no_order() {
        let expected = Some(EstimatedError { median: 2.5e-5, largest: 4e-4 });
        for errors in [vec![4e-4, 1e-5, 2e-5, 3e-5], vec![1e-5, 2e-5, 3e-5, 4e-4]] {
            let found = estimated_error(errors.into_iter());
            assert_eq!(found, expected);
        }
        assert_eq!(estimated_error([].into_iter()), None);
        // The same bits as from a sorted list, whatever the count.
        for count in 1..40_u32 {
            let errors: Vec<f64> =
                (0..count).map(|i| 1e-5 * f64::from(i * 37 % 41) / f64::from(1 + i % 3)).collect();
            let mut sorted = errors.clone();
            sorted.sort_by(f64::total_cmp);
            let expected = [quantile(&sorted, 0.5).unwrap(), sorted[sorted.len() - 1]];
            let all = errors.iter().copied();
            let found = estimated_error(all).unwrap();
            assert_eq!([found.median, found.largest].map(f64::to_bits), expected.map(f64::to_bits));
        }
    }

    #[test]
    fn the_median_of_many_is_that_of_a_sorted_list() {
        let number = |i: usize| 1e-5 * (i * 7919 % 100_003) as f64 / (1 + i % 3) as f64;
        let constant = |_: usize| 2e-5;
        // Two halves far apart: the two numbers in the middle are in different bins.
        let halves = |i: usize| if i.is_multiple_of(2) { 1e-7 } else { 0.5 };
        let signed = |i: usize| number(i) - 0.1;
        let kinds: [&dyn Fn(usize) -> f64; 4] = [&number, &constant, &halves, &signed];
        for (kind, of) in kinds.iter().enumerate() {
            for count in [SMALL_MAX - 1, SMALL_MAX + 1, SMALL_MAX + 2] {
                let mut sorted: Vec<f64> = (0..count).map(of).collect();
                let found = estimated_error(sorted.clone().into_iter()).unwrap();
                sorted.sort_by(f64::total_cmp);
                let expected = [quantile(&sorted, 0.5).unwrap(), sorted[count - 1]];
                let found = [found.median, found.largest];
                assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits), "{kind} {count}");
            }
        }
    }
}
