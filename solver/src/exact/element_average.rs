//! The factor by which elements that have a width change the response to a line source at a line.
//!
//! The source emits evenly over its width w along the probe, and a receiver averages over the same width.
//! A wave of wavenumber k along the bone and g across the coupling has, at a place ξ along a probe tilted by
//! θ, the factor exp(±ikξ cos θ - gξ sin θ) at the receiver (+) and at the source (-). Their means over ξ
//! are sinh(a)/a and sinh(b)/b, and the product is the same for the opposite wavenumber:
//!
//! ```text
//! a = (g sin θ + ik cos θ) w/2,   b = (g sin θ - ik cos θ) w/2
//! ```
//!
//! In a level probe it is (sin(kw/2)/(kw/2))². Waves that the coupling's outer face reflects get the same
//! factor, although they meet the elements of a tilted probe from the other side: their times are right, and
//! their amplitudes where θ is zero.

use std::f64::consts::PI;

use osteon_common::probe::Probe;

use crate::complex::Complex;
use crate::quadrature::{PANEL_PHASE, for_each_node};

/// Up to this |z|, sinh(z)/z is summed by powers of z², of which the first one left out is below 1e-17.
const SERIES_END: f64 = 0.1;

/// The elements of one probe.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ElementAverage {
    /// Half the extent along the bone, m.
    along: f64,
    /// Half the extent upwards, m.
    upwards: f64,
}

impl ElementAverage {
    /// Returns the elements of a probe; `None` if they are lines.
    pub(crate) fn from_probe(probe: &Probe) -> Option<Self> {
        let (along, upwards) = probe.element_extent();
        (probe.element_width > 0.0).then_some(Self { along: 0.5 * along, upwards: 0.5 * upwards })
    }

    /// Returns the factor at wavenumbers `k` along the bone and `g` across the coupling, rad/m.
    pub(crate) fn factor(&self, k: f64, g: Complex) -> Complex {
        let (across, along) = (g.scale(self.upwards), Complex::new(0.0, k * self.along));
        sinh_over(across + along) * sinh_over(across - along)
    }
}

/// Returns the nodes and weights of the mean over the places of source and receiver on their elements, for a
/// wave of lengths from `shortest` (m) on: a node is the difference of the two places, from -1 to 1 times the
/// width. Lines have the node 0 alone.
pub(crate) fn separations(probe: &Probe, shortest: f64) -> Vec<(f64, f64)> {
    if probe.element_width == 0.0 {
        return vec![(0.0, 1.0)];
    }
    let phase = 2.0 * PI * probe.element_width / shortest;
    let panels = (phase / PANEL_PHASE).ceil().max(1.0) as usize;
    let mut nodes = Vec::new();
    // An even number of panels: the weight has a bend at 0.
    for_each_node(-1.0, 1.0, 2 * panels, |x, weight| nodes.push((x, weight * (1.0 - x.abs()))));
    nodes
}

/// Returns sinh(z)/z.
fn sinh_over(z: Complex) -> Complex {
    let one = Complex::new(1.0, 0.0);
    if z.abs() <= SERIES_END {
        let square = z * z;
        let mut sum = one;
        for denominator in [72.0, 42.0, 20.0, 6.0] {
            sum = one + (square * sum).scale(1.0 / denominator);
        }
        return sum;
    }
    (z.exp() - (-z).exp()).scale(0.5) / z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::direct;

    fn probe(tilt: f64) -> Probe {
        Probe { element_width: 0.7e-3, tilt, ..Probe::default() }
    }

    #[test]
    fn a_level_probe_has_the_square_of_a_sinc() {
        let elements = ElementAverage::from_probe(&probe(0.0)).unwrap();
        for k in [0.0, 1e-3, 200.0, 290.0, 4189.0, 17e3, 1e6] {
            let phase = 0.5 * k * 0.7e-3;
            let sinc = if phase == 0.0 { 1.0 } else { libm::sin(phase) / phase };
            let found = elements.factor(k, Complex::new(300.0, 4e3));
            assert!(
                (found.re - sinc * sinc).abs() < 1e-15 && found.im.abs() < 1e-15,
                "{k}: {found:?}"
            );
            // So is the mean over the separations, up to their shortest wave.
            let nodes = separations(&probe(0.0), 2.0 * PI / k.max(1.0)).into_iter();
            let mean: f64 = nodes.map(|(x, weight)| weight * libm::cos(k * 0.7e-3 * x)).sum();
            assert!((mean - sinc * sinc).abs() < 1e-13, "{k}: {mean}");
        }
        assert!(ElementAverage::from_probe(&Probe::default()).is_none());
    }

    /// The wave from a mirrored source, summed over wavenumbers with the factor, against its mean over all
    /// places of source and receiver on their elements.
    #[test]
    fn a_tilted_probe_hears_the_mean_over_its_elements() {
        let (density, sound_speed, s) = (1000.0, 1500.0, Complex::new(0.6e6, 2.0 * PI * 1e6));
        let (x, heights) = (11e-3, 4e-3);
        for tilt in [0.0, 0.03, -0.15] {
            let (sin, cos) = libm::sincos(tilt);
            let mut expected = Complex::default();
            let half = 0.5 * 0.7e-3;
            for_each_node(-half, half, 1, |source, weight| {
                for_each_node(-half, half, 1, |receiver, other| {
                    let across = heights + (source + receiver) * sin;
                    let way = libm::hypot(x + (receiver - source) * cos, across);
                    let pressure = direct::pressure(density, way / sound_speed, s);
                    expected = expected + pressure.scale(weight * other / (4.0 * half * half));
                });
            });
            // (ρ/2π) K0 is the sum of ρ e^(-g z)/(2 g) over all k.
            let elements = ElementAverage::from_probe(&probe(tilt)).unwrap();
            let mut sum = Complex::default();
            for_each_node(0.0, 12e3, 400, |k, weight| {
                let over_c = s.scale(1.0 / sound_speed);
                let g = (over_c * over_c + Complex::new(k * k, 0.0)).sqrt();
                let wave = (-g.scale(heights)).exp() / g * elements.factor(k, g);
                sum = sum + wave.scale(weight * libm::cos(k * x) * density / (2.0 * PI));
            });
            let error = (sum - expected).abs() / expected.abs();
            assert!(error < 1e-10, "{tilt}: {error:e}");
        }
    }
}
