//! Weights of the compared moments by the noise of the data: the cost χ² = rᵀ C⁻¹ r.
//!
//! For an observable other than the velocity only the mean is compared. Its values also scatter because
//! receivers are coupled differently, which the model does not contain; that scatter counts as an error of
//! the mean.

use super::noise::{PARTS_MIN, data_noise, normal_law_noise};
use crate::data::Data;
use crate::moments::{ComparedMoments, MOMENTS, MomentMatrix, MomentVector};
use crate::observables::ObservableSet;

/// Largest correlation of the errors of both logarithms that counts: beyond, C is nearly singular.
const CORRELATION_MAX: f64 = 0.95;
/// Fewest independent parts of a set with other observables: fewer do not tell the covariance of three
/// moments.
pub const OBSERVED_PARTS_MIN: usize = 10;
/// Smallest share of an observable's variance that must not follow from the moments before it.
const INDEPENDENT_MIN: f64 = 1e-4;

/// Weights of differences of the compared moments: a lower triangle W with Wᵀ W = C⁻¹, the inverse of the
/// Cholesky factor of the covariance C of the data's noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MomentWeights {
    /// The rows of observables that were not measured are 0.
    triangle: MomentMatrix,
    /// C.
    covariance: MomentMatrix,
    observables: ObservableSet,
}

impl MomentWeights {
    /// Returns the weights of set number `set` of the data; `None` if its noise is not known, or if an
    /// observable has none of its own.
    pub fn of_data(data: &Data, set: usize) -> Option<Self> {
        let found = data_noise(data, set)?;
        // The covariance is nearly singular: two velocities have the same spread about their mean.
        let few = found.freedom + 1 < PARTS_MIN;
        let normal = few.then(|| normal_law_noise(data, set)).flatten();
        Self::of_covariance(normal.unwrap_or(found).covariance, data.observables())
    }

    /// Returns the weights for a covariance of these observables and the moments of the velocities; `None`
    /// if a variance is not finite and above 0, or that of an observable follows from the others.
    pub fn of_covariance(covariance: MomentMatrix, observables: ObservableSet) -> Option<Self> {
        let [mean, variation] = [0, 1].map(|axis| covariance[axis][axis]);
        if !(mean > 0.0 && mean.is_finite() && variation > 0.0 && variation.is_finite()) {
            return None;
        }
        let [mean, variation] = [mean.sqrt(), variation.sqrt()];
        let correlation = covariance[0][1] / (mean * variation);
        let correlation = correlation.clamp(-CORRELATION_MAX, CORRELATION_MAX);
        let left = variation * (1.0 - correlation * correlation).sqrt();
        let (mut factor, mut triangle) = ([[0.0; MOMENTS]; MOMENTS], [[0.0; MOMENTS]; MOMENTS]);
        factor[0][0] = mean;
        factor[1][..2].copy_from_slice(&[correlation * variation, left]);
        triangle[0][0] = 1.0 / mean;
        triangle[1][..2].copy_from_slice(&[-correlation * variation / (mean * left), 1.0 / left]);
        for row in observables.members().map(|one| 2 + one as usize) {
            for column in 0..row {
                let known = dot(&factor[row][..column], &factor[column]);
                // The factor of an observable that was not measured is 0.
                if factor[column][column] > 0.0 {
                    factor[row][column] =
                        (covariance[row][column] - known) / factor[column][column];
                }
            }
            let variance = covariance[row][row];
            let own = variance - dot(&factor[row][..row], &factor[row]);
            if !(own > INDEPENDENT_MIN * variance && own.is_finite()) {
                return None;
            }
            factor[row][row] = own.sqrt();
            triangle[row] = inverse_row(row, &factor, &triangle);
        }
        Some(Self { triangle, covariance, observables })
    }

    /// Returns the weights where the means of the model's observables have these relative errors, which
    /// add to those of the data.
    #[must_use]
    pub fn with_errors_of_observables(self, errors: &MomentVector) -> Self {
        let mut covariance = self.covariance;
        for (axis, error) in errors.iter().enumerate().skip(2) {
            covariance[axis][axis] += error * error;
        }
        Self::of_covariance(covariance, self.observables).unwrap_or(self)
    }

    /// Returns W r, whose components have independent errors of 1.
    pub fn whiten(&self, r: MomentVector) -> MomentVector {
        self.triangle.map(|row| dot(&row, &r))
    }

