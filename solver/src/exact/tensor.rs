//! From the tensor of a bone to the common part of its plate's admittances.

use osteon_common::case::Bone;

use crate::exact::plate::Plate;
use crate::isa::Kernel;
use crate::medium::Medium;
use crate::vector::Vector;

/// Kernel that converts a tensor into the system's coefficients.
pub(crate) struct Solid<'a>(pub(crate) &'a Bone);

impl Kernel for Solid<'_> {
    type Output = Medium;

    #[inline(always)]
    fn run<V: Vector>(self) -> Medium {
        Medium::new(self.0)
    }
}

/// Kernel that computes the part common to all of a plate's admittances.
pub(crate) struct FillPlate<'a, const TERMS: usize> {
    pub(crate) medium: &'a Medium,
    pub(crate) thickness: f64,
    pub(crate) plate: &'a mut Plate<TERMS>,
}

impl<const TERMS: usize> Kernel for FillPlate<'_, TERMS> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        self.plate.fill::<V>(self.medium, self.thickness);
    }
}
