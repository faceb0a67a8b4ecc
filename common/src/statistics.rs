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
