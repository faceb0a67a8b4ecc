//! Published stiffness of cortical bone and phantoms, which job and case files use by name.
//!
//! The files in `examples/materials` are compiled in, so that a name works in every directory. A name
//! is replaced by the material's values when a file is read: a job knows the values alone.

use std::sync::LazyLock;

use osteon_common::elasticity::EngineeringConstants;
use osteon_common::field_path::quoted;
use osteon_common::parameters::{Parameter, Point};
use osteon_common::porosity::BoneMatrix;
use serde::Deserialize;

use crate::document::Value;
use crate::reader::{Reader, Table};

/// The key by which a file names a material.
pub(crate) const KEY: &str = "material";

/// A material: its stiffness, and where that comes from.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Description in a few words.
    pub description: String,
    /// Authors, title, journal, year and pages.
    pub reference: String,
    /// Digital object identifier of the reference, where it is known.
    pub doi: Option<String>,
    /// Which of its numbers, and whether its reference, were compared with the source.
    pub checked: String,
    /// Mass density, kg/m³.
    pub density: f64,
    /// Where the density comes from.
    pub density_origin: String,
    longitudinal_young_modulus: f64,
    longitudinal_poisson_ratio: f64,
    longitudinal_shear_modulus: f64,
    transverse_young_modulus: f64,
    transverse_poisson_ratio: f64,
}

impl Material {
    /// The parameters that a material has.
    pub const PARAMETERS: [Parameter; 6] = {
        let [of_material @ .., _dispersion] = Parameter::OF_BONE;
        of_material
    };

    /// Returns the constants of the stiffness; axis 1 is the long axis of the bone.
    pub fn constants(&self) -> EngineeringConstants {
        EngineeringConstants {
            longitudinal_young_modulus: self.longitudinal_young_modulus,
            longitudinal_poisson_ratio: self.longitudinal_poisson_ratio,
            longitudinal_shear_modulus: self.longitudinal_shear_modulus,
            transverse_young_modulus: self.transverse_young_modulus,
            transverse_poisson_ratio: self.transverse_poisson_ratio,
        }
    }

    /// Returns the value of a parameter, if a material has it: it has neither a dispersion nor a setup.
    pub fn value(&self, parameter: Parameter) -> Option<f64> {
        Some(match parameter {
            Parameter::Density => self.density,
            Parameter::LongitudinalYoungModulus => self.longitudinal_young_modulus,
            Parameter::LongitudinalPoissonRatio => self.longitudinal_poisson_ratio,
            Parameter::LongitudinalShearModulus => self.longitudinal_shear_modulus,
            Parameter::TransverseYoungModulus => self.transverse_young_modulus,
            Parameter::TransversePoissonRatio => self.transverse_poisson_ratio,
            _ => return None,
        })
    }
}

/// Name and text of a file of `examples/materials`.
macro_rules! file {
    ($name:literal) => {
        ($name, include_str!(concat!("../../examples/materials/", $name, ".toml")))
    };
}

/// All files, in the order in which they are listed.
const FILES: [(&str, &str); 10] = [
    file!("human-radius-desceliers"),
    file!("human-femur-ashman-1984"),
    file!("human-femur-dong-2004"),
    file!("human-femur-dry-yoon-1976"),
    file!("human-tibia-rho-1996"),
    file!("bovine-femur-haversian-katz-1984"),
    file!("bovine-femur-plexiform-katz-1984"),
    file!("bovine-femur-van-buskirk-1981"),
    file!("bovine-phalanx-lang-1969"),
    file!("sawbones-cortical-2016"),
];

/// The names, for the JSON Schema.
pub(crate) const NAMES: [&str; FILES.len()] = {
    let mut names = [""; FILES.len()];
    let mut index = 0;
    while index < names.len() {
        names[index] = FILES[index].0;
        index += 1;
    }
    names
};

#[expect(clippy::expect_used, reason = "the texts are compiled in, and a test reads each")]
static MATERIALS: LazyLock<Vec<(&'static str, Material)>> = LazyLock::new(|| {
    let read = |(name, text)| (name, toml::from_str(text).expect("a material's file is valid"));
    FILES.into_iter().map(read).collect()
});

/// Returns the materials with their names.
pub fn all() -> &'static [(&'static str, Material)] {
    &MATERIALS
}

/// Returns the material with this name.
pub fn named(name: &str) -> Option<&'static Material> {
    all().iter().find(|(known, _)| *known == name).map(|(_, material)| material)
}

/// The material that a table names; its values stand in for keys that the table leaves out.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Base {
    /// It names none.
    None,
    /// It names one that cannot be told, which has been recorded.
    Unknown,
    /// It names this one.
    Known(&'static Material),
    /// It names none, and belongs to a bone with pores: the default is what lies between them.
    Matrix,
}

impl Base {
    /// Reads the key of `table`.
    pub(crate) fn read(reader: &mut Reader, table: &Table<'_>) -> Self {
        let Some(node) = table.get(KEY) else { return Self::None };
        let names = format!("one of {} (`osteon materials` describes them)", NAMES.join(", "));
        let Value::Text(name) = &node.value else {
            reader.wrong_type(table.path(KEY), &names, &node.value);
            return Self::Unknown;
        };
        named(name).map_or_else(
            || {
                let message = format!("is {}; it must be {names}", quoted(name));
                reader.violations.add(table.path(KEY), message);
                Self::Unknown
            },
            Self::Known,
        )
    }

    /// Returns the value of a parameter that the table leaves out. If the material is not known, that
    /// is the value of any material: the file is refused, and nothing else shall be said of it.
    pub(crate) fn value(self, parameter: Parameter) -> Option<f64> {
        match self {
            Self::None => None,
            Self::Unknown => all().first()?.1.value(parameter),
            Self::Known(material) => material.value(parameter),
            Self::Matrix if parameter == Parameter::Dispersion => None,
            Self::Matrix => Some(Point::of_matrix(&BoneMatrix::default(), 0.0).get(parameter)),
        }
    }
}

#[cfg(test)]
mod tests;
