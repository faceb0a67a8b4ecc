//! Admittance of the plate by doubling.
//!
//! A sublayer of thickness d = h/2ⁿ has, from its transfer matrix, the dynamic stiffness
//! `[t_top; t_bottom] = K [u_top; u_bottom]` (outward tractions). For every triclinic tensor
//! K_bb = K_ttᵀ, K_tb and K_bt are symmetric, and K_bt(k) = K_tb(-k). Two equal layers, one on the
//! other, form one of twice the thickness: with A = K_tt, D = -K_tb, U = -K_bt
//!
//! ```text
//! S = A + Aᵀ,   A ← A - D S⁻¹ U,   D ← D S⁻¹ D,   U ← U S⁻¹ U
//! ```
//!
//! S is complex symmetric. As s has a positive real part, its factorization needs no pivoting. The
//! last doubling closes the lower face with the marrow and eliminates directly to the scalar 1/Y,
//! Y = û3(0)/p̂(0). There are no roots to find, no branches and no degenerate solids.
//!
//! Matrix entries are written out, and closures are avoided: code that the compiler does not inline
//! and unroll is not kept in registers, nor compiled for the instruction set (see [`crate::isa`]).

use crate::complex::Complex;
use crate::exact::growth::Growth;
use crate::exact::series::{Polynomials, Series};
use crate::medium::Medium;
use crate::vector::{ComplexVector, Vector};

/// Maximum number of doublings: a plate of 2⁴⁰ sublayers is beyond every admissible input.
const DOUBLINGS_MAX: u32 = 40;

/// A plate of one solid, with the quantities computed for the current frequency.
#[derive(Debug)]
pub(crate) struct Plate<const TERMS: usize> {
    series: Series<TERMS>,
    growth: Growth,
    polynomials: Polynomials,
    growth_max: f64,
    thickness: f64,
    /// Frequency and sublayer for which the polynomials were summed.
    prepared: Option<Prepared>,
}

/// The plate of quick passes: the remainder of its series is 3e-7 of the leading terms. This error
/// is as smooth as that of a slightly different solid, and has no visible effect on a velocity.
pub(crate) type FastPlate = Plate<8>;

/// The plate of thorough passes, traces and single admittances: accurate to 1e-13.
pub(crate) type AccuratePlate = Plate<11>;

impl Default for FastPlate {
    fn default() -> Self {
        Self::new(2.65)
    }
}

impl Default for AccuratePlate {
    fn default() -> Self {
        Self::new(2.0)
    }
}

/// Frequency and sublayer of the current polynomials.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Prepared {
    s: Complex,
    doublings: u32,
    /// Thickness of the sublayer, m.
    sublayer: f64,
    /// The stiffness, Pa/m, that corresponds to a scaled stiffness of one.
    stiffness: f64,
}

/// A general matrix, by rows.
type Matrix<V> = [ComplexVector<V>; 9];
/// The entries 11, 12, 13, 22, 23, 33 of a symmetric matrix.
pub(crate) type Symmetric<V> = [ComplexVector<V>; 6];

/// Dynamic stiffness of a layer, scaled.
pub(crate) struct Layer<V> {
    /// A = K_tt; K_bb is its transpose.
    pub(crate) top: Matrix<V>,
    /// D = -K_tb: minus the traction on top for a displacement of the bottom.
    pub(crate) down: Symmetric<V>,
    /// U = -K_bt: minus the traction on the bottom for a displacement of the top.
    up: Symmetric<V>,
}

impl<const TERMS: usize> Plate<TERMS> {
    /// Creates a plate. `growth_max` is the largest |λ| d of a sublayer; it is below π, where the
    /// block that is inverted becomes singular.
    fn new(growth_max: f64) -> Self {
        Self {
            series: Series::default(),
            growth: Growth::default(),
            polynomials: Polynomials::default(),
            growth_max,
            thickness: 0.0,
            prepared: None,
        }
    }

