//! The plates of a bone's sublayers, one on the other.

use crate::complex::Complex;
use crate::exact::layer::{FaceImpedance, Foundation};
use crate::exact::plate::{AccuratePlate, FastPlate, Fill, Plate};
use crate::isa::{Isa, Kernel};
use crate::lanes::{ComplexLanes, LANES, Lanes};
use crate::media::{Media, MediumLayer};
use crate::vector::Vector;

/// One plate for each medium of a bone.
#[derive(Debug)]
pub(crate) struct PlateStack<const TERMS: usize> {
    pub(crate) uppermost: Plate<TERMS>,
    /// Those below it, downwards; a bone with fewer media uses the first ones.
    lower: Vec<Plate<TERMS>>,
    create: fn() -> Plate<TERMS>,
}

impl Default for PlateStack<8> {
    fn default() -> Self {
        Self::new(FastPlate::default)
    }
}

impl Default for PlateStack<11> {
    fn default() -> Self {
        Self::new(AccuratePlate::default)
    }
}

impl<const TERMS: usize> PlateStack<TERMS> {
    fn new(create: fn() -> Plate<TERMS>) -> Self {
        Self { uppermost: create(), lower: Vec::new(), create }
    }

    /// Computes what all admittances of a bone have in common.
    pub(crate) fn fill(&mut self, isa: Isa, media: &Media) {
        let Self { uppermost, lower, create } = self;
        let missing = media.lower.len().saturating_sub(lower.len());
        lower.extend((0..missing).map(|_| create()));
        let doublings_min = u32::from(media.lower.is_empty());
        for (layer, plate) in media.iter().zip([uppermost].into_iter().chain(lower)) {
            let MediumLayer { medium, thickness } = layer;
            isa.run(Fill { medium, thickness: *thickness, doublings_min, plate });
        }
    }

    /// Prepares all plates for complex frequency `s` (1/s) and wavenumbers `k` (rad/m), ascending.
    #[inline]
    pub(crate) fn prepare(&mut self, isa: Isa, media: &Media, s: Complex, k: &Lanes) {
        let Self { uppermost, lower, .. } = self;
        for (layer, plate) in media.iter().zip([uppermost].into_iter().chain(lower)) {
            isa.run(Prepare { layer, plate, s, k: (k.0[0], k.0[LANES - 1]) });
        }
    }

    /// Returns what the uppermost plate lies on, at wavenumbers `k` (rad/m), if there are others below it:
    /// the impedance of their upper face, Pa/m, with the lowest loaded by τ3 = `load` u3 (Pa/m).
    /// [`PlateStack::prepare`] must have been called for these wavenumbers.
    #[inline]
    pub(crate) fn foundation(
        &self,
        isa: Isa,
        media: &Media,
        k: &Lanes,
        load: &ComplexLanes,
    ) -> Option<FaceImpedance> {
        let lower = self.lower.get(..media.lower.len())?;
        let (lowest, others) = lower.split_last()?;
        let lowest = isa.run(UpperFace { plate: lowest, k, foundation: load });
        let carry = |foundation, plate| isa.run(UpperFace { plate, k, foundation: &foundation });
        Some(others.iter().rev().fold(lowest, carry))
    }
}

/// Kernel that prepares a plate for one block of wavenumbers.
struct Prepare<'a, const TERMS: usize> {
    layer: &'a MediumLayer,
    plate: &'a mut Plate<TERMS>,
    s: Complex,
    k: (f64, f64),
}

impl<const TERMS: usize> Kernel for Prepare<'_, TERMS> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        self.plate.prepare::<V>(&self.layer.medium, self.s, self.k);
    }
}

/// Kernel that computes the impedance of a plate's upper face at one block of wavenumbers.
struct UpperFace<'a, F, const TERMS: usize> {
    plate: &'a Plate<TERMS>,
    k: &'a Lanes,
    foundation: &'a F,
}

impl<F: Foundation, const TERMS: usize> Kernel for UpperFace<'_, F, TERMS> {
    type Output = FaceImpedance;

    #[inline(always)]
    fn run<V: Vector>(self) -> FaceImpedance {
        let Self { plate, k, foundation } = self;
        let mut face = [ComplexLanes::ZERO; 9];
        for part in 0..V::PARTS {
            let impedance = plate.upper_face::<V, F>(k, foundation, part);
            for i in 0..9 {
                impedance[i].store(&mut face[i], part);
            }
        }
        face
    }
}
