//! The parameters of the identification: the mean model a = (ρ, e_L, ν_L, g_L, e_T, ν_T) and the
//! dispersion δ (the paper, Sec. 5), and quantities of the setup that may be searched with them.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::accepted::Interval;
use crate::elasticity::EngineeringConstants;
use crate::ensemble::DISPERSION_MAX;
use crate::limits::QUALITY_FACTOR_MIN;
use crate::plausible::{self, PlausibleRange};
use crate::shift::{Shift, SystematicQuantity};

/// Number of all parameters.
pub const PARAMETERS: usize = BONE_PARAMETERS + 6;
/// Number of the parameters that every job has.
pub const BONE_PARAMETERS: usize = 7;
/// The number that stands in a point for a parameter of the setup that is not searched: the setup's
/// value holds. All valid values are above it.
pub const AS_IN_SETUP: f64 = 0.0;

/// The porosities of a job's bone: without pores there is no such parameter.
const POROSITY: Interval = Interval::between(0.0, 0.5, "of the volume");

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
    /// Porosity of the bone, the same through its thickness.
    Porosity,
    /// Porosity at the skin's side of the bone.
    SurfacePorosity,
    /// Porosity at the marrow's side of the bone.
    MarrowPorosity,
    /// Thickness of the bone, m.
    BoneThickness,
    /// Quality factor of the bone.
    BoneQualityFactor,
    /// Speed of sound of the coupling layer, m/s.
    CouplingSoundSpeed,
}

/// A row of the table of parameters: everything about a parameter that is not computed.
#[derive(Debug)]
pub struct ParameterRow {
    /// Name in files and messages.
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Its name for people.
    pub title: &'static str,
    /// Its symbol.
    pub symbol: &'static str,
    /// Unit as printed after a number; empty for pure numbers.
    pub unit: &'static str,
    /// Values that are accepted, regardless of other fields.
    pub accepted: Interval,
    /// The range of a physical value, and units that people write instead.
    pub plausible: &'static PlausibleRange,
    /// The unit in which people read it, and what one of that is in the unit of files.
    pub shown_in: (&'static str, f64),
    /// Whether its intervals are those of its logarithm.
    pub scale: ParameterScale,
}

/// The scale on which the error of a parameter is nearly normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterScale {
    /// That of its values.
    Linear,
    /// That of their logarithms.
    Logarithmic,
}

const ROWS: [ParameterRow; PARAMETERS] = [
    ParameterRow {
        name: "density",
        meaning: "mass density of the bone",
        title: "density",
        symbol: "ρ",
        unit: "kg/m³",
        accepted: Interval::above(0.0, "kg/m³"),
        plausible: &plausible::DENSITY,
        shown_in: ("kg/m³", 1.0),
        scale: ParameterScale::Logarithmic,
    },
    ParameterRow {
        name: "longitudinal_young_modulus",
        meaning: "longitudinal Young modulus",
        title: "longitudinal Young modulus",
        symbol: "e_L",
        unit: "Pa",
        accepted: Interval::above(0.0, "Pa"),
        plausible: &plausible::MODULUS,
        shown_in: ("GPa", 1e9),
        scale: ParameterScale::Logarithmic,
    },
    ParameterRow {
        name: "longitudinal_poisson_ratio",
        meaning: "longitudinal Poisson ratio",
        title: "longitudinal Poisson ratio",
        symbol: "ν_L",
        unit: "",
        accepted: Interval::finite(""),
        plausible: &plausible::POISSON_RATIO,
        shown_in: ("", 1.0),
        scale: ParameterScale::Linear,
    },
    ParameterRow {
        name: "longitudinal_shear_modulus",
        meaning: "longitudinal shear modulus",
        title: "longitudinal shear modulus",
        symbol: "g_L",
        unit: "Pa",
        accepted: Interval::above(0.0, "Pa"),
        plausible: &plausible::MODULUS,
        shown_in: ("GPa", 1e9),
        scale: ParameterScale::Logarithmic,
    },
    ParameterRow {
        name: "transverse_young_modulus",
        meaning: "transverse Young modulus",
        title: "transverse Young modulus",
        symbol: "e_T",
        unit: "Pa",
        accepted: Interval::above(0.0, "Pa"),
        plausible: &plausible::MODULUS,
        shown_in: ("GPa", 1e9),
        scale: ParameterScale::Logarithmic,
    },
    ParameterRow {
        name: "transverse_poisson_ratio",
        meaning: "transverse Poisson ratio",
        title: "transverse Poisson ratio",
        symbol: "ν_T",
        unit: "",
        accepted: Interval::between(-1.0, 1.0, ""),
        plausible: &plausible::POISSON_RATIO,
        shown_in: ("", 1.0),
        scale: ParameterScale::Linear,
    },
    ParameterRow {
        name: "dispersion",
        meaning: "dispersion of the random elasticity",
        title: "dispersion",
        symbol: "δ",
        unit: "",
        accepted: Interval::between(0.0, DISPERSION_MAX, "that is √(7/11)"),
        plausible: &plausible::DISPERSION,
        shown_in: ("", 1.0),
        scale: ParameterScale::Logarithmic,
    },
    ParameterRow {
        name: "porosity",
        meaning: "porosity of the bone",
        title: "porosity",
        symbol: "φ",
        unit: "",
        accepted: POROSITY,
        plausible: &plausible::POROSITY,
        shown_in: ("", 1.0),
        scale: ParameterScale::Linear,
    },
    ParameterRow {
        name: "surface_porosity",
        meaning: "porosity at the skin's side of the bone",
        title: "porosity at the skin's side",
        symbol: "φ_s",
        unit: "",
        accepted: POROSITY,
        plausible: &plausible::POROSITY,
        shown_in: ("", 1.0),
        scale: ParameterScale::Linear,
    },
    ParameterRow {
        name: "marrow_porosity",
        meaning: "porosity at the marrow's side of the bone",
        title: "porosity at the marrow's side",
        symbol: "φ_m",
        unit: "",
        accepted: POROSITY,
        plausible: &plausible::POROSITY,
        shown_in: ("", 1.0),
        scale: ParameterScale::Linear,
    },
    ParameterRow {
        name: "bone_thickness",
        meaning: "thickness of the bone",
        title: "bone thickness",
        symbol: "h",
        unit: "m",
        accepted: Interval::above(0.0, "m"),
        plausible: &plausible::BONE_THICKNESS,
        shown_in: ("mm", 1e-3),
        scale: ParameterScale::Logarithmic,
    },
    ParameterRow {
        name: "bone_quality_factor",
        meaning: "quality factor of the bone",
        title: "bone quality factor",
        symbol: "Q",
        unit: "",
        accepted: Interval::at_least(QUALITY_FACTOR_MIN, ""),
        plausible: &plausible::QUALITY_FACTOR,
        shown_in: ("", 1.0),
        scale: ParameterScale::Logarithmic,
    },
    ParameterRow {
        name: "coupling_sound_speed",
        meaning: "speed of sound of the coupling layer",
        title: "speed of sound of the coupling layer",
        symbol: "c₁",
        unit: "m/s",
        accepted: Interval::above(0.0, "m/s"),
        plausible: &plausible::SOUND_SPEED,
        shown_in: ("m/s", 1.0),
        scale: ParameterScale::Logarithmic,
    },
];

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
        Self::Porosity,
        Self::SurfacePorosity,
        Self::MarrowPorosity,
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
        let mut of_setup = [Self::BoneThickness; PARAMETERS - BONE_PARAMETERS];
        let mut place = 0;
        while place < of_setup.len() {
            of_setup[place] = Self::ALL[BONE_PARAMETERS + place];
            place += 1;
        }
        of_setup
    };

    /// The porosities: parameters of the setup that √(c1111/ρ) depends on.
    pub const OF_PORES: [Self; 3] = [Self::Porosity, Self::SurfacePorosity, Self::MarrowPorosity];

    /// Returns the row of the table.
    pub const fn row(self) -> &'static ParameterRow {
        &ROWS[self as usize]
    }

    /// Returns the name used in files and messages.
    pub const fn name(self) -> &'static str {
        self.row().name
    }

    /// Returns the unit as printed after a number; empty for pure numbers.
    pub const fn unit(self) -> &'static str {
        self.row().unit
    }
}

