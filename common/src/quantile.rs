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
pub fn estimated_error(mut errors: Vec<f64>) -> Option<EstimatedError> {
    let largest = errors.iter().copied().max_by(f64::total_cmp)?;
    let (below, fraction) = place(errors.len() - 1, 0.5);
    // The others need no order: there may be millions of them.
    let (_, &mut low, above) = errors.select_nth_unstable_by(below, f64::total_cmp);
    let high = above.iter().copied().min_by(f64::total_cmp).unwrap_or(low);
    Some(EstimatedError { median: between(low, high, fraction), largest })
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
            let found = estimated_error(errors);
            assert_eq!(found, expected);
        }
        assert_eq!(estimated_error(vec![]), None);
        // The same bits as from a sorted list, whatever the count.
        for count in 1..40_u32 {
            let errors: Vec<f64> =
                (0..count).map(|i| 1e-5 * f64::from(i * 37 % 41) / f64::from(1 + i % 3)).collect();
            let mut sorted = errors.clone();
            sorted.sort_by(f64::total_cmp);
            let found = estimated_error(errors).unwrap();
            let expected = [quantile(&sorted, 0.5).unwrap(), sorted[sorted.len() - 1]];
            assert_eq!([found.median, found.largest].map(f64::to_bits), expected.map(f64::to_bits));
        }
    }
}
