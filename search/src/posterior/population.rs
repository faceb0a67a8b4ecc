//! Weighted points that stand for a posterior.

use osteon_common::moments::MomentVector;
use osteon_common::parameters::{PARAMETERS, Point};

/// A weighted point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Member {
    pub(super) point: Point,
    /// Compared moments by the interpolation, in logarithms.
    pub(super) moments: MomentVector,
    /// Logarithm of the weight, with any common factor.
    pub(super) log_weight: f64,
    /// Parameters other than the pivots, in the coordinates in which their prior is uniform from 0 to 1;
    /// the rest is 0.
    pub(super) coordinates: [f64; PARAMETERS],
}

/// Weighted points.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Population {
    pub(super) members: Vec<Member>,
    /// Their weights, with the sum 1.
    pub(super) weights: Vec<f64>,
}

impl Population {
    pub(super) fn new(members: Vec<Member>) -> Self {
        let logs = members.iter().map(|member| member.log_weight);
        let weights = normalised(&logs.collect::<Vec<f64>>());
        Self { members, weights }
    }

    /// Returns the effective number of independent draws, (Σ w)²/Σ w².
    pub(super) fn effective(&self) -> f64 {
        let squares: f64 = self.weights.iter().map(|weight| weight * weight).sum();
        if squares > 0.0 { 1.0 / squares } else { 0.0 }
    }

    /// Returns the weighted mean of a value of each member.
    pub(super) fn mean(&self, values: &[f64]) -> f64 {
        self.weights.iter().zip(values).map(|(weight, value)| weight * value).sum()
    }

    /// Returns the population with its weights multiplied by a factor for each member; as it is if
    /// nothing would be left.
    pub(super) fn reweighted(&self, factors: &[f64]) -> Self {
        let total = self.mean(factors);
        let mut changed = self.clone();
        if total > 0.0 && total.is_finite() {
            let weights = changed.weights.iter_mut().zip(factors);
            weights.for_each(|(weight, factor)| *weight *= factor / total);
        }
        changed
    }

    /// Returns members in proportion to their weights, in systematic steps; `offset` from 0 to 1
    /// shifts these.
    pub(super) fn resampled(&self, count: usize, offset: f64) -> Vec<&Member> {
        let chosen = self.resampled_indices(count, offset);
        chosen.into_iter().map(|index| &self.members[index]).collect()
    }

    /// Returns the places of [`resampled`](Self::resampled) members.
    pub(super) fn resampled_indices(&self, count: usize, offset: f64) -> Vec<usize> {
        let mut chosen = Vec::with_capacity(count);
        let mut below = 0.0;
        for (index, weight) in self.weights.iter().enumerate() {
            below += weight;
            while chosen.len() < count && (chosen.len() as f64 + offset) < below * count as f64 {
                chosen.push(index);
            }
        }
        // Rounding may leave the last step just beyond the last member.
        let last = chosen.last().copied();
        chosen.extend(last.into_iter().cycle().take(count - chosen.len()));
        chosen
    }
}

/// Returns the weights of these logarithms, with the sum 1.
pub(super) fn normalised(logs: &[f64]) -> Vec<f64> {
    let largest = logs.iter().fold(f64::NEG_INFINITY, |largest, log| largest.max(*log));
    let mut weights: Vec<f64> = logs.iter().map(|log| libm::exp(log - largest)).collect();
    let total: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= total);
    weights
}
