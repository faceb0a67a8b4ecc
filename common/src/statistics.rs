//! Moments of a set of velocities, their standard errors, and the cost of a point.
//!
//! Every sum runs in index order with Neumaier's compensation, or adds neighbours in pairs: its
//! bits depend only on the values in their order, and its rounding error hardly grows with their
//! number.

mod blocks;
mod central;
mod controlled;
mod failure_bias;
mod kernel_density;
mod likelihood;
mod measured;
mod observed;
mod sum;

use crate::job::{MonteCarlo, Sampling};
use crate::moments::{ComparedMoments, Estimate, Moments};
use crate::observables::ObservableValues;
use crate::outcome::Outcome;
use crate::outcomes::Outcomes;
use crate::parameters::Point;

use self::blocks::DoublingFactors;
use self::central::{Central, central};
use self::controlled::Controlled;

pub use self::failure_bias::failure_bias;
pub use self::likelihood::{LikelihoodFit, likelihood_cost, likelihood_error, likelihood_fit};
pub use self::measured::{covariance_of_logarithms, without_repeatability};
pub use self::observed::{
    covariance_of_moments, measured_observables, observable_estimates, observable_means,
};
pub(crate) use self::sum::Sum;

/// -ln 0.05: the evidence that makes a point infeasible.
const EVIDENCE: f64 = 2.995_732_273_553_991;

/// Returns mean and coefficient of variation (the paper's Secs. 2 and 5), or `None` for no
/// velocity.
///
/// Two passes, first the mean and then the deviations from it, avoid cancellation. The variance is
/// that of the set (division by N, as in the paper).
///
/// ```
/// use osteon_common::statistics::moments;
///
/// let found = moments(&[3900.0, 4100.0]).unwrap();
/// assert_eq!((found.mean, found.coefficient_of_variation), (4000.0, 0.025));
/// ```
pub fn moments(velocities: &[f64]) -> Option<Moments> {
    central(velocities.iter().copied()).map(|central| central.moments())
}

/// Returns the moments over the successes of an evaluation at `point` with their standard errors,
/// or `None` if every realization failed.
///
/// They are the moments of the velocities, or, if `monte_carlo` requests the control variate and no
/// realization failed, those of the regression on √(c1111/ρ).
///
/// Standard errors for independent germs: with N successes, s² their variance with division by N -
/// 1, m₂, m₃, m₄ their central moments and Δ = √m₂ / v, that of the mean is s/√N, and that of Δ is
/// by the delta method, without the assumption of a normal law,
///
/// Δ/√N · √((m₄/m₂² - 1)/4 - Δ m₃/m₂^(3/2) + Δ²).
///
/// For Sobol' points they come from the scatter of parts of the sample: of its scrambles, or, if
/// there is only one, of its blocks of consecutive points.
///
/// An error can be estimated only from at least two different velocities: with one velocity, both
/// errors are NaN (unknown); with several equal ones, both are 0, and so is Δ.
pub fn estimate(monte_carlo: &MonteCarlo, point: &Point, outcomes: &[Outcome]) -> Option<Estimate> {
    let sample = Sample::from_outcomes(monte_carlo, point, outcomes)?;
    Some(Estimate {
        moments: sample.moments(),
        standard_error: sample.standard_error(monte_carlo),
        controlled: sample.controlled.is_some(),
    })
}

/// Returns the paper's cost: (v_exp - v_mod)²/v_exp² + (Δ_exp - Δ_mod)²/Δ_exp².
pub fn cost(data: Moments, model: Moments) -> f64 {
    let mean = (data.mean - model.mean) / data.mean;
    let variation = (data.coefficient_of_variation - model.coefficient_of_variation)
        / data.coefficient_of_variation;
    mean * mean + variation * variation
}

/// Moments and feasibility of a point, computed from one complete evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointStatistics {
    /// Moments over the successes, unless there are none.
    pub moments: Option<Moments>,
    /// Means over the successes of the observables that were measured.
    pub observables: ObservableValues,
    /// Whether the failures are no evidence that more than the accepted fraction of all realizations fail, and
    /// at least one succeeded.
    pub feasible: bool,
}

