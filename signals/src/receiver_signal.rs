//! The signal of one receiver: its noise, its extrema before the direct wave, and whether it is usable.

use std::ops::Range;

use osteon_common::line_fit::mean;
use osteon_solver::picking::{PACKET_PERIODS, Window};

use crate::band_filter::BandFilter;
use crate::interpolation::{self, CurvedExtremum, HALF_WIDTH, SampleSlopes};
use crate::pick_failure::PickFailure;

/// Extrema below this multiple of the noise's standard deviation do not open a packet. Of a thousand independent
/// values of noise one is larger with a probability below 1 %.
pub(crate) const NOISE_FLOOR: f64 = 4.5;
/// Periods of noise before the earliest arrival that are needed to know its size.
const NOISE_PERIODS_MIN: f64 = 1.5;
/// Equal samples at the largest or smallest value, in periods, that show clipping. A converter of few steps has
/// shorter ones at the top of a wave.
const CLIPPED_PERIODS: f64 = 0.12;
const CLIPPED_SAMPLES_MIN: usize = 4;
/// Ratio of the standard deviation of the record before the first arrival to that of its later half beyond which
/// the rest of it is no noise.
const UNEVEN_NOISE: f64 = 2.5;
/// Most extrema of a packet, the largest, that are compared with those of other receivers.
const PACKET_MAX: usize = 16;

/// Standard deviations of the noise.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct NoiseSize {
    /// Of the signal.
    pub(crate) value: f64,
    /// Of its slope, per s.
    pub(crate) slope: f64,
    /// Of its curvature, per s².
    pub(crate) curvature: f64,
}

/// The part of the time axis that matters, s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ArrivalSpan {
    /// Earliest possible arrival.
    pub(crate) earliest: f64,
    /// Arrival of the direct wave.
    pub(crate) direct: f64,
    /// Centre frequency, Hz.
    pub(crate) center_frequency: f64,
}

/// A signal with what was found in it.
#[derive(Debug)]
pub(crate) struct ReceiverSignal {
    /// Samples less their mean before the first arrival.
    samples: Vec<f64>,
    start: f64,
    step: f64,
    /// `None` if too little is recorded before the first arrival.
    pub(crate) noise: Option<NoiseSize>,
    /// All extrema between earliest arrival and direct wave, in order of time.
    pub(crate) extrema: Vec<CurvedExtremum>,
    /// Modulus at the end of that time.
    pub(crate) last: f64,
    /// Time from which on the record is clipped, s; infinite if it is not.
    pub(crate) clipped_from: f64,
    /// Largest modulus of all samples.
    pub(crate) largest: f64,
}

impl ReceiverSignal {
    /// Filters a signal and looks at it. `full_scale` is the largest modulus that can be recorded.
    pub(crate) fn new(
        raw: &[f64],
        filter: Option<&BandFilter>,
        (start, step): (f64, f64),
        span: ArrivalSpan,
        full_scale: Option<f64>,
        slopes: &SampleSlopes,
    ) -> Self {
        let clipped_from = first_clipped(raw, 1.0 / (span.center_frequency * step), full_scale)
            .map_or(f64::INFINITY, |index| (index as f64).mul_add(step, start));
        let (mut samples, step) = match filter {
            Some(filter) => {
                (interpolation::continued(&filter.apply(raw)), filter.stride() as f64 * step)
            }
            None => (interpolation::continued(raw), step),
        };
        let start = (HALF_WIDTH as f64).mul_add(-step, start);
        let index = |time: f64| ((time - start) / step).clamp(0.0, samples.len() as f64) as usize;
        let inside = interpolation::interior(samples.len());
        let before = inside.start + filter.map_or(0, BandFilter::unsettled);
        let from = index(span.earliest).max(inside.start);
        let to = index(span.direct).min(inside.end.saturating_sub(1));
        let period = 1.0 / (span.center_frequency * step);
        let quiet = before..from.min(inside.end).max(before);
        let noise = (quiet.len() as f64 >= NOISE_PERIODS_MIN * period).then(|| {
            let quiet = of_one_kind(&samples, quiet);
            let mean = mean(&samples[quiet.clone()]);
            samples.iter_mut().for_each(|sample| *sample -= mean);
            noise_of(&samples, quiet, step, slopes)
        });
        let extrema = match from < to {
            true => {
                let mut found = interpolation::extrema(&samples, (from, to), (start, step), slopes);
                found.retain(|e| e.at.time >= span.earliest && e.at.time < span.direct);
                found
            }
            false => Vec::new(),
        };
        let largest = raw.iter().fold(0.0, |max: f64, sample| max.max(sample.abs()));
        let last = samples.get(to).map_or(0.0, |sample| sample.abs());
        Self { samples, start, step, noise, extrema, last, clipped_from, largest }
    }

    /// Returns the value at a time, s.
    pub(crate) fn at(&self, time: f64) -> f64 {
        interpolation::value(&self.samples, (time - self.start) / self.step)
    }

