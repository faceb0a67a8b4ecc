//! Mapping between enumerations of messages and types of `osteon-common`.

use osteon_common::job::{JobKind, Objective, PriorDistribution, Sampling};
use osteon_common::outcome::FailureKind;
use osteon_common::parameters::Parameter;
use osteon_common::results::{JobFailure, Status};
use osteon_common::systematic::SystematicQuantity;

use crate::malformed::Malformed;
use crate::v1;

/// Mapping of a type of `osteon-common` to an enumeration of messages, whose number 0 is
/// unspecified.
pub struct EnumMapping<T: 'static, M> {
    all: &'static [T],
    message: fn(T) -> M,
    name: fn(&M) -> &'static str,
}

impl<T: Copy, M: Into<i32>> EnumMapping<T, M> {
    /// Returns the number of a value.
    pub fn number(&self, value: T) -> i32 {
        (self.message)(value).into()
    }

    /// Returns the value of a number; `None` if it is unspecified or unknown.
    pub fn value(&self, number: i32) -> Option<T> {
        self.all.iter().copied().find(|&value| self.number(value) == number)
    }

    /// Returns the value of a number.
    ///
    /// # Errors
    /// If it is unspecified or unknown.
    pub fn required(&self, number: i32, field: &'static str) -> Result<T, Malformed> {
        self.optional(number, field)?.ok_or(Malformed::Missing { field })
    }

    /// Returns the value of a number; `None` if it is unspecified.
    ///
    /// # Errors
    /// If it is unknown.
    pub fn optional(&self, number: i32, field: &'static str) -> Result<Option<T>, Malformed> {
        match (number, self.value(number)) {
            (_, Some(value)) => Ok(Some(value)),
            (0, None) => Ok(None),
            (_, None) => Err(Malformed::UnknownValue { field, value: number.into() }),
        }
    }

    /// Returns the reason why a number is refused.
    pub fn refusal(&self, number: i32) -> String {
        let names = self.all.iter().map(|&value| (self.name)(&(self.message)(value)));
        let names: Vec<&str> = names.collect();
        format!("is {number}, which is not known; it must be {}", names.join(" or "))
    }
}

/// Kind of a job.
pub static JOB_KIND: EnumMapping<JobKind, v1::JobKind> = EnumMapping {
    all: &[JobKind::Identification, JobKind::Propagation],
    message: |kind| match kind {
        JobKind::Identification => v1::JobKind::Identification,
        JobKind::Propagation => v1::JobKind::Propagation,
    },
    name: v1::JobKind::as_str_name,
};

/// Sampling of the germs.
pub static SAMPLING: EnumMapping<Sampling, v1::Sampling> = EnumMapping {
    all: &Sampling::ALL,
    message: |sampling| match sampling {
        Sampling::MonteCarlo => v1::Sampling::MonteCarlo,
        Sampling::Sobol => v1::Sampling::Sobol,
    },
    name: v1::Sampling::as_str_name,
};

/// The function to be minimised.
pub static OBJECTIVE: EnumMapping<Objective, v1::ObjectiveKind> = EnumMapping {
    all: &Objective::ALL,
    message: |objective| match objective {
        Objective::Moments => v1::ObjectiveKind::Moments,
        Objective::ChiSquare => v1::ObjectiveKind::ChiSquare,
        Objective::Likelihood => v1::ObjectiveKind::Likelihood,
    },
    name: v1::ObjectiveKind::as_str_name,
};

/// Law of a prior.
pub static PRIOR_DISTRIBUTION: EnumMapping<PriorDistribution, v1::PriorDistribution> =
    EnumMapping {
        all: &PriorDistribution::ALL,
        message: |distribution| match distribution {
            PriorDistribution::Uniform => v1::PriorDistribution::Uniform,
            PriorDistribution::Normal => v1::PriorDistribution::Normal,
            PriorDistribution::LogNormal => v1::PriorDistribution::LogNormal,
        },
        name: v1::PriorDistribution::as_str_name,
    };

/// One of the parameters.
pub static PARAMETER: EnumMapping<Parameter, v1::Parameter> = EnumMapping {
    all: &Parameter::ALL,
    message: |parameter| match parameter {
        Parameter::Density => v1::Parameter::Density,
        Parameter::LongitudinalYoungModulus => v1::Parameter::LongitudinalYoungModulus,
        Parameter::LongitudinalPoissonRatio => v1::Parameter::LongitudinalPoissonRatio,
        Parameter::LongitudinalShearModulus => v1::Parameter::LongitudinalShearModulus,
        Parameter::TransverseYoungModulus => v1::Parameter::TransverseYoungModulus,
        Parameter::TransversePoissonRatio => v1::Parameter::TransversePoissonRatio,
        Parameter::Dispersion => v1::Parameter::Dispersion,
        Parameter::BoneThickness => v1::Parameter::BoneThickness,
        Parameter::BoneQualityFactor => v1::Parameter::BoneQualityFactor,
        Parameter::CouplingSoundSpeed => v1::Parameter::CouplingSoundSpeed,
        Parameter::Porosity => v1::Parameter::Porosity,
        Parameter::SurfacePorosity => v1::Parameter::SurfacePorosity,
        Parameter::MarrowPorosity => v1::Parameter::MarrowPorosity,
    },
    name: v1::Parameter::as_str_name,
};

