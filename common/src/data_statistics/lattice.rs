//! Rounding of measured velocities.

/// Steps that instruments round to, m/s, in descending order.
const STEPS: [f64; 16] =
    [500.0, 250.0, 200.0, 100.0, 50.0, 25.0, 20.0, 10.0, 5.0, 2.5, 2.0, 1.0, 0.5, 0.25, 0.2, 0.1];
/// Relative deviation from a multiple that reading and writing a number may cause.
const ROUNDING_ERROR: f64 = 1e-9;
/// Smallest number of different velocities that show a step. That all of five are multiples of
/// twice the true step by chance has the probability 1/32, and an error by a factor 2 matters little.
const DIFFERENT_MIN: usize = 5;

/// Returns the step to which velocities (m/s) are rounded, m/s: the largest of which all are
/// multiples. `None` if there is no such step, or fewer than five of them are different.
pub fn rounding(velocities: &[f64]) -> Option<f64> {
    let is_multiple = |velocity: f64, step: f64| {
        let multiple = velocity / step;
        (multiple - multiple.round()).abs() <= ROUNDING_ERROR * multiple.abs()
    };
    let fits = |step: &f64| velocities.iter().all(|&velocity| is_multiple(velocity, *step));
    let step = STEPS.into_iter().find(fits)?;
    let mut ascending = velocities.to_vec();
    ascending.sort_unstable_by(f64::total_cmp);
    ascending.dedup();
    (ascending.len() >= DIFFERENT_MIN).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_common_step_is_found() {
        for (velocities, expected) in [
            (&[3900.0, 3925.0, 3950.0, 3850.0, 4000.0][..], Some(25.0)),
            (&[3900.0, 3925.0, 3950.0, 3850.0, 4000.0, 3901.0], Some(1.0)),
            (&[3900.1, 3925.0, 3950.3, 3850.7, 4000.0], Some(0.1)),
            (&[3902.5, 3925.0, 3950.0, 3850.0, 4007.5], Some(2.5)),
            (&[3900.12, 3925.0, 3950.0, 3850.0, 4000.0], None),
            // Equal ones show no step.
            (&[3900.0, 3900.0, 3900.0, 4000.0, 4000.0, 4100.0], None),
            (&[], None),
        ] {
            assert_eq!(rounding(velocities), expected, "{velocities:?}");
        }
    }
}
