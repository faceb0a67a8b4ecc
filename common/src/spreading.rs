//! Spreading of waves across the plane of the model, which has none.
//!
//! The model's source and receivers are lines across its plane: what they record decays along the array without the
//! spreading of a device's waves, whose elements are finite. With elements of length l, and waves of the number
//! k = 2 π f/v that run along the bone, the level falls with the distance r as that of
//!
//! ```text
//! |∫₀ˡ (l - s) exp(i k s²/(2 r)) ds| / √r
//! ```
//!
//! in the Fresnel approximation: not at all close to long elements, and as 1/√r far from short ones.

use std::f64::consts::{LN_10, TAU};

use crate::accepted::Interval;
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

/// How waves spread across the plane of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spreading {
    /// Not at all, as in the model.
    Line,
    /// As from a point to points.
    Point,
    /// As from and to elements of this length, m.
    Elements(f64),
}

impl Spreading {
    /// Returns by how much more, dB/cm, the level of waves decays along a probe than in the model: minus the
    /// least-squares slope over the receivers. `velocity` is that of the waves, m/s.
    pub fn decay(self, probe: &Probe, velocity: f64) -> f64 {
        let wave_number = TAU * probe.center_frequency / velocity;
        let level = |distance: f64| match self {
            Self::Line => 0.0,
            Self::Point => -0.5 * libm::log(distance),
            Self::Elements(length) => level_of_elements(length, wave_number, distance),
        };
        let distances: Vec<f64> = probe.distances().collect();
        let levels: Vec<f64> = distances.iter().copied().map(level).collect();
        -slope(&distances, &levels) * DECIBELS / CENTIMETRES
    }
}

/// Returns the standard deviation of a decay, dB/cm, if the gains of the receivers differ by this one, dB.
pub fn decay_error_of_gains(probe: &Probe, gains: f64) -> f64 {
    let distances: Vec<f64> = probe.distances().collect();
    gains / sum_of_squares(&distances).sqrt() / CENTIMETRES
}

/// Returns the logarithm of the level, up to a constant.
fn level_of_elements(length: f64, wave_number: f64, distance: f64) -> f64 {
    let curvature = 0.5 * wave_number / distance;
    let pairs = (PAIRS + PAIRS_OF_RADIAN * curvature * length * length).ceil();
    let step = 0.5 * length / pairs;
    let (mut real, mut imaginary) = (0.0, 0.0);
    for k in 0..=2 * pairs as u64 {
        let s = k as f64 * step;
        let weight = if k.is_multiple_of(2) { 2.0 } else { 4.0 };
        let weight = if k == 0 { 1.0 } else { weight };
        // The last term is 0.
        let (sin, cos) = libm::sincos(curvature * s * s);
        real += weight * (length - s) * cos;
        imaginary += weight * (length - s) * sin;
    }
    let square = step * step * (real * real + imaginary * imaginary);
    0.5 * libm::log(square / distance)
}

/// Returns the least-squares slope of values at these places.
fn slope(places: &[f64], values: &[f64]) -> f64 {
    let centre = mean(places);
    let cross = places.iter().zip(values).map(|(x, value)| (x - centre) * value);
    cross.sum::<f64>() / sum_of_squares(places)
}

/// Returns the sum of squares about the mean.
fn sum_of_squares(places: &[f64]) -> f64 {
    let centre = mean(places);
    places.iter().map(|x| (x - centre) * (x - centre)).sum()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(spreading: Spreading, expected: f64, tolerance: f64) {
        let found = spreading.decay(&Probe::default(), 3900.0);
        assert!((found - expected).abs() <= tolerance, "{spreading:?}: {found}, {expected}");
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
