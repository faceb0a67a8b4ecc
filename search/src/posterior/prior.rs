//! The prior of each free parameter within its bounds.

use osteon_common::job::{JobSpecification, PosteriorPrior, Range};
use osteon_common::parameters::Parameter;
use osteon_common::special::{normal_probability, standard_normal_quantile};

/// The prior law of one free parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ParameterPrior {
    pub(super) parameter: Parameter,
    pub(super) lower: f64,
    pub(super) upper: f64,
    law: PosteriorPrior,
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
        let prior = Self { parameter, lower, upper, law, below: [0.0, 1.0] };
        let below = match law {
            PosteriorPrior::Uniform => prior.below,
            PosteriorPrior::Normal { .. } | PosteriorPrior::LogNormal { .. } => {
                [lower, upper].map(|bound| normal_probability(prior.score(bound)))
            }
        };
        Self { below, ..prior }
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

    /// Returns the logarithm of the density at a value, up to a constant; `None` outside the
    /// bounds.
    pub(super) fn log_density(&self, value: f64) -> Option<f64> {
        let within = (self.lower..=self.upper).contains(&value);
        within.then(|| match self.law {
            PosteriorPrior::Uniform => 0.0,
            PosteriorPrior::Normal { .. } => -0.5 * self.score(value) * self.score(value),
            PosteriorPrior::LogNormal { .. } => {
                -0.5 * self.score(value) * self.score(value) - libm::log(value / self.upper)
            }
        })
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
            PosteriorPrior::LogNormal { center, spread } => libm::log(value / center) / spread,
        }
    }

    /// Returns the quantile of the truncated standard normal law.
    fn normal_score(&self, u: f64) -> f64 {
        let [low, high] = self.below;
        let tiny = f64::MIN_POSITIVE;
        standard_normal_quantile((low + u * (high - low)).clamp(tiny, 1.0 - f64::EPSILON))
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
        assert_eq!((uniform.quantile(0.0), uniform.quantile(0.5)), (1500.0, 1750.0));
        let normal = prior(PosteriorPrior::Normal { center: 1700.0, spread: 20.0 });
        assert!((normal.quantile(0.5) - 1700.0).abs() < 1e-6);
        assert!((normal.quantile(0.841_344_746) - 1720.0).abs() < 1e-4);
        // Half of this law is cut off.
        let cut = prior(PosteriorPrior::Normal { center: 2000.0, spread: 20.0 });
        assert!((cut.quantile(0.5) - (2000.0 - 0.674_489_75 * 20.0)).abs() < 1e-4);
        let log = prior(PosteriorPrior::LogNormal { center: 1700.0, spread: 0.01 });
        assert!((log.quantile(0.841_344_746) - 1700.0 * libm::exp(0.01)).abs() < 1e-3);
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
            let log = |u: f64| prior.log_density(prior.quantile(u)).unwrap();
            let found = log(0.3) - log(0.8);
            assert!((found - libm::log(density(0.3) / density(0.8))).abs() < 1e-5, "{law:?}");
            assert_eq!(prior.log_density(1499.0), None);
        }
    }
}