impl PointStatistics {
    /// Same as [`Self::from_outcomes`], with the means of the observables.
    pub fn new(monte_carlo: &MonteCarlo, point: &Point, outcomes: &Outcomes) -> Self {
        let of_velocities = Self::from_outcomes(monte_carlo, point, outcomes);
        Self { observables: observable_means(outcomes), ..of_velocities }
    }

    /// Computes moments and feasibility from the outcomes of every index of an evaluation at
    /// `point`.
    pub fn from_outcomes(monte_carlo: &MonteCarlo, point: &Point, outcomes: &[Outcome]) -> Self {
        let failed = outcomes.iter().filter(|outcome| outcome.is_err()).count();
        let moments =
            Sample::from_outcomes(monte_carlo, point, outcomes).map(|sample| sample.moments());
        let too_many = fails_more_often(failed, outcomes.len(), monte_carlo.max_failed_fraction);
        let observables = ObservableValues::default();
        Self { moments, observables, feasible: moments.is_some() && !too_many }
    }

    /// Returns the paper's cost against the data's moments, to which each observable adds the square of
    /// the relative difference of its mean: infinite at an infeasible point, never NaN.
    pub fn cost(&self, data: &ComparedMoments) -> f64 {
        self.cost_by(|model| {
            let [_, _, observables @ ..] = model.differences(data);
            let of_observables = observables.iter().map(|difference| difference * difference);
            cost(data.velocities, model.velocities) + of_observables.sum::<f64>()
        })
    }

    /// Returns the cost by a function of the model's moments: infinite at an infeasible point, never
    /// NaN.
    pub fn cost_by(&self, cost: impl Fn(&ComparedMoments) -> f64) -> f64 {
        match self.compared() {
            Some(model) if self.feasible => {
                let cost = cost(&model);
                if cost.is_nan() { f64::INFINITY } else { cost }
            }
            _ => f64::INFINITY,
        }
    }

    /// Returns the moments that are compared with the data, unless there are none.
    pub fn compared(&self) -> Option<ComparedMoments> {
        Some(ComparedMoments { velocities: self.moments?, observables: self.observables })
    }
}

/// Returns whether `failed` of `all` realizations are evidence that more than a `fraction` of all fail. If just this
/// fraction did, so many failures would have a probability below 5 %, by Chernoff's bound exp(-n D(k/n ‖ fraction))
/// with the relative entropy D: one failure among 32 says little of a limit of 1 %, and 27 among 270 much.
fn fails_more_often(failed: usize, all: usize, fraction: f64) -> bool {
    let share = failed as f64 / all as f64;
    if all == 0 || share <= fraction {
        return false;
    }
    let part = |found: f64, limit: f64| {
        if found == 0.0 { 0.0 } else { found * libm::log(found / limit) }
    };
    let entropy = part(share, fraction) + part(1.0 - share, 1.0 - fraction);
    all as f64 * entropy > EVIDENCE
}

/// The outcomes of an evaluation, with the quantities derived from them.
struct Sample<'a> {
    outcomes: &'a [Outcome],
    central: Central,
    controlled: Option<Controlled>,
}

impl<'a> Sample<'a> {
    fn from_outcomes(
        monte_carlo: &MonteCarlo,
        point: &Point,
        outcomes: &'a [Outcome],
    ) -> Option<Self> {
        let central = central(outcomes.iter().filter_map(|outcome| outcome.ok()))?;
        let controlled = Controlled::new(monte_carlo, point, outcomes);
        Some(Self { outcomes, central, controlled })
    }

    fn moments(&self) -> Moments {
        self.controlled.as_ref().map_or(self.central.moments(), |controlled| controlled.moments)
    }

