//! Quantiles of a sample.

use crate::moments::EstimatedError;

/// Returns the quantile of probability `p` (0 to 1) of numbers in ascending order, linear between
/// neighbours (Hyndman and Fan's definition 7: the median of an even count is the mean of the two
/// middle values); `None` for no numbers.
pub fn quantile(ascending: &[f64], p: f64) -> Option<f64> {
    let last = ascending.len().checked_sub(1)?;
    let position = p.clamp(0.0, 1.0) * last as f64;
    let below = (position.floor() as usize).min(last);
    let above = (below + 1).min(last);
    let (low, high) = (ascending[below], ascending[above]);
    // The difference of infinite neighbours would be NaN, and is not needed.
    let fraction = position - below as f64;
    Some(if fraction == 0.0 || low == high { low } else { fraction.mul_add(high - low, low) })
}

/// Returns median and largest of the estimated errors of a set, in any order; `None` if there are
/// none.
pub fn estimated_error(mut errors: Vec<f64>) -> Option<EstimatedError> {
    errors.sort_unstable_by(f64::total_cmp);
    Some(EstimatedError { median: quantile(&errors, 0.5)?, largest: *errors.last()? })
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
    }
}
