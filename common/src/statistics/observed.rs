//! Observables besides the velocity: their means over realizations and over data, and the errors of both.

use crate::data::{Data, VelocitySet};
use crate::job::{MonteCarlo, Sampling};
use crate::moments::{
    ComparedMoments, MomentMatrix, ObservableEstimate, ObservableEstimates, moment_vector,
};
use crate::observables::ObservableValues;
use crate::outcomes::Outcomes;

use super::blocks::{self, DoublingFactors};
use super::measured::{covariance_of_means, influences_on_logarithms};
use super::sum::Sum;

/// Number, mean and standard deviation of a set of values.
#[derive(Clone, Copy)]
struct ValueScatter {
    count: f64,
    mean: f64,
    deviation: f64,
}

/// Returns the mean of each observable of these outcomes over the realizations that succeeded, unless
/// none did.
pub fn observable_means(outcomes: &Outcomes) -> ObservableValues {
    outcomes.observables().map(|values| {
        let values = successes(outcomes, values?);
        mean(values).map(|(_, mean)| mean)
    })
}

/// Returns the same with the scatter of the values, and the standard error by sampling: for independent
/// germs s/√N with division by N - 1, for Sobol' points from the scatter of scrambles or blocks, as for
/// the moments of the velocities.
pub fn observable_estimates(monte_carlo: &MonteCarlo, outcomes: &Outcomes) -> ObservableEstimates {
    outcomes.observables().map(|values| estimate(monte_carlo, outcomes, values?))
}

fn estimate(
    monte_carlo: &MonteCarlo,
    outcomes: &Outcomes,
    values: &[f64],
) -> Option<ObservableEstimate> {
    let found = scatter(successes(outcomes, values))?;
    let standard_error = match monte_carlo.sampling {
        _ if found.count < 2.0 => f64::NAN,
        Sampling::MonteCarlo => found.deviation / (found.count - 1.0).sqrt(),
        Sampling::Sobol => {
            let influence = |(outcome, value): (&Result<f64, _>, &f64)| match outcome {
                Ok(_) => [value - found.mean, 0.0],
                Err(_) => [0.0; 2],
            };
            let influences = outcomes.iter().zip(values).map(influence);
            let doubling = DoublingFactors::CONTROLLED;
            blocks::standard_error(influences, doubling, monte_carlo, found.count).mean
        }
    };
    let ValueScatter { mean, deviation: standard_deviation, .. } = found;
    Some(ObservableEstimate { mean, standard_deviation, standard_error })
}

impl Data {
    /// Returns the moments of a set, by its number, in which a model is compared with it.
    pub fn compared(&self, set: usize) -> ComparedMoments {
        let measured = self.set(set).map(|set| set.observables).unwrap_or_default();
        let observables = measured.map(|values| mean_of(values?));
        ComparedMoments { velocities: self.moments(set), observables }
    }
}

/// Returns mean and scatter of each measured observable, with the standard error of the mean, from the
/// scatter between subjects if these are given.
pub fn measured_observables(set: &VelocitySet<'_>) -> ObservableEstimates {
    set.observables.map(|values| {
        let values = values?;
        let ValueScatter { mean, deviation: standard_deviation, .. } =
            scatter(values.iter().copied())?;
        let variance = covariance_of_means(set, values.iter().map(|value| [value - mean]));
        let standard_error = variance.map_or(f64::NAN, |[[variance]]| variance.sqrt());
        Some(ObservableEstimate { mean, standard_deviation, standard_error })
    })
}

/// Returns the covariance of a set's compared moments (ln v, ln Δ, and of each measured observable its
/// mean relative to that of the data), by the delta method; `None` where
/// [`super::covariance_of_logarithms`] is.
pub fn covariance_of_moments(set: &VelocitySet<'_>) -> Option<MomentMatrix> {
    let logarithms = influences_on_logarithms(set)?;
    let measured = set.observables.map(|values| Some((values?, mean_of(values?)?)));
    let influences = logarithms.enumerate().map(|(index, of_velocity)| {
        moment_vector(of_velocity, |observable| match measured[observable] {
            Some((values, mean)) => (values[index] - mean) / mean.abs(),
            None => 0.0,
        })
    });
    covariance_of_means(set, influences)
}

fn successes<'a>(
    outcomes: &'a Outcomes,
    values: &'a [f64],
) -> impl Iterator<Item = f64> + Clone + 'a {
    outcomes.iter().zip(values).filter(|(outcome, _)| outcome.is_ok()).map(|(_, value)| *value)
}

fn mean_of(values: &[f64]) -> Option<f64> {
    mean(values.iter().copied()).map(|(_, mean)| mean)
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

fn scatter(values: impl Iterator<Item = f64> + Clone) -> Option<ValueScatter> {
    let (count, mean) = mean(values.clone())?;
    let mut squares = Sum::default();
    values.for_each(|value| squares.add((value - mean) * (value - mean)));
    Some(ValueScatter { count, mean, deviation: (squares.total() / count).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observables::{Observable, PerObservable};
    use crate::outcome::FailureKind;

    fn outcomes(decays: &[f64], failed: usize) -> Outcomes {
        let of = |index: usize| match index == failed {
            true => Err(FailureKind::NoArrival),
            false => Ok(3900.0),
        };
        let outcomes: Outcomes = (0..decays.len()).map(of).collect();
        let mut columns = PerObservable::default();
        columns[Observable::Decay] = Some(decays.to_vec());
        outcomes.with_observables(columns)
    }

    fn estimate(monte_carlo: &MonteCarlo, outcomes: &Outcomes) -> ObservableEstimate {
        observable_estimates(monte_carlo, outcomes)[Observable::Decay].unwrap()
    }

    #[test]
    fn failures_have_no_decay() {
        let found = estimate(&MonteCarlo::default(), &outcomes(&[4.0, 0.0, 6.0, 5.0], 1));
        assert_eq!(found.mean, 5.0);
        assert!((found.standard_deviation - (2.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!((found.standard_error - (1.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert_eq!(observable_means(&outcomes(&[0.0], 0)), PerObservable::default());
        let without = Outcomes::from([Ok(3900.0)]);
        assert_eq!(observable_means(&without), PerObservable::default());
        let one = estimate(&MonteCarlo::default(), &outcomes(&[4.0], 9));
        assert!(one.standard_error.is_nan());
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
        let found = estimate(&monte_carlo, &found);
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
            let mut set = VelocitySet { subjects, ..VelocitySet::independent(&velocities) };
            set.observables[Observable::Decay] = Some(&decays);
            let all = covariance_of_moments(&set).unwrap();
            let axes = [0, 1, 2 + Observable::Decay as usize];
            let found = axes.map(|i| axes.map(|j| all[i][j]));
            let expected = crate::statistics::covariance_of_logarithms(&set).unwrap();
            for (i, row) in found.iter().enumerate() {
                for (j, value) in row.iter().enumerate() {
                    let expected = expected[if i == 2 { 0 } else { i }][if j == 2 { 0 } else { j }];
                    assert!((value / expected - 1.0).abs() < 1e-9, "{i} {j}: {value}, {expected}");
                }
            }
            let decay = measured_observables(&set)[Observable::Decay].unwrap();
            assert!((decay.standard_error / decay.mean / found[0][0].sqrt() - 1.0).abs() < 1e-9);
        }
    }
}
