//! The velocity √(c1111/ρ) of a wave along the bone that is not affected by its faces, in closed
//! form.
//!
//! It governs the mean velocity of the first arriving signal, as the dispersion governs the
//! coefficient of variation: a search starts from its derivatives.

use crate::elasticity::Inadmissible;
use crate::parameters::{PARAMETERS, Point, extended};

/// ln √(c1111/ρ) at a point, with its derivatives with respect to the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BulkVelocity {
    /// ln √(c1111/ρ), the velocity in m/s.
    pub logarithm: f64,
    /// Its derivatives with respect to [`crate::parameters::Parameter::ALL`], each per unit of
    /// that parameter (SI).
    pub gradient: [f64; PARAMETERS],
}

/// Computes the velocity √(c1111/ρ) of the mean model at `point`.
///
/// By the paper's Eq. (7), c1111 = e_L² (1 - ν_T) / (e_L (1 - ν_T) - 2 e_T ν_L²).
///
/// # Errors
/// The first violated condition of admissibility of the density and the mean model.
pub fn bulk_velocity(point: &Point) -> Result<BulkVelocity, Inadmissible> {
    let density = point.density();
    if !(density > 0.0 && density.is_finite()) {
        return Err(Inadmissible::NotPositive { name: "density", value: density });
    }
    let constants = point.constants();
    if let Some(&violated) = constants.violated().first() {
        return Err(violated);
    }
    let (e_l, nu_l) = (constants.longitudinal_young_modulus, constants.longitudinal_poisson_ratio);
    let (e_t, nu_t) = (constants.transverse_young_modulus, constants.transverse_poisson_ratio);
    let margin = e_l * (1.0 - nu_t) - 2.0 * e_t * nu_l * nu_l;
    let stiffness = e_l * (e_l * (1.0 - nu_t) / margin);
    Ok(BulkVelocity {
        logarithm: 0.5 * (libm::log(stiffness) - libm::log(density)),
        gradient: extended(
            [
                -0.5 / density,
                1.0 / e_l - 0.5 * (1.0 - nu_t) / margin,
                2.0 * e_t * nu_l / margin,
                0.0,
                nu_l * nu_l / margin,
                0.5 * (e_l / margin - 1.0 / (1.0 - nu_t)),
                0.0,
            ],
            0.0,
        ),
    })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::ensemble::Germs;

    pub(crate) const OPTIMUM: Point =
        Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
    pub(crate) const BOUNDS: [(f64, f64); 7] = [
        (1500.0, 2000.0),
        (12e9, 25e9),
        (0.2, 0.45),
        (3e9, 6.5e9),
        (8e9, 16e9),
        (0.2, 0.5),
        (0.02, 0.3),
    ];

    #[test]
    fn it_is_that_of_the_elasticity() {
        let velocity = bulk_velocity(&OPTIMUM).unwrap();
        let stiffness = OPTIMUM.constants().elasticity().unwrap().rows()[0][0];
        let expected = (stiffness / OPTIMUM.density()).sqrt();
        assert!((libm::exp(velocity.logarithm) / expected - 1.0).abs() < 1e-14);
    }

    /// Derivatives per relative change of each parameter, to four digits, from an independent
    /// computation.
    #[test]
    fn sensitivities_at_the_papers_optimum() {
        let velocity = bulk_velocity(&OPTIMUM).unwrap();
        let expected = [-0.5, 0.2924, 0.4152, 0.0, 0.2076, 0.1695, 0.0];
        for ((slope, value), expected) in velocity.gradient.iter().zip(OPTIMUM.0).zip(expected) {
            assert!((slope * value - expected).abs() < 5e-5, "{} {expected}", slope * value);
        }
    }

    /// Compares with central differences with a step of 1e-5. Their error is the square of the step
    /// times a third derivative, which is large near the edge of admissibility, plus 1e-11 of
    /// rounding.
    #[test]
    fn derivatives_are_those_of_differences() {
        let mut checked = 0;
        for index in 0..200 {
            let germs = Germs::draw(11, index);
            let mut germs = germs.values().iter();
            let point =
                Point::of_bone(BOUNDS.map(|(from, to)| {
                    from + (to - from) * germs.next().copied().unwrap_or_default()
                }));
            let Ok(velocity) = bulk_velocity(&point) else { continue };
            for (axis, slope) in velocity.gradient.iter().enumerate() {
                let step = 1e-5 * point.0[axis];
                let at = |sign: f64| {
                    let mut moved = point;
                    moved.0[axis] += sign * step;
                    bulk_velocity(&moved).map(|velocity| velocity.logarithm)
                };
                let (Ok(above), Ok(below)) = (at(1.0), at(-1.0)) else { continue };
                let (found, slope) = (0.5 * (above - below) / 1e-5, slope * point.0[axis]);
                let bound = 1e-9 + 1e-8 * slope.abs() * (1.0 + slope * slope);
                assert!((found - slope).abs() < bound, "{axis} at {point:?}: {found}, {slope}");
                checked += 1;
            }
        }
        assert!(checked > 1000, "{checked}");
    }

    #[test]
    fn an_inadmissible_point_is_named() {
        let check = |parameter: usize, value: f64, expected: &str| {
            let mut point = OPTIMUM;
            point.0[parameter] = value;
            let message = bulk_velocity(&point).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        };
        check(0, -1.0, "density is -1");
        check(1, 0.0, "longitudinal_young_modulus is 0");
        check(2, 0.9, "e_L (1 - ν_T) - 2 e_T ν_L²");
        check(5, f64::NAN, "transverse_poisson_ratio is NaN");
    }
}
