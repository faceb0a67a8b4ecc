//! The first arriving signal: one extremum, the same at every receiver, and the line through its
//! times.
//!
//! Which extremum that is decides [`array_rank`], for computed pressures and measured signals alike.

use osteon_common::case::Setup;
use osteon_common::line_fit::{mean, slope};
use osteon_common::outcome::FailureKind;
use osteon_common::settings::{self, Picking};

use crate::failure::Failure;
use crate::pulse::relative_onset;

/// An extremum below this fraction of the window's largest one is numerical noise.
pub const FLOOR: f64 = 1e-3;
/// A packet's peak is searched for up to this many periods of the centre frequency after an extremum.
pub const PACKET_PERIODS: f64 = 1.2;
/// Largest distance of a pick from the line, in periods of the centre frequency.
pub const RESIDUAL_PERIODS_MAX: f64 = 0.05;

/// A local extremum of the pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureExtremum {
    /// Time, s.
    pub time: f64,
    /// Pressure, Pa; of a measured signal in its own unit.
    pub pressure: f64,
}

/// The signal at one receiver before the direct wave can arrive.
#[derive(Debug, Default)]
pub struct Window {
    /// Local extrema in order of time.
    pub extrema: Vec<PressureExtremum>,
    /// |p| at the end of the window, Pa.
    pub last: f64,
}

impl Window {
    /// Removes extrema below the numerical floor.
    ///
    /// A wave that still rises when the direct wave arrives has no extremum in the window; then
    /// only noise remains, which is small compared to the window's last value, and none of it is
    /// kept.
    pub fn drop_noise(&mut self) {
        let largest = self.extrema.iter().fold(0.0, |max: f64, e| max.max(e.pressure.abs()));
        if largest < FLOOR * self.last {
            self.extrema.clear();
        }
        self.extrema.retain(|e| e.pressure.abs() >= FLOOR * largest);
    }

    /// Returns the largest |p| of an extremum, or at the end.
    fn largest(&self) -> f64 {
        self.extrema.iter().fold(self.last, |max, e| max.max(e.pressure.abs()))
    }

    /// Returns the ratio of |p| of extremum `rank` to its packet's peak; `None` if there are fewer extrema.
    pub fn ratio(&self, rank: usize, packet: f64) -> Option<f64> {
        let first = self.extrema.get(rank)?;
        let peak = self.extrema[rank..]
            .iter()
            .take_while(|e| e.time <= first.time + packet)
            .fold(0.0, |max: f64, e| max.max(e.pressure.abs()));
        Some(first.pressure.abs() / peak)
    }
}

/// The first arriving signal of an array.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pick {
    /// Velocity, m/s.
    pub(crate) velocity: f64,
    /// Time of the extremum at each receiver, s.
    pub(crate) times: Vec<f64>,
    /// |p| of the extremum at each receiver, Pa, for a pulse of any one amplitude.
    pub(crate) amplitudes: Vec<f64>,
    /// Ratio of the packet's first extremum to the packet's peak, in the median over the receivers.
    pub(crate) ratio: f64,
    /// Largest such ratio of an earlier extremum, which is below the threshold; 0 if there is none.
    pub(crate) skipped: f64,
    /// Largest distance of a time from the line, s.
    pub(crate) residual: f64,
    /// Ratio of |p| of the extremum to the largest in the window, at the receiver where it is
    /// smallest.
    pub(crate) prominence: f64,
}

/// Returns the criterion for the signals of a setup: its threshold is the one for the paper's pulse, and is
/// lower for a pulse that begins more gently.
pub fn criterion(setup: &Setup) -> Picking {
    let threshold = setup.picking.threshold * relative_onset(&setup.probe);
    Picking { threshold, ..setup.picking }
}

