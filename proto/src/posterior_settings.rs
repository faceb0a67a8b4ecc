//! The settings of a posterior as a message.

use osteon_common::job::{PosteriorPrior, PosteriorSettings, PriorDistribution};
use osteon_common::parameters::{PARAMETERS, Parameter};
use osteon_common::violations::Violations;

use crate::choice::{PARAMETER, PRIOR_DISTRIBUTION};
use crate::fields;
use crate::v1;

/// Returns the complete message; uniform priors, which are the default, are left out.
pub(crate) fn to_message(settings: &PosteriorSettings) -> v1::PosteriorSettings {
    let prior = |(parameter, prior): (&Parameter, &PosteriorPrior)| {
        let [center, spread] = prior.numbers()?;
        Some(v1::PosteriorPrior {
            parameter: PARAMETER.number(*parameter),
            distribution: PRIOR_DISTRIBUTION.number(prior.distribution()),
            center: Some(center),
            spread: Some(spread),
        })
    };
    let message: v1::PosteriorSettings = fields::to_message(&mut settings.clone());
    let priors = Parameter::ALL.iter().zip(&settings.priors).filter_map(prior);
    v1::PosteriorSettings { priors: priors.collect(), ..message }
}

/// Returns the settings of a message, with defaults filled in. Fields that cannot be read are
/// recorded.
pub(crate) fn from_message(
    message: &v1::PosteriorSettings,
    violations: &mut Violations,
) -> PosteriorSettings {
    let mut settings = PosteriorSettings::default();
    fields::from_message(PosteriorSettings::KEY.name, message, &mut settings, violations);
    let mut given = [false; PARAMETERS];
    for prior in &message.priors {
        let Some(parameter) = PARAMETER.value(prior.parameter) else {
            let refusal = PARAMETER.refusal(prior.parameter);
            violations.add("posterior.priors", format!("`parameter` {refusal}"));
            // Report only the first unknown parameter.
            return settings;
        };
        let path = format!("posterior.priors.{}", parameter.name());
        if given[parameter as usize] {
            violations.add(path, "is given twice");
        } else {
            settings.priors[parameter as usize] = prior_from_message(&path, prior, violations);
        }
        given[parameter as usize] = true;
    }
    settings
}

fn prior_from_message(
    path: &str,
    message: &v1::PosteriorPrior,
    violations: &mut Violations,
) -> PosteriorPrior {
    let Some(distribution) = PRIOR_DISTRIBUTION.value(message.distribution) else {
        let refusal = PRIOR_DISTRIBUTION.refusal(message.distribution);
        violations.add(format!("{path}.distribution"), refusal);
        return PosteriorPrior::default();
    };
    let uniform = distribution == PriorDistribution::Uniform;
    let numbers = [("center", message.center), ("spread", message.spread)];
    let [center, spread] = numbers.map(|(name, number)| {
        match number {
            Some(_) if uniform => {
                violations.add(format!("{path}.{name}"), "must be absent of a uniform prior");
            }
            None if !uniform => {
                violations.add(format!("{path}.{name}"), "is missing; it must be a number");
            }
            _ => {}
        }
        number.unwrap_or(f64::NAN)
    });
    PosteriorPrior::new(distribution, center, spread)
}
