//! The fundamental guided waves A0 and S0 of the bone as a plate in a vacuum, and A0 of one between fluids.
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

mod banded;
mod complex_plate;
mod contour;
mod count;
mod cross_section;
mod crossings;
mod dense;
mod family;
mod fluid_bone;
mod fluid_modes;
mod free_bone;
mod modes;
mod shape;
mod stack;

use std::f64::consts::TAU;

use osteon_common::bone::BoneRef;

use self::family::{EXTENSIONAL, FLEXURAL, Family, Symmetry};
use self::fluid_modes::half_spaces;
use self::free_bone::FreeBone;
use crate::media::Media;
use crate::solver::Solver;

pub use self::fluid_modes::FluidModes;
pub use self::free_bone::GuidedWave;
pub use self::modes::{Mode, ModesError};
pub use self::shape::{ModeShape, ShapeError, ShapePoint};

/// Least products of thickness and wavenumber: below them, rounding of the stiffness hides that of bending,
/// which is their fourth power, or of extension, their square.
const THINNEST_FLEXURAL: f64 = 1e-2;
const THINNEST_EXTENSIONAL: f64 = 1e-5;

/// The fundamental guided waves of a bone, without attenuation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuidedWaves {
    /// Frequency, Hz.
    pub frequency: f64,
    /// The wave that is flexural at low frequencies, in a vacuum or, with [`Probe::a0_in_fluids`], between the
    /// fluids; `None` where none was found.
    ///
    /// [`Probe::a0_in_fluids`]: osteon_common::probe::Probe::a0_in_fluids
    pub a0: Option<GuidedWave>,
    /// The wave that is extensional along x1 at low frequencies; `None` where none was found.
    pub s0: Option<GuidedWave>,
    /// Whether there is no A0 because it is as fast as sound in a fluid, into which it would radiate.
    pub a0_radiates: bool,
}

impl GuidedWaves {
    /// Returns why there is no A0 or no S0; `None` if there are both.
    pub fn reason(&self) -> Option<&'static str> {
        if self.a0_radiates {
            return Some(
                "in a vacuum A0 is as fast as sound in coupling or marrow, so that it radiates into them; lower \
                 probe.guided_wave_frequency",
            );
        }
        (self.a0.is_none() || self.s0.is_none()).then_some(
            "the bone is too thin for its wavelength to be told from one without thickness, or a number is out \
             of scale",
        )
    }
}

impl Solver {
    /// Computes the fundamental guided waves of a bone at the probe's frequency of guided waves: those of a plate
    /// of the bone's thickness with free faces, without attenuation. Neither the fluids nor the solver's
    /// method and refinement matter. Only A0 may be that of the bone between its fluids as half-spaces: the
    /// slowest wave, which is slower than sound in both.
    pub fn guided_waves<'a>(&self, bone: impl Into<BoneRef<'a>>) -> GuidedWaves {
        self.guided_waves_of(bone.into())
    }

    fn guided_waves_of(&self, bone: BoneRef<'_>) -> GuidedWaves {
        let (isa, frequency) = (self.isa(), self.setup().probe.frequency_of_guided_waves());
        let thickness = self.setup().layers.bone_thickness;
        let media = Media::new(isa, bone, thickness);
        let symmetry = Symmetry::new(&bone.sublayers(thickness));
        let flexural = Family::new(symmetry, FLEXURAL);
        let extensional = Family::new(symmetry, EXTENSIONAL);
        let rank = extensional.rank_of_extensional(&media);
        let mut free_bone = FreeBone::new(isa, &media, symmetry);
        let in_vacuum = free_bone.wave(&flexural, 1, TAU * frequency, THINNEST_FLEXURAL);
        let s0 = free_bone.wave(&extensional, rank, TAU * frequency, THINNEST_EXTENSIONAL);
        let layers = &self.setup().layers;
        // A stack of fluids has been refused.
        let fluids = half_spaces(layers).ok().filter(|_| self.setup().probe.a0_in_fluids);
        let Some(fluids) = fluids else {
            return GuidedWaves { frequency, a0: in_vacuum, s0, a0_radiates: false };
        };
        let radiates =
            |wave: GuidedWave| fluids.iter().any(|fluid| wave.phase_velocity >= fluid.sound_speed);
        if in_vacuum.is_some_and(radiates) {
            return GuidedWaves { frequency, a0: None, s0, a0_radiates: true };
        }
        let slowest = Family::new(symmetry.between_fluids(), FLEXURAL);
        let a0 = FreeBone::between(isa, &media, fluids).wave(
            &slowest,
            1,
            TAU * frequency,
            THINNEST_FLEXURAL,
        );
        GuidedWaves { frequency, a0: in_vacuum.and(a0), s0, a0_radiates: false }
    }
}
