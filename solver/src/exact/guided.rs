//! The fundamental guided waves A0 and S0 of the bone as a plate in a vacuum.
//!
//! At a real wavenumber k and a real frequency ω the dynamic stiffness of the plate, which doubling
//! gives ([`crate::exact::plate`]), is Hermitian, and the plate's waves are where an eigenvalue of it is
//! zero. They are not searched by signs of a determinant, but counted: the number of waves whose ω(k) is
//! below ω is the number of negative eigenvalues of the stiffness at the faces, with those of every joint
//! that doubling eliminates (W. H. Wittrick and F. W. Williams, Q. J. Mech. Appl. Math. 24 (1971) 263).
//! So none is missed, and the n-th wave of a family is found by bisection.
//!
//! An elastic solid is its own image in a point, so with u even in x3 = p and u odd in x3 = i q the
//! stiffness of the faces is real. Where the solid is its own image in the plane of the plate, or in the
//! plane of propagation, or turned about x1 by half a turn, the waves fall into families that may cross.
//! Within a family none cross but by accident, so that a wave followed from low frequencies keeps its
//! place in the order.

use std::f64::consts::TAU;

use osteon_common::case::Bone;

use crate::complex::Complex;
use crate::exact::plate::{AccuratePlate, Layer, Symmetric};
use crate::exact::tensor::{FillPlate, Solid};
use crate::isa::{Isa, Kernel};
use crate::lanes::Lanes;
use crate::medium::Medium;
use crate::solver::Solver;
use crate::vector::{ComplexVector, Vector};

/// Entries of the elasticity matrix below this part of the largest are zero but for rounding.
const ROUNDING: f64 = 1e-12;
/// Ratio of neighbouring wavenumbers of the search.
const SEARCH_STEP: f64 = 1.02;
/// Maximum number of steps of the search: wavenumbers of 10⁸ times the least one.
const SEARCH_STEPS_MAX: usize = 1000;
/// The search begins with this part of the least possible wavenumber, for rounding.
const BELOW_LEAST: f64 = 1.0 - 1e-9;
/// Number of halvings of an interval: the width of the first one divided by 2⁵⁰ is below rounding.
const HALVINGS: usize = 50;
/// The group velocity is the difference quotient over this part of the wavenumber in both directions.
const GROUP_STEP: f64 = 1e-4;
/// Least products of thickness and wavenumber: below them, rounding of the stiffness hides that of bending,
/// which is their fourth power, or of extension, their square.
const THINNEST_FLEXURAL: f64 = 1e-2;
const THINNEST_EXTENSIONAL: f64 = 1e-5;
/// If a count is undecided because a pivot is exactly zero, it is repeated at the wavenumber times this.
const BESIDE: f64 = 1.0 + 1e-13;

/// One guided wave at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuidedWave {
    /// Phase velocity ω/k, m/s.
    pub phase_velocity: f64,
    /// Group velocity dω/dk, m/s.
    pub group_velocity: f64,
}

/// The fundamental guided waves of a bone in a vacuum, without its attenuation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuidedWaves {
    /// Frequency, Hz.
    pub frequency: f64,
    /// The wave that is flexural at low frequencies; `None` where none was found.
    pub a0: Option<GuidedWave>,
    /// The wave that is extensional along x1 at low frequencies; `None` where none was found.
    pub s0: Option<GuidedWave>,
}

impl GuidedWaves {
    /// Returns why there is no A0 or no S0; `None` if there are both.
    pub fn reason(&self) -> Option<&'static str> {
        (self.a0.is_none() || self.s0.is_none()).then_some(
            "the bone is too thin for its wavelength to be told from one without thickness, or a number is out \
             of scale",
        )
    }
}

impl Solver {
    /// Computes the fundamental guided waves of a bone at the probe's centre frequency: those of a plate
    /// of the bone's thickness with free faces, without attenuation. Neither the fluids nor the solver's
    /// method and refinement matter.
    pub fn guided_waves(&self, bone: &Bone) -> GuidedWaves {
        let (isa, layers) = (self.isa(), &self.setup().layers);
        let medium = isa.run(Solid(bone));
        let mut plate = AccuratePlate::default();
        let thickness = layers.bone_thickness;
        isa.run(FillPlate { medium: &medium, thickness, plate: &mut plate });
        let frequency = self.setup().probe.center_frequency;
        let symmetry = Symmetry::new(bone);
        let mut free_plate = FreePlate { isa, medium: &medium, plate, thickness };
        let flexural = Family::new(symmetry, FLEXURAL);
        let extensional = Family::new(symmetry, EXTENSIONAL);
        let rank = extensional.rank_of_extensional(&medium);
        GuidedWaves {
            frequency,
            a0: free_plate.wave(&flexural, 1, TAU * frequency, THINNEST_FLEXURAL),
            s0: free_plate.wave(&extensional, rank, TAU * frequency, THINNEST_EXTENSIONAL),
        }
    }
}