/// A point of the search space: the values of [`Parameter::ALL`], SI units, and [`AS_IN_SETUP`] for
/// those of the setup that are not searched; and a shift of a quantity of the setup, where what it moves is
/// measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point(pub [f64; PARAMETERS], Option<Shift>);

/// A point, to be compared and ordered to the bit.
pub type PointBits = ([u64; PARAMETERS], Option<(SystematicQuantity, u64)>);

/// Extends values of [`Parameter::OF_BONE`] to all parameters, by the same value for all others.
pub const fn extended<T: Copy>(of_bone: [T; BONE_PARAMETERS], others: T) -> [T; PARAMETERS] {
    let mut all = [others; PARAMETERS];
    let mut place = 0;
    while place < BONE_PARAMETERS {
        all[place] = of_bone[place];
        place += 1;
    }
    all
}

/// The numbers of the parameters that the point has.
impl fmt::Display for Point {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.given().map(|(_, value)| value)).finish()
    }
}

impl Point {
    /// Creates a point of these values of [`Parameter::ALL`].
    pub const fn new(values: [f64; PARAMETERS]) -> Self {
        Self(values, None)
    }

    /// Returns the point with this shift, or with none.
    #[must_use]
    pub const fn shifted(self, shift: Option<Shift>) -> Self {
        Self(self.0, shift)
    }

    /// Returns the shift of a quantity of the setup, if it has one.
    pub const fn shift(&self) -> Option<Shift> {
        self.1
    }

    /// Returns all that makes it this point, to the bit: its values and its shift.
    pub fn bits(&self) -> PointBits {
        let shift = self.1.map(|Shift { quantity, value }| (quantity, value.to_bits()));
        (self.0.map(f64::to_bits), shift)
    }

    /// Creates a point (a, δ) for the values of the setup.
    pub const fn of_bone(values: [f64; BONE_PARAMETERS]) -> Self {
        Self::new(extended(values, AS_IN_SETUP))
    }

    /// Returns the parameters that the point has, with their values: all of the bone, and those of the
    /// setup that are searched.
    pub fn given(&self) -> impl Iterator<Item = (Parameter, f64)> + '_ {
        let given = Parameter::ALL.into_iter().filter(|parameter| self.has(*parameter));
        given.map(|parameter| (parameter, self.get(parameter)))
    }

    /// Returns whether the point has this parameter.
    pub fn has(&self, parameter: Parameter) -> bool {
        (parameter as usize) < BONE_PARAMETERS || self.get(parameter) != AS_IN_SETUP
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_refuses_what_is_not_finite() {
        for parameter in Parameter::ALL {
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                assert!(!parameter.row().accepted.contains(value), "{}", parameter.name());
            }
        }
    }
}