    /// Returns Wᵀ t.
    pub(super) fn transposed(&self, t: &MomentVector) -> MomentVector {
        std::array::from_fn(|axis| self.triangle.iter().zip(t).map(|(row, t)| row[axis] * t).sum())
    }

    /// Returns the same weights with the largest of them being 1, for sums of squares whose scale
    /// does not matter.
    #[must_use]
    pub fn normalized(self) -> Self {
        let largest = self.triangle.iter().flatten().fold(0.0_f64, |most, one| most.max(one.abs()));
        Self { triangle: self.triangle.map(|row| row.map(|one| one / largest)), ..self }
    }

    /// Returns χ² of differences of the compared moments.
    pub fn square(&self, differences: MomentVector) -> f64 {
        sum_of_squares(&self.whiten(differences))
    }

    /// Returns the part of χ² by which the observables differ from what is expected of them, given the
    /// differences of the moments of the velocities.
    pub fn square_given_velocities(&self, differences: MomentVector) -> f64 {
        sum_of_squares(&self.whiten(differences)[2..])
    }

    /// Returns χ² of a model's moments.
    pub fn cost(&self, data: &ComparedMoments, model: &ComparedMoments) -> f64 {
        self.square(model.differences(data))
    }

    /// Returns the largest sum of squares of differences for which χ² is surely at most `square`.
    pub fn relative_squares(&self, square: f64) -> f64 {
        square / self.triangle.iter().map(|row| sum_of_squares(row)).sum::<f64>()
    }

    /// Returns the expectation of χ² if the differences have no other cause than independent errors
    /// with these standard deviations.
    pub fn of_errors(&self, errors: MomentVector) -> f64 {
        let of_one = |axis: usize| {
            let mut alone = [0.0; MOMENTS];
            alone[axis] = errors[axis];
            self.square(alone)
        };
        (0..MOMENTS).map(of_one).sum()
    }

    /// Returns the entries of W for (ln v, ln Δ).
    fn of_velocities(&self) -> [f64; 3] {
        [self.triangle[0][0], self.triangle[1][0], self.triangle[1][1]]
    }

