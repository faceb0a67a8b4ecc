//! Durations computed from what workers report, which may be any number.

use std::time::Duration;

use crate::core::policy::DURATION_MAX;

/// Returns the duration of so many seconds, or [`DURATION_MAX`] if they are more, negative or not a
/// number.
pub(crate) fn bounded_duration(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(DURATION_MAX).min(DURATION_MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_that_cannot_be_are_bounded() {
        assert_eq!(bounded_duration(2.0), Duration::from_secs(2));
        for seconds in [f64::NAN, f64::INFINITY, 1e300, -1.0] {
            assert_eq!(bounded_duration(seconds), DURATION_MAX, "{seconds}");
        }
    }
}
