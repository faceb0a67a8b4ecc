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

mod count;
mod family;
mod stack;

use std::f64::consts::TAU;

use osteon_common::bone::BoneRef;

use self::count::CountWaves;
use self::family::{EXTENSIONAL, FLEXURAL, Family, Symmetry};
use self::stack::FreeStack;
use crate::exact::plate::{AccuratePlate, Fill};
use crate::isa::Isa;
use crate::media::{Media, MediumLayer};
use crate::medium::Medium;
use crate::solver::Solver;

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
    pub fn guided_waves<'a>(&self, bone: impl Into<BoneRef<'a>>) -> GuidedWaves {
        self.guided_waves_of(bone.into())
    }

    fn guided_waves_of(&self, bone: BoneRef<'_>) -> GuidedWaves {
        let (isa, frequency) = (self.isa(), self.setup().probe.center_frequency);
        let thickness = self.setup().layers.bone_thickness;
        let media = Media::new(isa, bone, thickness);
        let symmetry = Symmetry::new(&bone.sublayers(thickness));
        let flexural = Family::new(symmetry, FLEXURAL);
        let extensional = Family::new(symmetry, EXTENSIONAL);
        let rank = extensional.rank_of_extensional(&media);
        let mut free_bone = FreeBone::new(isa, &media, symmetry);
        GuidedWaves {
            frequency,
            a0: free_bone.wave(&flexural, 1, TAU * frequency, THINNEST_FLEXURAL),
            s0: free_bone.wave(&extensional, rank, TAU * frequency, THINNEST_EXTENSIONAL),
        }
    }
}

/// A bone with free faces.
struct FreeBone {
    counter: WaveCounter,
    /// Bound of the speed of a wave without cut-off frequency, and of every group velocity, m/s.
    fastest: f64,
    /// Thickness, m.
    thickness: f64,
}

/// Counts the guided waves of a bone below a frequency.
enum WaveCounter {
    Plate { isa: Isa, plate: Box<(Medium, AccuratePlate)> },
    Stack(FreeStack),
}

impl FreeBone {
    fn new(isa: Isa, media: &Media, symmetry: Symmetry) -> Self {
        let counter = if media.lower.is_empty() {
            let MediumLayer { medium, thickness } = media.uppermost.clone();
            let mut plate = Box::new((medium, AccuratePlate::default()));
            let (medium, filled) = &mut *plate;
            isa.run(Fill { medium, thickness, doublings_min: 1, plate: filled });
            WaveCounter::Plate { isa, plate }
        } else {
            WaveCounter::Stack(FreeStack::new(isa, media, symmetry.halves()))
        };
        let thickness = media.iter().fold(0.0, |sum, layer| sum + layer.thickness);
        Self { counter, fastest: media.fastest(), thickness }
    }

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
        let mut low = BELOW_LEAST * omega / self.fastest;
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
        let reach = 2.0 * self.fastest * step;
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
        let mut at = |k: f64| match &mut self.counter {
            WaveCounter::Plate { isa, plate } => {
                let (medium, plate) = &mut **plate;
                isa.run(CountWaves { medium, plate, family, k, omega })
            }
            WaveCounter::Stack(stack) => stack.count(family, k, omega),
        };
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
