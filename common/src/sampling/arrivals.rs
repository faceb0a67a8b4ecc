//! Earliest possible arrivals: bounds from geometry and the fastest wave.

use crate::case::Setup;
use crate::layers::Fluid;
use crate::probe::Place;

/// Returns the highest speed, m/s, of waves along the bone, in which none is faster than `in_bone` (m/s)
/// at the reference frequency of its attenuation.
pub fn fastest(setup: &Setup, in_bone: f64) -> f64 {
    let attenuation = &setup.layers.bone_attenuation;
    let in_bone = in_bone * attenuation.fastest(setup.probe.band_unit());
    in_bone.max(fastest_in(&setup.layers.marrow, setup))
}

/// Returns the highest speed, m/s, of waves in a fluid of the setup.
pub fn fastest_in(fluid: &Fluid, setup: &Setup) -> f64 {
    fluid.sound_speed * fluid.attenuation.fastest(setup.probe.band_unit())
}

/// Returns the earliest possible arrival, s, at a receiver's place of a wave that travels along the
/// bone at `speed` (m/s) and through the coupling fluid at its ends.
///
/// It is a lower bound at every distance: within the critical one the reflected wave arrives later.
/// Elements of a width are heard from their nearest ends.
pub fn earliest_arrival(setup: &Setup, place: Place, speed: f64) -> f64 {
    let c1 = setup.layers.coupling.sound_speed;
    let heights = place.x3 + setup.probe.source.x3;
    if speed <= c1 {
        return reflected_arrival(setup, place) - setup.probe.element_width / c1;
    }
    place.x / speed + heights * slowness(c1, speed) - lead(setup, c1, speed)
}

/// Returns the earliest possible arrival, s, at a receiver's place of a reflection of an outer face, for
/// waves along the bone up to `speed` (m/s): a lower bound.
pub fn earliest_echo(setup: &Setup, place: Place, speed: f64) -> f64 {
    upper_echo(setup, place, speed).min(lower_echo(setup, place, speed))
}

/// Returns whether a reflection of an outer face can arrive before the direct wave at some receiver,
/// for waves along the bone up to `speed` (m/s).
pub fn echoes_are_audible(setup: &Setup, speed: f64) -> bool {
    is_audible(setup, speed, earliest_echo)
}

/// Returns the arrival, s, of the direct wave in the coupling fluid at a receiver's place, from the nearest
/// ends of the elements.
pub fn direct_arrival(setup: &Setup, place: Place) -> f64 {
    let (along, upwards) = setup.probe.element_extent();
    let (x, across) = (place.x - along, place.x3 - setup.probe.source.x3 - upwards);
    x.mul_add(x, across * across).sqrt() / setup.layers.coupling.sound_speed
}

/// Returns the smallest and the largest distance along the bone, m, of a receiver from the source, each
/// between the ends of their elements.
pub fn nearest_and_farthest(setup: &Setup) -> (f64, f64) {
    let of = |(nearest, farthest): (f64, f64), place: Place| {
        (nearest.min(place.x), farthest.max(place.x))
    };
    let (nearest, farthest) = setup.probe.places().fold((f64::INFINITY, 0.0), of);
    let width = setup.probe.element_width;
    (nearest - width, farthest + width)
}

/// Returns √(1/c² - 1/v²), s/m: the slowness across the layer of a wave that travels along it at
/// `v`.
pub fn slowness(c: f64, v: f64) -> f64 {
    (1.0 / (c * c) - 1.0 / (v * v)).max(0.0).sqrt()
}

/// Returns whether what arrives at the time that `echo` gives is before the direct wave at some receiver.
pub(super) fn is_audible(setup: &Setup, speed: f64, echo: fn(&Setup, Place, f64) -> f64) -> bool {
    setup.probe.places().any(|place| echo(setup, place, speed) <= direct_arrival(setup, place))
}

/// Returns the end, s, of the arrival at a receiver's place of the wave reflected by the bone's upper face:
/// the time from the farthest ends of the elements.
pub(super) fn last_reflected_arrival(setup: &Setup, place: Place) -> f64 {
    let across_elements = setup.probe.element_width / setup.layers.coupling.sound_speed;
    reflected_arrival(setup, place) + across_elements
}

/// Returns the arrival, s, at a receiver's place of the wave reflected by the bone's upper face, from the
/// middles of the elements.
fn reflected_arrival(setup: &Setup, place: Place) -> f64 {
    let (x, heights) = (place.x, place.x3 + setup.probe.source.x3);
    x.mul_add(x, heights * heights).sqrt() / setup.layers.coupling.sound_speed
}

/// Returns at most how much earlier, s, than between their middles a wave travels between the ends of two
/// elements, if it leaves and reaches them through a fluid with this speed of sound (m/s).
fn lead(setup: &Setup, sound_speed: f64, speed: f64) -> f64 {
    let (along, upwards) = setup.probe.element_extent();
    along / speed + upwards.abs() * slowness(sound_speed, speed)
}

/// Returns the earliest possible arrival, s, of a wave by way of the coupling's outer face.
pub(super) fn upper_echo(setup: &Setup, place: Place, speed: f64) -> f64 {
    let coupling = &setup.layers.coupling;
    let path = 2.0 * coupling.thickness - (place.x3 - setup.probe.source.x3).abs();
    place.x / speed + path * slowness(coupling.sound_speed, speed)
        - lead(setup, coupling.sound_speed, speed)
}

/// Returns the earliest possible arrival, s, of a wave by way of the marrow's outer face.
pub(super) fn lower_echo(setup: &Setup, place: Place, speed: f64) -> f64 {
    let marrow = &setup.layers.marrow;
    let across = 2.0 * marrow.thickness * slowness(marrow.sound_speed, speed);
    earliest_arrival(setup, place, speed) + across
}
