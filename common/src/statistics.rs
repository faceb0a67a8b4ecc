//! Moments of a set of velocities, their standard errors, and the cost of a point.
//!
//! Every sum runs over the index order with Neumaier's compensation: its bits depend on the
//! values in their order alone, and its rounding error does not grow with their number.

use crate::outcome::Outcome;
use crate::results::{Estimate, Moments};

/// Mean and coefficient of variation (the paper's Secs. 2 and 5), or `None` for no velocity.
///
/// Two passes: the mean first, then the deviations from it, so that nothing cancels. The variance
/// is that of the set (division by N, as in the paper).
pub fn moments(velocities: &[f64]) -> Option<Moments> {
    central(velocities.iter().copied()).map(|central| central.moments())
}

/// Moments over the successes with their standard errors, or `None` if every realization failed.
///
/// With N successes, s² their variance with division by N - 1, m₂, m₃, m₄ their central moments
/// and Δ = √m₂ / v: the standard error of the mean is s/√N, and that of Δ is by the delta method,
/// without the assumption of a normal law,
///
/// Δ/√N · √((m₄/m₂² - 1)/4 - Δ m₃/m₂^(3/2) + Δ²).
///
/// It takes at least two different velocities to know an error: with one, both errors are NaN
/// (unknown); with several equal ones, both are 0, and so is Δ.
pub fn estimate(outcomes: &[Outcome]) -> Option<Estimate> {
    let central = central(outcomes.iter().filter_map(|outcome| outcome.ok()))?;
    Some(Estimate { moments: central.moments(), standard_error: central.standard_error() })
}

/// The paper's cost: (v_exp - v_mod)²/v_exp² + (Δ_exp - Δ_mod)²/Δ_exp².
pub fn cost(data: Moments, model: Moments) -> f64 {
    let mean = (data.mean - model.mean) / data.mean;
    let variation = (data.coefficient_of_variation - model.coefficient_of_variation)
        / data.coefficient_of_variation;
    mean * mean + variation * variation
}

/// What one complete evaluation says about its point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// Moments over the successes, unless there are none.
    pub moments: Option<Moments>,
    /// Whether the failures stay within the accepted fraction and some realization succeeded.
    pub feasible: bool,
}

impl Verdict {
    /// The verdict on the outcomes of every index of an evaluation: feasible when at least one
    /// realization succeeded and at most `max_failed_fraction` of all failed.
    pub fn of(outcomes: &[Outcome], max_failed_fraction: f64) -> Self {
        let failed = outcomes.iter().filter(|outcome| outcome.is_err()).count();
        let moments = central(outcomes.iter().filter_map(|outcome| outcome.ok()))
            .map(|central| central.moments());
        let within = failed as f64 / outcomes.len() as f64 <= max_failed_fraction;
        Self { moments, feasible: moments.is_some() && within }
    }

    /// The cost against the data's moments: infinite at an infeasible point, never NaN.
    pub fn cost(&self, data: Moments) -> f64 {
        match self.moments {
            Some(model) if self.feasible => {
                let cost = cost(data, model);
                if cost.is_nan() { f64::INFINITY } else { cost }
            }
            _ => f64::INFINITY,
        }
    }
}

/// Mean and central moments of a set.
struct Central {
    count: f64,
    mean: f64,
    /// m₂, m₃, m₄ with m_p = (1/N) Σ (V_k - v)^p.
    m2: f64,
    m3: f64,
    m4: f64,
}

impl Central {
    fn moments(&self) -> Moments {
        Moments { mean: self.mean, coefficient_of_variation: self.m2.sqrt() / self.mean }
    }

    fn standard_error(&self) -> Moments {
        let n = self.count;
        if n < 2.0 {
            return Moments { mean: f64::NAN, coefficient_of_variation: f64::NAN };
        }
        if self.m2 == 0.0 {
            return Moments { mean: 0.0, coefficient_of_variation: 0.0 };
        }
        let variation = self.m2.sqrt() / self.mean;
        let skewness = self.m3 / (self.m2 * self.m2.sqrt());
        let kurtosis = self.m4 / (self.m2 * self.m2);
        // Of a quadratic form that is never negative; rounding can make it so.
        let relative =
            ((kurtosis - 1.0) / 4.0 - variation * skewness + variation * variation).max(0.0).sqrt();
        Moments {
            mean: (self.m2 / (n - 1.0)).sqrt(),
            coefficient_of_variation: variation * relative / n.sqrt(),
        }
    }
}

