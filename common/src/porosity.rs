//! The bone of a porosity: keys of `[bone.porosity_model]`, and density and elasticity that follow.

use thiserror::Error;

use crate::accepted::Interval;
use crate::case::Bone;
use crate::elasticity::{EngineeringConstants, Inadmissible, NotElastic};
use crate::fields::{self, Fields, Key, Number, Section};
use crate::homogenisation::HillModuli;
use crate::parameters::{Parameter, Point};
use crate::plausible;

fields::choices!(Homogenisation);

/// The key of `[bone]` that gives the porosity.
pub const POROSITY: Key = Key {
    name: "porosity",
    meaning: "in place of density and elasticity: the part of the volume that pores take, from which \
              both follow by `bone.porosity_model`",
};

/// The values that a porosity accepts.
///
/// From one half on, bone is spongy: bars and plates, and no solid around pores. There the
/// self-consistent estimate has no stiffness against shear either.
pub const ACCEPTED: Interval = Interval::from_below(0.0, 0.5, "of the volume");

/// An estimate of the stiffness of a solid with pores.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Homogenisation {
    /// The estimate of T. Mori and K. Tanaka: each pore lies in the matrix.
    #[default]
    MoriTanaka,
    /// R. Hill's self-consistent estimate: each pore lies in the porous bone.
    SelfConsistent,
}

/// The fluid in the pores.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoreFluid {
    /// Bulk modulus, Pa, at least 0; it has no shear modulus.
    pub bulk_modulus: f64,
    /// Mass density, kg/m³, at least 0.
    pub density: f64,
}

/// The bone between the pores.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoneMatrix {
    /// Mass density, kg/m³.
    pub density: f64,
    /// Elasticity.
    pub constants: EngineeringConstants,
}

impl Point {
    /// Creates a point with this mean model and dispersion.
    pub const fn of_matrix(matrix: &BoneMatrix, dispersion: f64) -> Self {
        let constants = &matrix.constants;
        Self::of_bone([
            matrix.density,
            constants.longitudinal_young_modulus,
            constants.longitudinal_poisson_ratio,
            constants.longitudinal_shear_modulus,
            constants.transverse_young_modulus,
            constants.transverse_poisson_ratio,
            dispersion,
        ])
    }

    /// Returns the mean model: the whole bone, or where it has pores, what is between them.
    pub fn mean_model(&self) -> BoneMatrix {
        BoneMatrix { density: self.density(), constants: self.constants() }
    }
}

/// How density and elasticity are computed from a porosity.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PorosityModel {
    /// The estimate.
    pub homogenisation: Homogenisation,
    /// The fluid in the pores.
    pub fluid: PoreFluid,
}

/// The table of a case file by which its porosities are computed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CasePorosityModel {
    /// How density and elasticity follow.
    pub model: PorosityModel,
    /// The bone between the pores.
    pub matrix: BoneMatrix,
}

/// Reason why a porosity has no bone.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum NoPorousBone {
    /// The matrix is no solid.
    #[error("the constants of the matrix are not admissible: {0}")]
    Matrix(#[from] Inadmissible),
    /// The self-consistent estimate has no stiffness against shear.
    #[error(
        "the self-consistent estimate has no stiffness against shear here: lower the porosity, or set \
         homogenisation = \"mori_tanaka\""
    )]
    NoShear,
    /// The estimate is no elasticity, by rounding.
    #[error("the estimate is no elasticity: {0}")]
    NotElastic(#[from] NotElastic),
    /// A profile has no sublayers, or too many.
    #[error("the profile has {count} sublayers")]
    Sublayers {
        /// Their number.
        count: usize,
    },
}

impl Homogenisation {
    /// All estimates, in the order in which messages and documentation list them.
    pub const ALL: [Self; 2] = [Self::MoriTanaka, Self::SelfConsistent];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::MoriTanaka => "mori_tanaka",
            Self::SelfConsistent => "self_consistent",
        }
    }
}

impl Default for PoreFluid {
    /// Water: 2.3 GPa is what models of bone take (docs/physics.md), 1500 m/s and 1000 kg/m³ make 2.25.
    fn default() -> Self {
        Self { bulk_modulus: 2.3e9, density: 1000.0 }
    }
}

impl Default for BoneMatrix {
    /// The matrix of which the Mori-Tanaka estimate, with a tenth of water, is the paper's optimum, to
    /// six digits. That its bones have a tenth is an assumption (docs/physics.md).
    fn default() -> Self {
        Self {
            density: 1665.33,
            constants: EngineeringConstants {
                longitudinal_young_modulus: 19.6757e9,
                longitudinal_poisson_ratio: 0.375823,
                longitudinal_shear_modulus: 5.86056e9,
                transverse_young_modulus: 12.4724e9,
                transverse_poisson_ratio: 0.435351,
            },
        }
    }
}