/// Picks the first arriving signal.
///
/// `picking` is the [`criterion`] of the setup; `windows` and `distances` (m, from the source) have one entry
/// per receiver.
///
/// # Errors
/// `DirectWaveFirst` if a receiver has no extremum before the direct wave, `NoArrival` if one has
/// too few, `InconsistentArrival` if the picks differ in sign or do not lie on one line.
pub(crate) fn pick(
    picking: &Picking,
    center_frequency: f64,
    distances: &[f64],
    windows: &[Window],
) -> Result<Pick, Failure> {
    if let Some(r) = windows.iter().position(|window| window.extrema.is_empty()) {
        return Err(Failure {
            kind: FailureKind::DirectWaveFirst,
            detail: format!(
                "at receiver {} ({:?} m from the source) the direct wave arrives before the first \
                 extremum of the wave through the bone",
                r + 1,
                distances[r]
            ),
        });
    }
    let ArrayRank { rank, ratio, skipped } = array_rank(picking, center_frequency, windows)?;
    let mut picks = Vec::with_capacity(windows.len());
    for (r, window) in windows.iter().enumerate() {
        picks.push(*window.extrema.get(rank).ok_or_else(|| no_arrival(r, rank))?);
    }
    if let Some(r) = picks.iter().position(|p| (p.pressure < 0.0) != (picks[0].pressure < 0.0)) {
        return Err(Failure {
            kind: FailureKind::InconsistentArrival,
            detail: format!(
                "the picked extremum has another sign at receiver {} than at receiver 1",
                r + 1
            ),
        });
    }
    let times: Vec<f64> = picks.iter().map(|p| p.time).collect();
    let (velocity, residual) = line(distances, &times, center_frequency)?;
    let shares = windows.iter().zip(&picks).map(|(window, p)| p.pressure.abs() / window.largest());
    let prominence = shares.fold(f64::INFINITY, f64::min);
    let amplitudes = picks.iter().map(|p| p.pressure.abs()).collect();
    Ok(Pick { velocity, times, amplitudes, ratio, skipped, residual, prominence })
}

/// Returns the velocity, m/s, of the line through picked times (s), and the largest distance of a
/// time from it.
///
/// # Errors
/// `InconsistentArrival` if the times do not lie on one line that leads away from the source.
pub(crate) fn line(
    distances: &[f64],
    times: &[f64],
    center_frequency: f64,
) -> Result<(f64, f64), Failure> {
    let residual_max = RESIDUAL_PERIODS_MAX / center_frequency;
    let slope = slope(distances, times);
    let (mean_distance, mean_time) = (mean(distances), mean(times));
    if !(slope > 0.0 && slope.is_finite()) {
        return Err(Failure {
            kind: FailureKind::InconsistentArrival,
            detail: "the picked extremum does not travel away from the source".to_owned(),
        });
    }
    let mut largest: f64 = 0.0;
    for (r, (x, t)) in distances.iter().zip(times).enumerate() {
        let residual = (x - mean_distance - slope * (t - mean_time)).abs() / slope;
        if residual > residual_max {
            return Err(Failure {
                kind: FailureKind::InconsistentArrival,
                detail: format!(
                    "the pick at receiver {} is {:.1} ns off the line, allowed are {:.1} ns",
                    r + 1,
                    residual * 1e9,
                    residual_max * 1e9
                ),
            });
        }
        largest = largest.max(residual);
    }
    Ok((slope, largest))
}

/// Which extremum is picked at every receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArrayRank {
    /// Its number in each window, from 0.
    pub rank: usize,
    /// Ratio of the packet's first extremum to the packet's peak, in the median over the receivers.
    pub ratio: f64,
    /// Largest such ratio of an earlier extremum, which is below the threshold; 0 if there is none.
    pub skipped: f64,
}

/// Decides which extremum is picked: the one of lowest rank whose ratio, in the median over the receivers,
/// exceeds the threshold, or the next.
///
/// `picking` is the [`criterion`] of the setup, and `center_frequency` is in Hz.
///
/// # Errors
/// `NoArrival` if a receiver has too few extrema.
pub fn array_rank(
    picking: &Picking,
    center_frequency: f64,
    windows: &[Window],
) -> Result<ArrayRank, Failure> {
    let packet = PACKET_PERIODS / center_frequency;
    // The loop ends at the latest when a receiver has no further extrema.
    let (mut first, mut skipped) = (0, 0.0_f64);
    loop {
        let mut ratios = Vec::with_capacity(windows.len());
        for (r, window) in windows.iter().enumerate() {
            ratios.push(window.ratio(first, packet).ok_or_else(|| no_arrival(r, first))?);
        }
        let ratio = median(&mut ratios);
        if ratio > picking.threshold {
            let rank = match picking.extremum {
                settings::Extremum::First => first,
                settings::Extremum::Second => first + 1,
            };
            return Ok(ArrayRank { rank, ratio, skipped });
        }
        skipped = skipped.max(ratio);
        first += 1;
    }
}

fn no_arrival(receiver: usize, rank: usize) -> Failure {
    Failure {
        kind: FailureKind::NoArrival,
        detail: format!(
            "receiver {} has {rank} extrema before the direct wave; extremum {} of the array is missing there",
            receiver + 1,
            rank + 1
        ),
    }
}

