//! The node that two sublayers of the bone share.
//!
//! Each computes its acceleration as that of a free face, along its own axes. Together, both masses move
//! under both forces.

use super::solid::{SOLID, SolidLayer};
use crate::lanes::Lanes;
use crate::medium::Matrix3;

/// What is between two sublayers.
#[derive(Debug, Clone)]
pub(super) struct Interface {
    /// Share of the lower sublayer in the mass of the node.
    share: f64,
    /// Components along the axes of the lower sublayer from those along the axes of the upper one.
    turn: Matrix3,
}

impl Interface {
    pub(super) fn new(lower: &SolidLayer, upper: &SolidLayer) -> Self {
        let turn = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                (0..3).fold(0.0, |sum, p| lower.axes[p][i].mul_add(upper.axes[p][j], sum))
            })
        });
        Self { share: lower.face_mass / (lower.face_mass + upper.face_mass), turn }
    }

    /// Replaces the accelerations of both free faces by that of the node, along the axes of either.
    #[inline(always)]
    pub(super) fn join(&self, lower: &mut [Lanes], upper: &mut [Lanes]) {
        let (share, rest) = (Lanes::splat(self.share), Lanes::splat(1.0 - self.share));
        for part in [0, SOLID / 2] {
            for i in 0..3 {
                let mut turned = Lanes::ZERO;
                for j in 0..3 {
                    turned = Lanes::splat(self.turn[i][j]).mul_add(upper[part + j], turned);
                }
                lower[part + i] = share.mul_add(lower[part + i], rest * turned);
            }
            for j in 0..3 {
                let mut turned = Lanes::ZERO;
                for i in 0..3 {
                    turned = Lanes::splat(self.turn[i][j]).mul_add(lower[part + i], turned);
                }
                upper[part + j] = turned;
            }
        }
    }
}
