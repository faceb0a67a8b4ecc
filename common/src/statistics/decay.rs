//! The decay along the array: its mean over realizations and over data, and the errors of both.

use crate::data::VelocitySet;
use crate::job::{MonteCarlo, Sampling};
use crate::moments::DecayEstimate;
use crate::outcomes::Outcomes;

use super::blocks::{self, DoublingFactors};
use super::measured::{covariance_of_means, influences_on_logarithms};
use super::sum::Sum;

/// Number, mean and standard deviation of a set of decays.
#[derive(Clone, Copy)]
struct DecayScatter {
    count: f64,
    mean: f64,
    deviation: f64,
}

/// Returns the mean decay of the realizations that succeeded, dB/cm; `None` if there is none, or if the
/// job has no measured decays.
pub fn mean_decay(outcomes: &Outcomes) -> Option<f64> {
    mean(of_successes(outcomes)?).map(|(_, mean)| mean)
}

/// Returns the same with the scatter of the decays, and the standard error by sampling: for independent
/// germs s/√N with division by N - 1, for Sobol' points from the scatter of scrambles or blocks, as for
/// the moments of the velocities.
pub fn decay_estimate(monte_carlo: &MonteCarlo, outcomes: &Outcomes) -> Option<DecayEstimate> {
    let found = scatter(of_successes(outcomes)?)?;
    let standard_error = match monte_carlo.sampling {
        _ if found.count < 2.0 => f64::NAN,
        Sampling::MonteCarlo => found.deviation / (found.count - 1.0).sqrt(),
        Sampling::Sobol => {
            let influence = |(outcome, decay): (&Result<f64, _>, &f64)| match outcome {
                Ok(_) => [decay - found.mean, 0.0],
                Err(_) => [0.0; 2],
            };
            let influences = outcomes.iter().zip(outcomes.decays()?).map(influence);
            let doubling = DoublingFactors::CONTROLLED;
            blocks::standard_error(influences, doubling, monte_carlo, found.count).mean
        }
    };
    let DecayScatter { mean, deviation: standard_deviation, .. } = found;
    Some(DecayEstimate { mean, standard_deviation, standard_error })
}

/// Returns mean and scatter of measured decays, with the standard error of the mean, from the scatter
/// between subjects if these are given; `None` if none were measured.
pub fn measured_decay(set: &VelocitySet<'_>) -> Option<DecayEstimate> {
    let decays = set.decays?;
    let DecayScatter { mean, deviation: standard_deviation, .. } = scatter(decays.iter().copied())?;
    let variance = covariance_of_means(set, decays.iter().map(|decay| [decay - mean]));
    let standard_error = variance.map_or(f64::NAN, |[[variance]]| variance.sqrt());
    Some(DecayEstimate { mean, standard_deviation, standard_error })
}

/// Returns the covariance of (ln v, ln Δ, d/|d|), by the delta method, with the mean d of the measured
/// decays; `None` if none were measured, and where [`super::covariance_of_logarithms`] is.
pub fn covariance_with_decay(set: &VelocitySet<'_>) -> Option<[[f64; 3]; 3]> {
    let decays = set.decays?;
    let (_, mean) = mean(decays.iter().copied())?;
    let logarithms = influences_on_logarithms(set)?;
    let relative = decays.iter().map(|decay| (decay - mean) / mean.abs());
    let influences =
        logarithms.zip(relative).map(|([mean, variation], decay)| [mean, variation, decay]);
    covariance_of_means(set, influences)
}

fn of_successes(outcomes: &Outcomes) -> Option<impl Iterator<Item = f64> + Clone> {
    let decays = outcomes.decays()?;
    Some(
        outcomes.iter().zip(decays).filter(|(outcome, _)| outcome.is_ok()).map(|(_, decay)| *decay),
    )
}

/// Returns number and mean of these values, unless there are none.
fn mean(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (mut sum, mut count) = (Sum::default(), 0_u64);
    for value in values {
        sum.add(value);
        count += 1;
    }
    (count > 0).then(|| (count as f64, sum.total() / count as f64))
}

fn scatter(values: impl Iterator<Item = f64> + Clone) -> Option<DecayScatter> {
    let (count, mean) = mean(values.clone())?;
    let mut squares = Sum::default();
    values.for_each(|value| squares.add((value - mean) * (value - mean)));
    Some(DecayScatter { count, mean, deviation: (squares.total() / count).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::FailureKind;

    fn outcomes(decays: &[f64], failed: usize) -> Outcomes {
        let of = |index: usize| match index == failed {
            true => Err(FailureKind::NoArrival),
            false => Ok(3900.0),
        };
        let outcomes: Outcomes = (0..decays.len()).map(of).collect();
        outcomes.with_decays(Some(decays.into()))
    }

    #[test]
    fn failures_have_no_decay() {
        let found = decay_estimate(&MonteCarlo::default(), &outcomes(&[4.0, 0.0, 6.0, 5.0], 1));
        let found = found.unwrap();
        assert_eq!(found.mean, 5.0);
        assert!((found.standard_deviation - (2.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!((found.standard_error - (1.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert_eq!(mean_decay(&outcomes(&[0.0], 0)), None);
        assert_eq!(mean_decay(&Outcomes::from([Ok(3900.0)])), None);
        assert!(
            decay_estimate(&MonteCarlo::default(), &outcomes(&[4.0], 9))
                .unwrap()
                .standard_error
                .is_nan()
        );
    }

    /// Four scrambles of two points each whose sums are 8, 10, 12 and 10.
    #[test]
    fn the_error_over_scrambles_is_that_of_their_sums() {
        let monte_carlo = MonteCarlo {
            realizations: 8,
            scrambles: 4,
            sampling: Sampling::Sobol,
            ..MonteCarlo::default()
        };
        let found = outcomes(&[3.0, 5.0, 5.5, 4.5, 6.0, 6.0, 4.0, 6.0], 9);
        let found = decay_estimate(&monte_carlo, &found).unwrap();
        let expected = (4.0 * 8.0 / 3.0_f64).sqrt() / 8.0;
        assert!((found.standard_error / expected - 1.0).abs() < 1e-14, "{found:?}");
    }

    /// Decays proportional to the velocities have the relative errors of these.
    #[test]
    fn proportional_decays_have_the_same_errors() {
        let velocities = [3900.0, 3925.0, 3890.0, 3960.0, 3911.0, 3904.0];
        let decays = velocities.map(|velocity| velocity * 1e-3);
        let subjects = [0, 0, 1, 1, 2, 3];
        for subjects in [None, Some(&subjects[..])] {
            let set = VelocitySet {
                decays: Some(&decays),
                subjects,
                ..VelocitySet::independent(&velocities)
            };
            let found = covariance_with_decay(&set).unwrap();
            let expected = crate::statistics::covariance_of_logarithms(&set).unwrap();
            for (i, row) in found.iter().enumerate() {
                for (j, value) in row.iter().enumerate() {
                    let expected = expected[if i == 2 { 0 } else { i }][if j == 2 { 0 } else { j }];
                    assert!((value / expected - 1.0).abs() < 1e-9, "{i} {j}: {value}, {expected}");
                }
            }
            let decay = measured_decay(&set).unwrap();
            assert!((decay.standard_error / decay.mean / found[0][0].sqrt() - 1.0).abs() < 1e-9);
        }
    }
}
