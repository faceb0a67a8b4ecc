//! The decay of waves along an array: of amplitudes, and what a device's elements and receivers add to it.
//!
//! The model has two dimensions: its waves do not spread at right angles to its plane, and those of a device, whose
//! elements are finite, do. With elements of length l, and waves of the wavenumber k = 2 π f/v that run along the
//! bone, the amplitude falls for that reason with the distance r as
//!
//! ```text
//! |∫₀ˡ (l - s) exp(i k s²/(2 r)) ds| / √r
//! ```
//!
//! in the Fresnel approximation: not at all close to long elements, and as 1/√r far from short ones.

use std::f64::consts::{LN_10, TAU};

use crate::accepted::Interval;
use crate::line_fit::{mean, slope};
use crate::probe::Probe;

/// Decibels per neper: 20/ln 10.
const DECIBELS: f64 = 20.0 / LN_10;
/// Centimetres in a metre.
const CENTIMETRES: f64 = 100.0;
/// Accepted lengths of elements across the array.
pub const ELEMENT_LENGTH: Interval = Interval::above_to(0.0, 0.1, "m");
/// Pairs of intervals of Simpson's rule, and further ones for each radian of the largest phase.
const PAIRS: f64 = 32.0;
const PAIRS_OF_RADIAN: f64 = 4.0;

/// How waves spread at right angles to the plane of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spreading {
    /// Not at all, as in the model.
    Line,
    /// As from a point to points.
    Point,
    /// As from and to elements of this length, m.
    Elements(f64),
}

/// Returns the decay, dB/cm, of amplitudes at distances (m) from the source: minus the least-squares slope of
/// 20 log10 of the amplitude.
pub fn decay(distances: &[f64], amplitudes: &[f64]) -> f64 {
    let levels: Vec<f64> = amplitudes.iter().map(|p| DECIBELS * libm::log(*p)).collect();
    -slope(&levels, distances) / CENTIMETRES
}

impl Spreading {
    /// Returns by how much more, dB/cm, waves decay along a probe than in the model. `velocity` is that of the
    /// waves, m/s.
    pub fn decay(self, probe: &Probe, velocity: f64) -> f64 {
        let wavenumber = TAU * probe.center_frequency / velocity;
        let amplitude = |distance: f64| match self {
            Self::Line => 1.0,
            Self::Point => 1.0 / distance.sqrt(),
            Self::Elements(length) => amplitude_of_elements(length, wavenumber, distance),
        };
        let distances: Vec<f64> = probe.distances().collect();
        let amplitudes: Vec<f64> = distances.iter().copied().map(amplitude).collect();
        decay(&distances, &amplitudes)
    }
}

/// Returns the standard deviation of a decay, dB/cm, if the gains of the receivers differ by this one, dB.
pub fn decay_error_of_gains(probe: &Probe, gains: f64) -> f64 {
    let distances: Vec<f64> = probe.distances().collect();
    decay_error(&distances, &vec![gains / DECIBELS; distances.len()])
}

/// Returns the standard deviation of a decay, dB/cm, given those of the amplitudes relative to these.
pub fn decay_error(distances: &[f64], relative_errors: &[f64]) -> f64 {
    let centre = mean(distances);
    let squares: f64 = distances.iter().map(|x| (x - centre) * (x - centre)).sum();
    let parts = distances.iter().zip(relative_errors).map(|(x, error)| (x - centre) * error);
    let variance: f64 = parts.map(|part| part * part).sum();
    DECIBELS * variance.sqrt() / squares / CENTIMETRES
}

/// Returns the amplitude at a distance (m), up to a constant, by Simpson's rule.
fn amplitude_of_elements(length: f64, wavenumber: f64, distance: f64) -> f64 {
    let curvature = 0.5 * wavenumber / distance;
    let pairs = (PAIRS + PAIRS_OF_RADIAN * curvature * length * length).ceil();
    let step = 0.5 * length / pairs;
    let (mut real, mut imaginary) = (0.0, 0.0);
    for k in 0..=2 * pairs as u64 {
        let s = k as f64 * step;
        // The last term is 0, so that its weight does not matter.
        let weight = match k {
            0 => 1.0,
            _ if k.is_multiple_of(2) => 2.0,
            _ => 4.0,
        };
        let (sin, cos) = libm::sincos(curvature * s * s);
        real += weight * (length - s) * cos;
        imaginary += weight * (length - s) * sin;
    }
    step * libm::hypot(real, imaginary) / distance.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(spreading: Spreading, expected: f64, tolerance: f64) {
        let found = spreading.decay(&Probe::default(), 3900.0);
        assert!((found - expected).abs() <= tolerance, "{spreading:?}: {found}, {expected}");
    }

    #[test]
    fn the_decay_is_the_slope_of_the_level() {
        // 20 dB in 2 cm, and a level that lies off the line without changing its slope.
        let distances = [0.01, 0.02, 0.03];
        assert!((decay(&distances, &[1.0, 0.4, 0.1]) - 10.0).abs() < 1e-12);
        assert!((decay(&distances, &[1.0, 2.0, 10.0]) + 10.0).abs() < 1e-12);
    }

    #[test]
    fn waves_of_a_point_decay_faster_than_those_of_a_line() {
        check(Spreading::Line, 0.0, 0.0);
        // From the first to the last receiver 10 log10 of the distance grows by 2.89 dB, in 1.04 cm.
        check(Spreading::Point, 2.75, 0.01);
        let point = Spreading::Point.decay(&Probe::default(), 3900.0);
        check(Spreading::Elements(0.3e-3), point, 2e-3);
        check(Spreading::Elements(0.1), 0.0, 0.05);
        // By 4,000 intervals.
        check(Spreading::Elements(4e-3), 2.5960, 1e-3);
        check(Spreading::Elements(8e-3), 0.7651, 1e-3);
        check(Spreading::Elements(20e-3), 0.2149, 1e-3);
    }

    #[test]
    fn gains_that_differ_err_the_decay() {
        let error = decay_error_of_gains(&Probe::default(), 0.4);
        assert!((error - 0.331).abs() < 1e-3, "{error}");
    }
}
