//! The structure of a job's bone: one solid, a solid with pores, or a stack of sublayers.
//!
//! A porosity is a quantity of the setup, as the bone's thickness is. Where there is one, the mean model of a
//! point (density and engineering constants) is that of the bone between the pores, and density and mean
//! elasticity of the bone follow by a [`PorosityModel`].

mod sublayers;

use crate::accepted::WholeRange;
use crate::bone::{Bone, CaseBone, Sublayer, Sublayers};
use crate::bulk_velocity::{BulkVelocity, bulk_velocity};
use crate::fields::{self, Condition, Fields, Key, Number, Section};
use crate::limits::SUBLAYERS_MAX;
use crate::parameters::{PARAMETERS, Parameter, Point};
use crate::plausible;
use crate::porosity::{self, BoneMatrix, NoPorousBone, PorosityModel};

pub use self::sublayers::{MeanSolid, MeanSublayer, thickness};

fields::choices!(ProfileShape);

/// Numbers of sublayers that a linear profile may have.
pub const SUBLAYERS: WholeRange = WholeRange::new(2, SUBLAYERS_MAX as u64);
/// Key of the profile on the wire.
const PROFILE: &str = "profile";
/// Relative step of the difference quotients of ln √(c1111/ρ), whose error is its square.
const STEP: f64 = 1e-5;

/// How the porosity changes from the skin's side to the marrow's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ProfileShape {
    /// Linearly.
    #[default]
    Linear,
    /// It is that of the skin's side in the outer half of the bone, and that of the marrow's side in the
    /// inner (endosteal) half.
    Endosteal,
    /// As in a table of sublayers.
    Table,
}

/// A porosity that changes through the thickness. There is none unless both ends, or a table, are given.
#[derive(Debug, Clone, PartialEq)]
pub struct PorosityProfile {
    /// Porosity at the skin's side.
    pub surface: Option<f64>,
    /// Porosity at the marrow's side.
    pub marrow: Option<f64>,
    /// How it changes between them.
    pub shape: ProfileShape,
    /// Number of sublayers of equal thickness by which a linear profile is computed, each with the porosity
    /// at its middle.
    pub sublayers: u32,
    /// Porosities of the sublayers of a table, all of the same thickness, from the skin's side to the marrow's.
    pub values: Vec<f64>,
}

/// The pores or the sublayers of the bone; by default it is one solid without pores.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BoneStructure {
    /// The porosity, if it is the same through the thickness.
    pub porosity: Option<f64>,
    /// The porosity, if it is not.
    pub profile: PorosityProfile,
    /// How density and elasticity follow from a porosity.
    pub model: PorosityModel,
    /// Sublayers from the skin's side to the marrow's, if it has any. Then there is neither of the two
    /// porosities above, and the setup's thickness is that of all together.
    pub sublayers: Vec<MeanSublayer>,
}

impl ProfileShape {
    /// All shapes, in the order in which messages and documentation list them.
    pub const ALL: [Self; 3] = [Self::Linear, Self::Endosteal, Self::Table];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Endosteal => "endosteal",
            Self::Table => "table",
        }
    }
}

impl Default for PorosityProfile {
    fn default() -> Self {
        Self {
            surface: None,
            marrow: None,
            shape: ProfileShape::default(),
            sublayers: 6,
            values: Vec::new(),
        }
    }
}

impl PorosityProfile {
    /// Returns whether a profile is given.
    pub fn is_given(&self) -> bool {
        self.mean().is_some()
    }

    /// Returns the mean through the thickness; `None` without a profile.
    fn mean(&self) -> Option<f64> {
        match self.shape {
            ProfileShape::Linear | ProfileShape::Endosteal => {
                Some(0.5 * (self.surface? + self.marrow?))
            }
            ProfileShape::Table if self.values.is_empty() => None,
            ProfileShape::Table => Some(self.values.iter().sum::<f64>() / self.values.len() as f64),
        }
    }

    /// Returns the porosity of each sublayer, downwards, all of the same thickness; `None` without a profile.
    fn of_sublayers(&self) -> Option<Vec<f64>> {
        match self.shape {
            ProfileShape::Table => Some(self.values.clone()).filter(|values| !values.is_empty()),
            ProfileShape::Endosteal => Some(vec![self.surface?, self.marrow?]),
            ProfileShape::Linear => {
                let (surface, marrow) = (self.surface?, self.marrow?);
                let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(self.sublayers);
                let at = |i| (marrow - surface).mul_add(middle(i), surface);
                Some((0..self.sublayers).map(at).collect())
            }
        }
    }
}

impl BoneStructure {
    /// The section of a job file that has them.
    pub const KEY: Key = Key {
        name: "bone",
        meaning: "pores or sublayers of the bone: with a porosity, density and constants in `parameters` \
                  are those of the bone between the pores",
    };
    /// The key of the sublayers.
    pub const SUBLAYERS: Key = Key {
        name: "sublayers",
        meaning: "sublayers from the skin's side to the marrow's, each with a thickness and a solid",
    };

