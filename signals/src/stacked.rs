//! The signals of all receivers laid over each other along a line of times: which extrema the array has in
//! common, and each receiver's own ones among them.
//!
//! Noise has fewer extrema in the mean of many signals, and what is in one signal only is not in the others. So
//! every receiver gets the same list of extrema, to which the model's own rule applies.

use osteon_solver::picking::{FLOOR, PressureExtremum, Window};

use crate::array_geometry::ArrayGeometry;
use crate::consensus::MoveoutLine;
use crate::dot::dot;
use crate::interpolation::CurvedExtremum;
use crate::receiver_signal::{NOISE_FLOOR, ReceiverSignal};

/// Time before and after the line that is laid over, in periods: the extrema before the line's own one, and the
/// rest of the packet.
const PERIODS: (f64, f64) = (-3.0, 2.2);
/// Steps in a period.
const STEPS_PER_PERIOD: f64 = 32.0;
/// Largest distance of a receiver's extremum from the common one, in periods: half of the time to the next of
/// the other sign.
const MATCH_PERIODS: f64 = 0.25;
/// A common extremum of this many standard deviations of the noise is none of noise.
const SURE_NOISE: f64 = 7.0;
/// Time before and after an extremum in which signals are compared, and largest delay, in periods.
const COMPARED: (f64, f64) = (-0.75, 1.2);
const DELAY_PERIODS: f64 = 1.6;
/// Largest delay, in periods, that is none.
const PUNCTUAL_PERIODS: f64 = 0.25;
/// Steps between the values that are compared.
const COMPARED_STEP: usize = 2;
/// Smallest size of an extremum that is matched, in standard deviations of the noise. It may be below that which
/// opens a packet, because it is known where to look.
const MATCHED_NOISE: f64 = 3.0;

/// The mean of the signals along a line, each relative to its largest extremum.
#[derive(Debug)]
pub(crate) struct StackedSignal {
    /// Time of the first value relative to the line, s.
    start: f64,
    step: f64,
    pub(crate) values: Vec<f64>,
    /// Common extrema, with times relative to the line.
    pub(crate) extrema: Vec<PressureExtremum>,
    /// Standard deviation of the noise of a value.
    pub(crate) noise: f64,
}

/// The signals that are laid over each other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AlignedArray<'a> {
    pub(crate) signals: &'a [ReceiverSignal],
    pub(crate) geometry: &'a ArrayGeometry,
    pub(crate) line: MoveoutLine,
    pub(crate) period: f64,
}

