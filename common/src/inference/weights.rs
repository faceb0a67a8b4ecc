//! Weights of the two moments by the noise of the data: the cost χ² = rᵀ C⁻¹ r.

use super::noise::{PARTS_MIN, data_noise, normal_law_noise};
use crate::job::Data;
use crate::moments::{Moments, log_ratios};

/// Largest correlation of the errors of both logarithms that counts, for the same reason.
const CORRELATION_MAX: f64 = 0.95;

/// Weights of differences of (ln v, ln Δ): the lower triangle of a matrix W with Wᵀ W = C⁻¹, the
/// inverse of the Cholesky factor of the covariance C of the data's noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MomentWeights {
    mean: f64,
    cross: f64,
    variation: f64,
}

impl MomentWeights {
    /// Returns the weights of set number `set` of the data; `None` if its noise is not known.
    pub fn of_data(data: &Data, set: usize) -> Option<Self> {
        let found = data_noise(data, set)?;
        // The covariance is nearly singular: two velocities have the same spread about their mean.
        let few = found.freedom + 1 < PARTS_MIN;
        let normal = few.then(|| normal_law_noise(data, set)).flatten();
        Self::of_covariance(normal.unwrap_or(found).covariance)
    }

    /// Returns the weights for a covariance; `None` if a variance is not finite and above 0.
    pub fn of_covariance([[mean, both], [_, variation]]: [[f64; 2]; 2]) -> Option<Self> {
        if !(mean > 0.0 && mean.is_finite() && variation > 0.0 && variation.is_finite()) {
            return None;
        }
        let [mean, variation] = [mean.sqrt(), variation.sqrt()];
        let correlation = (both / (mean * variation)).clamp(-CORRELATION_MAX, CORRELATION_MAX);
        let left = variation * (1.0 - correlation * correlation).sqrt();
        Some(Self {
            mean: 1.0 / mean,
            cross: -correlation * variation / (mean * left),
            variation: 1.0 / left,
        })
    }

    /// Returns W r, whose components have independent errors of 1.
    pub fn whiten(&self, [mean, variation]: [f64; 2]) -> [f64; 2] {
        [self.mean * mean, self.cross * mean + self.variation * variation]
    }

    /// Returns the same weights with the largest of them being 1, for sums of squares whose scale
    /// does not matter.
    #[must_use]
    pub fn normalized(self) -> Self {
        let Self { mean, cross, variation } = self;
        let largest = mean.max(cross.abs()).max(variation);
        Self { mean: mean / largest, cross: cross / largest, variation: variation / largest }
    }

    /// Returns χ² of a difference of (ln v, ln Δ).
    pub fn square(&self, difference: [f64; 2]) -> f64 {
        let [first, second] = self.whiten(difference);
        first * first + second * second
    }

    /// Returns χ² of a model's moments.
    pub fn cost(&self, data: Moments, model: Moments) -> f64 {
        self.square(log_ratios(model, data))
    }

    /// Returns the largest sum of squares of (ln v, ln Δ) for which χ² is surely at most `square`.
    pub fn relative_squares(&self, square: f64) -> f64 {
        let Self { mean, cross, variation } = self;
        square / mean.mul_add(*mean, cross.mul_add(*cross, variation * variation))
    }

    /// Returns the expectation of χ² if the differences have no other cause than independent errors
    /// with these standard deviations.
    pub fn of_errors(&self, [mean, variation]: [f64; 2]) -> f64 {
        self.square([mean, 0.0]) + self.square([0.0, variation])
    }

