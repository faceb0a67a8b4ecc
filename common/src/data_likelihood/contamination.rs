//! Velocities that may be wrong: each is, with probability ε, from a broad law instead of the
//! model's.
//!
//! The broad law is a Cauchy law about the median of the data with a scale of ten robust standard
//! deviations. ε is unknown; its prior is Beta(1, 49), with a mean of 1/50, and it is integrated out.
//! Velocities near the median, the core, count as the model's, which keeps their sums sufficient: for
//! independent ones its density is ten times ε times the broad law's at the end of the core. With subjects
//! the core reaches as far as velocities are not outlying. All others are mixtures.

use std::f64::consts::PI;

use crate::robust::RobustScale;

/// Scale of the broad law in robust standard deviations.
const BROAD: f64 = 10.0;
/// Second parameter b of the prior of ε, Beta(1, b), whose density is b (1 - ε)^(b - 1).
const PRIOR: f64 = 49.0;
/// Number of values of ε, evenly spaced in ln ε.
const RATES: usize = 24;
/// Distance from the median, in robust standard deviations, within which independent velocities are
/// of the core: a normal density there is ten times ε times the broad law's for ε = 0.015.
const CORE: f64 = 3.0;
/// Velocities outside the core that are this close together, in robust standard deviations, count as
/// equal; for more different ones than [`OUTSIDE_MAX`], the distance is doubled until they fit.
const CLOSE: f64 = 0.01;
/// Maximum number of different velocities outside the core.
const OUTSIDE_MAX: usize = 200;
/// Number of mixture densities, in units of the broad law's, that are multiplied before a logarithm is
/// taken. Each is at least ε, so that the product does not underflow.
const FACTORS: usize = 16;

/// Velocities that are not in the core, and the laws that they may have.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Contamination {
    /// The velocities outside the core, in ascending order.
    outside: Vec<OutsideVelocity>,
    /// Values of ε, with the logarithm of their weight times (1 - ε) for each velocity of the core.
    rates: Vec<(f64, f64)>,
}

/// Velocities outside the core that are nearly equal.
#[derive(Debug, Clone, Copy, PartialEq)]
struct OutsideVelocity {
    /// Distance from the centre of the likelihood, m/s.
    offset: f64,
    count: f64,
    /// Density of the broad law there, per m/s.
    broad: f64,
}

/// Share of wrong velocities among the data, and which ones they probably are.
#[derive(Debug, Clone, PartialEq)]
pub struct OutlierShare {
    /// Posterior mean of ε, the probability that a velocity is not from the model's law.
    pub mean: f64,
    /// Velocities outside the core (m/s; nearly equal ones once), each with the probability that it
    /// is not from the model's law.
    pub probabilities: Vec<(f64, f64)>,
}

impl Contamination {
    /// Returns whether a velocity is outside the core, given whether the velocities have subjects:
    /// those are then kept together as far as possible.
    pub(super) fn is_outside_core(scale: &RobustScale, velocity: f64, has_subjects: bool) -> bool {
        let radius = if has_subjects { scale.outlying_from } else { CORE };
        scale.deviations(velocity).abs() > radius
    }

    /// Creates it for `core` velocities in the core and the others, `outside` (m/s); `None` if there are no
    /// others. `centre` is that of the likelihood.
    pub(super) fn new(
        scale: &RobustScale,
        core: usize,
        outside: &[f64],
        centre: f64,
    ) -> Option<Self> {
        if outside.is_empty() {
            return None;
        }
        let mut ascending = outside.to_vec();
        ascending.sort_unstable_by(f64::total_cmp);
        let merged = |close: f64| merged(&ascending, close * scale.deviation);
        let mut close = CLOSE;
        let mut different = merged(close);
        while different.len() > OUTSIDE_MAX {
            close *= 2.0;
            different = merged(close);
        }
        let velocity = |(velocity, count): (f64, f64)| {
            let score = scale.deviations(velocity) / BROAD;
            let broad = 1.0 / (PI * BROAD * scale.deviation * score.mul_add(score, 1.0));
            OutsideVelocity { offset: velocity - centre, count, broad }
        };
        let outside = different.into_iter().map(velocity).collect::<Vec<OutsideVelocity>>();
        let outside_count: f64 = outside.iter().map(|one| one.count).sum();
        Some(Self { outside, rates: rates(core as f64, outside_count) })
    }

    /// Returns the logarithm of the density of the velocities outside the core, times (1 - ε) for
    /// each of the core, averaged over ε, for a normal law with this mean, as distance from the
    /// centre (m/s), and this variance (m²/s²). Up to a constant.
    pub(super) fn log(&self, mean: f64, variance: f64) -> f64 {
        log_of_sum(self.logs(mean, variance).into_iter())
    }