impl AlignedArray<'_> {
    /// Returns the time, s, at a receiver that lies `delay` (s) after the line.
    pub(crate) fn time(&self, r: usize, delay: f64) -> f64 {
        self.line.at(self.geometry.distances[r]) + delay
    }

    /// Lays the signals of `members` over each other; `peaks` are the largest extrema of each receiver's packet.
    pub(crate) fn stack(&self, members: &[usize], peaks: &[f64]) -> StackedSignal {
        let step = self.period / STEPS_PER_PERIOD;
        let (first, last) = (PERIODS.0 * STEPS_PER_PERIOD, PERIODS.1 * STEPS_PER_PERIOD);
        let start = PERIODS.0 * self.period;
        let mut values = Vec::new();
        for j in 0..=(last - first) as usize {
            let delay = (j as f64).mul_add(step, start);
            let (mut sum, mut count) = (0.0, 0);
            for &r in members {
                let time = self.time(r, delay);
                if time < self.geometry.direct[r] {
                    // Before the earliest arrival there is nothing.
                    let is_after = time >= self.geometry.earliest[r];
                    sum += if is_after { self.signals[r].at(time) / peaks[r] } else { 0.0 };
                    count += 1;
                }
            }
            if 2 * count < members.len() {
                break;
            }
            values.push(sum / count as f64);
        }
        let noise = members.iter().fold(0.0, |sum: f64, &r| {
            let size = self.signals[r].noise.map_or(0.0, |noise| noise.value / peaks[r]);
            size.mul_add(size, sum)
        });
        let noise = noise.sqrt() / members.len() as f64;
        let extrema =
            common_extrema(&values, (start, step), NOISE_FLOOR * noise, NOISE_FLOOR * noise);
        StackedSignal { start, step, values, extrema, noise }
    }

    /// Removes common extrema that may be noise: those that stand out little, and that few of the members have.
    pub(crate) fn drop_noise(&self, stacked: &mut StackedSignal, members: &[usize]) {
        let sure = SURE_NOISE * stacked.noise;
        stacked.extrema.retain(|common| {
            let count = members.iter().filter(|&&r| self.matched(r, common).is_some()).count();
            common.pressure.abs() >= sure || 2 * count >= members.len()
        });
    }

    /// Returns the extremum of a receiver that belongs to a common one: of its sign, near it, and no noise.
    pub(crate) fn matched(&self, r: usize, common: &PressureExtremum) -> Option<CurvedExtremum> {
        let signal = &self.signals[r];
        let time = self.time(r, common.time);
        let floor = MATCHED_NOISE / NOISE_FLOOR * signal.floor();
        let near = signal.extrema.iter().filter(|extremum| {
            (extremum.at.pressure < 0.0) == (common.pressure < 0.0)
                && extremum.at.pressure * extremum.curvature < 0.0
                && (extremum.at.time - time).abs() <= MATCH_PERIODS * self.period
                && extremum.at.pressure.abs() >= floor
        });
        // Noise may have several on the top of one wave.
        near.copied().reduce(|most, next| {
            if next.at.pressure.abs() > most.at.pressure.abs() { next } else { most }
        })
    }

    /// Returns the window of a receiver with the common extrema and no others: its own ones, or what is there
    /// if it has none.
    pub(crate) fn window(&self, r: usize, stacked: &StackedSignal) -> Window {
        let extrema = stacked.extrema.iter().map(|common| {
            if let Some(own) = self.matched(r, common) {
                return own.at;
            }
            let time = self.time(r, common.time);
            let value = self.signals[r].at(time);
            let is_like = (value < 0.0) == (common.pressure < 0.0);
            PressureExtremum { time, pressure: if is_like { value } else { 0.0 } }
        });
        Window { extrema: extrema.collect(), last: self.signals[r].last }
    }

    /// Compares a receiver's signal with the stacked one from shortly before to a period after `around`, s
    /// relative to the line.
    pub(crate) fn likeness(&self, r: usize, stacked: &StackedSignal, around: f64) -> Likeness {
        let base = self.time(r, 0.0);
        let steps = |periods: f64| (periods * STEPS_PER_PERIOD) as i64;
        let middle = ((around - stacked.start) / stacked.step) as i64;
        let end = (middle + steps(COMPARED.1)).min(stacked.values.len() as i64);
        let begin = (middle + steps(COMPARED.0)).clamp(0, end);
        let lags = steps(DELAY_PERIODS);
        let own: Vec<f64> = (begin - lags..end + lags)
            .step_by(COMPARED_STEP)
            .map(|j| self.signals[r].at((j as f64).mul_add(stacked.step, stacked.start) + base))
            .collect();
        let common: Vec<f64> = (begin..end)
            .step_by(COMPARED_STEP)
            .filter_map(|j| stacked.values.get(usize::try_from(j).ok()?).copied())
            .collect();
        let mut found = Likeness::default();
        for (place, own) in own.windows(common.len().max(1)).enumerate() {
            let lag = place as i64 * COMPARED_STEP as i64 - lags;
            let alike = correlation(own, &common);
            if alike.abs() > found.best.abs() {
                (found.delay, found.best) = (lag as f64 * stacked.step, alike);
            }
            if lag.abs() <= steps(PUNCTUAL_PERIODS) && alike > found.punctual {
                found.punctual = alike;
            }
        }
        found
    }
}

/// How alike a signal and the stacked one are: correlations from -1 to 1.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Likeness {
    /// The one of largest modulus at any delay.
    pub(crate) best: f64,
    /// Its delay, s.
    pub(crate) delay: f64,
    /// The largest one without a delay.
    pub(crate) punctual: f64,
}

fn correlation(one: &[f64], other: &[f64]) -> f64 {
    let (cross, own, common) = (dot(one, other), dot(one, one), dot(other, other));
    if own > 0.0 && common > 0.0 { cross / (own * common).sqrt() } else { 0.0 }
}

/// Returns the extrema of equally spaced values whose modulus is at least `floor`, relative to the largest value.
/// Of several on one wave, with dips between them that are shallower than the noise `shallow`, the largest counts.
fn common_extrema(
    values: &[f64],
    (start, step): (f64, f64),
    floor: f64,
    shallow: f64,
) -> Vec<PressureExtremum> {
    let mut found: Vec<(usize, PressureExtremum)> = Vec::new();
    'all: for (j, three) in values.windows(3).enumerate() {
        let [before, middle, after] = [three[0], three[1], three[2]];
        let bend = before - 2.0 * middle + after;
        if (middle - before) * (after - middle) >= 0.0 || middle * bend >= 0.0 {
            continue;
        }
        let within = 0.5 * (before - after) / bend;
        let time = ((j + 1) as f64 + within).mul_add(step, start);
        while let Some((index, last)) = found.last()
            && (last.pressure < 0.0) == (middle < 0.0)
        {
            let between = values[*index..=j + 1].iter();
            let dip = between.fold(f64::INFINITY, |least, value| least.min(value.abs()));
            if last.pressure.abs().min(middle.abs()) - dip >= shallow {
                break;
            }
            if last.pressure.abs() >= middle.abs() {
                continue 'all;
            }
            found.pop();
        }
        found.push((j + 1, PressureExtremum { time, pressure: middle }));
    }
    let largest = found.iter().fold(0.0, |max: f64, (_, e)| max.max(e.pressure.abs()));
    let extrema = found.into_iter().map(|(_, extremum)| extremum);
    extrema.filter(|e| e.pressure.abs() >= floor.max(FLOOR * largest)).collect()
}
