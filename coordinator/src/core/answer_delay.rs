//! How long answers take beside their computation: on the network, and in the queues before the core.
//!
//! A coordinator that is busy with the answers of thousands of workers sees all of them late. That is no
//! reason to have anything computed twice.

use std::time::Duration;

use crate::core::policy::{DELAY_MAX_S, DELAY_WEIGHT};

/// Mean delay of the answers that came last.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct AnswerDelay(f64);

impl AnswerDelay {
    /// Takes in an answer that arrived `waited_s` seconds after its batch was sent, of which its worker
    /// computed for `computed_s`.
    pub(crate) fn learn(&mut self, waited_s: f64, computed_s: f64) {
        let delay = waited_s - computed_s;
        // What is not a number counts as no delay.
        let delay = if delay > 0.0 { delay.min(DELAY_MAX_S) } else { 0.0 };
        self.0 += DELAY_WEIGHT * (delay - self.0);
    }

    /// Returns the mean delay.
    pub(crate) fn mean(self) -> Duration {
        Duration::from_secs_f64(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_delay_follows_the_answers() {
        let mut delay = AnswerDelay::default();
        assert_eq!(delay.mean(), Duration::ZERO);
        (0..200).for_each(|_| delay.learn(0.3, 0.1));
        assert!((delay.mean().as_secs_f64() - 0.2).abs() < 1e-5, "{delay:?}");
        (0..200).for_each(|_| delay.learn(0.1, 0.3));
        assert!(delay.mean().as_secs_f64() < 1e-5, "{delay:?}");
        for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            delay.learn(odd, odd);
            delay.learn(odd, 0.0);
            assert!(delay.mean().as_secs_f64() <= DELAY_MAX_S, "{odd}");
        }
    }
}