fn central(velocities: impl Iterator<Item = f64> + Clone) -> Option<Central> {
    let count = velocities.clone().count();
    if count == 0 {
        return None;
    }
    let count = count as f64;
    let mut sum = Sum::default();
    for velocity in velocities.clone() {
        sum.add(velocity);
    }
    let mean = sum.total() / count;
    let mut sums = [Sum::default(); 3];
    for velocity in velocities {
        let deviation = velocity - mean;
        let square = deviation * deviation;
        sums[0].add(square);
        sums[1].add(square * deviation);
        sums[2].add(square * square);
    }
    let [m2, m3, m4] = sums.map(|sum| sum.total() / count);
    Some(Central { count, mean, m2, m3, m4 })
}

/// Neumaier's compensated sum.
#[derive(Clone, Copy, Default)]
struct Sum {
    sum: f64,
    lost: f64,
}

impl Sum {
    fn add(&mut self, value: f64) {
        let sum = self.sum + value;
        self.lost += if self.sum.abs() >= value.abs() {
            (self.sum - sum) + value
        } else {
            (value - sum) + self.sum
        };
        self.sum = sum;
    }

    fn total(self) -> f64 {
        self.sum + self.lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::Germs;
    use crate::outcome::FailureKind;

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
    fn the_sum_does_not_lose_what_is_small() {
        let mut sum = Sum::default();
        for value in [1.0, 1e100, 1.0, -1e100] {
            sum.add(value);
        }
        assert_eq!(sum.total(), 2.0);
    }

    #[test]
    fn failures_do_not_enter_an_estimate() {
        let with = [Ok(3.0), Err(FailureKind::NoArrival), Ok(5.0), Err(FailureKind::NotFinite)];
        let estimate = estimate(&with).unwrap();
        close(estimate.moments.mean, 4.0);
        close(estimate.moments.coefficient_of_variation, 0.25);
        // s = √2; of a symmetric two-point law m₄ = m₂² and m₃ = 0: Δ/√N · Δ.
        close(estimate.standard_error.mean, 1.0);
        close(estimate.standard_error.coefficient_of_variation, 0.25 * 0.25 / 2.0_f64.sqrt());
        assert_eq!(super::estimate(&[Err(FailureKind::NoArrival)]), None);
        assert_eq!(super::estimate(&[]), None);
    }

    #[test]
    fn one_velocity_has_no_error_and_equal_ones_have_none() {
        let one = estimate(&[Ok(3900.0)]).unwrap();
        assert_eq!(one.moments, Moments { mean: 3900.0, coefficient_of_variation: 0.0 });
        assert!(one.standard_error.mean.is_nan());
        assert!(one.standard_error.coefficient_of_variation.is_nan());
        let equal = estimate(&[Ok(3900.0); 5]).unwrap();
        let zero = Moments { mean: 0.0, coefficient_of_variation: 0.0 };
        assert_eq!(equal.standard_error, zero);
    }

    /// The scatter of many samples of the exponential law (skewness 2, kurtosis 9) against the
    /// standard errors of each. The formula for a normal law would be 22 % off.
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
            let estimate = estimate(&outcomes).unwrap();
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
        let data = Moments { mean: 8.0, coefficient_of_variation: 0.25 };
        let check = |failed: usize, total: usize, fraction: f64, feasible: bool| {
            let outcomes: Vec<Outcome> = (0..total)
                .map(|k| {
                    if k < failed { Err(FailureKind::NoArrival) } else { Ok(3.0 + (k % 2) as f64) }
                })
                .collect();
            let verdict = Verdict::of(&outcomes, fraction);
            assert_eq!(verdict.feasible, feasible, "{failed} of {total}, {fraction}");
            assert_eq!(verdict.cost(data).is_finite(), feasible);
            assert!(!verdict.cost(data).is_nan());
            assert_eq!(verdict.moments.is_some(), failed < total);
        };
        check(0, 100, 0.0, true);
        check(1, 100, 0.0, false);
        check(1, 100, 0.01, true);
        check(2, 100, 0.01, false);
        check(27, 2700, 0.01, true);
        check(99, 100, 1.0, true);
        check(100, 100, 1.0, false);
        check(0, 0, 1.0, false);
    }

    #[test]
    fn a_cost_is_never_nan() {
        let data = Moments { mean: 4.0, coefficient_of_variation: 0.0 };
        assert_eq!(Verdict::of(&[Ok(4.0)], 0.0).cost(data), f64::INFINITY);
    }
}
