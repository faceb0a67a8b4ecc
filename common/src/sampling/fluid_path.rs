//! Paths through the fluids above the bone: how far each of them is crossed, and the earliest arrival of a
//! wave that does so.
//!
//! A path crosses lengths d_j of fluids with speeds of sound c_j, and goes the distance x along them. Its travel
//! time is at least p x + Σ d_j √(1/c_j² - p²), for every slowness p along x1 from 0 to that of the fastest
//! medium on the path. With the slowness of its ray the bound is the travel time itself.

use crate::fluid_sublayers::{FluidSublayer, FluidSublayers};
use crate::limits::FLUID_SUBLAYERS_MAX;

/// Number of halvings after which a slowness is known to the last bits.
const HALVINGS: usize = 60;

/// The lengths, m, that a path has across each fluid above the bone, upwards.
#[derive(Debug, Clone, Copy)]
pub(super) struct FluidPath {
    fluids: FluidSublayers,
    lengths: [f64; FLUID_SUBLAYERS_MAX],
}

impl FluidPath {
    /// Returns a path that has not crossed anything.
    pub(super) fn new(fluids: &FluidSublayers) -> Self {
        Self { fluids: *fluids, lengths: [0.0; FLUID_SUBLAYERS_MAX] }
    }

    /// Returns the path from the source's height to the bone and up to the receiver's (m).
    pub(super) fn by_the_bone(fluids: &FluidSublayers, source: f64, receiver: f64) -> Self {
        match fluids.as_slice() {
            [_] => Self::new(fluids).with(0, receiver + source),
            _ => Self::new(fluids).across(0.0, source).across(0.0, receiver),
        }
    }

    /// Returns the shortest path between two heights, m, by way of the coupling's outer face.
    pub(super) fn by_the_outer_face(fluids: &FluidSublayers, source: f64, receiver: f64) -> Self {
        let top = fluids.thickness();
        match fluids.as_slice() {
            [_] => Self::new(fluids).with(0, 2.0 * top - (receiver - source).abs()),
            // From the lower one to the bone and to the outer face, and from there to the upper one.
            _ => {
                let (lower, upper) = (source.min(receiver), source.max(receiver));
                Self::new(fluids).across(0.0, lower).across(0.0, top).across(upper, top)
            }
        }
    }

    fn with(mut self, index: usize, length: f64) -> Self {
        self.lengths[index] += length;
        self
    }

    /// Returns the path with the way between two heights, m, in addition.
    fn across(self, from: f64, to: f64) -> Self {
        let (mut path, mut start) = (self, 0.0);
        for (index, fluid) in self.fluids.as_slice().iter().enumerate() {
            let end = start + fluid.thickness;
            path = path.with(index, (to.min(end) - from.max(start)).max(0.0));
            start = end;
        }
        path
    }

    /// Returns each length, m, that is not zero, with the speed of its fluid, m/s.
    pub(super) fn parts(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let parts = self.lengths.iter().zip(self.fluids.as_slice());
        parts
            .filter(|(length, _)| **length > 0.0)
            .map(|(&length, fluid)| (length, fluid.sound_speed))
    }

    /// Returns the time, s, that a wave of speed `speed` (m/s) along x1 spends across the fluids.
    pub(super) fn delay(&self, speed: f64) -> f64 {
        self.parts().fold(0.0, |sum, (length, c)| sum + length * slowness(c, speed))
    }

    /// Returns the slowest speed of sound on the path, m/s; infinite if it crosses nothing.
    pub(super) fn slowest(&self) -> f64 {
        self.parts().fold(f64::INFINITY, |slowest, (_, c)| c.min(slowest))
    }

    /// Returns the fastest speed of sound on the path, m/s; 0 if it crosses nothing.
    fn fastest(&self) -> f64 {
        self.parts().fold(0.0, |fastest, (_, c)| c.max(fastest))
    }

    /// Returns the travel time, s, of the ray over the distance `x` (m) that turns nowhere else.
    pub(super) fn ray(&self, x: f64) -> f64 {
        let mut parts = self.parts();
        if let (Some((length, c)), None) = (parts.next(), parts.next()) {
            return x.mul_add(x, length * length).sqrt() / c;
        }
        let (mut low, mut high) = (0.0, 1.0 / self.fastest());
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if x > self.spread(middle) { low = middle } else { high = middle }
        }
        self.parts().fold(low * x, |sum, (length, c)| sum + length * slowness(c, 1.0 / low))
    }

    /// Returns the distance along x1, m, of the ray of slowness `along` (s/m), which is less than that of the
    /// fastest fluid on the path.
    fn spread(&self, along: f64) -> f64 {
        self.parts().fold(0.0, |sum, (length, c)| sum + length * along / slowness(c, 1.0 / along))
    }
}

/// Returns √(1/c² - 1/v²), s/m: the slowness across the layer of a wave that travels along it at
/// `v`.
pub fn slowness(c: f64, v: f64) -> f64 {
    (1.0 / (c * c) - 1.0 / (v * v)).max(0.0).sqrt()
}

