//! Mixtures of normal laws.

use crate::data_statistics::CONFIDENCE;
use crate::special::{normal_probability, standard_normal_quantile};

/// Steps of the search for a quantile; each at least halves what is left, and most square it.
const STEPS: usize = 60;
/// A quantile is found when the probability below it is off by less.
const TOLERANCE: f64 = 1e-9;
/// 1/√(2π).
const NORMAL_DENSITY: f64 = 0.398_942_280_401_432_7;

/// What is known of one number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PooledNumber {
    /// Its mean; of the scatter its median.
    pub value: f64,
    /// Standard deviation; of the scatter half the length of the interval that holds 68 %.
    pub standard_error: f64,
    /// Central 95 % interval.
    pub interval: [f64; 2],
}

/// One normal law with the probability with which it is the right one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Component {
    pub(super) weight: f64,
    pub(super) mean: f64,
    pub(super) deviation: f64,
}

/// A mixture of normal laws, whose weights add up to 1.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mixture(pub(super) Vec<Component>);

impl Mixture {
    /// Returns mean, standard deviation and central interval.
    pub(super) fn summary(&self) -> PooledNumber {
        let mean: f64 = self.0.iter().map(|one| one.weight * one.mean).sum();
        let second = |one: &Component| {
            let off = one.mean - mean;
            one.weight * one.deviation.mul_add(one.deviation, off * off)
        };
        let standard_error = self.0.iter().map(second).sum::<f64>().sqrt();
        let tail = 0.5 * (1.0 - CONFIDENCE);
        let end = |part: f64| self.quantile(part, mean, standard_error);
        PooledNumber { value: mean, standard_error, interval: [end(tail), end(1.0 - tail)] }
    }

    /// Returns the quantile, given mean and standard deviation, by Newton's steps within a bracket.
    fn quantile(&self, part: f64, mean: f64, deviation: f64) -> f64 {
        let at = |one: &Component| one.deviation.mul_add(standard_normal_quantile(part), one.mean);
        // The quantile is between those of the components.
        let mut low = self.0.iter().map(at).fold(f64::INFINITY, f64::min);
        let mut high = self.0.iter().map(at).fold(f64::NEG_INFINITY, f64::max);
        let mut x = deviation.mul_add(standard_normal_quantile(part), mean).clamp(low, high);
        for _ in 0..STEPS {
            let (below, density) = self.probability(x);
            let off = below - part;
            if off.abs() < TOLERANCE {
                break;
            }
            if off > 0.0 {
                high = x
            } else {
                low = x
            }
            let next = x - off / density;
            x = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        x
    }

    /// Returns the probability below a number, and the density there.
    fn probability(&self, x: f64) -> (f64, f64) {
        self.0.iter().fold((0.0, 0.0), |(below, density), one| {
            let z = (x - one.mean) / one.deviation;
            let here = NORMAL_DENSITY / one.deviation * libm::exp(-0.5 * z * z);
            (one.weight.mul_add(normal_probability(z), below), one.weight.mul_add(here, density))
        })
    }
}
