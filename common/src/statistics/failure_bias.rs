//! Estimate of the bias that failed realizations may have caused in the moments.
//!
//! A failed realization has no velocity V, but W = √(c1111/ρ) of its tensor is known from its
//! germs, and W explains nearly all of V. Therefore each failed one is given the velocity that the
//! regression of V on W and W², over the successes, has at its own W. The difference between the
//! moments of all velocities, including the estimated ones, and those of the successes is the size
//! of the possible bias. It is only an indication of the size, since a bone whose first arrival
//! cannot be found need not have the velocity of similar bones.

use super::central::central;
use super::sum::Sum;
use crate::job::MonteCarlo;
use crate::outcome::Outcome;
use crate::parameters::Point;
use crate::realization::Ensemble;
use crate::results::Moments;

/// Number of realizations, the first ones, to which the regression is fitted. Of more than these it
/// would cost as much as everything else that is done with an evaluation, and change an indication
/// of the size by less than a hundredth of itself.
const FITTED_MAX: usize = 1 << 16;

/// Minimum number of successes for a parabola that is more than a fit of their noise.
const SUCCESSES_MIN: usize = 10;

/// Returns the moments that all realizations would have, by the regression of the velocity on
/// √(c1111/ρ), minus those of the successes; 0 if none failed, `None` if it is unknown: for fewer
/// than ten successes among the first 65,536 realizations, or if all speeds are equal.
pub fn failure_bias(
    monte_carlo: &MonteCarlo,
    point: &Point,
    outcomes: &[Outcome],
) -> Option<Moments> {
    let successes = outcomes.iter().filter_map(|outcome| outcome.ok());
    let found = central(successes.clone())?.moments();
    if successes.count() == outcomes.len() {
        return Some(Moments { mean: 0.0, coefficient_of_variation: 0.0 });
    }
    let fitted = &outcomes[..outcomes.len().min(FITTED_MAX)];
    if fitted.iter().filter(|outcome| outcome.is_ok()).count() < SUCCESSES_MIN {
        return None;
    }
    let ensemble = Ensemble::drawn(point, monte_carlo.germs()).ok()?;
    let speeds: Vec<f64> = ensemble.longitudinal_speeds(fitted.len() as u64).collect();
    let completed = Parabola::fit(fitted, &speeds)?
        .completed(outcomes, |index| ensemble.longitudinal_speed(index as u64));
    let bias = Moments {
        mean: completed.mean - found.mean,
        coefficient_of_variation: completed.coefficient_of_variation
            - found.coefficient_of_variation,
    };
    let known = bias.mean.is_finite() && bias.coefficient_of_variation.is_finite();
    known.then_some(bias)
}

/// V by regression on the standardised speed t and on t² - γ t - 1, orthogonal over the successes.
struct Parabola {
    /// Mean and standard deviation of the successes' speeds, m/s.
    speed: (f64, f64),
    /// γ, the skewness of the successes' speeds.
    skewness: f64,
    /// Coefficients of 1, t and t² - γ t - 1, m/s.
    coefficients: [f64; 3],
    /// Mean square of the residuals, m²/s².
    residual: f64,
}

impl Parabola {
    fn fit(outcomes: &[Outcome], speeds: &[f64]) -> Option<Self> {
        let pairs = || {
            let pairs = outcomes.iter().zip(speeds);
            pairs.filter_map(|(outcome, &speed)| outcome.ok().map(|velocity| (velocity, speed)))
        };
        let law = central(pairs().map(|(_, speed)| speed).collect::<Vec<_>>().into_iter())?;
        let Moments { mean, coefficient_of_variation } = law.moments();
        let deviation = mean * coefficient_of_variation;
        if deviation.is_nan() || deviation <= 0.0 {
            return None;
        }
        let mut fit =
            Self { speed: (mean, deviation), skewness: 0.0, coefficients: [0.0; 3], residual: 0.0 };
        fit.skewness = average(pairs().map(|(_, speed)| {
            let t = (speed - mean) / deviation;
            t * t * t
        }));
        let basis = |speed| fit.basis(speed);
        let coefficients = [0, 1, 2].map(|k| {
            let product = average(pairs().map(|(velocity, speed)| velocity * basis(speed)[k]));
            let square = average(pairs().map(|(_, speed)| basis(speed)[k] * basis(speed)[k]));
            // For two different speeds t² is a linear function of t.
            if square > 1e-9 { product / square } else { 0.0 }
        });
        fit.coefficients = coefficients;
        fit.residual = average(pairs().map(|(velocity, speed)| {
            let rest = velocity - fit.velocity(speed);
            rest * rest
        }));
        Some(fit)
    }

    fn basis(&self, speed: f64) -> [f64; 3] {
        let t = (speed - self.speed.0) / self.speed.1;
        [1.0, t, t * (t - self.skewness) - 1.0]
    }

    fn velocity(&self, speed: f64) -> f64 {
        let terms = self.basis(speed).into_iter().zip(self.coefficients);
        terms.map(|(basis, coefficient)| basis * coefficient).sum()
    }

