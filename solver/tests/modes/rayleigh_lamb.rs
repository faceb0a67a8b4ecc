//! The equations of Rayleigh and Lamb.

/// The Rayleigh-Lamb function of a plate from -1 to 1, for waves of ratio `slow` to the longitudinal
/// velocity and with the velocity of shear waves 1: zero for a symmetric or an antisymmetric wave.
pub(super) fn rayleigh_lamb(slow: f64, symmetric: bool, k: f64, omega: f64) -> f64 {
    let squares = [(omega * slow).powi(2) - k * k, omega * omega - k * k];
    // cos p, sin(p)/p and p sin(p) are even in p, and so real.
    let [(cos_p, sin_p, up_p), (cos_q, sin_q, up_q)] = squares.map(|square: f64| {
        let root = square.abs().sqrt();
        let (cos, sin) = match square > 0.0 {
            true => (root.cos(), root.sin() / root),
            false => (root.cosh(), root.sinh() / root),
        };
        (cos, sin, square * sin)
    });
    let factor = (k * k - squares[1]).powi(2);
    match symmetric {
        true => factor.mul_add(cos_p * sin_q, 4.0 * k * k * up_p * cos_q),
        false => factor.mul_add(sin_p * cos_q, 4.0 * k * k * up_q * cos_p),
    }
}