    fn standard_error(&self, monte_carlo: &MonteCarlo) -> Moments {
        let successes = self.central.count;
        match (monte_carlo.sampling, &self.controlled) {
            (_, None) if !self.central.scatters() => self.central.standard_error(),
            (Sampling::MonteCarlo, None) => self.central.standard_error(),
            (Sampling::MonteCarlo, Some(controlled)) => controlled.standard_error(),
            (Sampling::Sobol, controlled) => {
                let doubling = if controlled.is_some() {
                    DoublingFactors::CONTROLLED
                } else {
                    DoublingFactors::PLAIN
                };
                blocks::standard_error(self.influences(), doubling, monte_carlo, successes)
            }
        }
    }

    /// Returns the influence of each realization on N times mean and coefficient of variation, to
    /// first order, in index order; zero for failed realizations.
    fn influences(&self) -> Box<dyn Iterator<Item = [f64; 2]> + '_> {
        let influence = |outcome: &Outcome| match outcome {
            Ok(velocity) => self.central.influence(*velocity),
            Err(_) => [0.0; 2],
        };
        match &self.controlled {
            Some(controlled) => Box::new(controlled.influences()),
            None => Box::new(self.outcomes.iter().map(influence)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::Germs;
    use crate::outcome::FailureKind;

    const OPTIMUM: Point =
        Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);

    fn plain(outcomes: &[Outcome]) -> Option<Estimate> {
        estimate(&MonteCarlo::default(), &OPTIMUM, outcomes)
    }

    fn point_statistics(outcomes: &[Outcome], max_failed_fraction: f64) -> PointStatistics {
        let monte_carlo = MonteCarlo { max_failed_fraction, ..MonteCarlo::default() };
        PointStatistics::from_outcomes(&monte_carlo, &OPTIMUM, outcomes)
    }

    fn of_velocities(mean: f64, coefficient_of_variation: f64) -> ComparedMoments {
        Moments { mean, coefficient_of_variation }.into()
    }

    fn close(value: f64, expected: f64) {
        assert!((value - expected).abs() <= 1e-15 * expected.abs(), "{value}, expected {expected}");
    }

    #[test]
    fn moments_of_small_sets() {
        let check = |velocities: &[f64], mean: f64, coefficient_of_variation: f64| {
            let moments = moments(velocities).unwrap();
            close(moments.mean, mean);
            close(moments.coefficient_of_variation, coefficient_of_variation);
        };
        check(&[3900.0], 3900.0, 0.0);
        check(&[3900.0, 3900.0, 3900.0], 3900.0, 0.0);
        check(&[3.0, 5.0], 4.0, 0.25);
        check(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0], 5.0, 0.4);
        assert_eq!(moments(&[]), None);
    }

    /// √(mean of squares / square of mean - 1) would lose every digit here.
    #[test]
    fn nothing_cancels_when_the_variation_is_small() {
        let velocities: Vec<f64> =
            (0..1000).map(|k| 4096.0 + f64::from(k % 2) / 1048576.0).collect();
        let moments = moments(&velocities).unwrap();
        let half = 0.5 / 1048576.0;
        close(moments.mean, 4096.0 + half);
        close(moments.coefficient_of_variation, half / (4096.0 + half));
    }

    #[test]
    fn failures_do_not_enter_an_estimate() {
        let with = [Ok(3.0), Err(FailureKind::NoArrival), Ok(5.0), Err(FailureKind::NotFinite)];
        let estimate = plain(&with).unwrap();
        close(estimate.moments.mean, 4.0);
        close(estimate.moments.coefficient_of_variation, 0.25);
        // s = √2; for a symmetric two-point law m₄ = m₂² and m₃ = 0: Δ/√N · Δ.
        close(estimate.standard_error.mean, 1.0);
        close(estimate.standard_error.coefficient_of_variation, 0.25 * 0.25 / 2.0_f64.sqrt());
        assert_eq!(plain(&[Err(FailureKind::NoArrival)]), None);
        assert_eq!(plain(&[]), None);
    }