/// Returns the median; for an even count the mean of the middle two, of none 0.
pub fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    values.sort_unstable_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FC: f64 = 1e6;

    /// Windows of receivers 1 mm apart; each extremum is (time in µs at the first receiver,
    /// pressure) and travels at 4 mm/µs.
    fn windows(extrema: &[(f64, f64)], receivers: usize) -> (Vec<f64>, Vec<Window>) {
        let distances: Vec<f64> = (0..receivers).map(|r| 0.01 + 1e-3 * r as f64).collect();
        let windows = (0..receivers)
            .map(|r| Window {
                extrema: extrema
                    .iter()
                    .map(|&(time, pressure)| PressureExtremum {
                        time: (time + 0.25 * r as f64) * 1e-6,
                        pressure,
                    })
                    .collect(),
                last: 0.0,
            })
            .collect();
        (distances, windows)
    }

    fn check(
        extrema: &[(f64, f64)],
        change: impl Fn(&mut Vec<Window>),
        expected: Result<(f64, f64), FailureKind>,
    ) {
        let (distances, mut windows) = windows(extrema, 4);
        change(&mut windows);
        windows.iter_mut().for_each(Window::drop_noise);
        let picked = pick(&Picking::default(), FC, &distances, &windows);
        match (picked, expected) {
            (Ok(arrival), Ok((velocity, time))) => {
                assert!((arrival.velocity - velocity).abs() < 1e-6 * velocity);
                assert!((arrival.times[0] - time * 1e-6).abs() < 1e-15);
            }
            (Err(failure), Err(kind)) => assert_eq!(failure.kind, kind, "{}", failure.detail),
            (picked, expected) => panic!("{picked:?} against {expected:?}"),
        }
    }

    #[test]
    fn the_first_extremum_above_the_threshold_is_the_same_at_every_receiver() {
        let packet = [(5.0, 0.04), (5.4, -0.2), (5.8, 1.0)];
        check(&packet, |_| (), Ok((4000.0, 5.4)));
        // At two of four receivers the small one is above the threshold: the median decides.
        check(&packet, |w| w[0].extrema[0].pressure = 0.07, Ok((4000.0, 5.4)));
        check(&packet, |w| (0..3).for_each(|r| w[r].extrema[0].pressure = 0.07), Ok((4000.0, 5.0)));
    }

    #[test]
    fn a_ratio_equal_to_the_threshold_does_not_open_the_packet() {
        check(&[(5.0, 0.05), (5.4, -1.0)], |_| (), Ok((4000.0, 5.4)));
    }

    #[test]
    fn a_packet_ends_after_its_periods() {
        // The large extremum 1.3 µs later belongs to another packet.
        check(&[(5.0, 0.04), (5.4, -0.2), (6.3, 30.0)], |_| (), Ok((4000.0, 5.0)));
    }

    #[test]
    fn noise_is_not_counted() {
        check(&[(4.8, 0.9e-3), (5.4, 1.0)], |_| (), Ok((4000.0, 5.4)));
        check(&[(4.8, 1.1e-3), (5.4, 1.0)], |_| (), Ok((4000.0, 5.4)));
    }

    #[test]
    fn what_is_wrong_with_an_array_is_typed() {
        let packet = [(5.0, 0.2), (5.4, -1.0)];
        check(&packet, |w| w[2].extrema.clear(), Err(FailureKind::DirectWaveFirst));
        check(&packet, |w| w[2].last = 1e4, Err(FailureKind::DirectWaveFirst));
        check(
            &[(5.0, 0.04), (5.4, -1.0)],
            |w| w[2].extrema.truncate(1),
            Err(FailureKind::NoArrival),
        );
        check(&packet, |w| w[1].extrema[0].pressure = -0.2, Err(FailureKind::InconsistentArrival));
        check(&packet, |w| w[1].extrema[0].time += 0.1e-6, Err(FailureKind::InconsistentArrival));
        check(
            &packet,
            |w| (0..4).for_each(|r| w[r].extrema[0].time = (9.0 - r as f64) * 1e-6),
            Err(FailureKind::InconsistentArrival),
        );
    }

    #[test]
    fn the_second_extremum_is_the_packets_next() {
        let (distances, windows) = windows(&[(5.0, 0.01), (5.4, -0.2), (5.8, 1.0)], 4);
        let picking = Picking { extremum: settings::Extremum::Second, threshold: 0.05 };
        let arrival = pick(&picking, FC, &distances, &windows).unwrap();
        assert!((arrival.times[0] - 5.8e-6).abs() < 1e-15);
        assert_eq!(arrival.amplitudes, [1.0; 4]);
    }

    #[test]
    fn median_of_an_even_count_is_the_mean_of_the_middle_two() {
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), 2.5);
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
    }
}
