//! What else the first signal tells: its other extremum, its decay along the array, and its frequency.
//!
//! The definitions are the model's (`osteon_solver::first_signal`).

use osteon_common::array_decay::{decay, decay_error};
use osteon_common::line_fit::mean;

use crate::receiver_pick::{MeasuredValue, ReceiverPick};

/// Observables of a first signal besides its velocity, those that were found.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FirstSignalEstimate {
    /// Velocity of the extremum that is not picked, m/s.
    pub other_velocity: Option<MeasuredValue>,
    /// Decay of the picked extremum along the array, dB/cm, for the first of the series' sources.
    pub decay: Option<MeasuredValue>,
    /// Frequency of the first signal, Hz, for the first of the series' sources.
    pub center_frequency: Option<MeasuredValue>,
}

/// Returns the decay of the amplitudes of those receivers that are used, at these distances (m).
pub(crate) fn decay_of(distances: &[f64], receivers: &[ReceiverPick]) -> Option<MeasuredValue> {
    let used = receivers.iter().zip(distances).filter(|(receiver, _)| receiver.failure.is_none());
    let (mut places, mut amplitudes, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    for (receiver, distance) in used {
        let amplitude = receiver.amplitude?;
        places.push(*distance);
        amplitudes.push(amplitude.value);
        errors.push(amplitude.standard_error / amplitude.value);
    }
    let (value, standard_error) = (decay(&places, &amplitudes), decay_error(&places, &errors));
    value.is_finite().then_some(MeasuredValue { value, standard_error })
}

/// Returns the frequency whose half period is the mean time between the picked extremum and the other one.
pub(crate) fn frequency_of(
    picked: &[ReceiverPick],
    other: &[ReceiverPick],
) -> Option<MeasuredValue> {
    let both = picked
        .iter()
        .zip(other)
        .filter(|(one, other)| one.failure.is_none() && other.failure.is_none());
    let (mut delays, mut variance) = (Vec::new(), 0.0);
    for (one, other) in both {
        delays.push(other.time? - one.time?);
        variance +=
            one.standard_error * one.standard_error + other.standard_error * other.standard_error;
    }
    let half_period = mean(&delays).abs();
    let error = variance.sqrt() / delays.len() as f64;
    let value = 0.5 / half_period;
    (half_period > 0.0)
        .then(|| MeasuredValue { value, standard_error: value * error / half_period })
}
