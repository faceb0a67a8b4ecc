//! The density of the posterior at a point whose moments are known, for programs that sample it
//! themselves.

use osteon_common::job::JobSpecification;
use osteon_common::moments::{ComparedMoments, MOMENTS, MomentVector};
use osteon_common::parameters::Point;

use super::likelihood::SetLikelihood;
use super::prior::ParameterPrior;

/// Likelihood of one set of data and priors of the free parameters.
#[derive(Debug, Clone)]
pub struct PosteriorDensity {
    likelihood: SetLikelihood,
    priors: Vec<ParameterPrior>,
}

impl PosteriorDensity {
    /// Creates the density for set number `set` of the data; `None` if there are no data, or if their
    /// noise is unknown.
    pub fn new(specification: &JobSpecification, set: usize) -> Option<Self> {
        let likelihood = SetLikelihood::new(specification, set)?;
        Some(Self { likelihood, priors: ParameterPrior::of_job(specification) })
    }

    /// Averages the likelihood over the sampling errors of the moments of the model's velocities, given as relative
    /// standard errors, which common germs make nearly the same at every point.
    #[must_use]
    pub fn with_model_errors(self, [mean, variation]: [f64; 2]) -> Self {
        let mut errors: MomentVector = [0.0; MOMENTS];
        (errors[0], errors[1]) = (mean, variation);
        Self { likelihood: self.likelihood.with_model_errors(errors), ..self }
    }

    /// Returns the logarithm of the prior density, nats, up to a constant; `None` outside the bounds.
    pub fn log_prior(&self, point: &Point) -> Option<f64> {
        self.priors.iter().map(|prior| prior.log_density(point.get(prior.parameter))).sum()
    }

    /// Returns the logarithm of likelihood times prior, nats, up to a constant, given the moments of
    /// the model at the point; `None` outside the bounds, and where it is not finite.
    pub fn log_density(&self, point: &Point, moments: &ComparedMoments) -> Option<f64> {
        let values = moments.in_logarithms(&self.likelihood.data);
        let density = self.log_prior(point)? + self.likelihood.log(&values);
        density.is_finite().then_some(density)
    }
}

#[cfg(test)]
mod tests {
    use osteon_common::case::Setup;
    use osteon_common::group_settings::GroupSettings;
    use osteon_common::job::{
        Data, JobKind, Measurements, MonteCarlo, Objective, PosteriorPrior, PosteriorSettings,
        Range, Search,
    };
    use osteon_common::moments::Moments;
    use osteon_common::observables::ObservedColumns;
    use osteon_common::random_quantities::RandomQuantities;
    use osteon_common::systematic::Systematic;

    use super::*;

    const MEAN: Moments = Moments { mean: 3900.0, coefficient_of_variation: 0.03 };

    fn job(data: Data) -> JobSpecification {
        let mut parameters = Range::of_bone(
            [1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1].map(Range::Fixed),
        );
        parameters[1] = Range::Free { start: 15e9, lower: 12e9, upper: 25e9 };
        let mut posterior = PosteriorSettings::default();
        posterior.priors[1] = PosteriorPrior::Normal { center: 18e9, spread: 1e9 };
        JobSpecification {
            kind: JobKind::Identification,
            setup: Setup::default(),
            data: Some(data),
            parameters,
            random: RandomQuantities::default(),
            systematic: Systematic::default(),
            groups: GroupSettings::default(),
            monte_carlo: MonteCarlo::default(),
            objective: Objective::Moments,
            search: Search::default(),
            posterior: Some(posterior),
        }
    }

    fn at(modulus: f64) -> Point {
        Point::of_bone([1598.8, modulus, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1])
    }

    /// For n velocities with known moments the likelihood is that of a normal sample.
    #[test]
    fn it_is_the_normal_likelihood_times_the_prior() {
        let mut data = Data::from_moments(3900.0, 0.03);
        data.measurements = Measurements::Moments {
            mean: 3900.0,
            coefficient_of_variation: 0.03,
            count: Some(1000),
        };
        let density = PosteriorDensity::new(&job(data), 0).unwrap();
        let best = density.log_density(&at(18e9), &MEAN.into()).unwrap();
        // The mean is off by two of its standard errors.
        let off = Moments { mean: 3900.0 * (1.0 + 2.0 * 0.03 / 1000f64.sqrt()), ..MEAN };
        let off = Moments { coefficient_of_variation: 117.0 / off.mean, ..off };
        let lower = density.log_density(&at(18e9), &off.into()).unwrap();
        assert!((best - lower - 2.0).abs() < 0.01, "{best} {lower}");
        let prior = density.log_density(&at(20e9), &MEAN.into()).unwrap();
        assert!((best - prior - 2.0).abs() < 1e-9, "{best} {prior}");
        // Errors of the model as large as those of the data halve what a misfit costs.
        let error = 0.03 / 1000f64.sqrt();
        let blurred = density.with_model_errors([error, 0.03 / 2000f64.sqrt()]);
        let cost = blurred.log_density(&at(18e9), &MEAN.into()).unwrap()
            - blurred.log_density(&at(18e9), &off.into()).unwrap();
        assert!((cost - 1.0).abs() < 0.1, "{cost}");
    }

    #[test]
    fn it_ends_at_the_bounds() {
        let velocities = [3800.0, 3900.0, 3950.0, 4000.0];
        let mut data = Data::from_moments(3900.0, 0.03);
        data.measurements = Measurements::Velocities {
            velocities: velocities.to_vec(),
            subjects: None,
            observables: ObservedColumns::default(),
        };
        let density = PosteriorDensity::new(&job(data), 0).unwrap();
        assert!(density.log_density(&at(12e9), &MEAN.into()).is_some());
        assert_eq!(density.log_density(&at(11.99e9), &MEAN.into()), None);
        assert_eq!(
            density.log_density(&at(18e9), &Moments { mean: f64::NAN, ..MEAN }.into()),
            None
        );
    }

    #[test]
    fn it_needs_data_whose_noise_is_known() {
        let without = JobSpecification { data: None, ..job(Data::from_moments(3900.0, 0.03)) };
        assert!(PosteriorDensity::new(&without, 0).is_none());
        assert!(PosteriorDensity::new(&job(Data::from_moments(3900.0, 0.03)), 0).is_none());
    }
}
