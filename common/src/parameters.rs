//! The seven parameters of the identification: the mean model a = (ρ, e_L, ν_L, g_L, e_T, ν_T)
//! and the dispersion δ (the paper, Sec. 5).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::elasticity::EngineeringConstants;

/// One of the seven parameters. The order of the variants is the order of the columns of
/// `history.csv`, of the digest and of every vector of seven numbers.
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
}

impl Parameter {
    /// All seven parameters, in their order.
    pub const ALL: [Self; 7] = [
        Self::Density,
        Self::LongitudinalYoungModulus,
        Self::LongitudinalPoissonRatio,
        Self::LongitudinalShearModulus,
        Self::TransverseYoungModulus,
        Self::TransversePoissonRatio,
        Self::Dispersion,
    ];

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
        }
    }

    /// Returns the unit as printed after a number; empty for pure numbers.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Density => "kg/m³",
            Self::LongitudinalYoungModulus
            | Self::LongitudinalShearModulus
            | Self::TransverseYoungModulus => "Pa",
            Self::LongitudinalPoissonRatio | Self::TransversePoissonRatio | Self::Dispersion => "",
        }
    }
}

/// A point (a, δ) of the search space: the values of [`Parameter::ALL`], SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point(pub [f64; 7]);

impl Point {
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