    /// Returns the smallest χ² of the differences between these ends, (ln v, ln Δ) each; NaN if an
    /// end is.
    pub fn smallest(&self, lower: [f64; 2], upper: [f64; 2]) -> f64 {
        if lower.iter().chain(&upper).any(|end| end.is_nan()) {
            return f64::NAN;
        }
        let inside = |axis: usize| lower[axis] <= 0.0 && upper[axis] >= 0.0;
        if inside(0) && inside(1) {
            return 0.0;
        }
        // χ² is convex, so that its minimum is on one of the four edges.
        let ratios = [
            // The best ln v for a given ln Δ, and the best ln Δ for a given ln v.
            -self.cross * self.variation / (self.mean * self.mean + self.cross * self.cross),
            -self.cross / self.variation,
        ];
        let on_edge = |fixed: usize, value: f64| {
            let other = 1 - fixed;
            let mut at = [0.0; 2];
            at[fixed] = value;
            at[other] = (ratios[other] * value).clamp(lower[other], upper[other]);
            self.square(at)
        };
        let edges = [0, 1].into_iter().flat_map(|axis| {
            [lower[axis], upper[axis]]
                .into_iter()
                .filter(|end| end.is_finite())
                .map(move |end| (axis, end))
        });
        edges.fold(f64::INFINITY, |least, (axis, end)| least.min(on_edge(axis, end)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COVARIANCE: [[f64; 2]; 2] = [[4e-6, -6e-6], [-6e-6, 25e-6]];

    /// The inverse of the covariance, by its determinant.
    #[test]
    fn weights_are_those_of_the_inverse() {
        let weights = MomentWeights::of_covariance(COVARIANCE).unwrap();
        let [[a, b], [_, d]] = COVARIANCE;
        let determinant = a * d - b * b;
        for r in [[1e-3, 0.0], [0.0, 1e-3], [2e-3, -3e-3], [2e-3, 3e-3]] {
            let expected =
                (d * r[0] * r[0] - 2.0 * b * r[0] * r[1] + a * r[1] * r[1]) / determinant;
            assert!((weights.square(r) / expected - 1.0).abs() < 1e-12, "{r:?}");
        }
        assert_eq!(MomentWeights::of_covariance([[0.0, 0.0], [0.0, 1.0]]), None);
    }

    #[test]
    fn relative_squares_bound_chi_square() {
        let weights = MomentWeights::of_covariance(COVARIANCE).unwrap();
        let radius = weights.relative_squares(0.25).sqrt();
        let angles = (0..360).map(|degrees| f64::from(degrees).to_radians());
        let squares = angles
            .map(|angle| weights.square([radius * libm::cos(angle), radius * libm::sin(angle)]));
        let largest = squares.fold(0.0, f64::max);
        assert!((0.1..=0.25).contains(&largest), "{largest}");
    }

    #[test]
    fn the_smallest_of_a_rectangle_is_that_of_a_fine_grid() {
        let weights = MomentWeights::of_covariance(COVARIANCE).unwrap();
        for (lower, upper) in [
            ([1e-3, -1e-2], [2e-3, 1e-2]),
            ([1e-3, 0.0], [2e-3, 1e-2]),
            ([-1e-3, 3e-3], [1e-2, 1e-2]),
            ([-3e-3, -4e-3], [-1e-3, -1e-3]),
            ([-1e-3, -1e-3], [1e-3, 1e-3]),
        ] {
            let at = |axis: usize, k: u32| {
                lower[axis] + (upper[axis] - lower[axis]) * f64::from(k) / 400.0
            };
            let grid = (0..=400).flat_map(|i| (0..=400).map(move |j| (i, j)));
            let least = grid.map(|(i, j)| weights.square([at(0, i), at(1, j)]));
            let least = least.fold(f64::INFINITY, f64::min);
            let found = weights.smallest(lower, upper);
            assert!(found <= least + 1e-12 && least - found < 0.02, "{lower:?}: {found}, {least}");
        }
    }

    #[test]
    fn two_velocities_have_weights_and_moments_alone_have_none() {
        assert!(MomentWeights::of_data(&Data::from_velocities(vec![3900.0, 4000.0]), 0).is_some());
        assert_eq!(MomentWeights::of_data(&Data::from_moments(3900.0, 0.03), 0), None);
    }
}