impl PorosityModel {
    /// The key of `[bone]` that has the model.
    pub const KEY: Key = Key {
        name: "porosity_model",
        meaning: "how density and elasticity follow from `bone.porosity`: pores are circular cylinders \
                  along the bone, filled with a fluid ([physics.md](physics.md#porosity))",
    };

    /// Returns the bone that a matrix with this porosity is.
    ///
    /// # Errors
    /// If the matrix is not admissible, or if the estimate has no stiffness.
    pub fn bone(&self, matrix: &BoneMatrix, porosity: f64) -> Result<Bone, NoPorousBone> {
        let solid = HillModuli::from_elasticity(&matrix.bone()?.elasticity);
        let fluid = self.fluid.bulk_modulus;
        let moduli = match self.homogenisation {
            Homogenisation::MoriTanaka => solid.mori_tanaka(fluid, porosity),
            Homogenisation::SelfConsistent => {
                solid.self_consistent(fluid, porosity).ok_or(NoPorousBone::NoShear)?
            }
        };
        let density = (1.0 - porosity) * matrix.density + porosity * self.fluid.density;
        Ok(Bone { density, elasticity: moduli.elasticity()? })
    }
}

impl BoneMatrix {
    /// Returns the bone without pores.
    ///
    /// # Errors
    /// If density or constants are not admissible.
    pub fn bone(&self) -> Result<Bone, Inadmissible> {
        let Self { density, constants } = *self;
        if !(density > 0.0 && density.is_finite()) {
            return Err(Inadmissible::NotPositive { name: "density", value: density });
        }
        Ok(Bone { density, elasticity: constants.elasticity()? })
    }
}

impl Section for PorosityModel {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let estimate = "`\"mori_tanaka\"`: around the pores is the matrix; `\"self_consistent\"`: around \
                        them is the porous bone, whose stiffness falls faster";
        fields.choice(Key { name: "homogenisation", meaning: estimate }, &mut self.homogenisation);
        let fluid = "the fluid in the pores, without viscosity";
        fields.table(Key { name: "fluid", meaning: fluid }, &mut |fields| {
            self.fluid.declare(fields);
        });
    }
}

impl CasePorosityModel {
    /// Returns the bone of this porosity.
    ///
    /// # Errors
    /// Same as [`PorosityModel::bone`].
    pub fn bone(&self, porosity: f64) -> Result<Bone, NoPorousBone> {
        self.model.bone(&self.matrix, porosity)
    }
}

impl Section for CasePorosityModel {
    fn declare(&mut self, fields: &mut dyn Fields) {
        self.model.declare(fields);
        let matrix = "the bone between the pores: its constants must be \
                      [admissible](physics.md#elasticity) together";
        fields.table(Key { name: "matrix", meaning: matrix }, &mut |fields| {
            self.matrix.declare(fields);
        });
    }
}

impl Section for BoneMatrix {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let constants = &mut self.constants;
        let declared: [(Parameter, &mut f64); 6] = [
            (Parameter::Density, &mut self.density),
            (Parameter::LongitudinalYoungModulus, &mut constants.longitudinal_young_modulus),
            (Parameter::LongitudinalPoissonRatio, &mut constants.longitudinal_poisson_ratio),
            (Parameter::LongitudinalShearModulus, &mut constants.longitudinal_shear_modulus),
            (Parameter::TransverseYoungModulus, &mut constants.transverse_young_modulus),
            (Parameter::TransversePoissonRatio, &mut constants.transverse_poisson_ratio),
        ];
        for (parameter, field) in declared {
            let row = parameter.row();
            let meaning = match parameter {
                Parameter::Density => "mass density of the matrix",
                _ => row.meaning,
            };
            let key = Key { name: row.name, meaning };
            let number = Number::plausible(row.accepted, parameter.row().plausible);
            fields.number(key, field, number);
        }
    }
}

impl Section for PoreFluid {
    fn declare(&mut self, fields: &mut dyn Fields) {
        fields.number(
            Key { name: "bulk_modulus", meaning: "bulk modulus; 0: the pores are empty" },
            &mut self.bulk_modulus,
            Number::at_least(0.0, &plausible::MODULUS),
        );
        fields.number(
            Key { name: "density", meaning: "mass density of the fluid" },
            &mut self.density,
            Number::at_least(0.0, &plausible::FLUID_DENSITY),
        );
    }
}

#[cfg(test)]
mod tests;
