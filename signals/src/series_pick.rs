//! The velocity of one measurement, from one source or both.

use osteon_common::line_fit::mean;
use osteon_common::signal_layout::Transmitter;
use osteon_files::probe_file::ProbeDescription;

use crate::array_decision::PickRefusal;
use crate::array_geometry::ArrayGeometry;
use crate::array_signals::{ArraySignals, SignalSeries};
use crate::direction::{DirectionPick, VelocityEstimate, pick_direction};
use crate::first_signal::FirstSignalEstimate;
use crate::pick_failure::PickFailure;
use crate::receiver_pick::{MeasuredValue, ReceiverPick};

/// The velocity of a series, and what each receiver contributed.
#[derive(Debug, Clone, PartialEq)]
pub struct SeriesPick {
    /// The velocity, of two sources the harmonic mean of both; or why there is none.
    pub estimate: Result<VelocityEstimate, PickRefusal>,
    /// Velocities for the first and the second source, m/s, if the series has both.
    pub directions: Option<[f64; 2]>,
    /// What else the first signal tells, if it has a velocity.
    pub first_signal: FirstSignalEstimate,
    /// The receivers in their order along the probe, for the first of the series' sources.
    pub receivers: Vec<ReceiverPick>,
}

/// Picks series of one probe.
#[derive(Debug, Clone)]
pub struct SeriesPicker {
    description: ProbeDescription,
}

impl SeriesPicker {
    /// Creates a picker for a probe that has been checked.
    pub fn new(description: ProbeDescription) -> Self {
        Self { description }
    }

    /// Returns the probe.
    pub fn description(&self) -> &ProbeDescription {
        &self.description
    }

    /// Picks one series. Its bits depend on the series and the probe alone.
    ///
    /// Each array must have the probe's number of receivers.
    pub fn pick(&self, series: &SignalSeries) -> SeriesPick {
        // The model has a source at either end; those beyond them only tell waves apart.
        let ends = series.directions.iter().filter(|array| array.offset == 0.0);
        let mut picks = ends.map(|array| self.direction(array));
        let Some(one) = picks.next() else {
            let refusal = PickRefusal::new(PickFailure::NoArrival, "the series has no signals");
            return SeriesPick {
                estimate: Err(refusal),
                directions: None,
                first_signal: FirstSignalEstimate::default(),
                receivers: Vec::new(),
            };
        };
        let DirectionPick { estimate, first_signal, receivers } = one;
        match picks.next() {
            Some(other) => of_both(estimate, first_signal, receivers, other),
            None => SeriesPick { estimate, directions: None, first_signal, receivers },
        }
    }

    /// Picks the signals of one source; receivers are returned in their order along the probe.
    fn direction(&self, array: &ArraySignals) -> DirectionPick {
        let geometry = ArrayGeometry::new(&self.description.setup, array.transmitter);
        let mut raw: Vec<&[f64]> = array.receivers.iter().map(Vec::as_slice).collect();
        let is_reversed = array.transmitter == Transmitter::Second;
        if is_reversed {
            raw.reverse();
        }
        let mut pick = pick_direction(&geometry, &self.description.signals, array, &raw);
        if is_reversed {
            pick.receivers.reverse();
        }
        pick
    }
}

/// Joins what both sources tell: the velocities, and of the first one the rest.
fn of_both(
    estimate: Result<VelocityEstimate, PickRefusal>,
    first_signal: FirstSignalEstimate,
    receivers: Vec<ReceiverPick>,
    other: DirectionPick,
) -> SeriesPick {
    let velocities = |one: VelocityEstimate| Ok((one, other.estimate?));
    match estimate.and_then(velocities) {
        Ok((one, two)) => SeriesPick {
            estimate: Ok(harmonic_mean(one, two)),
            directions: Some([one.velocity, two.velocity]),
            first_signal: FirstSignalEstimate {
                other_velocity: first_signal
                    .other_velocity
                    .zip(other.first_signal.other_velocity)
                    .map(|(one, two)| harmonic_mean_of(one, two)),
                ..first_signal
            },
            receivers,
        },
        Err(refusal) => SeriesPick {
            estimate: Err(refusal),
            directions: None,
            first_signal: FirstSignalEstimate::default(),
            receivers,
        },
    }
}

fn harmonic_mean(one: VelocityEstimate, other: VelocityEstimate) -> VelocityEstimate {
    let measured = |it: VelocityEstimate| MeasuredValue {
        value: it.velocity,
        standard_error: it.standard_error,
    };
    let MeasuredValue { value, standard_error } = harmonic_mean_of(measured(one), measured(other));
    let quality = one.quality.min(other.quality);
    VelocityEstimate { velocity: value, standard_error, quality }
}

/// Returns the harmonic mean of two velocities, whose errors are independent.
fn harmonic_mean_of(one: MeasuredValue, other: MeasuredValue) -> MeasuredValue {
    let value = 1.0 / mean(&[1.0 / one.value, 1.0 / other.value]);
    // The derivative of the mean with respect to each velocity.
    let part = |of: MeasuredValue| {
        let ratio = value / of.value;
        0.5 * ratio * ratio * of.standard_error
    };
    MeasuredValue { value, standard_error: libm::hypot(part(one), part(other)) }
}
