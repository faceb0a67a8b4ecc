//! The velocity along the array for one source.

use std::f64::consts::PI;

use osteon_common::signal_layout::SignalLayout;
use osteon_solver::picking::{RESIDUAL_PERIODS_MAX, median};

use crate::array_decision::{ArrayDecision, PickRefusal};
use crate::array_geometry::ArrayGeometry;
use crate::array_signals::ArraySignals;
use crate::band_filter::BandFilter;
use crate::first_signal::{FirstSignalEstimate, decay_of, frequency_of};
use crate::interpolation::{CurvedExtremum, SampleSlopes};
use crate::moveout_fit::{self, LOST_MAX, PickedTime};
use crate::pick_failure::PickFailure;
use crate::receiver_pick::{MeasuredValue, ReceiverPick};
use crate::receiver_signal::{ArrivalSpan, NOISE_FLOOR, ReceiverSignal};

/// Largest standard error of a time, in periods: beyond it the noise decides where the extremum is.
const ERROR_PERIODS_MAX: f64 = 0.08;
/// Largest curvature of the noise, relative to that of a wave of the centre frequency and the extremum's size:
/// beyond it the noise makes extrema of its own on the top of the wave, and the largest of them is picked.
const NOISE_CURVATURE_MAX: f64 = 1.0;
/// Upper edge, in centre frequencies, of the filter that is recommended.
const BAND_EDGE: f64 = 2.5;
/// Fewest receivers of a velocity.
const RECEIVERS_MIN: usize = 3;

/// A velocity with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityEstimate {
    /// Velocity of the first arriving signal, m/s.
    pub velocity: f64,
    /// Its standard error, m/s.
    pub standard_error: f64,
    /// From 0 to 1: the product of the share of receivers that are used, of how clear it is which extremum is
    /// the first, and of how small the errors of the times are compared with the largest that are used.
    pub quality: f64,
}

/// Velocity and times for one source; receivers are in the order of their distances from it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DirectionPick {
    pub(crate) estimate: Result<VelocityEstimate, PickRefusal>,
    /// The rest of what the first signal tells, if it has a velocity.
    pub(crate) first_signal: FirstSignalEstimate,
    pub(crate) receivers: Vec<ReceiverPick>,
}

/// Picks the signals of one source; `raw` has them in the order of the receivers' distances from it.
pub(crate) fn pick_direction(
    geometry: &ArrayGeometry,
    layout: &SignalLayout,
    recorded: &ArraySignals,
    raw: &[&[f64]],
) -> DirectionPick {
    let signals = signals(geometry, layout, recorded, raw);
    let mut receivers = vec![ReceiverPick::default(); signals.len()];
    let mut first_signal = FirstSignalEstimate::default();
    let mut estimate = estimate(geometry, &signals, &mut receivers, &mut first_signal);
    if let Err(refusal) = &mut estimate
        && refusal.failure == PickFailure::TooNoisy
        && layout.band.is_empty()
    {
        let edge = BAND_EDGE * geometry.center_frequency;
        refusal.detail += &format!("; [signals] band = [0.0, {edge:?}] filters noise");
    }
    DirectionPick { estimate, first_signal, receivers }
}

/// Filters the signals and finds their extrema.
fn signals(
    geometry: &ArrayGeometry,
    layout: &SignalLayout,
    recorded: &ArraySignals,
    raw: &[&[f64]],
) -> Vec<ReceiverSignal> {
    let slopes = SampleSlopes::new();
    let filter = match layout.band.as_slice() {
        &[low, high] => Some(BandFilter::new(low, high, recorded.step)),
        _ => None,
    };
    let spans = geometry.earliest.iter().zip(&geometry.direct);
    raw.iter()
        .zip(spans)
        .map(|(raw, (&earliest, &direct))| {
            let span =
                ArrivalSpan { earliest, direct, center_frequency: geometry.center_frequency };
            let axis = (recorded.start, recorded.step);
            ReceiverSignal::new(raw, filter.as_ref(), axis, span, layout.full_scale, &slopes)
        })
        .collect()
}

/// Returns the velocity, and enters times and failures of the receivers and what else the first signal tells.
fn estimate(
    geometry: &ArrayGeometry,
    signals: &[ReceiverSignal],
    receivers: &mut [ReceiverPick],
    first_signal: &mut FirstSignalEstimate,
) -> Result<VelocityEstimate, PickRefusal> {
    let mut sizes: Vec<f64> = signals.iter().map(|signal| signal.largest).collect();
    let typical = median(&mut sizes);
    let mut packets = Vec::with_capacity(signals.len());
    for (signal, receiver) in signals.iter().zip(receivers.iter_mut()) {
        receiver.failure = signal.unusable(typical);
        let packet = signal.packet(geometry.criterion.threshold, geometry.center_frequency);
        let is_used = receiver.failure.is_none();
        packets.push(if is_used { packet } else { Vec::<CurvedExtremum>::new() });
    }
    for (packet, receiver) in packets.iter().zip(receivers.iter_mut()) {
        let none = packet.is_empty().then_some(PickFailure::NoArrival);
        receiver.failure = receiver.failure.or(none);
    }
    enough(receivers)?;
    let decision = ArrayDecision::make(geometry, signals, &packets)?;
    let mut others = receivers.to_vec();
    enter_picks(geometry, signals, receivers, |r| decision.pick(r, decision.rank));
    enough(receivers)?;
    let found = velocity(geometry, receivers, decision.clarity)?;
    first_signal.decay = decay_of(&geometry.distances, receivers);
    if let Some(rank) = decision.other_rank {
        enter_picks(geometry, signals, &mut others, |r| decision.pick(r, rank));
        let other = enough(&others).and_then(|()| velocity(geometry, &mut others, 1.0));
        if let Ok(VelocityEstimate { velocity: value, standard_error, .. }) = other {
            first_signal.other_velocity = Some(MeasuredValue { value, standard_error });
            first_signal.center_frequency = frequency_of(receivers, &others);
        }
    }
    Ok(found)
}