    /// Fills the plate for `medium`; `thickness` in m.
    #[inline(always)]
    pub(crate) fn fill<V: Vector>(&mut self, medium: &Medium, thickness: f64) {
        self.series.fill(medium);
        self.growth.fill::<V>(medium);
        self.thickness = thickness;
        self.prepared = None;
    }

    /// Prepares for complex frequency `s` (1/s) and wavenumbers from `k_min` to `k_max` (rad/m).
    #[inline(always)]
    pub(crate) fn prepare<V: Vector>(
        &mut self,
        medium: &Medium,
        s: Complex,
        (k_min, k_max): (f64, f64),
    ) {
        let growth = self.growth.at(k_min, k_max, s.abs());
        let mut doublings = 1;
        let mut sublayer = 0.5 * self.thickness;
        while growth * sublayer > self.growth_max && doublings < DOUBLINGS_MAX {
            doublings += 1;
            sublayer *= 0.5;
        }
        if self.prepared.is_some_and(|p| p.s == s && p.doublings == doublings) {
            return;
        }
        let stiffness = medium.stiffness / sublayer;
        let sigma = (s * s).scale(medium.density * sublayer / stiffness);
        self.series.at_frequency::<V>(sigma, &mut self.polynomials);
        self.prepared = Some(Prepared { s, doublings, sublayer, stiffness });
    }

    /// Returns -1/Y, Pa/m, at wavenumbers `k` (rad/m), with the lower face loaded by τ3 = `load` u3
    /// (Pa/m).
    ///
    /// [`Plate::prepare`] must have been called for these wavenumbers; otherwise the result is NaN.
    #[inline(always)]
    pub(crate) fn impedance<V: Vector>(&self, k: V, load: ComplexVector<V>) -> ComplexVector<V> {
        let Some(prepared) = self.prepared else {
            let nan = V::splat(f64::NAN);
            return ComplexVector { re: nan, im: nan };
        };
        let mut layer = sublayer::<TERMS, V>(&self.polynomials, k.mul(V::splat(prepared.sublayer)));
        for _ in 1..prepared.doublings {
            layer = layer.double();
        }
        let load = load.scale(V::splat(1.0 / prepared.stiffness));
        layer.last_pivot(load).scale(V::splat(prepared.stiffness))
    }

    /// Returns the thinnest sublayer at wavenumbers `k` (rad/m), and the number of doublings, at least
    /// one, that make the plate of it; `None` without [`Plate::prepare`] for these wavenumbers.
    #[inline(always)]
    pub(crate) fn thinnest<V: Vector>(&self, k: V) -> Option<(Layer<V>, u32)> {
        let prepared = self.prepared?;
        let layer = sublayer::<TERMS, V>(&self.polynomials, k.mul(V::splat(prepared.sublayer)));
        Some((layer, prepared.doublings))
    }
}

/// Returns the stiffness of the thinnest sublayer: with the blocks X and Y of the transfer matrix,
/// D = Y(-k)⁻¹, U = Y(k)⁻¹, A = (U X)ᵀ.
#[inline(always)]
fn sublayer<const TERMS: usize, V: Vector>(polynomials: &Polynomials, k: V) -> Layer<V> {
    let mut plus = [ComplexVector::zero(); 6];
    let mut minus = [ComplexVector::zero(); 6];
    for i in 0..6 {
        let entry = polynomials.entry::<TERMS, V>(9 + i, k);
        plus[i] = entry.at(k);
        minus[i] = entry.at_opposite(k);
    }
    let up = inverse(&plus);
    let down = inverse(&minus);
    let rows = [[up[0], up[1], up[2]], [up[1], up[3], up[4]], [up[2], up[4], up[5]]];
    let [a, b, c] = products::<TERMS, V>(polynomials, k, 0, &rows);
    let [d, e, f] = products::<TERMS, V>(polynomials, k, 1, &rows);
    let [g, h, i] = products::<TERMS, V>(polynomials, k, 2, &rows);
    let top = [a, b, c, d, e, f, g, h, i];
    Layer { top, down, up }
}

