//! Errors of the model's moments that are correlated, or many times as large as those of the data: those of a setup
//! that is not known exactly.
//!
//! The average of the likelihood over a normal law is a sum over nodes along its principal axes, in units of the
//! data's errors. Along an axis on which the law is wider than a data's error, nodes have a fixed distance, and
//! only those near the data are used.

use super::nodes::NORMAL_NODES;

/// Distance of nodes, in errors of the data, and how far they reach, in standard deviations of the law: the sum is
/// that of the integral to exp(-2 (π/1.5)²), 2e-4 of it.
const DISTANCE: f64 = 1.5;
const LIMIT: f64 = 4.5;

/// A normal law of errors of the logarithms of mean and coefficient of variation.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CorrelatedErrors {
    /// Logarithms of the data's moments.
    centre: [f64; 2],
    /// Distance from these, in units of the data's errors, beyond which the likelihood is negligible.
    reach: f64,
    axes: [PrincipalAxis; 2],
}

/// A principal axis of the law in units of the data's errors.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PrincipalAxis {
    /// Change of both logarithms by a step of one error of the data along the axis.
    step: [f64; 2],
    /// Change of the position along the axis, in errors of the data, by those of both logarithms.
    position: [f64; 2],
    /// Standard deviation along the axis, in errors of the data.
    width: f64,
}

impl CorrelatedErrors {
    /// Creates the law with this covariance for data with these moments (logarithms) and errors.
    pub(super) fn new(
        covariance: [[f64; 2]; 2],
        (centre, errors): ([f64; 2], [f64; 2]),
        reach: f64,
    ) -> Self {
        let scaled = |i: usize, j: usize| covariance[i][j] / (errors[i] * errors[j]);
        let (first, both, second) = (scaled(0, 0), scaled(0, 1), scaled(1, 1));
        let (sine, cosine) = libm::sincos(0.5 * libm::atan2(2.0 * both, first - second));
        let axis = |[x, y]: [f64; 2]| PrincipalAxis {
            step: [x * errors[0], y * errors[1]],
            position: [x / errors[0], y / errors[1]],
            width: (first * x * x + 2.0 * both * x * y + second * y * y).max(0.0).sqrt(),
        };
        Self { centre, reach, axes: [axis([cosine, sine]), axis([-sine, cosine])] }
    }

    /// Returns the errors that count for a model with these moments (logarithms), and the logarithms of their
    /// weights.
    pub(super) fn nodes(&self, at: [f64; 2]) -> Vec<([f64; 2], f64)> {
        let [first, second] = self.axes.map(|axis| {
            let offset = |k: usize| axis.position[k] * (at[k] - self.centre[k]);
            axis.nodes(offset(0) + offset(1), self.reach)
        });
        let [along_first, along_second] = self.axes.map(|axis| axis.step);
        let mut all = Vec::with_capacity(first.len() * second.len());
        for &(x, weight) in &first {
            for &(y, other) in &second {
                let error = [0, 1].map(|k| x * along_first[k] + y * along_second[k]);
                all.push((error, weight + other));
            }
        }
        all
    }
}

impl PrincipalAxis {
    /// Returns positions relative to a model's, in errors of the data, and logarithms of weights, given the model's
    /// position relative to the data's.
    fn nodes(&self, offset: f64, reach: f64) -> Vec<(f64, f64)> {
        // Nodes of the fixed distance would miss a law that is narrower than it.
        if self.width <= 1.0 {
            let node = |(z, weight): &(f64, f64)| (z * self.width, libm::log(*weight));
            return NORMAL_NODES.iter().map(node).collect();
        }
        let last = (LIMIT * self.width / DISTANCE).ceil();
        let place = |position: f64| (position / DISTANCE).clamp(-last, last);
        let (low, high) =
            (place(-reach - offset).ceil() as i64, place(reach - offset).floor() as i64);
        let scale = libm::log(DISTANCE / (self.width * (2.0 * std::f64::consts::PI).sqrt()));
        let node = |k: i64| {
            let (position, z) = (k as f64 * DISTANCE, k as f64 * DISTANCE / self.width);
            (position, scale - 0.5 * z * z)
        };
        (low..=high).map(node).collect()
    }
}