    #[test]
    fn one_velocity_has_no_error_and_equal_ones_have_none() {
        let one = plain(&[Ok(3900.0)]).unwrap();
        assert_eq!(one.moments, Moments { mean: 3900.0, coefficient_of_variation: 0.0 });
        assert!(one.standard_error.mean.is_nan());
        assert!(one.standard_error.coefficient_of_variation.is_nan());
        let equal = plain(&[Ok(3900.0); 5]).unwrap();
        let zero = Moments { mean: 0.0, coefficient_of_variation: 0.0 };
        assert_eq!(equal.standard_error, zero);
    }

    /// Compares the scatter of many samples of the exponential law (skewness 2, kurtosis 9) with
    /// the standard errors of each. The formula for a normal law would be 22 % off.
    #[test]
    fn standard_errors_are_those_of_a_skewed_law() {
        let seed = 6;
        let (samples, size) = (600_u32, 2100);
        let mut moments = [Vec::new(), Vec::new()];
        let mut errors = [0.0; 2];
        for sample in 0..samples {
            let indices = (0..size / 21).map(|k| u64::from(sample) * 100 + k);
            let outcomes: Vec<Outcome> = indices
                .flat_map(|index| *Germs::draw(seed, index).values())
                .map(|u| Ok(-libm::log(u)))
                .collect();
            let estimate = plain(&outcomes).unwrap();
            moments[0].push(estimate.moments.mean);
            moments[1].push(estimate.moments.coefficient_of_variation);
            errors[0] += estimate.standard_error.mean / f64::from(samples);
            errors[1] += estimate.standard_error.coefficient_of_variation / f64::from(samples);
        }
        for (values, error) in moments.iter().zip(errors) {
            let moments = super::moments(values).unwrap();
            let scatter = moments.mean * moments.coefficient_of_variation;
            assert!((error / scatter - 1.0).abs() < 0.1, "seed {seed}: {error}, scatter {scatter}");
        }
    }

    #[test]
    fn the_cost_is_the_papers() {
        let of = |mean, coefficient_of_variation| Moments { mean, coefficient_of_variation };
        assert_eq!(cost(of(4000.0, 0.02), of(4000.0, 0.02)), 0.0);
        close(cost(of(4000.0, 0.02), of(3000.0, 0.02)), 0.0625);
        close(cost(of(4000.0, 0.02), of(4000.0, 0.03)), 0.25);
        close(cost(of(4000.0, 0.02), of(3000.0, 0.03)), 0.3125);
    }

    #[test]
    fn too_many_failures_make_a_point_infeasible() {
        let data = of_velocities(8.0, 0.25);
        let check = |failed: usize, total: usize, fraction: f64, feasible: bool| {
            let outcomes: Vec<Outcome> = (0..total)
                .map(|k| {
                    if k < failed { Err(FailureKind::NoArrival) } else { Ok(3.0 + (k % 2) as f64) }
                })
                .collect();
            let point_statistics = point_statistics(&outcomes, fraction);
            assert_eq!(point_statistics.feasible, feasible, "{failed} of {total}, {fraction}");
            assert_eq!(point_statistics.cost(&data).is_finite(), feasible);
            assert!(!point_statistics.cost(&data).is_nan());
            assert_eq!(point_statistics.moments.is_some(), failed < total);
        };
        check(0, 100, 0.0, true);
        check(1, 100, 0.0, false);
        check(1, 32, 0.01, true);
        check(2, 32, 0.01, true);
        check(3, 32, 0.01, false);
        check(4, 100, 0.01, true);
        check(5, 100, 0.01, false);
        check(27, 2700, 0.01, true);
        check(40, 2700, 0.01, true);
        check(42, 2700, 0.01, false);
        check(1_030, 100_000, 0.01, true);
        check(1_100, 100_000, 0.01, false);
        check(99, 100, 1.0, true);
        check(100, 100, 1.0, false);
        check(0, 0, 1.0, false);
    }

    #[test]
    fn a_cost_is_never_nan() {
        let data = of_velocities(4.0, 0.0);
        assert_eq!(point_statistics(&[Ok(4.0)], 0.0).cost(&data), f64::INFINITY);
    }
}
