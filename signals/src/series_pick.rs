//! The velocity of one measurement, from one source or both.

use osteon_common::line_fit::mean;
use osteon_common::signal_layout::Transmitter;
use osteon_files::probe_file::ProbeDescription;

use crate::array_decision::PickRefusal;
use crate::array_geometry::ArrayGeometry;
use crate::array_signals::{ArraySignals, SignalSeries};
use crate::direction::{DirectionPick, ReceiverPick, VelocityEstimate, pick_direction};

/// The velocity of a series, and what each receiver contributed.
#[derive(Debug, Clone, PartialEq)]
pub struct SeriesPick {
    /// The velocity, of two sources the harmonic mean of both; or why there is none.
    pub estimate: Result<VelocityEstimate, PickRefusal>,
    /// Velocities for the first and the second source, m/s, if the series has both.
    pub directions: Option<[f64; 2]>,
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
        let picks: Vec<_> = ends.map(|array| self.direction(array)).collect();
        let receivers = picks.first().map(|pick| pick.receivers.clone()).unwrap_or_default();
        let both = match picks.as_slice() {
            [one, other] => Some((one, other)),
            _ => None,
        };
        let Some((one, other)) = both else {
            let refusal = || {
                let detail = "the series has no signals";
                Err(PickRefusal::new(crate::pick_failure::PickFailure::NoArrival, detail))
            };
            let estimate = picks.into_iter().next().map_or_else(refusal, |pick| pick.estimate);
            return SeriesPick { estimate, directions: None, receivers };
        };
        match (&one.estimate, &other.estimate) {
            (Ok(one), Ok(other)) => SeriesPick {
                estimate: Ok(harmonic_mean(one, other)),
                directions: Some([one.velocity, other.velocity]),
                receivers,
            },
            (Err(refusal), _) | (_, Err(refusal)) => {
                SeriesPick { estimate: Err(refusal.clone()), directions: None, receivers }
            }
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

/// Returns the harmonic mean of the velocities of both sources, whose errors are independent.
fn harmonic_mean(one: &VelocityEstimate, other: &VelocityEstimate) -> VelocityEstimate {
    let velocity = 1.0 / mean(&[1.0 / one.velocity, 1.0 / other.velocity]);
    // The derivative of the mean with respect to each velocity.
    let part = |of: &VelocityEstimate| {
        let ratio = velocity / of.velocity;
        0.5 * ratio * ratio * of.standard_error
    };
    VelocityEstimate {
        velocity,
        standard_error: libm::hypot(part(one), part(other)),
        quality: one.quality.min(other.quality),
    }
}
