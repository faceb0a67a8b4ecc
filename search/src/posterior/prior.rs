//! The prior of each free parameter within its bounds.

use osteon_common::job::{JobSpecification, PosteriorPrior, Range};
use osteon_common::parameters::Parameter;
use osteon_common::special::{normal_probability, standard_normal_quantile};

/// Number of points of a law whose standard deviation is computed.
const DEVIATION_POINTS: u32 = 1000;

/// Returns the standard deviation of the prior of a parameter, in its unit; `None` if it is not free.
pub fn prior_deviation(specification: &JobSpecification, parameter: Parameter) -> Option<f64> {
    let priors = ParameterPrior::of_job(specification);
    priors.iter().find(|prior| prior.parameter == parameter).map(ParameterPrior::deviation)
}

/// The prior law of one free parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ParameterPrior {
    pub(super) parameter: Parameter,
    pub(super) lower: f64,
    pub(super) upper: f64,
    law: PosteriorPrior,
    /// Whether the bounds are above the law's centre. Then it is mirrored: probabilities close to 1
    /// would have lost their digits.
    mirrored: bool,
    /// Probabilities of the law below both bounds.
    below: [f64; 2],
}

impl ParameterPrior {
    /// Returns the priors of the free parameters of a job.
    pub(super) fn of_job(specification: &JobSpecification) -> Vec<Self> {
        let priors = specification.posterior.unwrap_or_default().priors;
        let of = |parameter: Parameter| match specification.range(parameter) {
            Range::Fixed(_) => None,
            Range::Free { lower, upper, .. } => {
                Some(Self::new(parameter, lower, upper, priors[parameter as usize]))
            }
        };
        Parameter::ALL.into_iter().filter_map(of).collect()
    }

    fn new(parameter: Parameter, lower: f64, upper: f64, law: PosteriorPrior) -> Self {
        let prior = Self { parameter, lower, upper, law, mirrored: false, below: [0.0, 1.0] };
        if law == PosteriorPrior::Uniform {
            return prior;
        }
        let [low, high] = [lower, upper].map(|bound| prior.score(bound));
        let mirrored = low > 0.0;
        let scores = if mirrored { [-high, -low] } else { [low, high] };
        Self { mirrored, below: scores.map(normal_probability), ..prior }
    }

    /// Returns the value below which the prior has this probability.
    pub(super) fn quantile(&self, u: f64) -> f64 {
        let value = match self.law {
            PosteriorPrior::Uniform => self.lower + u * (self.upper - self.lower),
            PosteriorPrior::Normal { center, spread } => center + spread * self.normal_score(u),
            PosteriorPrior::LogNormal { center, spread } => {
                center * libm::exp(spread * self.normal_score(u))
            }
        };
        value.clamp(self.lower, self.upper)
    }

    /// Returns the probability of the prior below a value within the bounds, of which
    /// [`quantile`](Self::quantile) is the inverse.
    pub(super) fn probability_below(&self, value: f64) -> f64 {
        let [low, high] = self.below;
        let below = match self.law {
            PosteriorPrior::Uniform => return (value - self.lower) / (self.upper - self.lower),
            _ if self.mirrored => normal_probability(-self.score(value)),
            _ => normal_probability(self.score(value)),
        };
        let u = (below - low) / (high - low);
        if self.mirrored { 1.0 - u } else { u }
    }

    /// Returns the logarithm of the density at a value, up to a constant; `None` outside the
    /// bounds.
    pub(super) fn log_density(&self, value: f64) -> Option<f64> {
        let possible = value > 0.0 || !matches!(self.law, PosteriorPrior::LogNormal { .. });
        let within = (self.lower..=self.upper).contains(&value);
        (within && possible).then(|| match self.law {
            PosteriorPrior::Uniform => 0.0,
            PosteriorPrior::Normal { .. } => -0.5 * self.score(value) * self.score(value),
            PosteriorPrior::LogNormal { .. } => {
                -0.5 * self.score(value) * self.score(value) - libm::log(value / self.upper)
            }
        })
    }

    /// Returns the standard deviation, by midpoints of equal probability.
    pub(super) fn deviation(&self) -> f64 {
        let values: Vec<f64> = (0..DEVIATION_POINTS)
            .map(|k| self.quantile((f64::from(k) + 0.5) / f64::from(DEVIATION_POINTS)))
            .collect();
        let count = f64::from(DEVIATION_POINTS);
        let mean = values.iter().sum::<f64>() / count;
        (values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count).sqrt()
    }

