//! A number for each parameter as a message.

use osteon_common::parameters::{Parameter, Point};

use crate::malformed::Malformed;
use crate::v1;

/// Returns the message of a point.
pub fn point_to_message(point: &Point) -> v1::ParameterValues {
    let [
        density,
        longitudinal_young_modulus,
        longitudinal_poisson_ratio,
        longitudinal_shear_modulus,
        transverse_young_modulus,
        transverse_poisson_ratio,
        dispersion,
    ] = point.0.map(Some);
    v1::ParameterValues {
        density,
        longitudinal_young_modulus,
        longitudinal_poisson_ratio,
        longitudinal_shear_modulus,
        transverse_young_modulus,
        transverse_poisson_ratio,
        dispersion,
    }
}

/// Returns the point of a message.
///
/// # Errors
/// If the message or one of the seven numbers is absent, or if one is not finite.
pub fn point_from_message(message: Option<&v1::ParameterValues>) -> Result<Point, Malformed> {
    let message = message.ok_or(Malformed::Missing { field: "point" })?;
    let mut point = Point([0.0; 7]);
    for (slot, parameter) in point.0.iter_mut().zip(Parameter::ALL) {
        let field = parameter.name();
        *slot = get(message, parameter).ok_or(Malformed::Missing { field })?;
        if !slot.is_finite() {
            let allowed = "every number of a point must be finite";
            return Err(Malformed::OutOfRange { field, value: *slot, allowed });
        }
    }
    Ok(point)
}

/// Returns the message of one number for each of these parameters.
pub(crate) fn some_to_message(parameters: &[Parameter], values: &[f64]) -> v1::ParameterValues {
    let mut message = v1::ParameterValues::default();
    for (&parameter, &value) in parameters.iter().zip(values) {
        *slot(&mut message, parameter) = Some(value);
    }
    message
}

/// Returns the numbers of these parameters.
///
/// # Errors
/// If one is absent.
pub(crate) fn some_from_message(
    parameters: &[Parameter],
    message: &v1::ParameterValues,
) -> Result<Vec<f64>, Malformed> {
    let value = |&parameter: &Parameter| {
        get(message, parameter).ok_or(Malformed::Missing { field: parameter.name() })
    };
    parameters.iter().map(value).collect()
}

fn get(message: &v1::ParameterValues, parameter: Parameter) -> Option<f64> {
    let mut message = *message;
    *slot(&mut message, parameter)
}

fn slot(message: &mut v1::ParameterValues, parameter: Parameter) -> &mut Option<f64> {
    match parameter {
        Parameter::Density => &mut message.density,
        Parameter::LongitudinalYoungModulus => &mut message.longitudinal_young_modulus,
        Parameter::LongitudinalPoissonRatio => &mut message.longitudinal_poisson_ratio,
        Parameter::LongitudinalShearModulus => &mut message.longitudinal_shear_modulus,
        Parameter::TransverseYoungModulus => &mut message.transverse_young_modulus,
        Parameter::TransversePoissonRatio => &mut message.transverse_poisson_ratio,
        Parameter::Dispersion => &mut message.dispersion,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_has_all_seven_and_they_are_finite() {
        // The sign of zero is kept, too.
        let point = Point([1598.8, 17.717e9, -0.0, 4.795e9, 9.8254e9, 0.0, 0.1029]);
        let message = point_to_message(&point);
        assert_eq!((message.density, message.dispersion), (Some(1598.8), Some(0.1029)));
        let read = point_from_message(Some(&message)).unwrap();
        assert_eq!(read.0.map(f64::to_bits), point.0.map(f64::to_bits));
        for parameter in Parameter::ALL {
            let field = parameter.name();
            let mut missing = message;
            *slot(&mut missing, parameter) = None;
            assert_eq!(point_from_message(Some(&missing)), Err(Malformed::Missing { field }));
            *slot(&mut missing, parameter) = Some(f64::INFINITY);
            let refused = point_from_message(Some(&missing)).unwrap_err();
            assert!(matches!(refused, Malformed::OutOfRange { field: at, .. } if at == field));
        }
        assert_eq!(point_from_message(None), Err(Malformed::Missing { field: "point" }));
    }
}