/// Number of displacements at the faces: p1, p2, p3 (even in x3), q1, q2, q3 (odd).
const FACES: usize = 6;
/// p1, the displacement of S0 at low frequencies.
const EXTENSIONAL: usize = 0;
/// p2, that of the wave of horizontal shear.
const SHEAR: usize = 1;
/// p3, that of A0.
const FLEXURAL: usize = 2;

/// The planes in which a solid is its own mirror image.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Symmetry {
    /// The plane of propagation, across x2.
    propagation: bool,
    /// The plane of the plate, across x3.
    plate: bool,
    /// The plane across x1: with the image in a point, half a turn about x1.
    cross: bool,
}

impl Symmetry {
    fn new(bone: &Bone) -> Self {
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
}

/// Waves that do not cross each other: those of one behaviour under every symmetry of the solid.
#[derive(Debug, Clone, PartialEq)]
struct Family {
    /// The displacements at the faces.
    faces: Vec<usize>,
    /// The components of the displacement.
    components: Vec<usize>,
    /// Those that are not zero in the middle plane.
    middle: Vec<usize>,
    /// How many waves of the family belong to one of a clamped half of the plate.
    copies: u64,
}

impl Family {
    /// Returns the family of waves that contain the displacement `of` of the faces.
    fn new(symmetry: Symmetry, of: usize) -> Self {
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
            copies: if symmetry.plate || symmetry.cross { 1 } else { 2 },
            faces,
        }
    }

    /// Returns the place of S0, from 1, in the order of ω at low wavenumbers.
    fn rank_of_extensional(&self, medium: &Medium) -> u64 {
        let flexural = self.faces.contains(&FLEXURAL);
        // Of the two waves in the plane of the plate the faster one has more of the component whose
        // stiffness is larger.
        let slower_shear = medium.membrane[1][1] < medium.membrane[0][0];
        let shear = self.faces.contains(&SHEAR) && slower_shear;
        1 + u64::from(flexural) + u64::from(shear)
    }
}

/// A plate with free faces.
struct FreePlate<'a> {
    isa: Isa,
    medium: &'a Medium,
    plate: AccuratePlate,
    /// Thickness, m.
    thickness: f64,
}

impl FreePlate<'_> {
    /// Returns the wave of this rank in a family at `omega`, rad/s: the first wavenumber at which its
    /// frequency, which rises from zero, is `omega`. `None` if its product with the thickness is below
    /// `thinnest`.
    fn wave(
        &mut self,
        family: &Family,
        rank: u64,
        omega: f64,
        thinnest: f64,
    ) -> Option<GuidedWave> {
        // No wave that has no cut-off frequency is faster: the displacement that is the same at all
        // depths bounds its frequency from above.
        let mut low = BELOW_LEAST * omega / self.medium.fastest;
        let mut high = low;
        for step in 0.. {
            if step == SEARCH_STEPS_MAX {
                return None;
            }
            high *= SEARCH_STEP;
            if self.count(family, high, omega)? < rank {
                break;
            }
            low = high;
        }
        let k = bisect((low, high), |k| Some(self.count(family, k, omega)? < rank))?;
        if k * self.thickness < thinnest {
            return None;
        }
        let step = GROUP_STEP * k;
        let reach = 2.0 * self.medium.fastest * step;
        let mut at = |k: f64| {
            let range = (omega - reach, omega + reach);
            bisect(range, |omega| Some(self.count(family, k, omega)? >= rank))
        };
        let difference = at(k + step)? - at(k - step)?;
        Some(GuidedWave { phase_velocity: omega / k, group_velocity: difference / (2.0 * step) })
    }

    /// Returns the number of waves of a family whose frequency at `k` (rad/m) is below `omega` (rad/s);
    /// `None` if a number is not finite.
    fn count(&mut self, family: &Family, k: f64, omega: f64) -> Option<u64> {
        let Self { isa, medium, plate, .. } = self;
        let mut at = |k: f64| isa.run(CountWaves { medium, plate, family, k, omega });
        at(k).or_else(|| at(BESIDE * k))
    }
}

/// Returns where a condition begins to hold, by halving a range at the end of which it holds.
fn bisect(
    (mut low, mut high): (f64, f64),
    mut holds: impl FnMut(f64) -> Option<bool>,
) -> Option<f64> {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle)? {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(0.5 * (low + high))
}

/// Kernel that counts the waves below a frequency.
struct CountWaves<'a> {
    medium: &'a Medium,
    plate: &'a mut AccuratePlate,
    family: &'a Family,
    /// Wavenumber, rad/m.
    k: f64,
    /// Frequency, rad/s.
    omega: f64,
}

