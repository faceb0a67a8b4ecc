//! All guided waves of a bone in a vacuum at one frequency.

use std::f64::consts::TAU;

use osteon_common::bone::{Bone, BoneRef, Sublayers};
use osteon_common::elasticity::Elasticity;
use thiserror::Error;

use super::count::negative_pivots;
use super::crossings::crossings;
use super::family::{FLEXURAL, Family, Symmetry};
use super::free_bone::{FreeBone, bisect};
use crate::isa::Isa;
use crate::media::{Media, MediumLayer};
use crate::solver::Solver;

/// Maximum number of waves of one family at one frequency.
const MODES_MAX: u64 = 1000;
/// Least ratio of the angular frequency to that of a wave of the fastest speed and of the length 2π
/// thicknesses. There k times the thickness is some 0.02 in A0, which rounding hides below 0.01.
const THINNEST: f64 = 1e-4;
/// The search begins at this part of the least wavenumber of a wave without cut-off frequency.
const FIRST: f64 = 1e-9;
/// The smaller part of a golden section.
const DIVISION: f64 = 0.381_966_011_250_105_15;
/// Part by which bounds are moved outwards, for rounding.
const ROUNDING: f64 = 1e-9;

/// One guided wave at one frequency: fields ∝ exp(i(ωt - kx1)) with k > 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// The waves among which it has its rank: those of one behaviour under every symmetry of the bone.
    pub family: &'static str,
    /// Place, from 1, in the order of the family's frequencies at this wavenumber.
    pub rank: u64,
    /// Its usual name, such as A0, where it has one.
    pub name: Option<String>,
    /// Wavenumber k, rad/m.
    pub wavenumber: f64,
    /// Phase velocity ω/k, m/s.
    pub phase_velocity: f64,
    /// Group velocity dω/dk, m/s: below zero for a backward wave, whose energy runs against its phase.
    pub group_velocity: f64,
    /// Attenuation -Im k along x1, Np/m (1 Np is 8.686 dB); 0 in a vacuum.
    pub attenuation: f64,
}

/// Why the guided waves at a frequency are not known.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum ModesError {
    /// The bone is thin for the wavelengths, so that rounding hides them.
    #[error(
        "frequency: {frequency} Hz is too low for a bone that is so thin; it must be at least {lowest:.3} Hz"
    )]
    TooLow {
        /// The frequency, Hz.
        frequency: f64,
        /// The lowest frequency of this bone, Hz.
        lowest: f64,
    },
    /// There are too many waves.
    #[error(
        "frequency: at {frequency} Hz the bone has {count} waves of one family; at most {MODES_MAX} are allowed"
    )]
    TooMany {
        /// The frequency, Hz.
        frequency: f64,
        /// Number of the family's waves that begin at lower frequencies.
        count: u64,
    },
    /// The bone does not lie between half-spaces of one fluid each.
    #[error(
        "{field}: guided waves are known between half-spaces of one fluid each, not in a stack of fluids; give one \
         fluid, or ask for the waves in a vacuum"
    )]
    SeveralFluids {
        /// The field, `layers.coupling.sublayers` or `layers.marrow.sublayers`.
        field: &'static str,
    },
    /// A number is not finite, or waves nearly stand still in too many places.
    #[error(
        "frequency: the waves at {frequency} Hz cannot be told apart; a number is out of scale"
    )]
    Undecided {
        /// The frequency, Hz.
        frequency: f64,
    },
}

impl Solver {
    /// Computes all guided waves of a bone at `frequency` (Hz, above 0) that propagate, by ascending phase
    /// velocity: those of a plate of the bone's thickness with free faces, without attenuation.
    ///
    /// None is missed, except two of one family whose wavenumbers differ by less than 1e-6 of ω/c, c the
    /// fastest speed in the bone: the frequency is then, but for some 1e-12 of it, one without group velocity.
    ///
    /// # Errors
    /// If the frequency is too low or too high for the bone's thickness, or a number is not finite.
    pub fn modes<'a>(
        &self,
        bone: impl Into<BoneRef<'a>>,
        frequency: f64,
    ) -> Result<Vec<Mode>, ModesError> {
        Ok(FreeModes::new(self, bone.into(), frequency)?.modes)
    }
}