/// A quantity of the setup that is not known exactly.
pub(crate) static SYSTEMATIC_QUANTITY: EnumMapping<SystematicQuantity, v1::SystematicQuantity> =
    EnumMapping {
        all: &SystematicQuantity::ALL,
        message: |quantity| match quantity {
            SystematicQuantity::BoneThickness => v1::SystematicQuantity::BoneThickness,
            SystematicQuantity::BoneQualityFactor => v1::SystematicQuantity::BoneQualityFactor,
            SystematicQuantity::CouplingSoundSpeed => v1::SystematicQuantity::CouplingSoundSpeed,
            SystematicQuantity::MarrowSoundSpeed => v1::SystematicQuantity::MarrowSoundSpeed,
            SystematicQuantity::SourceHeight => v1::SystematicQuantity::SourceHeight,
            SystematicQuantity::ReceiverHeight => v1::SystematicQuantity::ReceiverHeight,
            SystematicQuantity::FirstReceiver => v1::SystematicQuantity::FirstReceiver,
            SystematicQuantity::Pitch => v1::SystematicQuantity::Pitch,
            SystematicQuantity::CenterFrequency => v1::SystematicQuantity::CenterFrequency,
            SystematicQuantity::Tilt => v1::SystematicQuantity::Tilt,
            SystematicQuantity::PorosityGradient => v1::SystematicQuantity::PorosityGradient,
            SystematicQuantity::VelocityOffset => v1::SystematicQuantity::VelocityOffset,
        },
        name: v1::SystematicQuantity::as_str_name,
    };

/// Reason why a realization has no velocity.
pub static FAILURE_KIND: EnumMapping<FailureKind, v1::FailureKind> = EnumMapping {
    all: &FailureKind::ALL,
    message: |kind| match kind {
        FailureKind::NoArrival => v1::FailureKind::NoArrival,
        FailureKind::InconsistentArrival => v1::FailureKind::InconsistentArrival,
        FailureKind::DirectWaveFirst => v1::FailureKind::DirectWaveFirst,
        FailureKind::NotFinite => v1::FailureKind::NotFinite,
        FailureKind::NoConvergence => v1::FailureKind::NoConvergence,
    },
    name: v1::FailureKind::as_str_name,
};

/// Final status of a job; unspecified while it has not ended.
pub static JOB_STATUS: EnumMapping<Status, v1::JobStatus> = EnumMapping {
    all: &Status::ALL,
    message: |status| match status {
        Status::Converged => v1::JobStatus::Converged,
        Status::NotMatched => v1::JobStatus::NotMatched,
        Status::MaxEvaluations => v1::JobStatus::MaxEvaluations,
        Status::Cancelled => v1::JobStatus::Cancelled,
        Status::Failed => v1::JobStatus::Failed,
    },
    name: v1::JobStatus::as_str_name,
};

/// Reason why a job failed; unspecified if it has not.
pub static JOB_FAILURE: EnumMapping<JobFailure, v1::JobFailureKind> = EnumMapping {
    all: &JobFailure::ALL,
    message: |failure| match failure {
        JobFailure::NoFeasiblePoint => v1::JobFailureKind::NoFeasiblePoint,
        JobFailure::IntegrityError => v1::JobFailureKind::IntegrityError,
        JobFailure::PoisonRealization => v1::JobFailureKind::PoisonRealization,
        JobFailure::Store => v1::JobFailureKind::Store,
    },
    name: v1::JobFailureKind::as_str_name,
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_failures_are_their_code_bytes() {
        for kind in FailureKind::ALL {
            assert_eq!(FAILURE_KIND.number(kind), i32::from(kind.code()));
        }
    }

    #[test]
    fn a_number_that_is_not_known_is_refused_by_its_field() {
        let field = "status";
        assert_eq!(JOB_STATUS.required(0, field), Err(Malformed::Missing { field }));
        assert_eq!(JOB_STATUS.optional(0, field), Ok(None));
        let unknown = Malformed::UnknownValue { field, value: 9 };
        assert_eq!(JOB_STATUS.required(9, field), Err(unknown.clone()));
        assert_eq!(
            JOB_STATUS.optional(-1, field),
            Err(Malformed::UnknownValue { field, value: -1 })
        );
    }
}
