//! The line on which most receivers have an extremum of one sign: robust against receivers of any kind.

use crate::interpolation::CurvedExtremum;

/// Largest distance of an extremum from the line, in periods.
const NEAR_PERIODS: f64 = 0.15;
/// Share of the receivers that must have one.
const SHARE_MIN: f64 = 0.6;
/// Receivers at each end of the array whose extrema define lines.
const ENDS_MAX: usize = 5;
/// Speeds, m/s, between which a line's speed must lie.
const SPEEDS: (f64, f64) = (1000.0, 20_000.0);

/// A line of times over distances, and the sign of the extrema on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MoveoutLine {
    /// Time at distance 0, s.
    intercept: f64,
    /// Slowness, s/m.
    slowness: f64,
    pub(crate) is_negative: bool,
}

impl MoveoutLine {
    /// Returns the time, s, at a distance, m.
    pub(crate) fn at(&self, distance: f64) -> f64 {
        self.slowness.mul_add(distance, self.intercept)
    }
}

/// Returns the line with the most receivers near it; of several the one with the larger extrema. `packets` has
/// the extrema of each receiver's first packet, none of one that is not used. `None` if no line has enough.
pub(crate) fn consensus(
    distances: &[f64],
    packets: &[Vec<CurvedExtremum>],
    period: f64,
) -> Option<(MoveoutLine, Vec<bool>)> {
    let used: Vec<usize> = (0..packets.len()).filter(|&r| !packets[r].is_empty()).collect();
    let needed = ((SHARE_MIN * used.len() as f64).ceil() as usize).max(3);
    let ends = ENDS_MAX.min(used.len() / 2);
    let mut best: Option<(usize, f64, MoveoutLine, Vec<bool>)> = None;
    for &near in &used[..ends] {
        for &far in &used[used.len() - ends..] {
            for (one, other) in pairs(&packets[near], &packets[far]) {
                let apart = distances[far] - distances[near];
                let Some(line) = through((distances[near], one), other, apart) else { continue };
                let (members, total) = members(&line, distances, packets, period);
                let count = members.iter().filter(|&&is| is).count();
                let is_better = best.as_ref().is_none_or(|(most, largest, ..)| {
                    count > *most || count == *most && total > *largest
                });
                if count >= needed && is_better {
                    best = Some((count, total, line, members));
                }
            }
        }
    }
    best.map(|(_, _, line, members)| (line, members))
}

/// Returns all pairs of extrema of one sign.
fn pairs<'a>(
    near: &'a [CurvedExtremum],
    far: &'a [CurvedExtremum],
) -> impl Iterator<Item = (&'a CurvedExtremum, &'a CurvedExtremum)> {
    let both = near.iter().flat_map(move |one| far.iter().map(move |other| (one, other)));
    both.filter(|(one, other)| (one.at.pressure < 0.0) == (other.at.pressure < 0.0))
}

fn through(
    (distance, one): (f64, &CurvedExtremum),
    other: &CurvedExtremum,
    apart: f64,
) -> Option<MoveoutLine> {
    let slowness = (other.at.time - one.at.time) / apart;
    let (least, most) = (1.0 / SPEEDS.1, 1.0 / SPEEDS.0);
    (least..=most).contains(&slowness).then_some(MoveoutLine {
        intercept: one.at.time - slowness * distance,
        slowness,
        is_negative: one.at.pressure < 0.0,
    })
}

/// Returns which receivers have an extremum of the line's sign near it, and the sum of their sizes relative to
/// their receivers' largest.
fn members(
    line: &MoveoutLine,
    distances: &[f64],
    packets: &[Vec<CurvedExtremum>],
    period: f64,
) -> (Vec<bool>, f64) {
    let mut total = 0.0;
    let members = packets.iter().zip(distances).map(|(packet, &distance)| {
        let largest = packet.iter().fold(0.0, |max: f64, e| max.max(e.at.pressure.abs()));
        let near = packet.iter().find(|e| {
            (e.at.pressure < 0.0) == line.is_negative
                && (e.at.time - line.at(distance)).abs() <= NEAR_PERIODS * period
        });
        if let Some(near) = near {
            total += near.at.pressure.abs() / largest;
        }
        near.is_some()
    });
    let members = members.collect();
    (members, total)
}
