//! Moments by regression on a control variate.
//!
//! W = √(c1111/ρ) of the realization's own tensor explains nearly all of its velocity V, and its
//! law has mean and variance in closed form. With β the slope of the regression of V on W over the
//! sample and R the residuals,
//!
//! v = V̄ + β (E W - W̄),        variance = β² Var W + (1/N) Σ R²
//!
//! (S. Asmussen and P. W. Glynn, "Stochastic Simulation" (2007), Sec. V.2; the variance is the law
//! of total variance of the linear prediction). β itself is estimated from the sample: that is of
//! second order in v, and included in the error of the variance.

use super::sum::Sum;
use crate::job::MonteCarlo;
use crate::outcome::Outcome;
use crate::parameters::Point;
use crate::realization::Ensemble;
use crate::results::Moments;

/// Minimum number of realizations of a regression with residuals.
const REALIZATIONS_MIN: usize = 3;
/// Number of parameters that the regression estimates from the sample.
const FITTED: f64 = 2.0;

/// A sample with its regression.
pub(super) struct Controlled {
    /// The moments.
    pub(super) moments: Moments,
    velocities: Vec<f64>,
    /// W of each realization, m/s.
    speeds: Vec<f64>,
    /// V̄, m/s.
    velocity: f64,
    /// W̄, m/s.
    speed: f64,
    /// β.
    slope: f64,
    /// (1/N) Σ R², m²/s².
    residual: f64,
    /// β² Var W + (1/N) Σ R², m²/s².
    variance: f64,
    /// 2 β Var W divided by the sample's variance of W.
    gain: f64,
}

impl Controlled {
    /// Returns the regression, if it is requested and possible. It requires every realization, as
    /// the moments of W over the successes alone are not known.
    pub(super) fn new(
        monte_carlo: &MonteCarlo,
        point: &Point,
        outcomes: &[Outcome],
    ) -> Option<Self> {
        if !monte_carlo.control_variate || outcomes.len() < REALIZATIONS_MIN {
            return None;
        }
        let velocities: Vec<f64> =
            outcomes.iter().map(|outcome| outcome.ok()).collect::<Option<_>>()?;
        let ensemble = Ensemble::drawn(point, monte_carlo.germs()).ok()?;
        let speeds: Vec<f64> = ensemble.longitudinal_speeds(outcomes.len() as u64).collect();
        Self::fit(velocities, speeds, ensemble.longitudinal_speed_moments())
    }

    /// Returns the regression, given mean and variance of W under its law; `None` if W is constant.
    fn fit(velocities: Vec<f64>, speeds: Vec<f64>, law: (f64, f64)) -> Option<Self> {
        let count = velocities.len() as f64;
        let mean_of = |values: &mut dyn Iterator<Item = f64>| {
            let mut sum = Sum::default();
            values.for_each(|value| sum.add(value));
            sum.total() / count
        };
        let velocity = mean_of(&mut velocities.iter().copied());
        let speed = mean_of(&mut speeds.iter().copied());
        let deviations = || velocities.iter().zip(&speeds).map(|(v, w)| (v - velocity, w - speed));
        let square = mean_of(&mut deviations().map(|(_, w)| w * w));
        let product = mean_of(&mut deviations().map(|(v, w)| v * w));
        let slope = product / square;
        let rest = |(v, w): (f64, f64)| v - slope * w;
        let residual = mean_of(&mut deviations().map(|pair| rest(pair) * rest(pair)));
        let (law_mean, law_variance) = law;
        let mean = velocity + slope * (law_mean - speed);
        let variance = slope * slope * law_variance + residual;
        let moments = Moments { mean, coefficient_of_variation: variance.sqrt() / mean };
        let gain = 2.0 * slope * law_variance / square;
        // Not sound if all speeds are equal, or if numbers are out of scale.
        let sound = variance > 0.0 && gain.is_finite() && moments.coefficient_of_variation > 0.0;
        sound.then_some(Self {
            moments,
            velocities,
            speeds,
            velocity,
            speed,
            slope,
            residual,
            variance,
            gain,
        })
    }

    /// Returns the influence of each realization on N times mean and coefficient of variation, to
    /// first order, in index order.
    pub(super) fn influences(&self) -> impl Iterator<Item = [f64; 2]> {
        let Moments { mean, coefficient_of_variation: variation } = self.moments;
        self.velocities.iter().zip(&self.speeds).map(move |(velocity, speed)| {
            let speed = speed - self.speed;
            let rest = velocity - self.velocity - self.slope * speed;
            let variance = (self.gain * speed).mul_add(rest, rest * rest - self.residual);
            [rest, variation * (0.5 * variance / self.variance - rest / mean)]
        })
    }

    /// Returns the standard errors for independent realizations.
    pub(super) fn standard_error(&self) -> Moments {
        let mut squares = [Sum::default(); 2];
        for influence in self.influences() {
            for (sum, value) in squares.iter_mut().zip(influence) {
                sum.add(value * value);
            }
        }
        let count = self.velocities.len() as f64;
        let [mean, coefficient_of_variation] =
            squares.map(|sum| (sum.total() / (count - FITTED) / count).sqrt());
        Moments { mean, coefficient_of_variation }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::Germs;
    use crate::outcome::FailureKind;
    use crate::statistics::{estimate, moments};

    const OPTIMUM: Point =
        Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);

