//! The sublayers of a job's bone.

use crate::bone::{Bone, Sublayer, whole_thickness};
use crate::elasticity::Elasticity;
use crate::porosity::{BoneMatrix, NoPorousBone, PorosityModel};

/// A sublayer of the bone of a job.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanSublayer {
    /// Thickness, m, where the bone has the thickness of all together; otherwise it is in proportion.
    pub thickness: f64,
    /// Its solid.
    pub solid: MeanSolid,
}

/// The solid of a sublayer without dispersion.
#[derive(Debug, Clone, PartialEq)]
pub enum MeanSolid {
    /// The matrix of the point with this porosity.
    Porous(f64),
    /// This one, whatever the point.
    Given(Box<Bone>),
}

impl MeanSolid {
    /// Returns density and elasticity, given the matrix of a point.
    ///
    /// # Errors
    /// If the matrix has no stiffness with these pores.
    fn bone(&self, matrix: &BoneMatrix, model: &PorosityModel) -> Result<Bone, NoPorousBone> {
        match self {
            Self::Porous(porosity) => model.bone(matrix, *porosity),
            Self::Given(bone) => Ok(**bone),
        }
    }
}

/// Returns the thickness of all together, m.
pub fn thickness(sublayers: &[MeanSublayer]) -> f64 {
    whole_thickness(sublayers.iter().map(|one| one.thickness))
}

/// Returns the sublayers of a bone of this `thickness` (m), with `realize` of each solid in place of that.
///
/// # Errors
/// If a solid does not exist, or as `realize`.
pub(super) fn realized<E: From<NoPorousBone>>(
    sublayers: &[MeanSublayer],
    (matrix, model): (&BoneMatrix, &PorosityModel),
    thickness: f64,
    realize: impl Fn(Bone) -> Result<Bone, E>,
) -> Result<Vec<Sublayer>, E> {
    // 1 where the thickness is their own, so that these are unchanged to the bit.
    let scale = thickness / self::thickness(sublayers);
    let one = |MeanSublayer { thickness, solid }: &MeanSublayer| {
        Ok(Sublayer { thickness: thickness * scale, solid: realize(solid.bone(matrix, model)?)? })
    };
    sublayers.iter().map(one).collect()
}

/// Returns the solid whose density and elasticity are the means of those of the sublayers by thickness.
///
/// # Errors
/// If a solid does not exist.
pub(super) fn mean(
    sublayers: &[MeanSublayer],
    of: (&BoneMatrix, &PorosityModel),
) -> Result<Bone, NoPorousBone> {
    let whole = thickness(sublayers);
    let (mut density, mut rows) = (0.0, [[0.0; 6]; 6]);
    for Sublayer { thickness, solid } in realized(sublayers, of, whole, Ok::<_, NoPorousBone>)? {
        let part = thickness / whole;
        density += part * solid.density;
        let entries = rows.iter_mut().flatten().zip(solid.elasticity.rows().iter().flatten());
        entries.for_each(|(sum, entry)| *sum += part * entry);
    }
    Ok(Bone { density, elasticity: Elasticity::new(rows)? })
}
