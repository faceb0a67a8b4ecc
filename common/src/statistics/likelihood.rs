//! The likelihood of measured velocities under the law of the model's.
//!
//! With v and σ the mean and the standard deviation of the model's velocities V_k, N their number and
//! z_k = (V_k - V̄) / s their standardised values,
//!
//! f(x) = (1 - ε) (1/N) Σ K_b((x - v)/σ - c z_k) / σ + ε / (π σ (1 + ((x - v)/σ)²)),     c = 1/√(1 + b²),
//!
//! and the cost of n measured velocities is -(1/n) Σ ln f(x_j), in nats, velocities in m/s.
//!
//! - b = 1.8 min(1, IQR/(1.34 s)) N^(-1/5) is the bandwidth in units of s, twice that of B. W. Silverman,
//!   "Density Estimation for Statistics and Data Analysis" (1986), Eq. 3.31, and not below a tenth of what it is
//!   by s alone. His serves the density itself; here its noise, of which the logarithm makes a bias of the
//!   dispersion, has to be smaller: with 1.8 it is a sixth of the sampling error, with 0.9 it was half.
//! - A kernel widens the law: its variance is that of the sample plus the kernel's. Shrinking by c takes that
//!   back (Silverman, Sec. 6.4.1), so that the density has the mean v and the standard deviation σ that are
//!   reported, those of the control variate where it is used.
//! - The second term is the floor, a Cauchy law of the weight ε: a velocity far from all of the model's has a
//!   finite cost, and one that still says in which direction the model's law is to be moved.

mod location_scale;

use super::kernel_density::KernelDensity;
use super::sum::Sum;
use super::{PointStatistics, Sample, blocks};
use crate::job::{MonteCarlo, Sampling};
use crate::outcome::Outcome;
use crate::parameters::Point;
use crate::quantile::quantile;
use crate::results::Moments;

pub use self::location_scale::{LikelihoodFit, likelihood_fit};

/// Weight ε of the floor: it exceeds a normal law from 4.4 standard deviations on, and biases a
/// standard deviation by less than 1e-4 of it.
const FLOOR: f64 = 1e-4;
/// The bandwidth in units of the smaller measure of scale, times N^(1/5): twice Silverman's.
const RULE: f64 = 1.8;
/// Interquartile range of a normal law in standard deviations, as the rule rounds it.
const NORMAL_RANGE: f64 = 1.34;
/// A bandwidth is at least this fraction of the one by the standard deviation, however narrow the
/// middle half is compared to the tails; this limits the size of the grid.
const NARROWEST: f64 = 0.1;

/// Returns minus the mean log likelihood of `measured` velocities (m/s) at a point, nats; infinite
/// at an infeasible point, and if all velocities of the model are equal. Failed realizations are
/// not part of the model's law.
pub fn likelihood_cost(
    statistics: &PointStatistics,
    monte_carlo: &MonteCarlo,
    point: &Point,
    outcomes: &[Outcome],
    measured: &[f64],
) -> f64 {
    let law =
        if statistics.feasible { Law::from_outcomes(monte_carlo, point, outcomes) } else { None };
    law.map_or(f64::INFINITY, |law| law.cost(measured))
}

