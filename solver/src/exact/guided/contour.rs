//! Zeros of an analytic function within a contour, by the argument principle.

use std::f64::consts::TAU;

use super::dense::Scaled;
use crate::complex::Complex;

/// Largest change of the argument along a piece of the contour that is not divided.
const TURN_MAX: f64 = 0.8;
/// Maximum number of values of the function.
const VALUES_MAX: usize = 20_000;

/// Returns the number of zeros of a function without poles within a polygon, given counterclockwise, each side of
/// which is divided into at least `pieces`; `None` if the function changes too fast, as on a zero.
pub(super) fn zeros_within(
    function: impl Fn(Complex) -> Scaled,
    corners: &[Complex],
    pieces: usize,
) -> Option<i64> {
    let (mut turn, mut values) = (0.0, 0_usize);
    for (corner, next) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let at = |part: f64| *corner + (*next - *corner).scale(part);
        let mut place = 0.0;
        let mut here = function(at(0.0));
        // Ends of the pieces that are still to come, the nearest last.
        let mut ends: Vec<f64> = (1..=pieces).rev().map(|end| end as f64 / pieces as f64).collect();
        while let Some(end) = ends.last().copied() {
            values += 1;
            if values > VALUES_MAX {
                return None;
            }
            let there = function(at(end));
            let ratio = there.over(here);
            let change = libm::atan2(ratio.im, ratio.re);
            if !change.is_finite() {
                return None;
            }
            if change.abs() > TURN_MAX {
                ends.push(0.5 * (place + end));
                continue;
            }
            ends.pop();
            turn += change;
            (place, here) = (end, there);
        }
    }
    Some(libm::round(turn / TAU) as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_are_counted_with_their_multiplicity() {
        let zeros = [(0.5, 0.5), (0.5, 0.5), (0.9, 0.1), (1.2, 0.5), (-0.1, 0.0)];
        let function = |z: Complex| {
            let factors = zeros.map(|(re, im)| Scaled::new(z - Complex::new(re, im)));
            factors.into_iter().fold(Scaled::new(z.exp()), Scaled::times)
        };
        let square = |size: f64| {
            [(0.0, 0.0), (size, 0.0), (size, size), (0.0, size)]
                .map(|(re, im)| Complex::new(re, im))
        };
        for (size, expected) in [(1.0, 3), (1.5, 4), (0.4, 0)] {
            assert_eq!(zeros_within(function, &square(size), 4), Some(expected), "{size}");
        }
        // A zero on the contour.
        assert_eq!(zeros_within(function, &square(0.5), 4), None);
    }
}
