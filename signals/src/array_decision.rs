//! Which extremum the array picks, by the model's own rule.

use osteon_common::settings::Picking;
use osteon_solver::picking::{Window, array_rank};

use crate::array_geometry::ArrayGeometry;
use crate::consensus::consensus;
use crate::interpolation::CurvedExtremum;
use crate::pick_failure::PickFailure;
use crate::receiver_signal::{NOISE_FLOOR, ReceiverSignal};
use crate::stacked::{AlignedArray, StackedSignal};

/// A signal that is more alike with a delay than without by this has slipped.
const SLIP_MARGIN: f64 = 0.05;
/// Smallest correlation of a signal that is recognized at another time or with the other sign.
const RECOGNIZED: f64 = 0.6;
/// Delays, in periods, that are a slip by whole ones.
const SLIP_PERIODS: f64 = 0.5;

/// Why there is no velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct PickRefusal {
    /// The kind.
    pub failure: PickFailure,
    /// A sentence about it.
    pub detail: String,
}

impl PickRefusal {
    pub(crate) fn new(failure: PickFailure, detail: impl Into<String>) -> Self {
        Self { failure, detail: detail.into() }
    }
}

/// What the array decided on.
#[derive(Debug)]
pub(crate) struct ArrayDecision<'a> {
    aligned: AlignedArray<'a>,
    stacked: StackedSignal,
    /// The number of the common extremum that is picked.
    pub(crate) rank: usize,
    /// The same of the other one, if the signals have it.
    pub(crate) other_rank: Option<usize>,
    /// How clear it is that no earlier extremum is the first, from 0 to 1: half of the threshold or less below
    /// it and twice the threshold or more above it are clear.
    pub(crate) clarity: f64,
}

impl<'a> ArrayDecision<'a> {
    /// Finds the line along which the first packet travels, and which of its extrema the model picks. `packets`
    /// are empty for receivers that are not used.
    ///
    /// # Errors
    /// If there is no line, no such extremum, or too much noise to know.
    pub(crate) fn make(
        geometry: &'a ArrayGeometry,
        signals: &'a [ReceiverSignal],
        packets: &[Vec<CurvedExtremum>],
    ) -> Result<Self, PickRefusal> {
        let (distances, fc) = (&geometry.distances, geometry.center_frequency);
        let (line, is_member) = consensus(distances, packets, 1.0 / fc).ok_or_else(|| {
            PickRefusal::new(
                PickFailure::Inconsistent,
                "most receivers have no extremum in common that travels along the array",
            )
        })?;
        let members: Vec<usize> = (0..signals.len()).filter(|&r| is_member[r]).collect();
        let largest = |packet: &Vec<CurvedExtremum>| {
            packet.iter().fold(0.0, |max: f64, e| max.max(e.at.pressure.abs()))
        };
        let peaks: Vec<f64> = packets.iter().map(largest).collect();
        let aligned = AlignedArray { signals, geometry, line, period: 1.0 / fc };
        let mut stacked = aligned.stack(&members, &peaks);
        let threshold = geometry.criterion.threshold;
        if NOISE_FLOOR * stacked.noise > threshold {
            return Err(PickRefusal::new(
                PickFailure::TooNoisy,
                format!(
                    "noise of {:.3} of the packet's peak, in the mean of {} signals, hides an extremum at the \
                     threshold {threshold:.3}",
                    stacked.noise,
                    members.len()
                ),
            ));
        }
        aligned.drop_noise(&mut stacked, &members);
        let windows: Vec<Window> = members.iter().map(|&r| aligned.window(r, &stacked)).collect();
        let found = array_rank(&geometry.criterion, fc, &windows);
        let found = found.ok().filter(|found| found.rank < stacked.extrema.len());
        let found = found.ok_or_else(|| {
            PickRefusal::new(
                PickFailure::NoArrival,
                "the first packet lacks the extremum that is picked before the direct wave arrives",
            )
        })?;
        let criterion = &geometry.criterion;
        let other = Picking { extremum: criterion.extremum.other(), ..*criterion };
        let other_rank = array_rank(&other, fc, &windows).ok().map(|found| found.rank);
        let other_rank = other_rank.filter(|rank| *rank < stacked.extrema.len());
        let clear_above = 2.0 * (1.0 - threshold / found.ratio);
        let clear_below = 2.0 * (1.0 - found.skipped / threshold);
        let clarity = clear_above.min(clear_below).clamp(0.0, 1.0);
        Ok(Self { aligned, stacked, rank: found.rank, other_rank, clarity })
    }

    /// Returns the extremum of a receiver that belongs to the common one of this number.
    ///
    /// # Errors
    /// If its signal is not as those of the others.
    pub(crate) fn pick(&self, r: usize, rank: usize) -> Result<CurvedExtremum, PickFailure> {
        let common = &self.stacked.extrema[rank];
        let (signal, period) = (&self.aligned.signals[r], self.aligned.period);
        let expected = self.aligned.time(r, common.time);
        // Half a period after an extremum the next one begins, which may be clipped.
        if signal.clipped_from < expected + 0.5 * period {
            return Err(PickFailure::Saturated);
        }
        let like = self.aligned.likeness(r, &self.stacked, common.time);
        let is_other =
            like.best.abs() > like.punctual + SLIP_MARGIN && like.best.abs() > RECOGNIZED;
        if is_other && like.delay.abs() > SLIP_PERIODS * period {
            return Err(PickFailure::CycleSlip);
        }
        if is_other && like.best < 0.0 && like.punctual < RECOGNIZED {
            return Err(PickFailure::WrongPolarity);
        }
        match self.aligned.matched(r, common) {
            Some(own) => Ok(own),
            None if like.best.abs() < RECOGNIZED => Err(PickFailure::NoArrival),
            None => Err(PickFailure::Inconsistent),
        }
    }
}
