//! Whether measured velocities are independent of their order.
//!
//! Intervals take velocities for independent ones. Repeated measurements of one bone, which stand beside each
//! other in a file, and a device that drifts make neighbours alike.

use crate::moments::OrderTest;
use crate::special::normal_probability;

/// Fewest velocities that are tested: the law of the ratio is nearly normal from here on.
const VELOCITIES_MIN: usize = 10;

/// Tests whether neighbours are more alike than in a random order, by the ratio of von Neumann for ranks (R.
/// Bartels, J. Am. Stat. Assoc. 77 (1982)). `None` for fewer than ten velocities, and for sorted ones, whose
/// order says nothing.
pub fn order_test(velocities: &[f64]) -> Option<OrderTest> {
    if velocities.len() < VELOCITIES_MIN
        || velocities.is_sorted()
        || velocities.iter().rev().is_sorted()
    {
        return None;
    }
    let (n, ranks) = (velocities.len() as f64, ranks(velocities));
    let middle = 0.5 * (n - 1.0);
    let spread: f64 = ranks.iter().map(|rank| (rank - middle) * (rank - middle)).sum();
    let steps: f64 = ranks.windows(2).map(|two| (two[1] - two[0]) * (two[1] - two[0])).sum();
    let ratio = steps / spread;
    // Over all orders the mean is 2.
    let variance = 4.0 * (n - 2.0) * (5.0 * n * n - 2.0 * n - 9.0)
        / (5.0 * n * (n + 1.0) * (n - 1.0) * (n - 1.0));
    Some(OrderTest { ratio, p_value: normal_probability((ratio - 2.0) / variance.sqrt()) })
}

/// Returns the rank of each value, from 0; equal ones share their mean rank.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut places: Vec<usize> = (0..values.len()).collect();
    places.sort_by(|one, other| values[*one].total_cmp(&values[*other]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    for equal in places.chunk_by(|one, other| values[*one] == values[*other]) {
        let mean = first as f64 + 0.5 * (equal.len() - 1) as f64;
        equal.iter().for_each(|place| ranks[*place] = mean);
        first += equal.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::Germs;
    use crate::special::standard_normal_quantile;

    fn normal(seed: u64, count: usize) -> Vec<f64> {
        let germs = (0..).flat_map(|index| *Germs::draw(seed, index).values());
        germs.take(count).map(|u| 3900.0 + 120.0 * standard_normal_quantile(u)).collect()
    }

    #[test]
    fn equal_values_share_a_rank() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0, 3.0]), [3.0, 0.0, 3.0, 1.0, 3.0]);
    }

    #[test]
    fn the_ratio_is_that_of_the_definition() {
        // Ranks 0 and 5, 1 and 6, …: steps of 5 and -4.
        let alternating: Vec<f64> = (0..5).flat_map(|k| [f64::from(k), f64::from(k + 5)]).collect();
        let found = order_test(&alternating).unwrap();
        assert!((found.ratio - (5.0 * 25.0 + 4.0 * 16.0) / 82.5).abs() < 1e-12, "{found:?}");
    }

    /// Checks the fractions of p-values below 0.5, 0.1, 0.05 and 0.01 to three standard deviations and a little:
    /// the law is only nearly normal.
    fn check_p_values(count: usize, step: f64) {
        let of = |seed| {
            let rounded: Vec<f64> =
                normal(seed, count).iter().map(|v| step * (v / step).round()).collect();
            order_test(&rounded).map_or(1.0, |test| test.p_value)
        };
        let found: Vec<f64> = (0..4000).map(of).collect();
        for limit in [0.5, 0.1, 0.05, 0.01_f64] {
            let share = found.iter().filter(|p| **p < limit).count() as f64 / 4000.0;
            let tolerance = 3.0 * (limit * (1.0 - limit) / 4000.0).sqrt() + 0.003;
            assert!((share - limit).abs() < tolerance, "{count}: {share} below {limit}");
        }
    }

    #[test]
    fn p_values_are_uniform_in_a_random_order() {
        for (count, step) in [(10, 1e-3), (20, 1e-3), (20, 50.0), (200, 1e-3)] {
            check_p_values(count, step);
        }
    }

    #[test]
    fn repeated_measurements_and_drift_are_seen() {
        let (bones, errors) = (normal(1, 30), normal(2, 90));
        let repeated: Vec<f64> =
            (0..90).map(|k| bones[k / 3] + 0.2 * (errors[k] - 3900.0)).collect();
        assert!(order_test(&repeated).unwrap().p_value < 1e-6);
        let drifting: Vec<f64> = (0..90).map(|k| errors[k] + 4.0 * k as f64).collect();
        assert!(order_test(&drifting).unwrap().p_value < 1e-3);
    }

    #[test]
    fn sorted_files_say_nothing() {
        let ascending: Vec<f64> = (0..20).map(f64::from).collect();
        let descending: Vec<f64> = ascending.iter().rev().copied().collect();
        for velocities in [&ascending[..], &descending, &[1.0; 20], &[1.0, 3.0, 2.0]] {
            assert_eq!(order_test(velocities), None);
        }
    }
}