    /// Returns whether there are pores or sublayers.
    pub fn is_given(&self) -> bool {
        self.mean_porosity().is_some() || self.is_layered()
    }

    /// Returns whether there are sublayers of their own solids.
    pub fn is_layered(&self) -> bool {
        !self.sublayers.is_empty()
    }

    /// Returns whether density and constants of the point are those of the bone between pores.
    pub fn has_pores(&self) -> bool {
        let is_porous = |one: &MeanSublayer| matches!(one.solid, MeanSolid::Porous(_));
        self.mean_porosity().is_some() || self.sublayers.iter().any(is_porous)
    }

    /// Returns whether a sublayer has a solid that no parameter changes.
    pub fn has_fixed_solids(&self) -> bool {
        self.sublayers.iter().any(|one| matches!(one.solid, MeanSolid::Given(_)))
    }

    /// Returns the thickness of the thinnest sublayer where `thickness` is that of the bone, both in m; `None`
    /// of a bone without sublayers.
    pub fn thinnest(&self, thickness: f64) -> Option<f64> {
        if let Some(count) = self.profile.of_sublayers().map(|each| each.len()) {
            return Some(thickness / count as f64);
        }
        let scale = thickness / sublayers::thickness(&self.sublayers);
        self.sublayers.iter().map(|one| one.thickness * scale).reduce(f64::min)
    }

    /// Returns whether a parameter has no effect, because each sublayer has a solid of its own.
    pub fn ignores(&self, parameter: Parameter) -> bool {
        let is_of_matrix =
            Parameter::OF_BONE.contains(&parameter) && parameter != Parameter::Dispersion;
        is_of_matrix && self.is_layered() && !self.has_pores()
    }

    /// Returns the porosity, or the mean of its profile through the thickness; `None` without either.
    pub fn mean_porosity(&self) -> Option<f64> {
        self.porosity.or_else(|| self.profile.mean())
    }

    /// Returns the porosity at the marrow's side less that at the skin's; `None` without pores, or where they
    /// have no such sides: of a table, or of sublayers.
    pub fn gradient(&self) -> Option<f64> {
        let PorosityProfile { surface, marrow, .. } = self.profile;
        self.porosity.map(|_| 0.0).or_else(|| Some(marrow? - surface?))
    }

    /// Changes the porosities at both sides to this difference, about the same mean.
    pub fn set_gradient(&mut self, gradient: f64) {
        let Some(mean) = self.mean_porosity() else { return };
        self.porosity = None;
        let half = 0.5 * gradient;
        (self.profile.surface, self.profile.marrow) = (Some(mean - half), Some(mean + half));
    }

    /// Returns the pores alone, with the porosities of a point where it has any.
    fn at(&self, point: &Point) -> Self {
        let searched = |parameter: Parameter, own: Option<f64>| {
            let value = Some(point.get(parameter)).filter(|_| point.has(parameter));
            value.or(own)
        };
        Self {
            porosity: searched(Parameter::Porosity, self.porosity),
            profile: PorosityProfile {
                surface: searched(Parameter::SurfacePorosity, self.profile.surface),
                marrow: searched(Parameter::MarrowPorosity, self.profile.marrow),
                ..self.profile.clone()
            },
            model: self.model,
            sublayers: Vec::new(),
        }
    }

    /// Returns the mean solid at a point: density and mean elasticity of the bone. Where the porosity changes
    /// through the thickness, it is that of the mean porosity; of sublayers it is the mean by thickness.
    ///
    /// # Errors
    /// If the mean model of the point is not admissible, or has no stiffness with its pores.
    pub fn mean_solid(&self, point: &Point) -> Result<Bone, NoPorousBone> {
        let matrix = point.mean_model();
        if self.is_layered() {
            return sublayers::mean(&self.sublayers, (&matrix, &self.model));
        }
        match self.at(point).mean_porosity() {
            Some(porosity) => self.model.bone(&matrix, porosity),
            None => Ok(matrix.bone()?),
        }
    }

    /// Returns ln √(c1111/ρ) of the mean solid at a point, with its derivatives. Those with pores are
    /// difference quotients.
    ///
    /// # Errors
    /// Same as [`BoneStructure::mean_solid`].
    pub fn bulk_velocity(&self, point: &Point) -> Result<BulkVelocity, NoPorousBone> {
        let of_matrix = bulk_velocity(point)?;
        if !self.is_layered() && !self.at(point).is_given() {
            return Ok(of_matrix);
        }
        let mut gradient = [0.0; PARAMETERS];
        for parameter in Parameter::ALL {
            let place = parameter as usize;
            let is_searched = Parameter::OF_PORES.contains(&parameter) && point.has(parameter);
            if of_matrix.gradient[place] != 0.0 || is_searched {
                gradient[place] = self.bulk_slope(point, parameter)?;
            }
        }
        Ok(BulkVelocity { logarithm: self.bulk_logarithm(point)?, gradient })
    }

