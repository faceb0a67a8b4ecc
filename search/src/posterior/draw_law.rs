//! The law that the parameters other than the pivots are drawn from, once it is known where they match.
//!
//! Drawn from the prior, points match the velocities by their pivots, but other observables only by
//! chance. So a further population is drawn from a mixture of the prior and of a normal law about the
//! weights of the one before, both in the coordinates in which the prior is uniform from 0 to 1.

use std::f64::consts::TAU;

use osteon_common::special::standard_normal_quantile;

use super::cholesky::{Cholesky, dot};

/// One point in so many is drawn from the prior.
const OF_PRIOR: usize = 5;
/// Variance of the normal law, in units of that of the weights: its tails must reach beyond theirs.
const WIDER: f64 = 2.0;
/// Smallest variance along an axis, after those before it.
const VARIANCE_MIN: f64 = 1e-12;

/// A mixture of the prior and a normal law.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DrawLaw {
    mean: Vec<f64>,
    factor: Cholesky,
    /// Logarithm of the largest density of the normal law.
    log_peak: f64,
}

impl DrawLaw {
    /// Returns the law about weighted coordinates, whose weights add up to 1; `None` if they do not
    /// scatter, as with a single one.
    pub(super) fn about(coordinates: &[&[f64]], weights: &[f64]) -> Option<Self> {
        let dimension = coordinates.first()?.len();
        let weighted = |value: &dyn Fn(&[f64]) -> f64| -> f64 {
            coordinates.iter().zip(weights).map(|(at, weight)| weight * value(at)).sum()
        };
        let mean: Vec<f64> = (0..dimension).map(|axis| weighted(&|at| at[axis])).collect();
        let mut factor = Cholesky::default();
        for i in 0..dimension {
            let with = |j: usize| WIDER * weighted(&|at| (at[i] - mean[i]) * (at[j] - mean[j]));
            let row: Vec<f64> = (0..=i).map(with).collect();
            if !factor.push(&row, VARIANCE_MIN) {
                return None;
            }
        }
        let log_peak = -0.5 * dimension as f64 * libm::log(TAU) - factor.half_log_determinant();
        Some(Self { mean, factor, log_peak })
    }

    /// Returns the coordinates of point number `index`, by independent numbers that are uniform from 0
    /// to 1. They may be outside of the prior.
    pub(super) fn draw(&self, index: usize, uniforms: &[f64]) -> Vec<f64> {
        if index.is_multiple_of(OF_PRIOR) {
            return uniforms.to_vec();
        }
        let normal: Vec<f64> = uniforms.iter().map(|&u| standard_normal_quantile(u)).collect();
        let steps = self.factor.multiply(&normal);
        self.mean.iter().zip(steps).map(|(mean, step)| mean + step).collect()
    }

    /// Returns the logarithm of the density of all points together, relative to the prior.
    pub(super) fn log_density(&self, at: &[f64]) -> f64 {
        let off: Vec<f64> = at.iter().zip(&self.mean).map(|(at, mean)| at - mean).collect();
        let white = self.factor.solve_lower(&off);
        let normal = libm::exp(self.log_peak - 0.5 * dot(&white, &white));
        let of_prior = 1.0 / OF_PRIOR as f64;
        libm::log(of_prior + (1.0 - of_prior) * normal)
    }
}

#[cfg(test)]
mod tests {
    use osteon_common::ensemble::Germs;

    use super::*;

    /// Weighted by the inverse of their density, points of the mixture are those of the prior.
    #[test]
    fn the_density_is_that_of_the_points() {
        let coordinates: Vec<[f64; 2]> = (0..40)
            .map(|k| {
                let [a, b, ..] = *Germs::draw(3, k).values();
                [0.4 + 0.1 * a, 0.7 + 0.05 * a + 0.02 * b]
            })
            .collect();
        let places: Vec<&[f64]> = coordinates.iter().map(<[f64; 2]>::as_slice).collect();
        let law = DrawLaw::about(&places, &[1.0 / 40.0; 40]).unwrap();
        let (mut sum, mut mean, count) = (0.0, [0.0; 2], 40_000_u64);
        for index in 0..count {
            let germs = Germs::draw(4, index);
            let at = law.draw(index as usize, &germs.values()[..2]);
            if at.iter().all(|u| (0.0..1.0).contains(u)) {
                let weight = libm::exp(-law.log_density(&at));
                sum += weight;
                mean.iter_mut().zip(at).for_each(|(mean, u)| *mean += weight * u);
            }
        }
        assert!((sum / count as f64 - 1.0).abs() < 0.02, "{sum}");
        assert!(mean.iter().all(|mean| (mean / sum - 0.5).abs() < 0.02), "{mean:?}");
        assert_eq!(DrawLaw::about(&places[..1], &[1.0]), None);
    }
}
