//! Mean and central moments of a set, and standard errors for independent values.

use super::sum::Sum;
use crate::results::Moments;

/// Mean and central moments of a set.
pub(super) struct Central {
    /// Number of values.
    pub(super) count: f64,
    mean: f64,
    /// m₂, m₃, m₄ with m_p = (1/N) Σ (V_k - v)^p.
    m2: f64,
    m3: f64,
    m4: f64,
}

impl Central {
    pub(super) fn moments(&self) -> Moments {
        Moments { mean: self.mean, coefficient_of_variation: self.m2.sqrt() / self.mean }
    }

    /// Returns whether there are different values.
    pub(super) fn scatters(&self) -> bool {
        self.m2 > 0.0
    }

    /// Returns the influence of one value on N times mean and coefficient of variation, to first
    /// order.
    pub(super) fn influence(&self, value: f64) -> [f64; 2] {
        self.influence_without(0.0, value)
    }

    /// Same as [`Self::influence`], on the coefficient of variation after the variance `known` is
    /// subtracted, which is smaller than that of the set.
    pub(super) fn influence_without(&self, known: f64, value: f64) -> [f64; 2] {
        let deviation = value - self.mean;
        let left = self.m2 - known;
        let variation = left.sqrt() / self.mean;
        let relative = 0.5 * (deviation * deviation / self.m2 - 1.0) * (self.m2 / left)
            - deviation / self.mean;
        [deviation, variation * relative]
    }

    /// Returns the variance of the set.
    pub(super) fn variance(&self) -> f64 {
        self.m2
    }

    /// Returns the standard errors for independent values.
    pub(super) fn standard_error(&self) -> Moments {
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
        // The quadratic form is never negative, except for rounding errors.
        let relative =
            ((kurtosis - 1.0) / 4.0 - variation * skewness + variation * variation).max(0.0).sqrt();
        Moments {
            mean: (self.m2 / (n - 1.0)).sqrt(),
            coefficient_of_variation: variation * relative / n.sqrt(),
        }
    }
}

/// Returns mean and central moments of a set, or `None` if it is empty.
pub(super) fn central(velocities: impl Iterator<Item = f64> + Clone) -> Option<Central> {
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