    /// Returns the distance between the quantiles at 25 and 75 %.
    pub(super) fn middle_half(&self) -> f64 {
        self.quantile(0.75) - self.quantile(0.25)
    }

    /// Returns a value as a number of spreads from the center.
    fn score(&self, value: f64) -> f64 {
        match self.law {
            PosteriorPrior::Uniform => 0.0,
            PosteriorPrior::Normal { center, spread } => (value - center) / spread,
            PosteriorPrior::LogNormal { .. } if value <= 0.0 => f64::NEG_INFINITY,
            PosteriorPrior::LogNormal { center, spread } => libm::log(value / center) / spread,
        }
    }

    /// Returns the quantile of the truncated standard normal law.
    fn normal_score(&self, u: f64) -> f64 {
        let [low, high] = self.below;
        let u = if self.mirrored { 1.0 - u } else { u };
        let tiny = f64::MIN_POSITIVE;
        let below = (low + u * (high - low)).clamp(tiny, 1.0 - f64::EPSILON);
        let score = standard_normal_quantile(below);
        if self.mirrored { -score } else { score }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prior(law: PosteriorPrior) -> ParameterPrior {
        ParameterPrior::new(Parameter::Density, 1500.0, 2000.0, law)
    }

    #[test]
    fn quantiles_are_those_of_the_truncated_laws() {
        let uniform = prior(PosteriorPrior::Uniform);
        assert_eq!(uniform.probability_below(1750.0), 0.5);
        assert_eq!((uniform.quantile(0.0), uniform.quantile(0.5)), (1500.0, 1750.0));
        let normal = prior(PosteriorPrior::Normal { center: 1700.0, spread: 20.0 });
        assert!((normal.quantile(0.5) - 1700.0).abs() < 1e-6);
        assert!((normal.quantile(0.841_344_746) - 1720.0).abs() < 1e-4);
        // Half of this law is cut off.
        let cut = prior(PosteriorPrior::Normal { center: 2000.0, spread: 20.0 });
        assert!((cut.quantile(0.5) - (2000.0 - 0.674_489_75 * 20.0)).abs() < 1e-4);
        // Only the outermost tails are left of these, which mirror each other.
        let [above, below] = [1420.0, 2080.0].map(|center| {
            let law = prior(PosteriorPrior::Normal { center, spread: 10.0 });
            [0.05, 0.5, 0.95].map(|u| law.quantile(u))
        });
        for (k, part) in [0.05, 0.5, 0.95].into_iter().enumerate() {
            // An exponential law with the rate 8/10 is close by.
            let near = -1.25 * libm::log(1.0 - part);
            assert!(
                (above[k] - 1500.0 + below[2 - k] - 2000.0).abs() < 1e-6,
                "{above:?} {below:?}"
            );
            assert!((above[k] - 1500.0 - near).abs() < 0.05 * near, "{above:?}");
        }
        let log = prior(PosteriorPrior::LogNormal { center: 1700.0, spread: 0.01 });
        assert!((log.quantile(0.841_344_746) - 1700.0 * libm::exp(0.01)).abs() < 1e-3);
    }

    /// Poisson ratios may have a negative bound.
    #[test]
    fn a_law_of_positive_values_has_none_below_zero() {
        let law = PosteriorPrior::LogNormal { center: 0.3, spread: 0.1 };
        let prior = ParameterPrior::new(Parameter::TransversePoissonRatio, -0.2, 0.5, law);
        assert!((prior.quantile(0.5) - 0.3).abs() < 1e-6, "{}", prior.quantile(0.5));
        assert_eq!(prior.log_density(-0.1), None);
        assert_eq!(prior.log_density(0.0), None);
    }

    #[test]
    fn densities_are_the_derivatives_of_probabilities() {
        for law in [
            PosteriorPrior::Uniform,
            PosteriorPrior::Normal { center: 1600.0, spread: 150.0 },
            PosteriorPrior::LogNormal { center: 1900.0, spread: 0.1 },
        ] {
            let prior = prior(law);
            let density = |u: f64| 1e-4 / (prior.quantile(u + 5e-5) - prior.quantile(u - 5e-5));
            let back = prior.probability_below(prior.quantile(0.3));
            assert!((back - 0.3).abs() < 1e-9, "{law:?}: {back}");
            let log = |u: f64| prior.log_density(prior.quantile(u)).unwrap();
            let found = log(0.3) - log(0.8);
            assert!((found - libm::log(density(0.3) / density(0.8))).abs() < 1e-5, "{law:?}");
            assert_eq!(prior.log_density(1499.0), None);
        }
    }
}
