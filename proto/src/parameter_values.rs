//! A number for each parameter as a message.

use osteon_common::parameters::{AS_IN_SETUP, PARAMETERS, Parameter, Point};
use osteon_common::systematic::Shift;

use crate::choice::SYSTEMATIC_QUANTITY;
use crate::malformed::Malformed;
use crate::v1;

/// Returns the message of a point.
pub fn point_to_message(point: &Point) -> v1::ParameterValues {
    let mut message = v1::ParameterValues::default();
    for (parameter, value) in point.given() {
        *slot(&mut message, parameter) = Some(value);
    }
    message.shift = point.shift().map(|Shift { quantity, value }| v1::Shift {
        quantity: SYSTEMATIC_QUANTITY.number(quantity),
        value,
    });
    message
}

/// Returns the point of a message.
///
/// # Errors
/// If the message or a number of the bone is absent, if one is not finite, or if one of the setup is
/// not above 0.
pub fn point_from_message(message: Option<&v1::ParameterValues>) -> Result<Point, Malformed> {
    let message = message.ok_or(Malformed::Missing { field: "point" })?;
    let mut point = Point::new([AS_IN_SETUP; PARAMETERS]);
    for (slot, parameter) in point.0.iter_mut().zip(Parameter::ALL) {
        let (field, of_setup) = (parameter.name(), parameter.of_setup().is_some());
        let value = match get(message, parameter) {
            Some(value) => value,
            None if of_setup => continue,
            None => return Err(Malformed::Missing { field }),
        };
        if !value.is_finite() || (of_setup && value <= 0.0) {
            let allowed = match of_setup {
                true => "it must be finite and above 0",
                false => "every number of a point must be finite",
            };
            return Err(Malformed::OutOfRange { field, value, allowed });
        }
        *slot = value;
    }
    let shift = message.shift.as_ref().map(shift_from_message).transpose()?;
    Ok(point.shifted(shift))
}

fn shift_from_message(message: &v1::Shift) -> Result<Shift, Malformed> {
    let quantity = SYSTEMATIC_QUANTITY.required(message.quantity, "shift.quantity")?;
    let value = message.value;
    if !value.is_finite() {
        let allowed = "it must be finite";
        return Err(Malformed::OutOfRange { field: "shift.value", value, allowed });
    }
    Ok(Shift { quantity, value })
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
        Parameter::BoneThickness => &mut message.bone_thickness,
        Parameter::BoneQualityFactor => &mut message.bone_quality_factor,
        Parameter::CouplingSoundSpeed => &mut message.coupling_sound_speed,
        Parameter::Porosity => &mut message.porosity,
        Parameter::SurfacePorosity => &mut message.surface_porosity,
        Parameter::MarrowPorosity => &mut message.marrow_porosity,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_has_all_of_the_bone_and_they_are_finite() {
        // The sign of zero is kept, too.
        let mut point = Point::of_bone([1598.8, 17.717e9, -0.0, 4.795e9, 9.8254e9, 0.0, 0.1029]);
        point.0[Parameter::BoneThickness as usize] = 3e-3;
        let message = point_to_message(&point);
        assert_eq!((message.density, message.dispersion), (Some(1598.8), Some(0.1029)));
        assert_eq!((message.bone_thickness, message.coupling_sound_speed), (Some(3e-3), None));
        let read = point_from_message(Some(&message)).unwrap();
        assert_eq!(read.0.map(f64::to_bits), point.0.map(f64::to_bits));
        for parameter in Parameter::ALL {
            let field = parameter.name();
            let of_setup = parameter.of_setup().is_some();
            let mut changed = message;
            *slot(&mut changed, parameter) = None;
            let missing = Err(Malformed::Missing { field });
            let found = point_from_message(Some(&changed));
            assert!(if of_setup { found.is_ok() } else { found == missing }, "{found:?}");
            let refused = if of_setup { 0.0 } else { f64::NAN };
            for value in [f64::INFINITY, refused] {
                *slot(&mut changed, parameter) = Some(value);
                let found = point_from_message(Some(&changed)).unwrap_err();
                assert!(matches!(found, Malformed::OutOfRange { field: at, .. } if at == field));
            }
        }
        assert_eq!(point_from_message(None), Err(Malformed::Missing { field: "point" }));
    }
}