    /// Returns the smallest χ² of the differences between these ends, (ln v, ln Δ) each, if no
    /// observable differs; NaN if an end is.
    pub fn smallest(&self, lower: [f64; 2], upper: [f64; 2]) -> f64 {
        let [mean, cross, variation] = self.of_velocities();
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
            -cross * variation / (mean * mean + cross * cross),
            -cross / variation,
        ];
        let on_edge = |fixed: usize, value: f64| {
            let other = 1 - fixed;
            let mut at = [0.0; MOMENTS];
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

/// Returns row number `row` of the inverse of a lower triangle, given the rows before it.
fn inverse_row(row: usize, factor: &MomentMatrix, inverse: &MomentMatrix) -> MomentVector {
    let mut solved = [0.0; MOMENTS];
    for (column, value) in solved.iter_mut().enumerate().take(row) {
        let known: f64 = (column..row).map(|k| factor[row][k] * inverse[k][column]).sum();
        *value = -known / factor[row][row];
    }
    solved[row] = 1.0 / factor[row][row];
    solved
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).fold(0.0, |sum, (a, b)| sum + a * b)
}

fn sum_of_squares(values: &[f64]) -> f64 {
    dot(values, values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Measurements;
    use crate::moments::moment_vector;
    use crate::observables::{Observable, PerObservable};
    use crate::statistics::measured_observables;

    const COVARIANCE: [[f64; 3]; 3] =
        [[4e-6, -6e-6, 3e-6], [-6e-6, 25e-6, 8e-6], [3e-6, 8e-6, 9e-5]];
    const DECAY: usize = 2 + Observable::Decay as usize;

    /// Returns the weights of [`COVARIANCE`], whose third row is that of the decay, if there is one.
    fn weights(with_decay: bool) -> Option<MomentWeights> {
        let axes = [0, 1, DECAY];
        let mut covariance = [[0.0; MOMENTS]; MOMENTS];
        for (i, row) in axes.into_iter().zip(COVARIANCE) {
            axes.into_iter().zip(row).for_each(|(j, value)| covariance[i][j] = value);
        }
        let decay = |one| with_decay && one == Observable::Decay;
        MomentWeights::of_covariance(covariance, PerObservable::new(decay))
    }

    fn of_velocities([mean, variation]: [f64; 2]) -> MomentVector {
        moment_vector([mean, variation], |_| 0.0)
    }

    #[test]
    fn the_triangle_whitens_the_covariance() {
        let w = weights(true).unwrap().triangle;
        let axes = [0, 1, DECAY];
        for i in 0..3 {
            for j in 0..3 {
                let entries = (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
                let term = |(k, l): (usize, usize)| {
                    w[axes[i]][axes[k]] * COVARIANCE[k][l] * w[axes[j]][axes[l]]
                };
                let sum: f64 = entries.map(term).sum();
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((sum - expected).abs() < 1e-12, "{i} {j}: {sum}");
            }
        }
    }

    #[test]
    fn an_observable_that_follows_from_the_velocities_has_no_weights() {
        let data = |decays: Vec<f64>| {
            let velocities: Vec<f64> = (0..12).map(|k| 3900.0 + f64::from(k * k)).collect();
            let mut observables = PerObservable::default();
            observables[Observable::Decay] = Some(decays);
            let measurements = Measurements::Velocities { velocities, subjects: None, observables };
            Data { measurements, repeatability: 0.0, decay_error: 0.0 }
        };
        let scattered = data((0..12).map(|k| 4.5 + f64::from(k * 7 % 12) / 10.0).collect());
        let weights = MomentWeights::of_data(&scattered, 0).unwrap();
        let moments = scattered.compared(0);
        assert!(weights.cost(&moments, &moments) < 1e-20);
        // One standard error of the decay alone is at least one in χ².
        let mut off = moments;
        let decay = measured_observables(&scattered.set(0).unwrap())[Observable::Decay].unwrap();
        off.observables[Observable::Decay] = Some(decay.mean + decay.standard_error);
        assert!(weights.cost(&moments, &off) >= 1.0);
        // An error that all decays have in common adds to the variance that the velocities leave.
        let uncertain = Data { decay_error: 0.3, ..scattered.clone() };
        let cost = |data: &Data| MomentWeights::of_data(data, 0).unwrap().cost(&moments, &off);
        let (relative, change) = (0.3 / decay.mean, decay.standard_error / decay.mean);
        let added = change * change * (1.0 / cost(&uncertain) - 1.0 / cost(&scattered));
        assert!((added / (relative * relative) - 1.0).abs() < 1e-9, "{added}");
        assert_eq!(MomentWeights::of_data(&data(vec![4.5; 12]), 0), None);
        let following = (0..12).map(|k| 4.5 + 1e-3 * f64::from(k * k)).collect();
        assert_eq!(MomentWeights::of_data(&data(following), 0), None);
    }

    /// The inverse of the covariance, by its determinant.
    #[test]
    fn weights_are_those_of_the_inverse() {
        let weights = weights(false).unwrap();
        let [[a, b, _], [_, d, _], _] = COVARIANCE;
        let determinant = a * d - b * b;
        for r in [[1e-3, 0.0], [0.0, 1e-3], [2e-3, -3e-3], [2e-3, 3e-3]] {
            let expected =
                (d * r[0] * r[0] - 2.0 * b * r[0] * r[1] + a * r[1] * r[1]) / determinant;
            assert!((weights.square(of_velocities(r)) / expected - 1.0).abs() < 1e-12, "{r:?}");
        }
        let mut without = [[0.0; MOMENTS]; MOMENTS];
        without[1][1] = 1.0;
        assert_eq!(MomentWeights::of_covariance(without, ObservableSet::NONE), None);
    }

    #[test]
    fn relative_squares_bound_chi_square() {
        let weights = weights(false).unwrap();
        let radius = weights.relative_squares(0.25).sqrt();
        let angles = (0..360).map(|degrees| f64::from(degrees).to_radians());
        let squares = angles.map(|angle| {
            weights.square(of_velocities([radius * libm::cos(angle), radius * libm::sin(angle)]))
        });
        let largest = squares.fold(0.0, f64::max);
        assert!((0.1..=0.25).contains(&largest), "{largest}");
    }

    #[test]
    fn the_smallest_of_a_rectangle_is_that_of_a_fine_grid() {
        let weights = weights(false).unwrap();
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
            let least = grid.map(|(i, j)| weights.square(of_velocities([at(0, i), at(1, j)])));
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
