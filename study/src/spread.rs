//! Summary statistics of many differences between solutions.

use osteon_common::quantile::quantile;
use osteon_solver::check::Difference;
use osteon_solver::{Arrival, Failure};

/// Summary statistics of many differences.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DifferenceSummary {
    /// Relative differences of velocities, ascending.
    velocities: Vec<f64>,
    /// Largest difference of picked times, s.
    pub(crate) largest_time: Option<f64>,
    /// Number of different picks.
    pub(crate) different_picks: usize,
}

impl DifferenceSummary {
    pub(crate) fn new(differences: &[Difference]) -> Self {
        let mut velocities: Vec<f64> =
            differences.iter().filter_map(|difference| difference.velocity()).collect();
        velocities.sort_unstable_by(f64::total_cmp);
        let times = differences.iter().filter_map(|difference| difference.time());
        Self {
            velocities,
            largest_time: times.reduce(f64::max),
            different_picks: differences.iter().filter(|&&it| it == Difference::Picks).count(),
        }
    }

    /// Returns a quantile of the relative differences of velocities.
    pub(crate) fn velocity(&self, p: f64) -> Option<f64> {
        quantile(&self.velocities, p)
    }
}

/// Returns whether two velocities differ by no more than both state; `None` without two velocities.
pub(crate) fn keeps_stated_errors(
    difference: Difference,
    outcomes: [&Result<Arrival, Failure>; 2],
) -> Option<bool> {
    let error = difference.velocity()?;
    let [one, other] = outcomes.map(|outcome| outcome.as_ref().ok());
    Some(error <= one?.estimated_error + other?.estimated_error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_counts_picks_apart() {
        let numbers = |velocity, time| Difference::Numbers { velocity, time };
        let spread = DifferenceSummary::new(&[
            numbers(3e-5, 1e-10),
            Difference::Picks,
            numbers(1e-5, 4e-10),
            Difference::BothFailed,
        ]);
        assert_eq!(spread.velocity(1.0), Some(3e-5));
        assert_eq!(spread.velocity(0.0), Some(1e-5));
        assert_eq!((spread.largest_time, spread.different_picks), (Some(4e-10), 1));
        assert_eq!(DifferenceSummary::new(&[Difference::Picks]).velocity(0.5), None);
    }
}