    /// Returns the derivative of [`BoneStructure::bulk_logarithm`] with respect to a parameter, as a difference
    /// quotient.
    ///
    /// # Errors
    /// Same as [`BoneStructure::mean_solid`].
    pub fn bulk_slope(&self, point: &Point, parameter: Parameter) -> Result<f64, NoPorousBone> {
        let place = parameter as usize;
        let step = STEP * point.0[place].abs().max(STEP);
        let at = |step: f64| {
            let mut beside = *point;
            beside.0[place] += step;
            self.bulk_logarithm(&beside)
        };
        Ok((at(step)? - at(-step)?) / (2.0 * step))
    }

    /// Returns ln √(c1111/ρ) of the mean solid at a point, the velocity in m/s.
    ///
    /// # Errors
    /// Same as [`BoneStructure::mean_solid`].
    pub fn bulk_logarithm(&self, point: &Point) -> Result<f64, NoPorousBone> {
        if !self.is_layered() && !self.at(point).is_given() {
            return Ok(bulk_velocity(point)?.logarithm);
        }
        let Bone { density, elasticity } = self.mean_solid(point)?;
        Ok(0.5 * libm::log(elasticity.rows()[0][0] / density))
    }

    /// Returns the bone of this structure between whose pores is `matrix`, with `realize` of each of its solids in place of
    /// that; `thickness` (m) is that of the bone.
    ///
    /// # Errors
    /// If a solid does not exist, or as `realize`.
    pub fn bone<E: From<NoPorousBone>>(
        &self,
        matrix: &BoneMatrix,
        thickness: f64,
        realize: impl Fn(Bone) -> Result<Bone, E>,
    ) -> Result<CaseBone, E> {
        if self.is_layered() {
            let of = (matrix, &self.model);
            return layered(&sublayers::realized(&self.sublayers, of, thickness, realize)?);
        }
        let solid = |porosity| realize(self.model.bone(matrix, porosity)?);
        if let Some(porosity) = self.porosity {
            return solid(porosity).map(CaseBone::Homogeneous);
        }
        let Some(porosities) = self.profile.of_sublayers() else {
            let whole = matrix.bone().map_err(NoPorousBone::from)?;
            return realize(whole).map(CaseBone::Homogeneous);
        };
        let each = thickness / porosities.len() as f64;
        let sublayer = |&porosity| Ok(Sublayer { thickness: each, solid: solid(porosity)? });
        layered(&porosities.iter().map(sublayer).collect::<Result<Vec<_>, E>>()?)
    }
}

fn layered<E: From<NoPorousBone>>(sublayers: &[Sublayer]) -> Result<CaseBone, E> {
    let bone = Sublayers::new(sublayers).map(CaseBone::Layered);
    bone.ok_or_else(|| NoPorousBone::Sublayers { count: sublayers.len() }.into())
}

impl Section for BoneStructure {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let number = Number::plausible(porosity::ACCEPTED, &plausible::POROSITY);
        let meaning = "part of the volume that pores take, the same through the thickness";
        let key = Key { name: porosity::POROSITY.name, meaning };
        fields.optional_number(key, &mut self.porosity, number);
        let meaning = "instead of `porosity`: one that changes from the skin's side to the marrow's; in a \
                       file it is written as `porosity = { surface = …, marrow = … }`";
        fields.table(Key { name: PROFILE, meaning }, &mut |fields| self.profile.declare(fields));
        fields.table(PorosityModel::KEY, &mut |fields| self.model.declare(fields));
        fields.custom_table(Self::SUBLAYERS);
    }
}

impl Section for PorosityProfile {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let number = Number::plausible(porosity::ACCEPTED, &plausible::POROSITY);
        let key = Key { name: "surface", meaning: "porosity at the skin's side of the bone" };
        fields.optional_number(key, &mut self.surface, number);
        let key = Key { name: "marrow", meaning: "porosity at the marrow's side" };
        fields.optional_number(key, &mut self.marrow, number);
        let meaning = "`\"linear\"`; `\"endosteal\"`: the inner half of the bone has that of the marrow's \
                       side, and the outer half that of the skin's; or `\"table\"`: as in `values`, without \
                       `surface` and `marrow`";
        fields.choice(Key { name: "shape", meaning }, &mut self.shape);
        let shape = self.shape;
        let only = |wanted: ProfileShape, description| Condition {
            holds: shape == wanted,
            decided_by: "shape",
            description,
            refusal: format!(
                "belongs to the shape \"{}\", which is not chosen; leave it out",
                wanted.name()
            ),
        };
        fields.only_if(&only(ProfileShape::Linear, "with the shape `\"linear\"`"), &mut |fields| {
            let meaning =
                "number of sublayers of equal thickness, each with the porosity at its middle";
            fields.whole(Key { name: "sublayers", meaning }, &mut self.sublayers, SUBLAYERS);
        });
        fields.only_if(&only(ProfileShape::Table, "with the shape `\"table\"`"), &mut |fields| {
            let meaning = "porosities of 2 to 16 sublayers of equal thickness, from the skin's side to the \
                           marrow's";
            let key = Key { name: "values", meaning };
            fields.numbers(key, &mut self.values, porosity::ACCEPTED, SUBLAYERS_MAX);
        });
    }
}

#[cfg(test)]
mod tests;
