//! The parameters of the identification: the mean model a = (ρ, e_L, ν_L, g_L, e_T, ν_T) and the
//! dispersion δ (the paper, Sec. 5), and quantities of the setup that may be searched with them.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::elasticity::EngineeringConstants;

/// Number of all parameters.
pub const PARAMETERS: usize = BONE_PARAMETERS + 3;
/// Number of the parameters that every job has.
pub const BONE_PARAMETERS: usize = 7;
/// The number that stands in a point for a parameter of the setup that is not searched: the setup's
/// value holds. All valid values are above it.
pub const AS_IN_SETUP: f64 = 0.0;

/// One of the parameters. The order of the variants is the order of the columns of `history.csv`, of
/// the digest and of every vector of numbers of all parameters.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Parameter {
    /// Mass density ρ of the bone, kg/m³.
    Density,
    /// Longitudinal Young modulus e_L, Pa.
    LongitudinalYoungModulus,
    /// Longitudinal Poisson ratio ν_L.
    LongitudinalPoissonRatio,
    /// Longitudinal shear modulus g_L, Pa.
    LongitudinalShearModulus,
    /// Transverse Young modulus e_T, Pa.
    TransverseYoungModulus,
    /// Transverse Poisson ratio ν_T.
    TransversePoissonRatio,
    /// Dispersion δ of the random elasticity.
    Dispersion,
    /// Thickness of the bone, m.
    BoneThickness,
    /// Quality factor of the bone.
    BoneQualityFactor,
    /// Speed of sound of the coupling layer, m/s.
    CouplingSoundSpeed,
}

impl Parameter {
    /// All parameters, in their order.
    pub const ALL: [Self; PARAMETERS] = [
        Self::Density,
        Self::LongitudinalYoungModulus,
        Self::LongitudinalPoissonRatio,
        Self::LongitudinalShearModulus,
        Self::TransverseYoungModulus,
        Self::TransversePoissonRatio,
        Self::Dispersion,
        Self::BoneThickness,
        Self::BoneQualityFactor,
        Self::CouplingSoundSpeed,
    ];

    /// The parameters that every job has: mean model and dispersion.
    pub const OF_BONE: [Self; BONE_PARAMETERS] = {
        let [density, e_l, nu_l, g_l, e_t, nu_t, dispersion, ..] = Self::ALL;
        [density, e_l, nu_l, g_l, e_t, nu_t, dispersion]
    };

    /// The others, quantities of the setup that a job may search.
    pub const OF_SETUP: [Self; PARAMETERS - BONE_PARAMETERS] = {
        let [.., thickness, quality, speed] = Self::ALL;
        [thickness, quality, speed]
    };

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Density => "density",
            Self::LongitudinalYoungModulus => "longitudinal_young_modulus",
            Self::LongitudinalPoissonRatio => "longitudinal_poisson_ratio",
            Self::LongitudinalShearModulus => "longitudinal_shear_modulus",
            Self::TransverseYoungModulus => "transverse_young_modulus",
            Self::TransversePoissonRatio => "transverse_poisson_ratio",
            Self::Dispersion => "dispersion",
            Self::BoneThickness => "bone_thickness",
            Self::BoneQualityFactor => "bone_quality_factor",
            Self::CouplingSoundSpeed => "coupling_sound_speed",
        }
    }

    /// Returns the unit as printed after a number; empty for pure numbers.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Density => "kg/m³",
            Self::LongitudinalYoungModulus
            | Self::LongitudinalShearModulus
            | Self::TransverseYoungModulus => "Pa",
            Self::LongitudinalPoissonRatio
            | Self::TransversePoissonRatio
            | Self::Dispersion
            | Self::BoneQualityFactor => "",
            Self::BoneThickness => "m",
            Self::CouplingSoundSpeed => "m/s",
        }
    }
}

/// A point of the search space: the values of [`Parameter::ALL`], SI units, and [`AS_IN_SETUP`] for
/// those of the setup that are not searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point(pub [f64; PARAMETERS]);

/// Extends values of [`Parameter::OF_BONE`] to all parameters, by the same value for all others.
pub const fn extended<T: Copy>(of_bone: [T; BONE_PARAMETERS], others: T) -> [T; PARAMETERS] {
    let [density, e_l, nu_l, g_l, e_t, nu_t, dispersion] = of_bone;
    [density, e_l, nu_l, g_l, e_t, nu_t, dispersion, others, others, others]
}

/// The numbers of the parameters that the point has.
impl fmt::Display for Point {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.given().map(|(_, value)| value)).finish()
    }
}

impl Point {
    /// Creates a point (a, δ) for the values of the setup.
    pub const fn of_bone(values: [f64; BONE_PARAMETERS]) -> Self {
        Self(extended(values, AS_IN_SETUP))
    }

    /// Returns the parameters that the point has, with their values: all of the bone, and those of the
    /// setup that are searched.
    pub fn given(&self) -> impl Iterator<Item = (Parameter, f64)> + '_ {
        let of = |parameter: Parameter| (parameter, self.get(parameter));
        let has = |(parameter, value): &(Parameter, f64)| {
            (*parameter as usize) < BONE_PARAMETERS || *value != AS_IN_SETUP
        };
        Parameter::ALL.into_iter().map(of).filter(has)
    }

    /// Returns the value of one parameter.
    pub fn get(&self, parameter: Parameter) -> f64 {
        self.0[parameter as usize]
    }

    /// Returns the mass density ρ, kg/m³.
    pub fn density(&self) -> f64 {
        self.0[0]
    }

    /// Returns the engineering constants of the mean elasticity.
    pub fn constants(&self) -> EngineeringConstants {
        EngineeringConstants {
            longitudinal_young_modulus: self.0[1],
            longitudinal_poisson_ratio: self.0[2],
            longitudinal_shear_modulus: self.0[3],
            transverse_young_modulus: self.0[4],
            transverse_poisson_ratio: self.0[5],
        }
    }

    /// Returns the dispersion δ.
    pub fn dispersion(&self) -> f64 {
        self.0[6]
    }
}