/// Returns the standard error of [`likelihood_cost`] due to the sampling noise of the model's
/// velocities, for fixed measured velocities. `None` if the model has no law.
///
/// To first order it is the influence of each velocity of the model on the cost, with the bandwidth
/// in units of the standard deviation held constant. That vanishes where the likelihood is largest;
/// the second-order error is therefore added, the scatter of half the mean square of the density's
/// relative noise,
///
/// κ √(½ √(2π) β L),     κ = 1/(2 √π N β),     L = (1/n) Σ min(k(x_j) / (σ f(x_j)²), 1/κ),
///
/// β = c b the kernel's standard deviation in units of σ, k the kernels' part of f: relative noise
/// has the variance κ k/(σ f²) and the correlation exp(-d²/(4β²)) over the distance d. For Sobol'
/// points it is equal or smaller.
pub fn likelihood_error(
    monte_carlo: &MonteCarlo,
    point: &Point,
    outcomes: &[Outcome],
    measured: &[f64],
) -> Option<f64> {
    let law = Law::from_outcomes(monte_carlo, point, outcomes)?;
    let influences = law.influences(outcomes, measured);
    let successes = law.sample.central.count;
    let first = match monte_carlo.sampling {
        Sampling::MonteCarlo => {
            let mut squares = Sum::default();
            influences.iter().for_each(|influence| squares.add(influence * influence));
            (squares.total() / (successes - 1.0) / successes).sqrt()
        }
        Sampling::Sobol => {
            let pairs = influences.iter().map(|&influence| [influence, influence]);
            blocks::standard_error(
                pairs,
                blocks::DoublingFactors::CONTROLLED,
                monte_carlo,
                successes,
            )
            .mean
        }
    };
    let second = law.second_order_error(measured);
    Some(first.mul_add(first, second * second).sqrt())
}

/// The law of the model's velocities.
struct Law<'a> {
    sample: Sample<'a>,
    /// v, m/s.
    mean: f64,
    /// σ, m/s.
    deviation: f64,
    /// V̄ and s, m/s.
    sampled: (f64, f64),
    /// c.
    shrinkage: f64,
    /// c b.
    width: f64,
    density: KernelDensity,
}

/// The contributions of the kernels and of the floor to f, both times σ, with their derivatives by
/// (x - v)/σ.
struct DensityParts {
    kernels: (f64, f64),
    floor: (f64, f64),
}

/// Derivatives of the cost with respect to v, per m/s, and to ln σ.
#[derive(Clone, Copy, Default)]
struct Gradient {
    mean: Sum,
    deviation: Sum,
}

impl<'a> Law<'a> {
    fn from_outcomes(
        monte_carlo: &MonteCarlo,
        point: &Point,
        outcomes: &'a [Outcome],
    ) -> Option<Self> {
        let sample = Sample::from_outcomes(monte_carlo, point, outcomes)?;
        let Moments { mean, coefficient_of_variation } = sample.moments();
        let plain = sample.central.moments();
        let sampled = (plain.mean, plain.coefficient_of_variation * plain.mean);
        let deviation = coefficient_of_variation * mean;
        if !(deviation > 0.0 && deviation.is_finite() && sampled.1 > 0.0 && sampled.1.is_finite()) {
            return None;
        }
        let successes = outcomes.iter().filter_map(|outcome| outcome.ok());
        let mut scores: Vec<f64> =
            successes.map(|velocity| (velocity - sampled.0) / sampled.1).collect();
        let bandwidth = bandwidth(&scores)?;
        let shrinkage = 1.0 / bandwidth.mul_add(bandwidth, 1.0).sqrt();
        scores.iter_mut().for_each(|score| *score *= shrinkage);
        let width = shrinkage * bandwidth;
        let density = KernelDensity::new(&scores, width);
        Some(Self { sample, mean, deviation, sampled, shrinkage, width, density })
    }

    fn cost(&self, measured: &[f64]) -> f64 {
        let mut sum = Sum::default();
        for &velocity in measured {
            sum.add(libm::log(self.parts(self.score(velocity)).density()));
        }
        libm::log(self.deviation) - sum.total() / measured.len() as f64
    }

    /// Returns (x - v)/σ of a velocity.
    fn score(&self, velocity: f64) -> f64 {
        (velocity - self.mean) / self.deviation
    }

    fn parts(&self, score: f64) -> DensityParts {
        let (density, slope) = self.density.at(score);
        let cauchy = FLOOR / (std::f64::consts::PI * score.mul_add(score, 1.0));
        let falling = -2.0 * score * cauchy / score.mul_add(score, 1.0);
        DensityParts {
            kernels: ((1.0 - FLOOR) * density, (1.0 - FLOOR) * slope),
            floor: (cauchy, falling),
        }
    }

