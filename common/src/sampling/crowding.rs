//! How near the first packet is to slower waves.

use crate::case::Setup;

use super::arrivals::{by_the_bone, nearest_and_farthest};

/// Slowness at which waves begin to be left out, as a multiple of that of the fastest wave.
pub(super) const SLOWNESS_START: f64 = 0.8;
/// Range of slowness over which they fade, as a fraction of that of the coupling fluid.
pub(super) const SLOWNESS_FADE: f64 = 0.5;
/// Minimum separation, at the nearest receiver, of the waves at the two ends of the fading, in
/// periods of the centre frequency, for frequencies to be thinned and slow waves to be left out
/// from their usual place on; if the separation is smaller, this happens higher in the band.
const APART: f64 = 2.2;

/// Returns how much higher in the band than usual the first packet separates from slower waves, at
/// the nearest receiver: below that, the signals of both would overlap if they were cut off sharply
/// in time and slowness.
pub(super) fn crowding(setup: &Setup, speed: f64) -> f64 {
    let path = by_the_bone(setup);
    let c1 = path.slowest();
    let start = SLOWNESS_START * c1 / speed;
    let end = start + SLOWNESS_FADE;
    if end >= 1.0 {
        return 1.0;
    }
    let (nearest, _) = nearest_and_farthest(setup);
    // Slowness relative to that of the slowest fluid, along and across.
    let later = path.parts().fold(0.0, |sum, (length, c)| {
        let of_fluid = c1 / c;
        let across = |along: f64| (of_fluid * of_fluid - along * along).max(0.0).sqrt();
        sum + length * (across(start) - across(end))
    });
    let apart = nearest * (end - start) - later;
    let periods = apart / c1 * setup.probe.center_frequency;
    if periods > 0.0 { (APART / periods).max(1.0) } else { f64::INFINITY }
}
