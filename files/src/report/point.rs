//! The mean model at a point.

use osteon_common::parameters::{AS_IN_SETUP, PARAMETERS, Parameter, Point};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The six parameters of the mean model; null where there is no point.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct MeanModel {
    /// Mass density, kg/m³.
    pub density: Option<f64>,
    /// Longitudinal Young modulus, Pa.
    pub longitudinal_young_modulus: Option<f64>,
    /// Longitudinal Poisson ratio.
    pub longitudinal_poisson_ratio: Option<f64>,
    /// Longitudinal shear modulus, Pa.
    pub longitudinal_shear_modulus: Option<f64>,
    /// Transverse Young modulus, Pa.
    pub transverse_young_modulus: Option<f64>,
    /// Transverse Poisson ratio.
    pub transverse_poisson_ratio: Option<f64>,
    /// Porosity of the bone; only if it was searched, or is known of the group.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub porosity: Option<f64>,
    /// Porosity at the skin's side of the bone; only if it was searched, or is known of the group.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface_porosity: Option<f64>,
    /// Porosity at the marrow's side of the bone; only if it was searched, or is known of the group.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marrow_porosity: Option<f64>,
    /// Thickness of the bone, m; only if it was searched, or is known of the group.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bone_thickness: Option<f64>,
    /// Quality factor of the bone; only if it was searched, or is known of the group.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bone_quality_factor: Option<f64>,
    /// Speed of sound of the coupling layer, m/s; only if it was searched, or is known of the group.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coupling_sound_speed: Option<f64>,
}

impl MeanModel {
    /// Returns the value of a parameter of the mean model, or of the setup; `None` of the dispersion.
    pub fn get(&self, parameter: Parameter) -> Option<f64> {
        match parameter {
            Parameter::Density => self.density,
            Parameter::LongitudinalYoungModulus => self.longitudinal_young_modulus,
            Parameter::LongitudinalPoissonRatio => self.longitudinal_poisson_ratio,
            Parameter::LongitudinalShearModulus => self.longitudinal_shear_modulus,
            Parameter::TransverseYoungModulus => self.transverse_young_modulus,
            Parameter::TransversePoissonRatio => self.transverse_poisson_ratio,
            Parameter::Dispersion => None,
            Parameter::Porosity => self.porosity,
            Parameter::SurfacePorosity => self.surface_porosity,
            Parameter::MarrowPorosity => self.marrow_porosity,
            Parameter::BoneThickness => self.bone_thickness,
            Parameter::BoneQualityFactor => self.bone_quality_factor,
            Parameter::CouplingSoundSpeed => self.coupling_sound_speed,
        }
    }

    /// The whole point, with this dispersion; `None` where a number is missing.
    pub fn point(&self, dispersion: Option<f64>) -> Option<Point> {
        let mut point = Point::new([AS_IN_SETUP; PARAMETERS]);
        for parameter in Parameter::ALL {
            let value = match parameter {
                Parameter::Dispersion => dispersion,
                _ => self.get(parameter),
            };
            let is_required = parameter.of_setup().is_none();
            point.0[parameter as usize] =
                if is_required { value? } else { value.unwrap_or(AS_IN_SETUP) };
        }
        Some(point)
    }
}

impl From<&Point> for MeanModel {
    fn from(point: &Point) -> Self {
        let value = |parameter| super::finite_or_null(point.get(parameter));
        let searched = |parameter| value(parameter).filter(|value| *value != AS_IN_SETUP);
        Self {
            density: value(Parameter::Density),
            longitudinal_young_modulus: value(Parameter::LongitudinalYoungModulus),
            longitudinal_poisson_ratio: value(Parameter::LongitudinalPoissonRatio),
            longitudinal_shear_modulus: value(Parameter::LongitudinalShearModulus),
            transverse_young_modulus: value(Parameter::TransverseYoungModulus),
            transverse_poisson_ratio: value(Parameter::TransversePoissonRatio),
            porosity: searched(Parameter::Porosity),
            surface_porosity: searched(Parameter::SurfacePorosity),
            marrow_porosity: searched(Parameter::MarrowPorosity),
            bone_thickness: searched(Parameter::BoneThickness),
            bone_quality_factor: searched(Parameter::BoneQualityFactor),
            coupling_sound_speed: searched(Parameter::CouplingSoundSpeed),
        }
    }
}