    fn asked(seed: u64) -> MonteCarlo {
        MonteCarlo { seed, control_variate: true, ..MonteCarlo::default() }
    }

    fn ensemble(seed: u64) -> Ensemble {
        Ensemble::drawn(&OPTIMUM, asked(seed).germs()).unwrap()
    }

    /// Velocities that the speed explains up to noise of 3 m/s, with a term in the speed's square.
    fn outcomes(seed: u64, count: u64) -> Vec<Outcome> {
        let ensemble = ensemble(seed);
        let (mean, _) = ensemble.longitudinal_speed_moments();
        let velocity = |(index, speed): (usize, f64)| {
            let noise = Germs::draw(seed ^ 0xabcd, index as u64).values()[0] - 0.5;
            let bent = (speed - mean) / mean;
            Ok(0.99 * speed + 10.0 * noise + 2000.0 * bent * bent)
        };
        ensemble.longitudinal_speeds(count).enumerate().map(velocity).collect()
    }

    #[test]
    fn a_linear_velocity_has_the_moments_of_the_law() {
        let ensemble = ensemble(3);
        let outcomes: Vec<Outcome> =
            ensemble.longitudinal_speeds(50).map(|speed| Ok(2.0 * speed + 100.0)).collect();
        let found = estimate(&asked(3), &OPTIMUM, &outcomes).unwrap();
        let (mean, variance) = ensemble.longitudinal_speed_moments();
        let mean = 2.0 * mean + 100.0;
        assert!(found.controlled);
        assert!((found.moments.mean / mean - 1.0).abs() < 1e-13, "{found:?}");
        let variation = 2.0 * variance.sqrt() / mean;
        assert!((found.moments.coefficient_of_variation / variation - 1.0).abs() < 1e-12);
        assert!(found.standard_error.mean < 1e-9, "{found:?}");
        assert!(found.standard_error.coefficient_of_variation < 1e-12, "{found:?}");
    }

    /// Over 400 samples: the gains have the order of magnitude of the theory, the errors are right,
    /// and there is no bias above the scatter of the average.
    #[test]
    fn moments_scatter_less_and_errors_are_right() {
        let (samples, size) = (400, 300);
        let mut found = [Vec::new(), Vec::new()];
        let mut plain = [Vec::new(), Vec::new()];
        let mut errors = [0.0; 2];
        for seed in 1..=samples {
            let outcomes = outcomes(seed, size);
            let with = estimate(&asked(seed), &OPTIMUM, &outcomes).unwrap();
            let without = MonteCarlo { control_variate: false, ..asked(seed) };
            let without = estimate(&without, &OPTIMUM, &outcomes).unwrap();
            assert!(with.controlled && !without.controlled);
            for (all, of) in [(&mut found, with.moments), (&mut plain, without.moments)] {
                all[0].push(of.mean);
                all[1].push(of.coefficient_of_variation);
            }
            errors[0] += with.standard_error.mean / samples as f64;
            errors[1] += with.standard_error.coefficient_of_variation / samples as f64;
        }
        let deviation = |values: &[f64]| {
            let moments = moments(values).unwrap();
            moments.mean * moments.coefficient_of_variation
        };
        // One sample as large as all of them together.
        let exact = estimate(&asked(1), &OPTIMUM, &outcomes(1, size * samples)).unwrap().moments;
        let exact = [exact.mean, exact.coefficient_of_variation];
        for i in 0..2 {
            let (with, without) = (deviation(&found[i]), deviation(&plain[i]));
            assert!(without / with > 8.0, "moment {i}: {with}, plain {without}");
            let ratio = errors[i] / with;
            assert!((0.85..1.15).contains(&ratio), "moment {i}: reported {ratio} of {with}");
            let bias = moments(&found[i]).unwrap().mean - exact[i];
            let scatter = with / (samples as f64).sqrt();
            assert!(bias.abs() < 5.0 * scatter, "moment {i}: bias {bias}, scatter {scatter}");
        }
    }

    #[test]
    fn without_every_realization_moments_are_the_plain_ones() {
        let check = |outcomes: &[Outcome], controlled: bool| {
            let found = estimate(&asked(1), &OPTIMUM, outcomes).unwrap();
            assert_eq!(found.controlled, controlled, "{outcomes:?}");
            let plain = MonteCarlo { control_variate: false, ..asked(1) };
            let plain = estimate(&plain, &OPTIMUM, outcomes).unwrap();
            assert_eq!(found.moments == plain.moments, !controlled, "{found:?} {plain:?}");
        };
        let mut outcomes = outcomes(1, 20);
        check(&outcomes, true);
        check(&outcomes[..2], false);
        check(&outcomes[..3], true);
        check(&[Ok(3900.0); 20], false);
        outcomes[7] = Err(FailureKind::NoArrival);
        check(&outcomes, false);
    }
}