/// Returns the products of three rows with one column of the block (u, u) of the transfer matrix.
#[inline(always)]
fn products<const TERMS: usize, V: Vector>(
    polynomials: &Polynomials,
    k: V,
    column: usize,
    rows: &[[ComplexVector<V>; 3]; 3],
) -> [ComplexVector<V>; 3] {
    let mut x = [ComplexVector::zero(); 3];
    for row in 0..3 {
        x[row] = polynomials.entry::<TERMS, V>(3 * row + column, k).at(k);
    }
    [dot(rows[0], x), dot(rows[1], x), dot(rows[2], x)]
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

    /// Returns the last pivot of the elimination of all displacements but u3 of the upper face, for
    /// two of these layers, one on the other, with the lower face loaded by `load`.
    #[inline(always)]
    fn last_pivot(&self, load: ComplexVector<V>) -> ComplexVector<V> {
        let a = &self.top;
        // Lower face: (K_bb + load e3 e3ᵀ) u_bottom = U u_middle.
        let bottom = [a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8].add(load)];
        let [s0, s1, s2, s3, s4, s5] = self.joint();
        let joint = [s0, s1, s2, s1, s3, s4, s2, s4, s5];
        let middle = self.eliminate(&bottom, &joint);
        let top = self.eliminate(&middle, &self.top);
        Lu::new(&top).last_pivot
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

/// Returns Σ a b.
#[inline(always)]
fn dot<V: Vector>(a: [ComplexVector<V>; 3], b: [ComplexVector<V>; 3]) -> ComplexVector<V> {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0].mul(b[0])))
}

/// Returns minuend - Σ a b.
#[inline(always)]
fn dot_from<V: Vector>(
    minuend: ComplexVector<V>,
    a: [ComplexVector<V>; 3],
    b: [ComplexVector<V>; 3],
) -> ComplexVector<V> {
    a[2].mul_sub_from(b[2], a[1].mul_sub_from(b[1], a[0].mul_sub_from(b[0], minuend)))
}

/// Returns the symmetric product aᵀ b of matrices given by columns.
#[inline(always)]
fn gram<V: Vector>(a: &[[ComplexVector<V>; 3]; 3], b: &[[ComplexVector<V>; 3]; 3]) -> Symmetric<V> {
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
struct Lower<V> {
    l10: ComplexVector<V>,
    l20: ComplexVector<V>,
    l21: ComplexVector<V>,
}

impl<V: Vector> Lower<V> {
    /// Returns the columns of L⁻¹ b.
    #[inline(always)]
    fn forward(&self, b: &Symmetric<V>) -> [[ComplexVector<V>; 3]; 3] {
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
struct Factor<V> {
    lower: Lower<V>,
    /// Inverses of the pivots.
    inverse: [ComplexVector<V>; 3],
}

impl<V: Vector> Factor<V> {
    #[inline(always)]
    fn new(s: &Symmetric<V>) -> Self {
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
    fn divide_by_diagonal(&self, b: &[[ComplexVector<V>; 3]; 3]) -> [[ComplexVector<V>; 3]; 3] {
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
fn inverse<V: Vector>(s: &Symmetric<V>) -> Symmetric<V> {
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
struct Lu<V> {
    lower: Lower<V>,
    u01: ComplexVector<V>,
    u02: ComplexVector<V>,
    u12: ComplexVector<V>,
    /// Inverses of the first two pivots.
    inverse: [ComplexVector<V>; 2],
    last_pivot: ComplexVector<V>,
}

impl<V: Vector> Lu<V> {
    #[inline(always)]
    fn new(a: &Matrix<V>) -> Self {
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
    fn divide_row(
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
