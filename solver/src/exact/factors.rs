//! Products and factorizations of complex 3×3 matrices, for kernels.
//!
//! Entries are written out, and closures are avoided: code that the compiler does not inline and unroll
//! is not kept in registers, nor compiled for the instruction set (see [`crate::isa`]).

use crate::vector::{ComplexVector, Vector};

/// A general matrix, by rows.
pub(crate) type Matrix<V> = [ComplexVector<V>; 9];
/// The entries 11, 12, 13, 22, 23, 33 of a symmetric matrix.
pub(crate) type Symmetric<V> = [ComplexVector<V>; 6];

/// Returns Σ a b.
#[inline(always)]
pub(super) fn dot<V: Vector>(
    a: [ComplexVector<V>; 3],
    b: [ComplexVector<V>; 3],
) -> ComplexVector<V> {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0].mul(b[0])))
}

/// Returns minuend - Σ a b.
#[inline(always)]
pub(super) fn dot_from<V: Vector>(
    minuend: ComplexVector<V>,
    a: [ComplexVector<V>; 3],
    b: [ComplexVector<V>; 3],
) -> ComplexVector<V> {
    a[2].mul_sub_from(b[2], a[1].mul_sub_from(b[1], a[0].mul_sub_from(b[0], minuend)))
}

/// Returns the symmetric product aᵀ b of matrices given by columns.
#[inline(always)]
pub(super) fn gram<V: Vector>(
    a: &[[ComplexVector<V>; 3]; 3],
    b: &[[ComplexVector<V>; 3]; 3],
) -> Symmetric<V> {
    [
        dot(a[0], b[0]),
        dot(a[0], b[1]),
        dot(a[0], b[2]),
        dot(a[1], b[1]),
        dot(a[1], b[2]),
        dot(a[2], b[2]),
    ]
}

/// L: ones on the diagonal, these below it.
pub(super) struct Lower<V> {
    l10: ComplexVector<V>,
    l20: ComplexVector<V>,
    l21: ComplexVector<V>,
}

impl<V: Vector> Lower<V> {
    /// Returns the columns of L⁻¹ b.
    #[inline(always)]
    pub(super) fn forward(&self, b: &Symmetric<V>) -> [[ComplexVector<V>; 3]; 3] {
        [
            self.forward_column(b[0], b[1], b[2]),
            self.forward_column(b[1], b[3], b[4]),
            self.forward_column(b[2], b[4], b[5]),
        ]
    }

    #[inline(always)]
    fn forward_column(
        &self,
        x: ComplexVector<V>,
        y: ComplexVector<V>,
        z: ComplexVector<V>,
    ) -> [ComplexVector<V>; 3] {
        let second = self.l10.mul_sub_from(x, y);
        [x, second, self.l21.mul_sub_from(second, self.l20.mul_sub_from(x, z))]
    }
}

/// L D Lᵀ of a complex symmetric 3×3 matrix.
pub(super) struct Factor<V> {
    pub(super) lower: Lower<V>,
    /// Inverses of the pivots.
    inverse: [ComplexVector<V>; 3],
}

impl<V: Vector> Factor<V> {
    #[inline(always)]
    pub(super) fn new(s: &Symmetric<V>) -> Self {
        let first = s[0].recip();
        let l10 = s[1].mul(first);
        let l20 = s[2].mul(first);
        let second = l10.mul_sub_from(s[1], s[3]).recip();
        let below = l20.mul_sub_from(s[1], s[4]);
        let l21 = below.mul(second);
        let third = l21.mul_sub_from(below, l20.mul_sub_from(s[2], s[5])).recip();
        Self { lower: Lower { l10, l20, l21 }, inverse: [first, second, third] }
    }

    /// Returns the columns of D⁻¹ b.
    #[inline(always)]
    pub(super) fn divide_by_diagonal(
        &self,
        b: &[[ComplexVector<V>; 3]; 3],
    ) -> [[ComplexVector<V>; 3]; 3] {
        [
            self.divide_column_by_diagonal(b[0]),
            self.divide_column_by_diagonal(b[1]),
            self.divide_column_by_diagonal(b[2]),
        ]
    }

    #[inline(always)]
    fn divide_column_by_diagonal(&self, b: [ComplexVector<V>; 3]) -> [ComplexVector<V>; 3] {
        [b[0].mul(self.inverse[0]), b[1].mul(self.inverse[1]), b[2].mul(self.inverse[2])]
    }
}

/// Returns the inverse of a complex symmetric 3×3 matrix: L⁻ᵀ D⁻¹ L⁻¹.
#[inline(always)]
pub(super) fn inverse<V: Vector>(s: &Symmetric<V>) -> Symmetric<V> {
    let Factor { lower: Lower { l10, l20, l21 }, inverse: [d0, d1, d2] } = Factor::new(s);
    // L⁻¹ = [1; -l10 1; m20 -l21 1]
    let m20 = l10.mul_add(l21, l20.neg());
    let m20_d2 = m20.mul(d2);
    let l21_d2 = l21.mul(d2);
    let l10_d1 = l10.mul(d1);
    [
        m20_d2.mul_add(m20, l10_d1.mul_add(l10, d0)),
        m20_d2.mul_add(l21, l10_d1).neg(),
        m20_d2,
        l21_d2.mul_add(l21, d1),
        l21_d2.neg(),
        d2,
    ]
}

/// LU of a general complex 3×3 matrix without pivoting.
pub(super) struct Lu<V> {
    pub(super) lower: Lower<V>,
    u01: ComplexVector<V>,
    u02: ComplexVector<V>,
    u12: ComplexVector<V>,
    /// Inverses of the first two pivots.
    inverse: [ComplexVector<V>; 2],
    pub(super) last_pivot: ComplexVector<V>,
}

impl<V: Vector> Lu<V> {
    #[inline(always)]
    pub(super) fn new(a: &Matrix<V>) -> Self {
        let first = a[0].recip();
        let (l10, l20) = (a[3].mul(first), a[6].mul(first));
        let second = l10.mul_sub_from(a[1], a[4]).recip();
        let u12 = l10.mul_sub_from(a[2], a[5]);
        let l21 = l20.mul_sub_from(a[1], a[7]).mul(second);
        let last_pivot = l21.mul_sub_from(u12, l20.mul_sub_from(a[2], a[8]));
        let lower = Lower { l10, l20, l21 };
        Self { lower, u01: a[1], u02: a[2], u12, inverse: [first, second], last_pivot }
    }

    /// Returns the row b U⁻¹; `last` is the inverse of the last pivot.
    #[inline(always)]
    pub(super) fn divide_row(
        &self,
        b: [ComplexVector<V>; 3],
        last: ComplexVector<V>,
    ) -> [ComplexVector<V>; 3] {
        let x = b[0].mul(self.inverse[0]);
        let y = x.mul_sub_from(self.u01, b[1]).mul(self.inverse[1]);
        let z = y.mul_sub_from(self.u12, x.mul_sub_from(self.u02, b[2])).mul(last);
        [x, y, z]
    }
}
