//! Observables of a measured first signal besides its velocity: the velocity of its other extremum, its decay
//! along the array, and its frequency.
//!
//! The definitions are the model's (`osteon_solver::first_signal`).

use osteon_common::array_decay::{decay, decay_error};
use osteon_common::line_fit::{mean, slope};

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
    if errors.contains(&0.0) {
        // The noise is unknown; the scatter about the line is not.
        let logarithms: Vec<f64> =
            amplitudes.iter().map(|amplitude| libm::log(*amplitude)).collect();
        errors = vec![scatter_about_line(&places, &logarithms); places.len()];
    }
    let (value, standard_error) = (decay(&places, &amplitudes), decay_error(&places, &errors));
    value.is_finite().then_some(MeasuredValue { value, standard_error })
}

/// Returns the frequency whose half period is the mean time between the picked extremum and the other one.
pub(crate) fn frequency_of(
    picked: &[ReceiverPick],
    other: &[ReceiverPick],
) -> Option<MeasuredValue> {
    let is_used = |(one, other): &(&ReceiverPick, &ReceiverPick)| {
        one.failure.is_none() && other.failure.is_none()
    };
    let (mut delays, mut variance, mut is_noise_known) = (Vec::new(), 0.0, true);
    for (one, other) in picked.iter().zip(other).filter(is_used) {
        delays.push(other.time? - one.time?);
        let errors = [one.standard_error, other.standard_error];
        is_noise_known &= !errors.contains(&0.0);
        variance += errors.iter().map(|error| error * error).sum::<f64>();
    }
    let count = delays.len() as f64;
    let half_period = mean(&delays).abs();
    let error = match is_noise_known {
        true => variance.sqrt() / count,
        false => scatter(&delays) / count.sqrt(),
    };
    let value = 0.5 / half_period;
    (half_period > 0.0)
        .then(|| MeasuredValue { value, standard_error: value * error / half_period })
}

/// Returns the standard deviation of values about their line over places.
fn scatter_about_line(places: &[f64], values: &[f64]) -> f64 {
    let (slope, middle, centre) = (slope(values, places), mean(values), mean(places));
    let off = values.iter().zip(places).map(|(value, x)| value - middle - slope * (x - centre));
    let squares: f64 = off.map(|off| off * off).sum();
    (squares / (values.len() as f64 - 2.0).max(1.0)).sqrt()
}

/// Returns the standard deviation of values.
fn scatter(values: &[f64]) -> f64 {
    let middle = mean(values);
    let squares: f64 = values.iter().map(|value| (value - middle) * (value - middle)).sum();
    (squares / (values.len() as f64 - 1.0).max(1.0)).sqrt()
}
