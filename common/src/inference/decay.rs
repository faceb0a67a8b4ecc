//! The third moment of data with decays: their mean. Its weights in χ², beside those of the moments of
//! the velocities.
//!
//! Of the decays only the mean is compared with the model. Their scatter is also that of how each
//! receiver is coupled, which the model does not have; it is a part of the error of the mean.

use crate::data::Data;
use crate::moments::{Moments, log_ratios};
use crate::statistics::{covariance_with_decay, measured_decay};

/// Fewest independent parts of a set with decays: fewer do not tell the covariance of three moments.
pub const DECAY_PARTS_MIN: usize = 10;
/// Smallest share of a moment's variance that must not follow from the moments before it.
const INDEPENDENT_MIN: f64 = 1e-4;

/// Weights of differences of (ln v, ln Δ, relative decay): χ² = rᵀ C⁻¹ r with the covariance C of the
/// noise of the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecayWeights {
    data: Moments,
    /// Mean of the measured decays, dB/cm, above 0.
    decay: f64,
    /// Covariance of the noise.
    pub(super) covariance: [[f64; 3]; 3],
    /// Lower triangle of W, the inverse of the Cholesky factor of the covariance: Wᵀ W = C⁻¹.
    triangle: [[f64; 3]; 3],
}

impl DecayWeights {
    /// Returns the weights of set number `set` of the data; `None` if there are no decays, if these have
    /// no mean above 0, or if the noise of the three moments is not known.
    pub fn of_data(data: &Data, set: usize) -> Option<Self> {
        let given = data.set(set)?;
        let decay = measured_decay(&given)?.mean;
        let covariance = covariance_with_decay(&given)?;
        let triangle = inverse_factor(&covariance)?;
        let usable = decay > 0.0 && decay.is_finite();
        usable.then_some(Self { data: data.moments(set), decay, covariance, triangle })
    }

    /// Returns the differences of (ln v, ln Δ, d/d_data), with the mean decay d in dB/cm, model minus
    /// data.
    pub fn differences(&self, model: Moments, decay: f64) -> [f64; 3] {
        let [mean, variation] = log_ratios(model, self.data);
        [mean, variation, self.difference_of_decays(decay)]
    }

    /// Returns the difference of a model's mean decay, dB/cm, from that of the data, relative to it.
    pub(super) fn difference_of_decays(&self, decay: f64) -> f64 {
        self.relative(decay - self.decay)
    }

    /// Returns a difference of mean decays relative to that of the data.
    pub(super) fn relative(&self, difference: f64) -> f64 {
        difference / self.decay
    }

    /// Returns χ² of a model's moments and its mean decay, dB/cm.
    pub fn cost(&self, model: Moments, decay: f64) -> f64 {
        self.whiten(self.differences(model, decay)).iter().map(|x| x * x).sum()
    }

    /// Returns W r, whose components have independent errors of 1.
    pub(super) fn whiten(&self, r: [f64; 3]) -> [f64; 3] {
        self.triangle.map(|row| row.iter().zip(r).map(|(w, r)| w * r).sum())
    }

    /// Returns Wᵀ t.
    pub(super) fn transposed(&self, t: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.triangle.iter().zip(t).map(|(row, t)| row[axis] * t).sum())
    }
}

/// Returns the inverse of the lower Cholesky factor of a matrix; `None` if it is not safely positive
/// definite.
fn inverse_factor(matrix: &[[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let mut factor = [[0.0; 3]; 3];
    for row in 0..3 {
        for column in 0..=row {
            let known: f64 = (0..column).map(|k| factor[row][k] * factor[column][k]).sum();
            let left = matrix[row][column] - known;
            factor[row][column] = if row == column {
                let safe = left > INDEPENDENT_MIN * matrix[row][row] && left.is_finite();
                safe.then(|| left.sqrt())?
            } else {
                left / factor[column][column]
            };
        }
    }
    let mut inverse = [[0.0; 3]; 3];
    for row in 0..3 {
        let mut solved = [0.0; 3];
        for (column, value) in solved.iter_mut().enumerate().take(row + 1) {
            let unit = if row == column { 1.0 } else { 0.0 };
            let known: f64 = (column..row).map(|k| factor[row][k] * inverse[k][column]).sum();
            *value = (unit - known) / factor[row][row];
        }
        inverse[row] = solved;
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Measurements;

    const COVARIANCE: [[f64; 3]; 3] =
        [[4e-6, -6e-6, 3e-6], [-6e-6, 25e-6, 8e-6], [3e-6, 8e-6, 9e-5]];

    #[test]
    fn the_factor_whitens_the_covariance() {
        let w = inverse_factor(&COVARIANCE).unwrap();
        for i in 0..3 {
            for j in 0..3 {
                let sum: f64 = (0..3)
                    .flat_map(|k| (0..3).map(move |l| (k, l)))
                    .map(|(k, l)| w[i][k] * COVARIANCE[k][l] * w[j][l])
                    .sum();
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((sum - expected).abs() < 1e-12, "{i} {j}: {sum}");
            }
        }
        let mut singular = COVARIANCE;
        singular[2] = COVARIANCE[0];
        singular.iter_mut().for_each(|row| row[2] = row[0]);
        assert_eq!(inverse_factor(&singular), None);
    }

    fn data(decays: Option<Vec<f64>>) -> Data {
        let velocities = (0..12).map(|k| 3900.0 + f64::from(k * k)).collect();
        let measurements = Measurements::Velocities { velocities, subjects: None, decays };
        Data { measurements, repeatability: 0.0 }
    }

    #[test]
    fn a_model_with_the_data_s_moments_costs_nothing() {
        let scattered: Vec<f64> = (0..12).map(|k| 4.5 + f64::from(k * 7 % 12) / 10.0).collect();
        let data_with = data(Some(scattered));
        let weights = DecayWeights::of_data(&data_with, 0).unwrap();
        let moments = data_with.moments(0);
        assert!(weights.cost(moments, 5.05) < 1e-20);
        // One standard error of the decay alone is at least one in χ².
        let error = measured_decay(&data_with.set(0).unwrap()).unwrap().standard_error;
        assert!(weights.cost(moments, 5.05 + error) >= 1.0);
        assert_eq!(DecayWeights::of_data(&data(None), 0), None);
        assert_eq!(DecayWeights::of_data(&data(Some(vec![4.5; 12])), 0), None);
    }
}