/// All guided waves of a bone in a vacuum at one frequency.
pub(super) struct FreeModes {
    pub(super) media: Media,
    /// The waves, by ascending phase velocity.
    pub(super) modes: Vec<Mode>,
    /// Components of the displacement that no others are coupled to, whatever the faces.
    pub(super) components: Vec<Vec<usize>>,
    /// Names of the families, with the place of their components.
    families: Vec<(&'static str, usize)>,
    /// A wavenumber beyond which there are no waves, rad/m.
    pub(super) last: f64,
}

impl FreeModes {
    /// Computes the waves at `frequency`, Hz.
    pub(super) fn new(
        solver: &Solver,
        bone: BoneRef<'_>,
        frequency: f64,
    ) -> Result<Self, ModesError> {
        let (isa, thickness) = (solver.isa(), solver.setup().layers.bone_thickness);
        let sublayers = bone.sublayers(thickness);
        let symmetry = Symmetry::new(&sublayers);
        let media = divided(&Media::new(isa, bone, thickness), symmetry.halves());
        let mut free_bone = FreeBone::new(isa, &media, symmetry);
        let (omega, undecided) = (TAU * frequency, ModesError::Undecided { frequency });
        let lowest = THINNEST * free_bone.fastest / (TAU * free_bone.thickness);
        if frequency < lowest {
            return Err(ModesError::TooLow { frequency, lowest });
        }
        let last = last_wavenumber(isa, &sublayers, omega).ok_or(undecided)?;
        let ends = [FIRST * omega / free_bone.fastest, last];
        let (mut modes, mut components, mut families) = (Vec::new(), Vec::new(), Vec::new());
        for family in symmetry.families() {
            let count = free_bone.count(&family, ends[0], omega).ok_or(undecided)?;
            if count > MODES_MAX {
                return Err(ModesError::TooMany { frequency, count });
            }
            let place = components.iter().position(|known| *known == family.components);
            families.push((family.name(), place.unwrap_or(components.len())));
            if place.is_none() {
                components.push(family.components.clone());
            }
            let extensional = family.rank_of_extensional(&media);
            for found in crossings(&mut free_bone, &family, omega, ends).ok_or(undecided)? {
                let group_velocity = free_bone.group_velocity(&family, found.rank, found.k, omega);
                modes.push(Mode {
                    family: family.name(),
                    rank: found.rank,
                    name: family.name_of(found.rank, extensional),
                    wavenumber: found.k,
                    phase_velocity: omega / found.k,
                    group_velocity: group_velocity.ok_or(undecided)?,
                    attenuation: 0.0,
                });
            }
        }
        modes.sort_by(|a, b| a.phase_velocity.total_cmp(&b.phase_velocity));
        Ok(Self { media, modes, components, families, last })
    }

    /// Returns the components of the displacement of a wave.
    pub(super) fn components_of(&self, mode: &Mode) -> &[usize] {
        let family = self.families.iter().find(|(name, _)| *name == mode.family);
        family.map_or(&[], |(_, place)| &self.components[*place])
    }
}

/// Returns the same bone with each solid in two parts of irrational ratio, or the one in its middle in three, so
/// that it remains the same from both faces.
///
/// A wave of horizontal shear with n nodes has a joint of equal halves, quarters, … of a solid where its traction
/// is zero. There the joint's stiffness is zero, and what is added to the faces' stiffness infinite. So are those
/// of all waves at their cut-off frequencies.
fn divided(media: &Media, is_half: bool) -> Media {
    let count = media.iter().count();
    let middle = is_half.then_some(count / 2);
    let mut parts = Vec::new();
    for (place, MediumLayer { medium, thickness }) in media.iter().enumerate() {
        let shares: &[f64] = if middle == Some(place) {
            &[0.5 * DIVISION, 1.0 - DIVISION, 0.5 * DIVISION]
        } else if middle.is_some_and(|middle| middle < place) {
            &[1.0 - DIVISION, DIVISION]
        } else {
            &[DIVISION, 1.0 - DIVISION]
        };
        parts.extend(
            shares
                .iter()
                .map(|share| MediumLayer { medium: medium.clone(), thickness: share * thickness }),
        );
    }
    let lower = parts.split_off(1);
    Media { uppermost: parts.swap_remove(0), lower }
}

/// Returns a wavenumber (rad/m) beyond which every wave of the bone has a higher frequency than `omega`
/// (rad/s).
///
/// With the least eigenvalue of all elasticity matrices times the unit matrix as elasticity and the largest
/// density, the energy of every deformation is smaller and the inertia larger. So the slowest wave of this
/// isotropic plate, A0, whose frequency grows with the wavenumber, has a lower frequency than every wave of
/// the bone at the same wavenumber.
fn last_wavenumber(isa: Isa, sublayers: &Sublayers, omega: f64) -> Option<f64> {
    let (mut density, mut stiffness) = (0.0_f64, f64::INFINITY);
    for sublayer in sublayers.iter() {
        density = density.max(sublayer.solid.density);
        stiffness = stiffness.min(least_eigenvalue(&sublayer.solid.elasticity)?);
    }
    let entry = |i, j| if i == j { stiffness } else { 0.0 };
    let rows = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
    let soft = Bone { density, elasticity: Elasticity::new(rows).ok()? };
    let bone = BoneRef::Homogeneous(&soft);
    let (media, symmetry) = (
        Media::new(isa, bone, sublayers.thickness()),
        Symmetry::new(&bone.sublayers(sublayers.thickness())),
    );
    let mut soft = FreeBone::new(isa, &media, symmetry);
    let slowest = soft.wave(&Family::new(symmetry, FLEXURAL), 1, omega, 0.0)?;
    Some((1.0 + ROUNDING) * omega / slowest.phase_velocity)
}

/// Returns a number just below the least eigenvalue of the matrix, Pa.
fn least_eigenvalue(elasticity: &Elasticity) -> Option<f64> {
    const ALL: [usize; 6] = [0, 1, 2, 3, 4, 5];
    let rows = elasticity.rows();
    let smallest = ALL.iter().fold(f64::INFINITY, |least, &i| least.min(rows[i][i]));
    let is_above = |value: f64| {
        let mut shifted = *rows;
        for i in ALL {
            shifted[i][i] -= value;
        }
        // A pivot of zero is an eigenvalue of zero.
        Some(negative_pivots(&mut shifted, &ALL, &[]) != Some(0))
    };
    bisect((0.0, (1.0 + ROUNDING) * smallest), is_above).map(|least| (1.0 - ROUNDING) * least)
}
