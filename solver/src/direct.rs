//! The direct wave of a line source in an unbounded fluid, in closed form up to one quadrature:
//! p(r, t) = ρ/(2π) ∫ F(t - τ) / √(τ² - (r/c)²) dτ over τ > r/c.

use std::f64::consts::PI;

use crate::pulse::Pulse;
use crate::quadrature::for_each_node;

/// Panels over the pulse; 16 nodes each resolve its few oscillations to rounding.
const PANELS: usize = 8;

/// Pressure, Pa, at time `t` (s) of a wave that needs `travel` (s, above 0) from the source, in a
/// fluid of density `density` (kg/m³).
pub(crate) fn pressure(pulse: &Pulse, density: f64, travel: f64, t: f64) -> f64 {
    if t <= travel {
        return 0.0;
    }
    // With τ = travel · cosh θ the integrand has no singularity; F bounds θ from below.
    let oldest = (t - pulse.length()).max(travel);
    let (from, to) = (libm::acosh(oldest / travel), libm::acosh(t / travel));
    let mut integral = 0.0;
    for_each_node(from, to, PANELS, |theta, weight| {
        integral = weight.mul_add(pulse.at(t - travel * libm::cosh(theta)), integral);
    });
    density / (2.0 * PI) * integral
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_far_wave_is_the_half_derivative_spread_over_a_cylinder() {
        // Energy flux through cylinders of two radii must be equal far away.
        let pulse = Pulse::new(100.0, 1e6);
        let energy = |r: f64| {
            let travel = r / 1500.0;
            let sum: f64 = (0..6000)
                .map(|j| pressure(&pulse, 1000.0, travel, travel + 1e-9 * f64::from(j)))
                .map(|p| p * p)
                .sum();
            sum * r
        };
        let (near, far) = (energy(0.05), energy(0.2));
        assert!((near / far - 1.0).abs() < 3e-3, "{near} {far}");
    }

    #[test]
    fn nothing_arrives_before_its_time() {
        let pulse = Pulse::new(100.0, 1e6);
        assert_eq!(pressure(&pulse, 1000.0, 1e-6, 1e-6), 0.0);
        assert!(pressure(&pulse, 1000.0, 1e-6, 1.3e-6) > 0.0);
    }
}