/// Enters the extremum that `pick` finds for each receiver, or why there is none.
fn enter_picks(
    geometry: &ArrayGeometry,
    signals: &[ReceiverSignal],
    receivers: &mut [ReceiverPick],
    pick: impl Fn(usize) -> Result<CurvedExtremum, PickFailure>,
) {
    for (r, receiver) in receivers.iter_mut().enumerate() {
        if receiver.failure == Some(PickFailure::DeadReceiver) {
            continue;
        }
        match pick(r) {
            Ok(pick) => {
                let noise = signals[r].noise.unwrap_or_default();
                let size = pick.at.pressure.abs();
                receiver.time = Some(pick.at.time);
                receiver.standard_error = noise.slope / pick.curvature.abs();
                receiver.amplitude =
                    Some(MeasuredValue { value: size, standard_error: noise.value });
                let turns = 2.0 * PI * geometry.center_frequency;
                let is_noisy = receiver.standard_error
                    > ERROR_PERIODS_MAX / geometry.center_frequency
                    || noise.curvature > NOISE_CURVATURE_MAX * size * turns * turns;
                receiver.failure = is_noisy.then_some(PickFailure::TooNoisy);
            }
            Err(failure) => receiver.failure = Some(failure),
        }
    }
}

/// Fits the velocity to the receivers' times, and enters which are rejected.
fn velocity(
    geometry: &ArrayGeometry,
    receivers: &mut [ReceiverPick],
    clarity: f64,
) -> Result<VelocityEstimate, PickRefusal> {
    let period = 1.0 / geometry.center_frequency;
    let times: Vec<_> = receivers
        .iter()
        .map(|receiver| {
            let time = receiver.time.filter(|_| receiver.failure.is_none())?;
            Some(PickedTime { time, error: receiver.standard_error })
        })
        .collect();
    let fitted = moveout_fit::fit(&geometry.distances, &times, period).ok_or_else(|| {
        let detail = "the picked extremum does not travel away from the source";
        PickRefusal::new(PickFailure::Inconsistent, detail)
    })?;
    for (receiver, rejected) in receivers.iter_mut().zip(&fitted.rejected) {
        receiver.failure = receiver.failure.or(rejected.then_some(PickFailure::Inconsistent));
    }
    enough(receivers)?;
    let used = receivers.iter().filter(|receiver| receiver.failure.is_none());
    let errors: Vec<f64> = used.map(|receiver| receiver.standard_error).collect();
    let largest = errors.iter().copied().fold(0.0, f64::max);
    let allowed = NOISE_FLOOR.mul_add(largest, RESIDUAL_PERIODS_MAX * period);
    if fitted.residual > allowed {
        return Err(PickRefusal::new(
            PickFailure::Inconsistent,
            format!(
                "a time is {:.1} ns off the line, allowed are {:.1} ns",
                fitted.residual * 1e9,
                allowed * 1e9
            ),
        ));
    }
    let share = errors.len() as f64 / receivers.len() as f64;
    let relative = largest / (ERROR_PERIODS_MAX * period);
    let precision = (1.0 - relative * relative).max(0.0);
    Ok(VelocityEstimate {
        velocity: fitted.velocity,
        standard_error: fitted.standard_error,
        quality: share * clarity * precision,
    })
}

/// Refuses an array of which too many receivers have failed, by their most frequent failure.
fn enough(receivers: &[ReceiverPick]) -> Result<(), PickRefusal> {
    let failures: Vec<_> = receivers.iter().filter_map(|receiver| receiver.failure).collect();
    let lost_max = (LOST_MAX * receivers.len() as f64) as usize;
    let lost_max = lost_max.min(receivers.len().saturating_sub(RECEIVERS_MIN));
    if failures.len() <= lost_max {
        return Ok(());
    }
    let count = |kind: &PickFailure| failures.iter().filter(|&other| other == kind).count();
    // Of several that are as frequent, the first.
    let most = PickFailure::ALL.into_iter().rev().max_by_key(count);
    let failure = most.unwrap_or(PickFailure::NoArrival);
    let list =
        receivers.iter().enumerate().filter(|(_, receiver)| receiver.failure == Some(failure));
    let list: Vec<String> = list.map(|(r, _)| (r + 1).to_string()).collect();
    Err(PickRefusal::new(
        failure,
        format!(
            "{} of {} receivers cannot be used, at most {lost_max} may fail; number {} {}",
            failures.len(),
            receivers.len(),
            list.join(", "),
            failure.meaning()
        ),
    ))
}