    /// Returns N times the influence of each realization on the cost, to first order, in index
    /// order; 0 for failures.
    ///
    /// A larger weight of a realization raises the density around itself, and moves v, σ, V̄ and s.
    /// The density of scores keeps its kernels; V̄ and s only move their positions.
    fn influences(&self, outcomes: &[Outcome], measured: &[f64]) -> Vec<f64> {
        let count = measured.len() as f64;
        let [of_kernels, of_floor] = self.gradients(measured);
        let weights = measured.iter().map(|&velocity| {
            let score = self.score(velocity);
            (score, (1.0 - FLOOR) / (count * self.parts(score).density()))
        });
        let nearby = self.density.reversed(weights);
        let c = self.shrinkage;
        let of = |velocity: f64, [mean, variation]: [f64; 2]| {
            let score = (velocity - self.sampled.0) / self.sampled.1;
            let deviation = mean / self.mean + variation * self.mean / self.deviation;
            let kernels = of_kernels.along(
                mean - c * self.deviation * score,
                deviation - 0.5 * c * c * (score * score - 1.0),
            );
            kernels + of_floor.along(mean, deviation) - nearby(c * score)
        };
        let of_moments = self.sample.influences();
        let mut influences: Vec<f64> = outcomes
            .iter()
            .zip(of_moments)
            .map(|(outcome, moments)| outcome.map_or(0.0, |velocity| of(velocity, moments)))
            .collect();
        // Weights add up to 1: more of one means less of all others.
        let mut sum = Sum::default();
        influences.iter().for_each(|&influence| sum.add(influence));
        let average = sum.total() / self.sample.central.count;
        for (influence, _) in influences.iter_mut().zip(outcomes).filter(|(_, o)| o.is_ok()) {
            *influence -= average;
        }
        influences
    }

    /// Returns the second-order error due to the noise of the density, which remains where the
    /// influences vanish.
    fn second_order_error(&self, measured: &[f64]) -> f64 {
        use std::f64::consts::PI;
        let noise = 1.0 / (2.0 * PI.sqrt() * self.sample.central.count * self.width);
        let mut sum = Sum::default();
        for &velocity in measured {
            let parts = self.parts(self.score(velocity));
            let density = parts.density();
            // The expansion is not valid where less than one kernel contributes.
            sum.add((parts.kernels.0 / (density * density)).min(1.0 / noise));
        }
        let extent = sum.total() / measured.len() as f64;
        noise * (0.5 * (2.0 * PI).sqrt() * self.width * extent).sqrt()
    }

    /// Returns the gradients of the kernels' part and of the floor's part.
    fn gradients(&self, measured: &[f64]) -> [Gradient; 2] {
        let count = measured.len() as f64;
        let mut gradients = [Gradient::default(); 2];
        for &velocity in measured {
            let score = self.score(velocity);
            let parts = self.parts(score);
            let weight = 1.0 / (count * parts.density());
            for (gradient, (value, slope)) in gradients.iter_mut().zip([parts.kernels, parts.floor])
            {
                gradient.mean.add(weight * slope / self.deviation);
                gradient.deviation.add(weight * score.mul_add(slope, value));
            }
        }
        gradients
    }
}

impl DensityParts {
    fn density(&self) -> f64 {
        self.kernels.0 + self.floor.0
    }
}

impl Gradient {
    /// Returns the change with v by `mean` and ln σ by `deviation`.
    fn along(&self, mean: f64, deviation: f64) -> f64 {
        self.mean.total() * mean + self.deviation.total() * deviation
    }
}

/// Returns b of standardised values.
fn bandwidth(scores: &[f64]) -> Option<f64> {
    let mut ascending = scores.to_vec();
    ascending.sort_unstable_by(f64::total_cmp);
    let range = quantile(&ascending, 0.75)? - quantile(&ascending, 0.25)?;
    let scale = (range / NORMAL_RANGE).clamp(NARROWEST, 1.0);
    Some(RULE * scale * libm::pow(scores.len() as f64, -0.2))
}

#[cfg(test)]
mod tests;