    /// Returns the posterior of ε for such a law.
    pub(super) fn share(&self, mean: f64, variance: f64, centre: f64) -> OutlierShare {
        let logs = self.logs(mean, variance);
        let largest = logs.iter().fold(f64::NEG_INFINITY, |largest, log| largest.max(*log));
        let weights: Vec<f64> = logs.iter().map(|log| libm::exp(log - largest)).collect();
        let total: f64 = weights.iter().sum();
        let average = |of: &dyn Fn(f64) -> f64| {
            let values = self.rates.iter().zip(&weights).map(|((rate, _), w)| w * of(*rate));
            values.sum::<f64>() / total
        };
        let normal = Ratio::new(mean, variance);
        let probability = |one: &OutsideVelocity| {
            let ratio = normal.at(one);
            average(&|rate| rate / ((1.0 - rate) * ratio + rate))
        };
        OutlierShare {
            mean: average(&|rate| rate),
            probabilities: self
                .outside
                .iter()
                .map(|f| (centre + f.offset, probability(f)))
                .collect(),
        }
    }

    /// Returns the logarithms for each ε.
    fn logs(&self, mean: f64, variance: f64) -> Vec<f64> {
        let normal = Ratio::new(mean, variance);
        let ratios: Vec<(f64, f64)> =
            self.outside.iter().map(|one| (normal.at(one), one.count)).collect();
        let of = |&(rate, log_weight): &(f64, f64)| {
            let mixture = |ratio: f64| (1.0 - rate).mul_add(ratio, rate);
            let mut log = log_weight;
            for some in ratios.chunks(FACTORS) {
                let mut product = 1.0;
                for &(ratio, count) in some {
                    if count == 1.0 {
                        product *= mixture(ratio);
                    } else {
                        log += count * libm::log(mixture(ratio));
                    }
                }
                log += libm::log(product);
            }
            log
        };
        self.rates.iter().map(of).collect()
    }
}

/// Returns the logarithm of the sum of the exponentials.
pub(super) fn log_of_sum(logs: impl ExactSizeIterator<Item = f64>) -> f64 {
    if logs.len() == 1 {
        return logs.sum();
    }
    let logs: Vec<f64> = logs.collect();
    let largest = logs.iter().fold(f64::NEG_INFINITY, |largest, log| largest.max(*log));
    if !largest.is_finite() {
        return f64::NEG_INFINITY;
    }
    largest + libm::log(logs.iter().map(|log| libm::exp(log - largest)).sum())
}

/// Density of a normal law over that of the broad law.
struct Ratio {
    mean: f64,
    variance: f64,
    height: f64,
}

impl Ratio {
    fn new(mean: f64, variance: f64) -> Self {
        Self { mean, variance, height: 1.0 / (2.0 * PI * variance).sqrt() }
    }

    fn at(&self, velocity: &OutsideVelocity) -> f64 {
        let off = velocity.offset - self.mean;
        self.height * libm::exp(-0.5 * off * off / self.variance) / velocity.broad
    }
}

/// Returns the means of velocities in ascending order that are at most this far apart, with their
/// numbers.
fn merged(ascending: &[f64], close: f64) -> Vec<(f64, f64)> {
    let mut merged = Vec::new();
    let mut rest = ascending;
    while let Some(&first) = rest.first() {
        let together = rest.partition_point(|velocity| velocity - first <= close);
        let count = together as f64;
        let sum: f64 = rest[..together].iter().map(|velocity| velocity - first).sum();
        merged.push((first + sum / count, count));
        rest = &rest[together..];
    }
    merged
}

/// Returns values of ε that cover its posterior, with logarithms of their weights: from a tenth of
/// what a single wrong velocity would suggest to four times what all those outside the core would.
fn rates(core: f64, outside: f64) -> Vec<(f64, f64)> {
    let all = core + outside + PRIOR + 1.0;
    let [low, high] = [0.1 / all, (4.0 * (outside + 3.0) / all).min(0.9)];
    let step = libm::log(high / low) / RATES as f64;
    let rate = |k: usize| {
        let rate = low * libm::exp((k as f64 + 0.5) * step);
        // The prior's density by ln ε is ε 49 (1 - ε)⁴⁸.
        let log_weight = libm::log(rate) + (PRIOR - 1.0 + core) * libm::log1p(-rate);
        (rate, log_weight)
    };
    (0..RATES).map(rate).collect()
}
