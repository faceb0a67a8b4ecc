//! Moments of velocities and of decays as messages.

use osteon_common::results::{DecayEstimate, Moments};

use crate::v1;

pub(crate) fn moments_to_message(moments: &Moments) -> v1::Moments {
    v1::Moments { mean: moments.mean, coefficient_of_variation: moments.coefficient_of_variation }
}

pub(crate) fn moments_from_message(message: &v1::Moments) -> Moments {
    Moments { mean: message.mean, coefficient_of_variation: message.coefficient_of_variation }
}

pub(crate) fn decay_to_message(decay: DecayEstimate) -> v1::DecayEstimate {
    let DecayEstimate { mean, standard_deviation, standard_error } = decay;
    v1::DecayEstimate { mean, standard_deviation, standard_error }
}

pub(crate) fn decay_from_message(message: v1::DecayEstimate) -> DecayEstimate {
    let v1::DecayEstimate { mean, standard_deviation, standard_error } = message;
    DecayEstimate { mean, standard_deviation, standard_error }
}
