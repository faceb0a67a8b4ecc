//! The dynamic stiffness of a layer, and how layers are put together.
//!
//! `[t_top; t_bottom] = K [u_top; u_bottom]` with outward tractions t. For every triclinic tensor
//! K_bb = K_ttᵀ, K_tb and K_bt are symmetric, and K_bt(k) = K_tb(-k). Two equal layers, one on the
//! other, form one of twice the thickness: with A = K_tt, D = -K_tb, U = -K_bt
//!
//! ```text
//! S = A + Aᵀ,   A ← A - D S⁻¹ U,   D ← D S⁻¹ D,   U ← U S⁻¹ U
//! ```
//!
//! S is complex symmetric. On a foundation that answers a displacement of the layer's lower face by the
//! traction Z u, the upper face answers by (A - D (Aᵀ + Z)⁻¹ U) u. As s has a positive real part, none of
//! these factorizations needs pivoting.

use crate::exact::factors::{Factor, Lu, Matrix, Symmetric, dot_from, gram};
use crate::lanes::ComplexLanes;
use crate::vector::{ComplexVector, Vector};

/// What a layer lies on: the tractions per displacement by which it answers.
pub(crate) trait Foundation {
    /// Whether it is a solid, and not a fluid.
    const IS_SOLID: bool;

    /// Adds these, multiplied by `factor`, to the stiffness of a lower face.
    fn add_to<V: Vector>(&self, part: usize, factor: V, face: Matrix<V>) -> Matrix<V>;
}

/// A fluid resists displacements across the face only: τ3 = `self` u3.
impl Foundation for ComplexLanes {
    const IS_SOLID: bool = false;

    #[inline(always)]
    fn add_to<V: Vector>(&self, part: usize, factor: V, face: Matrix<V>) -> Matrix<V> {
        let [a, b, c, d, e, f, g, h, i] = face;
        [a, b, c, d, e, f, g, h, i.add(ComplexVector::load(self, part).scale(factor))]
    }
}

/// The impedance of the upper face of a solid, by rows.
pub(crate) type FaceImpedance = [ComplexLanes; 9];

impl Foundation for FaceImpedance {
    const IS_SOLID: bool = true;

    #[inline(always)]
    fn add_to<V: Vector>(&self, part: usize, factor: V, face: Matrix<V>) -> Matrix<V> {
        let mut sum = face;
        for i in 0..9 {
            sum[i] = face[i].add(ComplexVector::load(&self[i], part).scale(factor));
        }
        sum
    }
}

/// Dynamic stiffness of a layer, scaled.
pub(crate) struct Layer<V> {
    /// A = K_tt; K_bb is its transpose.
    pub(crate) top: Matrix<V>,
    /// D = -K_tb: minus the traction on top for a displacement of the bottom.
    pub(crate) down: Symmetric<V>,
    /// U = -K_bt: minus the traction on the bottom for a displacement of the top.
    pub(super) up: Symmetric<V>,
}

impl<V: Vector> Layer<V> {
    /// Puts two of these layers together, one on the other.
    #[inline(always)]
    pub(crate) fn double(&self) -> Self {
        let factor = Factor::new(&self.joint());
        let down = factor.lower.forward(&self.down);
        let scaled = factor.divide_by_diagonal(&down);
        let new_down = gram(&scaled, &down);
        let up = factor.lower.forward(&self.up);
        let a = &self.top;
        let top = [
            dot_from(a[0], scaled[0], up[0]),
            dot_from(a[1], scaled[0], up[1]),
            dot_from(a[2], scaled[0], up[2]),
            dot_from(a[3], scaled[1], up[0]),
            dot_from(a[4], scaled[1], up[1]),
            dot_from(a[5], scaled[1], up[2]),
            dot_from(a[6], scaled[2], up[0]),
            dot_from(a[7], scaled[2], up[1]),
            dot_from(a[8], scaled[2], up[2]),
        ];
        Self { top, down: new_down, up: gram(&factor.divide_by_diagonal(&up), &up) }
    }

    /// Returns S = A + Aᵀ of the joint between two equal layers.
    #[inline(always)]
    pub(crate) fn joint(&self) -> Symmetric<V> {
        let a = &self.top;
        [
            a[0].add(a[0]),
            a[1].add(a[3]),
            a[2].add(a[6]),
            a[4].add(a[4]),
            a[5].add(a[7]),
            a[8].add(a[8]),
        ]
    }

    /// Returns the impedance of the upper face, with this layer on a foundation.
    #[inline(always)]
    pub(super) fn upper_face<F: Foundation>(
        &self,
        foundation: &F,
        part: usize,
        factor: V,
    ) -> Matrix<V> {
        self.eliminate(&self.lower_face(foundation, part, factor), &self.top)
    }

    /// The same for two of these layers, one on the other.
    #[inline(always)]
    pub(super) fn upper_face_of_two<F: Foundation>(
        &self,
        foundation: &F,
        part: usize,
        factor: V,
    ) -> Matrix<V> {
        let bottom = self.lower_face(foundation, part, factor);
        let [s0, s1, s2, s3, s4, s5] = self.joint();
        let joint = [s0, s1, s2, s1, s3, s4, s2, s4, s5];
        let middle = self.eliminate(&bottom, &joint);
        self.eliminate(&middle, &self.top)
    }

    /// Returns K_bb and the foundation's stiffness.
    #[inline(always)]
    fn lower_face<F: Foundation>(&self, foundation: &F, part: usize, factor: V) -> Matrix<V> {
        let a = &self.top;
        let face = [a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]];
        foundation.add_to(part, factor, face)
    }

    /// Returns target - D pivot⁻¹ U.
    #[inline(always)]
    fn eliminate(&self, pivot: &Matrix<V>, target: &Matrix<V>) -> Matrix<V> {
        let lu = Lu::new(pivot);
        let last = lu.last_pivot.recip();
        let right = lu.lower.forward(&self.up);
        let d = &self.down;
        let first = lu.divide_row([d[0], d[1], d[2]], last);
        let a = dot_from(target[0], first, right[0]);
        let b = dot_from(target[1], first, right[1]);
        let c = dot_from(target[2], first, right[2]);
        let second = lu.divide_row([d[1], d[3], d[4]], last);
        let e = dot_from(target[3], second, right[0]);
        let f = dot_from(target[4], second, right[1]);
        let g = dot_from(target[5], second, right[2]);
        let third = lu.divide_row([d[2], d[4], d[5]], last);
        let h = dot_from(target[6], third, right[0]);
        let i = dot_from(target[7], third, right[1]);
        let j = dot_from(target[8], third, right[2]);
        [a, b, c, e, f, g, h, i, j]
    }
}