impl Kernel for CountWaves<'_> {
    type Output = Option<u64>;

    #[inline(always)]
    fn run<V: Vector>(self) -> Option<u64> {
        let Self { medium, plate, family, k, omega } = self;
        plate.prepare::<V>(medium, Complex::new(0.0, omega), (k, k));
        let (mut layer, doublings) = plate.thinnest(V::splat(k))?;
        // A sublayer is so thin that it has no wave between clamped faces.
        let mut clamped = 0_u64;
        for _ in 1..doublings {
            let joint = negative_pivots(joint_matrix(&layer.joint()), &family.components)?;
            clamped = clamped.checked_mul(2)?.checked_add(joint)?;
            layer = layer.double();
        }
        let middle = negative_pivots(joint_matrix(&layer.joint()), &family.middle)?;
        clamped = clamped.checked_mul(family.copies)?.checked_add(middle)?;
        let faces = negative_pivots(face_matrix(&layer.double()), &family.faces)?;
        clamped.checked_add(faces)
    }
}

/// A real symmetric matrix, or its upper left part.
type Real = [[f64; FACES]; FACES];

/// Returns the first lane of a number.
#[inline(always)]
fn first_lane<V: Vector>(value: ComplexVector<V>) -> Complex {
    let (mut re, mut im) = (Lanes::ZERO, Lanes::ZERO);
    value.re.store(&mut re, 0);
    value.im.store(&mut im, 0);
    Complex::new(re.0[0], im.0[0])
}

/// Returns the stiffness of a joint, which is real without damping.
#[inline(always)]
fn joint_matrix<V: Vector>(joint: &Symmetric<V>) -> Real {
    let mut matrix = [[0.0; FACES]; FACES];
    for i in 0..3 {
        for j in 0..3 {
            matrix[i][j] = first_lane(joint[symmetric_entry(i, j)]).re;
        }
    }
    matrix
}

/// Returns the stiffness of both faces of a layer in the displacements p and q: with u = p + i q on top
/// and p - i q at the bottom,
///
/// ```text
/// [ Re A - Re D, -Im A - Im D; its transpose, Re A + Re D ]
/// ```
#[inline(always)]
fn face_matrix<V: Vector>(layer: &Layer<V>) -> Real {
    let mut matrix = [[0.0; FACES]; FACES];
    for i in 0..3 {
        for j in 0..3 {
            let top = first_lane(layer.top[3 * i + j]);
            let down = first_lane(layer.down[symmetric_entry(i, j)]);
            matrix[i][j] = top.re - down.re;
            matrix[i + 3][j + 3] = top.re + down.re;
            matrix[i][j + 3] = -(top.im + down.im);
            matrix[j + 3][i] = matrix[i][j + 3];
        }
    }
    matrix
}

/// Returns where entry (i, j) of a symmetric 3×3 matrix is stored.
#[inline(always)]
fn symmetric_entry(i: usize, j: usize) -> usize {
    let (low, high) = if i < j { (i, j) } else { (j, i) };
    low * (5 - low) / 2 + high
}

/// Returns the number of negative eigenvalues of the part of a matrix with these rows and columns: that
/// of the negative pivots. `None` if a pivot is zero or not finite.
#[inline(always)]
fn negative_pivots(mut matrix: Real, rows: &[usize]) -> Option<u64> {
    let (mut left, mut count) = ([0; FACES], rows.len());
    left[..count].copy_from_slice(rows);
    let mut negative = 0;
    while count > 0 {
        // The largest pivot first.
        let mut place = 0;
        for other in 1..count {
            let size = |place: usize| matrix[left[place]][left[place]].abs();
            if size(other) > size(place) {
                place = other;
            }
        }
        count -= 1;
        left.swap(place, count);
        let row = left[count];
        let pivot = matrix[row][row];
        if pivot == 0.0 || !pivot.is_finite() {
            return None;
        }
        negative += u64::from(pivot < 0.0);
        for &i in &left[..count] {
            let factor = matrix[i][row] / pivot;
            for &j in &left[..count] {
                matrix[i][j] = (-factor).mul_add(matrix[row][j], matrix[i][j]);
            }
        }
    }
    Some(negative)
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

    #[test]
    fn pivots_have_the_signs_of_the_eigenvalues() {
        let mut matrix = [[0.0; FACES]; FACES];
        // Eigenvalues 3 and -1, and a row that is left out.
        (matrix[0][0], matrix[0][4], matrix[4][0], matrix[4][4]) = (1.0, 2.0, 2.0, 1.0);
        matrix[2][2] = -5.0;
        assert_eq!(negative_pivots(matrix, &[0, 4]), Some(1));
        assert_eq!(negative_pivots(matrix, &[0, 2, 4]), Some(2));
        assert_eq!(negative_pivots(matrix, &[1]), None);
        assert_eq!(symmetric_entry(2, 1), 4);
    }
}
