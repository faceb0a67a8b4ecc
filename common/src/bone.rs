//! The bone: one solid, or sublayers of different ones.

use crate::accepted::Interval;
use crate::elasticity::Elasticity;
use crate::field_path::element_path;
use crate::limits::{SUBLAYER_THICKNESS_MIN, SUBLAYERS_MAX};

/// The solid of a homogeneous bone, or of one of its sublayers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bone {
    /// Mass density ρ, kg/m³.
    pub density: f64,
    /// Elasticity, Pa.
    pub elasticity: Elasticity,
}

/// A layer of one solid within the bone, unbounded along x1 and x2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sublayer {
    /// Thickness, m.
    pub thickness: f64,
    /// Its solid.
    pub solid: Bone,
}

/// The sublayers of a bone from the skin's side to the marrow's: at least one, and at most
/// [`SUBLAYERS_MAX`].
#[derive(Debug, Clone, PartialEq)]
pub struct Sublayers {
    uppermost: Sublayer,
    lower: Vec<Sublayer>,
}

impl Sublayers {
    /// The thicknesses that a sublayer in a file may have.
    pub const THICKNESS: Interval = Interval::from(SUBLAYER_THICKNESS_MIN, "m");

    /// Returns these sublayers, or `None` if there are none or too many.
    pub fn new(sublayers: &[Sublayer]) -> Option<Self> {
        let (uppermost, lower) = sublayers.split_first()?;
        let few = sublayers.len() <= SUBLAYERS_MAX;
        few.then(|| Self { uppermost: *uppermost, lower: lower.to_vec() })
    }

    /// Returns the sublayer on the skin's side.
    pub fn uppermost(&self) -> &Sublayer {
        &self.uppermost
    }

    /// Returns the sublayers below the uppermost, downwards.
    pub fn lower(&self) -> &[Sublayer] {
        &self.lower
    }

    /// Returns each, downwards.
    pub fn iter(&self) -> impl Iterator<Item = &Sublayer> {
        [&self.uppermost].into_iter().chain(&self.lower)
    }

    /// Returns the thickness of all together, m.
    pub fn thickness(&self) -> f64 {
        whole_thickness(self.iter().map(|one| one.thickness))
    }

    /// Returns the same bone with neighbours of one solid as one sublayer.
    fn merged(&self) -> Self {
        let (mut uppermost, mut lower) = (self.uppermost, Vec::new());
        for next in &self.lower {
            let last = lower.last_mut().unwrap_or(&mut uppermost);
            if last.solid == next.solid {
                last.thickness += next.thickness;
            } else {
                lower.push(*next);
            }
        }
        Self { uppermost, lower }
    }
}

/// Returns the sum of thicknesses (m), downwards, so that files, messages and cases have the same bits; 0 without any.
pub fn whole_thickness(mut downwards: impl Iterator<Item = f64>) -> f64 {
    downwards.next().map_or(0.0, |uppermost| downwards.fold(uppermost, |sum, next| sum + next))
}

/// The bone of a case.
#[derive(Debug, Clone, PartialEq)]
pub enum CaseBone {
    /// One solid through the whole thickness, which is that of the setup.
    Homogeneous(Bone),
    /// Sublayers; the setup's thickness is that of all together.
    Layered(Sublayers),
}

/// A reference to a bone, as solvers take it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BoneRef<'a> {
    /// One solid through the setup's thickness.
    Homogeneous(&'a Bone),
    /// Sublayers.
    Layered(&'a Sublayers),
}

impl BoneRef<'_> {
    /// Returns the bone as sublayers of which no two neighbours have the same solid, so that the way in
    /// which it is described has no influence on what is computed. `thickness` (m) is that of the setup.
    #[must_use]
    pub fn sublayers(self, thickness: f64) -> Sublayers {
        match self {
            Self::Homogeneous(&solid) => {
                Sublayers { uppermost: Sublayer { thickness, solid }, lower: Vec::new() }
            }
            Self::Layered(sublayers) => sublayers.merged(),
        }
    }
}

impl From<Bone> for CaseBone {
    fn from(bone: Bone) -> Self {
        Self::Homogeneous(bone)
    }
}

impl<'a> From<&'a Bone> for BoneRef<'a> {
    fn from(bone: &'a Bone) -> Self {
        Self::Homogeneous(bone)
    }
}

impl<'a> From<&'a Sublayers> for BoneRef<'a> {
    fn from(sublayers: &'a Sublayers) -> Self {
        Self::Layered(sublayers)
    }
}

impl<'a> From<&'a CaseBone> for BoneRef<'a> {
    fn from(bone: &'a CaseBone) -> Self {
        match bone {
            CaseBone::Homogeneous(bone) => Self::Homogeneous(bone),
            CaseBone::Layered(sublayers) => Self::Layered(sublayers),
        }
    }
}

impl CaseBone {
    /// Returns the sublayers, if it has any.
    pub fn sublayers(&self) -> Option<&Sublayers> {
        match self {
            Self::Homogeneous(_) => None,
            Self::Layered(sublayers) => Some(sublayers),
        }
    }

    /// Returns each solid with its table in a file, downwards.
    pub fn solids(&self) -> Vec<(String, &Bone)> {
        match self {
            Self::Homogeneous(bone) => vec![("bone".to_owned(), bone)],
            Self::Layered(sublayers) => {
                let path = |index| element_path("bone.sublayers", index);
                let each = sublayers.iter().enumerate();
                each.map(|(index, sublayer)| (path(index), &sublayer.solid)).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solid(density: f64) -> Bone {
        let rows =
            std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1e10 } else { 0.0 }));
        Bone { density, elasticity: Elasticity::new(rows).unwrap() }
    }

    #[test]
    fn neighbours_of_one_solid_are_one_sublayer() {
        let sublayer = |thickness, density| Sublayer { thickness, solid: solid(density) };
        let of = |all: &[(f64, f64)]| {
            let all: Vec<_> = all.iter().map(|&(h, density)| sublayer(h, density)).collect();
            Sublayers::new(&all).unwrap()
        };
        let given = of(&[(1e-3, 1800.0), (2e-3, 1800.0), (1e-3, 1700.0), (1e-3, 1800.0)]);
        assert_eq!(given.merged(), of(&[(1e-3 + 2e-3, 1800.0), (1e-3, 1700.0), (1e-3, 1800.0)]));
        assert_eq!(of(&[(1e-3, 1800.0); 4]).merged(), of(&[(4e-3, 1800.0)]));
        assert_eq!(of(&[(1e-3, 1800.0); 4]).thickness(), 4e-3);
    }

    #[test]
    fn there_is_at_least_one_and_there_are_not_too_many() {
        let sublayer = Sublayer { thickness: 1e-3, solid: solid(1800.0) };
        let is_some = |count| Sublayers::new(&vec![sublayer; count]).is_some();
        assert_eq!(
            [0, 1, SUBLAYERS_MAX, SUBLAYERS_MAX + 1].map(is_some),
            [false, true, true, false]
        );
    }
}
