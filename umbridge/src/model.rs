//! The models that the server offers.

use osteon_common::job::JobSpecification;
use osteon_common::parameters::Parameter;

use super::protocol_error::{ProtocolError, ProtocolErrorKind, quoted};

/// A function of the job's parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ServedModel {
    /// Mean and coefficient of variation of the velocity, by multiples of the job's values.
    Forward,
    /// The same, by values in SI units.
    ForwardSi,
    /// Velocity of the mean model, without randomness.
    Velocity,
    /// Logarithm of the posterior density of the free parameters.
    Posterior,
}

impl ServedModel {
    /// All models, in the order in which they are listed.
    const ALL: [Self; 4] = [Self::Forward, Self::ForwardSi, Self::Velocity, Self::Posterior];

    /// Returns the name in requests.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::ForwardSi => "forward-si",
            Self::Velocity => "velocity",
            Self::Posterior => "posterior",
        }
    }

    /// Returns the models of a job: all of them, or those without a posterior.
    pub(super) fn offered(has_posterior: bool) -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(move |model| has_posterior || *model != Self::Posterior)
    }

    /// Returns the model of this name.
    ///
    /// # Errors
    /// If the job has none.
    pub(super) fn named(name: &str, has_posterior: bool) -> Result<Self, ProtocolError> {
        let not_found = |message| ProtocolError::new(ProtocolErrorKind::ModelNotFound, message);
        match Self::ALL.into_iter().find(|model| model.name() == name) {
            Some(Self::Posterior) if !has_posterior => Err(not_found(
                "this job has no model \"posterior\": that needs [data] whose noise is known \
                 (velocities, or moments with their count), without other observables, and a free parameter"
                    .to_owned(),
            )),
            Some(model) => Ok(model),
            None => {
                let names: Vec<&str> = Self::offered(has_posterior).map(Self::name).collect();
                let (name, names) = (quoted(name), names.join(", "));
                Err(not_found(format!("there is no model {name}; there are: {names}")))
            }
        }
    }

    /// Returns the parameters that the entries of the input stand for.
    pub(super) fn parameters(self, specification: &JobSpecification) -> Vec<Parameter> {
        match self {
            Self::Forward | Self::ForwardSi => specification.parameters_ranged().collect(),
            Self::Velocity => specification
                .parameters_ranged()
                .filter(|parameter| *parameter != Parameter::Dispersion)
                .collect(),
            Self::Posterior => specification.free().collect(),
        }
    }

    /// Returns the length of the output.
    pub(super) fn outputs(self) -> usize {
        match self {
            Self::Forward | Self::ForwardSi => 2,
            Self::Velocity | Self::Posterior => 1,
        }
    }
}
