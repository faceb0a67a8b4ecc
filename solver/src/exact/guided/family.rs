//! Families of guided waves: those of one behaviour under every symmetry of the bone.

use osteon_common::bone::{Bone, Sublayer, Sublayers};

use crate::media::{Media, MediumLayer};

/// Entries of the elasticity matrix below this part of the largest are zero but for rounding.
const ROUNDING: f64 = 1e-12;

/// Number of displacements at the faces: p1, p2, p3 (even in x3), q1, q2, q3 (odd).
pub(super) const FACES: usize = 6;
/// p1, the displacement of S0 at low frequencies.
pub(super) const EXTENSIONAL: usize = 0;
/// p2, that of the wave of horizontal shear.
const SHEAR: usize = 1;
/// p3, that of A0.
pub(super) const FLEXURAL: usize = 2;

/// The planes in which a bone is its own mirror image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Symmetry {
    /// The plane of propagation, across x2.
    propagation: bool,
    /// The plane of the plate, across x3.
    plate: bool,
    /// The plane across x1: with the image in a point, half a turn about x1.
    cross: bool,
}

impl Symmetry {
    /// Returns those of a bone, of which no two neighbouring sublayers are equal. Every solid is its own
    /// image in a point, but a stack only if it is the same from both faces.
    pub(super) fn new(sublayers: &Sublayers) -> Self {
        let all: Vec<&Sublayer> = sublayers.iter().collect();
        let is_palindrome = all.iter().zip(all.iter().rev()).all(|(one, other)| {
            let difference = (one.thickness - other.thickness).abs();
            one.solid == other.solid && difference <= ROUNDING * one.thickness
        });
        let of_uppermost = Self::of_solid(&sublayers.uppermost().solid);
        sublayers.lower().iter().fold(of_uppermost, |common, sublayer| {
            let other = Self::of_solid(&sublayer.solid);
            Self {
                propagation: common.propagation && other.propagation,
                plate: common.plate && other.plate && is_palindrome,
                cross: common.cross && other.cross && is_palindrome,
            }
        })
    }

    fn of_solid(bone: &Bone) -> Self {
        let rows = bone.elasticity.rows();
        let largest = rows.iter().flatten().fold(0.0, |max: f64, entry| max.max(entry.abs()));
        // 22 has no influence where nothing varies along x2; the others by their index pairs.
        let is_zero = |pairs: &[(usize, usize)]| {
            pairs.iter().all(|&(i, j)| rows[i][j].abs() <= ROUNDING * largest)
        };
        Self {
            propagation: is_zero(&[(0, 3), (0, 5), (2, 3), (2, 5), (3, 4), (4, 5)]),
            plate: is_zero(&[(0, 3), (0, 4), (2, 3), (2, 4), (3, 5), (4, 5)]),
            cross: is_zero(&[(0, 4), (0, 5), (2, 4), (2, 5), (3, 4), (3, 5)]),
        }
    }

    /// Returns those of the bone between two fluids that differ.
    pub(super) fn between_fluids(self) -> Self {
        Self { plate: false, cross: false, ..self }
    }

    /// Returns whether waves differ by their behaviour in the middle plane, so that half of the bone has
    /// them all.
    pub(super) fn halves(self) -> bool {
        self.plate || self.cross
    }

    /// Returns all families of waves.
    pub(super) fn families(self) -> Vec<Family> {
        let mut families: Vec<Family> = Vec::new();
        for of in 0..FACES {
            if !families.iter().any(|family| family.faces.contains(&of)) {
                families.push(Family::new(self, of));
            }
        }
        families
    }
}

/// Waves that do not cross each other: those of one behaviour under every symmetry of the solid.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Family {
    /// The displacements at the faces.
    pub(super) faces: Vec<usize>,
    /// The components of the displacement.
    pub(super) components: Vec<usize>,
    /// Those that are not zero in the middle plane.
    pub(super) middle: Vec<usize>,
    /// How many waves of the family belong to one of a clamped half of the plate.
    pub(super) copies: u64,
}