/// Returns the earliest arrival, s, at `x` (m) from the source and at the height `receiver` (m) of a wave from
/// the height `source` (m) that neither meets the bone nor the outer face: the direct one, or one along
/// a faster fluid.
pub(super) fn earliest_in_fluids(
    fluids: &FluidSublayers,
    source: f64,
    receiver: f64,
    x: f64,
) -> f64 {
    let (lower, upper) = (source.min(receiver), source.max(receiver));
    let (mut earliest, mut start) = (f64::INFINITY, 0.0);
    let between = FluidPath::new(fluids).across(lower, upper);
    if between.fastest() > 0.0 {
        earliest = between.ray(x);
    }
    for &FluidSublayer { thickness, sound_speed, .. } in fluids.as_slice() {
        let end = start + thickness;
        // The way to the fluid's nearer face and back, if it is not on the direct one.
        let path = if start >= upper {
            between.across(upper, start).across(upper, start)
        } else if end <= lower {
            between.across(end, lower).across(end, lower)
        } else {
            between
        };
        start = end;
        // A wave along a fluid that is no faster, or which the ray meets too steeply, is later than the
        // direct one.
        let is_faster = path.fastest() < sound_speed;
        if is_faster && x >= path.spread(1.0 / sound_speed) {
            earliest = earliest.min(x / sound_speed + path.delay(sound_speed));
        }
    }
    earliest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fluids(all: &[(f64, f64)]) -> FluidSublayers {
        let one =
            |&(thickness, sound_speed)| FluidSublayer { thickness, density: 1000.0, sound_speed };
        FluidSublayers::new(&all.iter().map(one).collect::<Vec<_>>()).unwrap()
    }

    /// The earliest arrival by brute force: the shortest way over a grid of points on the joints, between
    /// any two of which on neighbouring joints, or on the same one, the way is straight.
    fn by_shortest_way(all: &[(f64, f64)], source: f64, receiver: f64, x: f64) -> f64 {
        const STEPS: usize = 200;
        let step = x / STEPS as f64;
        let mut heights = vec![source, receiver];
        let mut height = 0.0;
        for (index, (thickness, _)) in all.iter().enumerate() {
            height += thickness;
            // Neither the bone nor the outer face.
            if index + 1 < all.len() {
                heights.push(height);
            }
        }
        heights.sort_by(f64::total_cmp);
        heights.dedup();
        let at = |one: f64| heights.iter().position(|height| *height == one).unwrap();
        let speed = |from: f64, to: f64| {
            let (middle, mut start, mut fastest) = (0.5 * (from + to), 0.0, 0.0_f64);
            for &(thickness, c) in all {
                if (start..=start + thickness).contains(&middle) {
                    fastest = fastest.max(c);
                }
                start += thickness;
            }
            fastest
        };
        let rows = heights.len();
        let mut best = vec![vec![f64::INFINITY; STEPS + 1]; rows];
        best[at(source)][0] = 0.0;
        // Twice upwards and downwards: no shortest way turns more often.
        for _ in 0..2 {
            for row in (0..rows).chain((0..rows).rev()) {
                let along = step / speed(heights[row], heights[row]);
                for i in 1..=STEPS {
                    best[row][i] = best[row][i].min(best[row][i - 1] + along);
                }
                for next in [row.wrapping_sub(1), row + 1].into_iter().filter(|&n| n < rows) {
                    let across = (heights[next] - heights[row]).abs();
                    let c = speed(heights[row], heights[next]);
                    for i in 0..=STEPS {
                        for j in i..=STEPS {
                            let along = (j - i) as f64 * step;
                            let time =
                                best[row][i] + along.mul_add(along, across * across).sqrt() / c;
                            best[next][j] = best[next][j].min(time);
                        }
                    }
                }
            }
        }
        best[at(receiver)][STEPS]
    }

    #[test]
    fn no_way_through_the_fluids_is_shorter() {
        let stack = [(2e-3, 1580.0), (1e-3, 1450.0), (1.5e-3, 1620.0), (3e-3, 1500.0)];
        for (source, receiver) in [(0.5e-3, 1.7e-3), (5e-3, 5e-3), (2.5e-3, 0.7e-3), (3e-3, 7e-3)] {
            for x in [2e-3, 11e-3, 30e-3] {
                let found = earliest_in_fluids(&fluids(&stack), source, receiver, x);
                let expected = by_shortest_way(&stack, source, receiver, x);
                // A point of the grid is at most 0.075 mm from that of the ray, which takes 2 ns for each joint.
                let excess = expected / found - 1.0;
                assert!((-1e-12..4e-4).contains(&excess), "{source} {receiver} {x}: {excess:e}");
            }
        }
    }

    #[test]
    fn one_fluid_has_straight_rays() {
        let found = earliest_in_fluids(&fluids(&[(10e-3, 1500.0)]), 2e-3, 5e-3, 4e-3);
        assert!((found - 5e-3 / 1500.0).abs() < 1e-20);
        let path = FluidPath::by_the_bone(&fluids(&[(10e-3, 1500.0)]), 2e-3, 5e-3);
        assert_eq!(path.ray(24e-3), 25e-3 / 1500.0);
        assert_eq!(path.delay(3000.0), 7e-3 * slowness(1500.0, 3000.0));
    }
}
