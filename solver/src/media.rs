//! The media of a bone, from its upper face to its lower one.

use osteon_common::bone::{Bone, BoneRef, Sublayer};

use crate::isa::{Isa, Kernel};
use crate::medium::Medium;
use crate::vector::Vector;

/// One medium of a bone.
#[derive(Debug, Clone)]
pub(crate) struct MediumLayer {
    pub(crate) medium: Medium,
    /// Thickness, m.
    pub(crate) thickness: f64,
}

/// The media of a bone; no two neighbours are equal.
#[derive(Debug, Clone)]
pub(crate) struct Media {
    pub(crate) uppermost: MediumLayer,
    /// Those below it, downwards.
    pub(crate) lower: Vec<MediumLayer>,
}

impl Media {
    /// Returns the media of a bone; `thickness` (m) is that of the setup.
    pub(crate) fn new(isa: Isa, bone: BoneRef<'_>, thickness: f64) -> Self {
        let layer = |sublayer: &Sublayer| MediumLayer {
            medium: isa.run(Solid(&sublayer.solid)),
            thickness: sublayer.thickness,
        };
        let sublayers = bone.sublayers(thickness);
        Self {
            uppermost: layer(sublayers.uppermost()),
            lower: sublayers.lower().iter().map(layer).collect(),
        }
    }

    /// Returns a bound of every wave's speed along x1, m/s. In each medium, energy flows along x1 at most
    /// at the medium's own bound; so none flows faster than at the largest of them, by whatever way.
    pub(crate) fn fastest(&self) -> f64 {
        self.iter().fold(0.0, |fastest, layer| fastest.max(layer.medium.fastest))
    }

    /// Returns each medium, downwards.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &MediumLayer> {
        [&self.uppermost].into_iter().chain(&self.lower)
    }
}

/// Kernel that converts a tensor into the system's coefficients.
struct Solid<'a>(&'a Bone);

impl Kernel for Solid<'_> {
    type Output = Medium;

    #[inline(always)]
    fn run<V: Vector>(self) -> Medium {
        Medium::new(self.0)
    }
}