impl Family {
    /// Returns the family of waves that contain the displacement `of` of the faces.
    pub(super) fn new(symmetry: Symmetry, of: usize) -> Self {
        let across_x2 = |face: usize| face % 3 == 1;
        let across_x3 = |face: usize| (face % 3 == 2) != (face >= 3);
        let belongs = |&face: &usize| {
            let (changes2, changes3) =
                (across_x2(face) != across_x2(of), across_x3(face) != across_x3(of));
            !(symmetry.propagation && changes2
                || symmetry.plate && changes3
                || symmetry.cross && changes2 != changes3)
        };
        let faces: Vec<usize> = (0..FACES).filter(belongs).collect();
        let has = |component: &usize| faces.iter().any(|face| face % 3 == *component);
        Self {
            components: (0..3).filter(has).collect(),
            middle: faces.iter().copied().filter(|face| *face < 3).collect(),
            copies: if symmetry.halves() { 1 } else { 2 },
            faces,
        }
    }

    /// Returns what its waves have in common: what is the same or the opposite on both sides of the middle
    /// plane, or the direction of the displacement.
    pub(super) fn name(&self) -> &'static str {
        match *self.faces.as_slice() {
            [0, 5] | [0, 1, 5] => "symmetric",
            [2, 3] | [2, 3, 4] => "antisymmetric",
            [1] => "shear_symmetric",
            [4] => "shear_antisymmetric",
            [1, 4] => "shear",
            [0, 2, 3, 5] => "sagittal",
            // After half a turn about x1.
            [0, 4, 5] => "turned_same",
            [1, 2, 3] => "turned_opposite",
            _ => "all",
        }
    }

    /// Returns the usual name of the wave of this rank, given that of S0. Waves that are numbered by symmetry
    /// have one, and A0 and S0 of every bone.
    pub(super) fn name_of(&self, rank: u64, extensional: u64) -> Option<String> {
        let numbered = |letters, number: u64| Some(format!("{letters}{number}"));
        match *self.faces.as_slice() {
            [0, 5] => numbered("S", rank - 1),
            [2, 3] => numbered("A", rank - 1),
            [1] => numbered("SH", 2 * rank - 2),
            [4] => numbered("SH", 2 * rank - 1),
            [1, 4] => numbered("SH", rank - 1),
            _ if rank == 1 && self.faces.contains(&FLEXURAL) => numbered("A", 0),
            _ if rank == extensional && self.faces.contains(&EXTENSIONAL) => numbered("S", 0),
            _ => None,
        }
    }

    /// Returns the place of S0, from 1, in the order of ω at low wavenumbers.
    pub(super) fn rank_of_extensional(&self, media: &Media) -> u64 {
        let flexural = self.faces.contains(&FLEXURAL);
        // Of the two waves in the plane of the plate the faster one has more of the component whose
        // stiffness is larger.
        let whole = |i: usize| {
            media.iter().fold(0.0, |sum, MediumLayer { medium, thickness }| {
                (medium.membrane[i][i] * medium.stiffness).mul_add(*thickness, sum)
            })
        };
        let slower_shear = whole(1) < whole(0);
        let shear = self.faces.contains(&SHEAR) && slower_shear;
        1 + u64::from(flexural) + u64::from(shear)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: Symmetry = Symmetry { propagation: true, plate: true, cross: true };
    const NONE: Symmetry = Symmetry { propagation: false, plate: false, cross: false };

    #[test]
    fn families_are_those_of_the_symmetries() {
        let faces = |symmetry, of| Family::new(symmetry, of).faces;
        assert_eq!(faces(ALL, EXTENSIONAL), [0, 5]);
        assert_eq!(faces(ALL, FLEXURAL), [2, 3]);
        assert_eq!(faces(NONE, FLEXURAL), [0, 1, 2, 3, 4, 5]);
        assert_eq!(faces(Symmetry { plate: true, ..NONE }, EXTENSIONAL), [0, 1, 5]);
        assert_eq!(faces(Symmetry { plate: true, ..NONE }, FLEXURAL), [2, 3, 4]);
        assert_eq!(faces(Symmetry { propagation: true, ..NONE }, FLEXURAL), [0, 2, 3, 5]);
        assert_eq!(faces(Symmetry { cross: true, ..NONE }, EXTENSIONAL), [0, 4, 5]);
        assert_eq!(faces(Symmetry { cross: true, ..NONE }, FLEXURAL), [1, 2, 3]);
        let family = Family::new(ALL, EXTENSIONAL);
        assert_eq!((family.components, family.middle, family.copies), (vec![0, 2], vec![0], 1));
    }
}