    /// Returns the smallest modulus of an extremum that noise hardly reaches, 0 if the noise is unknown.
    pub(crate) fn floor(&self) -> f64 {
        self.noise.map_or(0.0, |noise| NOISE_FLOOR * noise.value)
    }

    /// Returns the extrema of the first packet whose first one has a ratio above `threshold`, as the model's
    /// window does, but only among those above the noise.
    pub(crate) fn packet(&self, threshold: f64, center_frequency: f64) -> Vec<CurvedExtremum> {
        let packet = PACKET_PERIODS / center_frequency;
        let mut window = Window {
            extrema: self.extrema.iter().map(|extremum| extremum.at).collect(),
            last: self.last,
        };
        window.drop_noise();
        window.extrema.retain(|extremum| extremum.pressure.abs() >= self.floor());
        let opens = |rank: &usize| window.ratio(*rank, packet).is_some_and(|it| it > threshold);
        let Some(first) = (0..window.extrema.len()).find(opens) else { return Vec::new() };
        let from = window.extrema[first].time;
        let within = |e: &&CurvedExtremum| {
            (from..=from + packet).contains(&e.at.time) && e.at.pressure.abs() >= self.floor()
        };
        let mut packet: Vec<_> = self.extrema.iter().filter(within).copied().collect();
        // Of unfiltered noise there may be many.
        packet.sort_by(|one, other| other.at.pressure.abs().total_cmp(&one.at.pressure.abs()));
        packet.truncate(PACKET_MAX);
        packet
    }

    /// Returns why the signal is not used at all, if it is not; `typical` is the largest modulus of a usual one.
    pub(crate) fn unusable(&self, typical: f64) -> Option<PickFailure> {
        let first = self.samples.first().copied().unwrap_or_default();
        let is_constant = self.samples.iter().all(|&sample| sample == first);
        (is_constant || self.largest < 1e-3 * typical).then_some(PickFailure::DeadReceiver)
    }
}

fn noise_of(samples: &[f64], quiet: Range<usize>, step: f64, slopes: &SampleSlopes) -> NoiseSize {
    // A slope takes samples on both sides, of which those after the earliest arrival still are noise: even
    // the fastest wave begins gently.
    let rates: Vec<f64> = quiet.clone().map(|index| slopes.at(samples, index)).collect();
    let bends: Vec<f64> = rates.windows(2).map(|two| two[1] - two[0]).collect();
    NoiseSize {
        value: deviation(&samples[quiet]),
        slope: deviation(&rates) / step,
        curvature: deviation(&bends) / (step * step),
    }
}

/// Returns a range of samples, or its later half if the signals there are much smaller, as when the pulse couples
/// into the receiver.
pub(crate) fn of_one_kind(samples: &[f64], range: Range<usize>) -> Range<usize> {
    let later = range.start.midpoint(range.end)..range.end;
    let scatter = |range: &Range<usize>| {
        let part = &samples[range.clone()];
        let middle = mean(part);
        deviation(&part.iter().map(|sample| sample - middle).collect::<Vec<_>>())
    };
    if scatter(&range) > UNEVEN_NOISE * scatter(&later) { later } else { range }
}

/// Returns the root of the mean square.
fn deviation(values: &[f64]) -> f64 {
    let square = values.iter().fold(0.0, |sum: f64, value| sum + value * value);
    (square / values.len().max(1) as f64).sqrt()
}

/// Returns the first sample that is clipped: of full size, or one of many equal ones at the largest or the
/// smallest value of the record.
pub(crate) fn first_clipped(raw: &[f64], period: f64, full_scale: Option<f64>) -> Option<usize> {
    let full = full_scale.and_then(|full| raw.iter().position(|sample| sample.abs() >= full));
    let enough = ((CLIPPED_PERIODS * period).ceil() as usize).max(CLIPPED_SAMPLES_MIN);
    let (least, most) = raw
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), &x| (least.min(x), most.max(x)));
    let flat = [least, most].into_iter().filter_map(|edge| first_run(raw, edge, enough)).min();
    [full, flat].into_iter().flatten().min()
}

/// Returns where `count` samples in a row equal `value`.
fn first_run(raw: &[f64], value: f64, count: usize) -> Option<usize> {
    let mut length = 0;
    for (index, &sample) in raw.iter().enumerate() {
        length = if sample == value && value != 0.0 { length + 1 } else { 0 };
        if length == count {
            return Some(index + 1 - count);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(raw: &[f64], full_scale: Option<f64>, expected: Option<usize>) {
        assert_eq!(first_clipped(raw, 20.0, full_scale), expected, "{raw:?}");
    }

    #[test]
    fn clipping_shows_by_equal_samples_at_an_edge() {
        let wave: Vec<f64> =
            (0..60).map(|j| libm::sin(0.314 * f64::from(j)) * f64::from(j)).collect();
        check(&wave, None, None);
        let clipped: Vec<f64> = wave.iter().map(|x| x.clamp(-20.0, 100.0)).collect();
        check(&clipped, None, Some(33));
        check(&wave, Some(40.0), wave.iter().position(|x| x.abs() >= 40.0));
        // Zeros before the wave are none.
        check(&[0.0; 30], None, None);
    }
}
