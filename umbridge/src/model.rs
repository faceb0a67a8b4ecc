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

    /// Returns the models of a job: those with an input, and the posterior if there is one.
    pub(super) fn offered(
        specification: &JobSpecification,
        has_posterior: bool,
    ) -> impl Iterator<Item = Self> {
        let is_offered = move |model: &Self| {
            let has_input = !model.parameters(specification).is_empty();
            has_input && (has_posterior || *model != Self::Posterior)
        };
        Self::ALL.into_iter().filter(is_offered)
    }

    /// Returns the model of this name.
    ///
    /// # Errors
    /// If the job has none.
    pub(super) fn named(
        name: &str,
        specification: &JobSpecification,
        has_posterior: bool,
    ) -> Result<Self, ProtocolError> {
        let not_found = |message| ProtocolError::new(ProtocolErrorKind::ModelNotFound, message);
        let offered = || Self::offered(specification, has_posterior);
        match offered().find(|model| model.name() == name) {
            Some(model) => Ok(model),
            None if name == Self::Posterior.name() => Err(not_found(
                "this job has no model \"posterior\": that needs [data] whose noise is known \
                 (velocities, or moments with their count), without other observables, and a free parameter"
                    .to_owned(),
            )),
            None => {
                let names: Vec<&str> = offered().map(Self::name).collect();
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

#[cfg(test)]
mod tests {
    use osteon_common::bone::Bone;
    use osteon_common::bone_structure::{MeanSolid, MeanSublayer};
    use osteon_common::porosity::BoneMatrix;

    use super::super::input_space::tests::job;
    use super::*;

    #[test]
    fn sublayers_of_their_own_solids_leave_the_dispersion_alone() {
        let mut specification = job();
        let bone: Bone = BoneMatrix::default().bone().unwrap();
        let names = |specification: &JobSpecification| -> Vec<&str> {
            ServedModel::offered(specification, true).map(ServedModel::name).collect()
        };
        assert_eq!(names(&specification), ["forward", "forward-si", "velocity", "posterior"]);
        let solid = MeanSolid::Given(Box::new(bone));
        specification.setup.structure.sublayers = vec![MeanSublayer { thickness: 4e-3, solid }];
        assert_eq!(names(&specification), ["forward", "forward-si", "posterior"]);
        assert_eq!(ServedModel::Forward.parameters(&specification), [Parameter::Dispersion]);
        assert!(ServedModel::named("velocity", &specification, true).is_err());
    }
}
