//! Earliest possible arrivals: bounds from geometry and the fastest wave.

use crate::attenuation::Attenuation;
use crate::case::Setup;
use crate::fluid_sublayers::FluidSublayers;
use crate::probe::Place;

use super::fluid_path::{FluidPath, earliest_in_fluids, slowness};

/// Returns the highest speed, m/s, of waves along the bone, in which none is faster than `in_bone` (m/s)
/// at the reference frequency of its attenuation.
pub fn fastest(setup: &Setup, in_bone: f64) -> f64 {
    let attenuation = &setup.layers.bone_attenuation;
    let in_bone = in_bone * attenuation.fastest(setup.probe.band_unit());
    let marrow = &setup.layers.marrow;
    in_bone.max(fastest_in(&setup.layers.marrow_fluids(), &marrow.attenuation, setup))
}

/// Returns the highest speed, m/s, of waves in the coupling.
pub fn fastest_in_coupling(setup: &Setup) -> f64 {
    let coupling = &setup.layers.coupling;
    fastest_in(&setup.layers.coupling_fluids(), &coupling.attenuation, setup)
}

fn fastest_in(fluids: &FluidSublayers, attenuation: &Attenuation, setup: &Setup) -> f64 {
    fluids.fastest() * attenuation.fastest(setup.probe.band_unit())
}

/// Returns the earliest possible arrival, s, at a receiver's place of a wave that travels along the
/// bone at `speed` (m/s) and through the coupling fluid at its ends.
///
/// It is a lower bound at every distance: within the critical one the reflected wave arrives later.
/// Elements of a width are heard from their nearest ends.
pub fn earliest_arrival(setup: &Setup, place: Place, speed: f64) -> f64 {
    let fluids = setup.layers.coupling_fluids();
    let path = FluidPath::by_the_bone(&fluids, setup.probe.source.x3, place.x3);
    match fluids.as_slice() {
        [one] if speed <= one.sound_speed => {
            path.ray(place.x) - setup.probe.element_width / one.sound_speed
        }
        _ => {
            let speed = fastest_way(&fluids, speed);
            place.x / speed + path.delay(speed) - lead(setup, &path, speed)
        }
    }
}

/// Returns the highest speed along x1, m/s, of what may run in the fluids on its way, too, and else at up to
/// `speed` (m/s). One fluid is no way: what runs in it meets the bone in vain.
fn fastest_way(fluids: &FluidSublayers, speed: f64) -> f64 {
    match fluids.as_slice() {
        [_] => speed,
        _ => speed.max(fluids.fastest()),
    }
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
/// ends of the elements; in sublayers, of the first wave that does not meet the bone.
pub fn direct_arrival(setup: &Setup, place: Place) -> f64 {
    let fluids = setup.layers.coupling_fluids();
    let source = setup.probe.source.x3;
    match fluids.as_slice() {
        [one] => {
            let (along, upwards) = setup.probe.element_extent();
            let (x, across) = (place.x - along, place.x3 - source - upwards);
            x.mul_add(x, across * across).sqrt() / one.sound_speed
        }
        _ => earliest_in_fluids(&fluids, source, place.x3, place.x),
    }
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

/// Returns the path from the source by way of the bone to the lowest receiver.
pub(super) fn by_the_bone(setup: &Setup) -> FluidPath {
    let fluids = setup.layers.coupling_fluids();
    FluidPath::by_the_bone(&fluids, setup.probe.source.x3, setup.probe.lowest_receiver())
}

/// Returns whether what arrives at the time that `echo` gives is before the direct wave at some receiver.
pub(super) fn is_audible(setup: &Setup, speed: f64, echo: fn(&Setup, Place, f64) -> f64) -> bool {
    setup.probe.places().any(|place| echo(setup, place, speed) <= direct_arrival(setup, place))
}

/// Returns the end, s, of the arrival at a receiver's place of the wave reflected by the bone's upper face:
/// the time from the farthest ends of the elements.
pub(super) fn last_reflected_arrival(setup: &Setup, place: Place) -> f64 {
    let fluids = setup.layers.coupling_fluids();
    let path = FluidPath::by_the_bone(&fluids, setup.probe.source.x3, place.x3);
    path.ray(place.x) + setup.probe.element_width / path.slowest()
}

/// Returns at most how much earlier, s, than between their middles a wave on this path travels between the
/// ends of two elements. Only those in one fluid have a width.
fn lead(setup: &Setup, path: &FluidPath, speed: f64) -> f64 {
    let (along, upwards) = setup.probe.element_extent();
    along / speed + upwards.abs() * slowness(path.slowest(), speed)
}

/// Returns the earliest possible arrival, s, of a wave by way of the coupling's outer face.
pub(super) fn upper_echo(setup: &Setup, place: Place, speed: f64) -> f64 {
    let fluids = setup.layers.coupling_fluids();
    let path = FluidPath::by_the_outer_face(&fluids, setup.probe.source.x3, place.x3);
    let speed = fastest_way(&fluids, speed);
    place.x / speed + path.delay(speed) - lead(setup, &path, speed)
}

/// Returns the earliest possible arrival, s, of a wave by way of the marrow's outer face.
pub(super) fn lower_echo(setup: &Setup, place: Place, speed: f64) -> f64 {
    let fluids = setup.layers.marrow_fluids();
    let across = fluids
        .as_slice()
        .iter()
        .fold(0.0, |sum, fluid| sum + 2.0 * fluid.thickness * slowness(fluid.sound_speed, speed));
    earliest_arrival(setup, place, speed) + across
}