    /// Returns the moments of all realizations, where failed ones have the parabola's velocity and
    /// the scatter of its residuals.
    fn completed(&self, outcomes: &[Outcome], speed: impl Fn(usize) -> f64) -> Moments {
        let failed = outcomes.iter().enumerate().filter(|(_, outcome)| outcome.is_err());
        let expected: Vec<f64> = failed.map(|(index, _)| self.velocity(speed(index))).collect();
        let all = || {
            let mut expected = expected.iter();
            outcomes.iter().map(move |outcome| match outcome {
                Ok(velocity) => (*velocity, 0.0),
                Err(_) => (expected.next().copied().unwrap_or(f64::NAN), self.residual),
            })
        };
        let mean = average(all().map(|(velocity, _)| velocity));
        let square =
            |(velocity, scatter): (f64, f64)| (velocity - mean).mul_add(velocity - mean, scatter);
        let variance = average(all().map(square));
        Moments { mean, coefficient_of_variation: variance.sqrt() / mean }
    }
}

fn average(values: impl Iterator<Item = f64>) -> f64 {
    let mut sum = Sum::default();
    let mut count = 0_u64;
    for value in values {
        sum.add(value);
        count += 1;
    }
    sum.total() / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::FailureKind;
    use crate::statistics::moments;

    const POINT: Point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.3]);

    /// Velocities that are a parabola of the speed; realizations with a speed below `least` failed.
    fn outcomes(count: u64, least: f64) -> (Vec<f64>, Vec<Outcome>) {
        let ensemble = Ensemble::drawn(&POINT, MonteCarlo::default().germs()).unwrap();
        let velocity = |speed: f64| 100.0 + 0.9 * speed + 1e-5 * speed * speed;
        let speeds: Vec<f64> = ensemble.longitudinal_speeds(count).collect();
        let outcome = |&speed: &f64| {
            if speed < least { Err(FailureKind::NoArrival) } else { Ok(velocity(speed)) }
        };
        let outcomes = speeds.iter().map(outcome).collect();
        (speeds.into_iter().map(velocity).collect(), outcomes)
    }

    #[test]
    fn what_the_speed_explains_comes_back() {
        let (all, outcomes) = outcomes(300, 3500.0);
        let failed = outcomes.iter().filter(|outcome| outcome.is_err()).count();
        assert!((5..60).contains(&failed), "{failed}");
        let successes: Vec<f64> = outcomes.iter().filter_map(|outcome| outcome.ok()).collect();
        let bias = failure_bias(&MonteCarlo::default(), &POINT, &outcomes).unwrap();
        let (all, found) = (moments(&all).unwrap(), moments(&successes).unwrap());
        let mean = all.mean - found.mean;
        let variation = all.coefficient_of_variation - found.coefficient_of_variation;
        assert!((bias.mean - mean).abs() < 1e-9 * all.mean, "{bias:?}, {mean}");
        assert!((bias.coefficient_of_variation - variation).abs() < 1e-10, "{bias:?}, {variation}");
        assert!(mean < -10.0 && variation > 1e-3, "{mean} {variation}");
    }

    /// The velocities scatter about the parabola by a tenth of their own scatter.
    #[test]
    fn the_first_realizations_are_enough_for_the_regression() {
        let count = 4 * FITTED_MAX;
        let (all, outcomes) = outcomes(count as u64, 3500.0);
        let spread = moments(&all).unwrap();
        let tenth = 0.1 * spread.mean * spread.coefficient_of_variation;
        let noise =
            |index: usize| f64::from((index as u32).wrapping_mul(2_654_435_769)) / 2e9 - 1.0;
        let scattered = outcomes.iter().enumerate();
        let outcomes: Vec<Outcome> =
            scattered.map(|(i, outcome)| outcome.map(|v| v + tenth * noise(i))).collect();
        let ensemble = Ensemble::drawn(&POINT, MonteCarlo::default().germs()).unwrap();
        let speeds: Vec<f64> = ensemble.longitudinal_speeds(count as u64).collect();
        let of_all = Parabola::fit(&outcomes, &speeds).unwrap().completed(&outcomes, |i| speeds[i]);
        let successes: Vec<f64> = outcomes.iter().filter_map(|outcome| outcome.ok()).collect();
        let found = moments(&successes).unwrap();
        let bias = failure_bias(&MonteCarlo::default(), &POINT, &outcomes).unwrap();
        let expected = [
            of_all.mean - found.mean,
            of_all.coefficient_of_variation - found.coefficient_of_variation,
        ];
        for (bias, expected) in [bias.mean, bias.coefficient_of_variation].into_iter().zip(expected)
        {
            assert!((bias / expected - 1.0).abs() < 0.01, "{bias} {expected}");
            assert_ne!(bias, expected, "the regression was fitted to all");
        }
    }

    #[test]
    fn without_failures_there_is_no_bias_and_with_few_successes_it_is_not_known() {
        let of = |outcomes: &[Outcome]| failure_bias(&MonteCarlo::default(), &POINT, outcomes);
        let none = Some(Moments { mean: 0.0, coefficient_of_variation: 0.0 });
        let (_, mut outcomes) = outcomes(11, 0.0);
        assert_eq!(of(&outcomes), none);
        assert_eq!(of(&outcomes[..1]), none);
        outcomes[3] = Err(FailureKind::NotFinite);
        assert!(of(&outcomes).is_some_and(|bias| bias.mean.abs() > 0.0));
        assert_eq!(of(&outcomes[..10]), None);
        assert_eq!(of(&[Err(FailureKind::NoArrival); 20]), None);
        assert_eq!(of(&[]), None);
    }
}
