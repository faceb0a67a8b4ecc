//! Admittance of the plate by doubling.
//!
//! A sublayer of thickness d = h/2ⁿ has, from its transfer matrix, the dynamic stiffness
//! `[t_top; t_bottom] = K [u_top; u_bottom]` (outward tractions). For every triclinic tensor
//! K_bb = K_ttᵀ, K_tb and K_bt are symmetric, and K_bt(k) = K_tb(-k). Two equal layers, one upon
//! the other, are one of twice the thickness:
//!
//! ```text
//! S = K_tt + K_ttᵀ,   K_tt ← K_tt - K_tb S⁻¹ K_bt,   K_tb ← -K_tb S⁻¹ K_tb,   K_bt ← -K_bt S⁻¹ K_bt
//! ```
//!
//! S is complex symmetric and, s having a positive real part, its factorization needs no pivoting.
//! The last doubling closes the lower face on the marrow and eliminates straight to the scalar
//! 1/Y, Y = û3(0)/p̂(0). There are no roots to find, no branches and no degenerate solids.
//!
//! Loops rather than `array::from_fn` and `map`: a closure that the compiler does not inline is not
//! compiled for the instruction set of its caller (see [`crate::isa`]).

use crate::complex::Complex;
use crate::lanes::{ComplexLanes, Lanes};
use crate::medium::Medium;
use crate::series::{GROWTH_MAX, Polynomials, Series};

/// Most doublings: a plate of 2⁴⁰ sublayers is beyond every admissible input.
const DOUBLINGS_MAX: u32 = 40;

/// Position of entry (i, j) of a symmetric matrix in its six kept entries.
const AT: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// A plate of one solid, with what was computed for the present frequency.
#[derive(Debug, Default)]
pub(crate) struct Plate {
    series: Series,
    polynomials: Polynomials,
    thickness: f64,
    /// What the polynomials were summed for.
    prepared: Option<Prepared>,
}

/// Frequency and sublayer of the present polynomials.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Prepared {
    s: Complex,
    doublings: u32,
    /// Thickness of the sublayer, m.
    sublayer: f64,
    /// Pa/m that a scaled stiffness of one stands for.
    stiffness: f64,
}

/// Dynamic stiffness of a layer, scaled.
struct Stiffness {
    /// K_tt by rows; K_bb is its transpose.
    top: [ComplexLanes; 9],
    /// K_tb: traction on top for a displacement below.
    down: [ComplexLanes; 6],
    /// K_bt: traction below for a displacement on top.
    up: [ComplexLanes; 6],
}

impl Plate {
    /// Makes this the plate of `medium`, `thickness` in m.
    #[inline(always)]
    pub(crate) fn fill(&mut self, medium: &Medium, thickness: f64) {
        self.series.fill(medium);
        self.thickness = thickness;
        self.prepared = None;
    }

    /// Prepares for complex frequency `s` (1/s) and wavenumbers up to `k_max` (rad/m).
    #[inline(always)]
    pub(crate) fn prepare(&mut self, medium: &Medium, s: Complex, k_max: f64) {
        let growth = medium.growth(k_max, s.abs());
        let mut doublings = 1;
        let mut sublayer = 0.5 * self.thickness;
        while growth * sublayer > GROWTH_MAX && doublings < DOUBLINGS_MAX {
            doublings += 1;
            sublayer *= 0.5;
        }
        if self.prepared.is_some_and(|p| p.s == s && p.doublings == doublings) {
            return;
        }
        let stiffness = medium.stiffness / sublayer;
        let sigma = (s * s).scale(medium.density * sublayer / stiffness);
        self.series.at_frequency(sigma, &mut self.polynomials);
        self.prepared = Some(Prepared { s, doublings, sublayer, stiffness });
    }

    /// -1/Y, Pa/m, at wavenumbers `k` (rad/m), the lower face loaded by τ3 = `load` u3 (Pa/m).
    ///
    /// [`Plate::prepare`] has been called for these wavenumbers; else the result is NaN.
    #[inline(always)]
    pub(crate) fn impedance(&self, k: Lanes, load: ComplexLanes) -> ComplexLanes {
        let Some(prepared) = self.prepared else {
            let nan = Lanes::splat(f64::NAN);
            return ComplexLanes { re: nan, im: nan };
        };
        let mut layer = self.sublayer(k * Lanes::splat(prepared.sublayer));
        for _ in 1..prepared.doublings {
            layer = layer.doubled();
        }
        let scale = Lanes::splat(prepared.stiffness);
        let load_scale = Lanes::splat(1.0 / prepared.stiffness);
        let closed =
            layer.closed(ComplexLanes { re: load.re * load_scale, im: load.im * load_scale });
        ComplexLanes { re: closed.re * scale, im: closed.im * scale }
    }

    /// Stiffness of the thinnest sublayer: K_tb = -T12(-k)⁻¹, K_bt = -T12(k)⁻¹,
    /// K_tt = (T12⁻¹ T11)ᵀ, T the transfer matrix.
    #[inline(always)]
    fn sublayer(&self, k: Lanes) -> Stiffness {
        let traction = self.polynomials.traction(k);
        let displacement = self.polynomials.displacement(k);
        let (mut plus, mut minus) = ([ComplexLanes::ZERO; 6], [ComplexLanes::ZERO; 6]);
        for i in 0..6 {
            plus[i] = traction.even[i] + traction.odd[i];
            minus[i] = traction.even[i] - traction.odd[i];
        }
        let (plus, minus) = (inverse(&plus), inverse(&minus));
        let mut top = [ComplexLanes::ZERO; 9];
        for i in 0..3 {
            for j in 0..3 {
                let mut sum = plus[AT[j][0]] * displacement[i];
                sum = plus[AT[j][1]].mul_add(displacement[3 + i], sum);
                top[3 * i + j] = plus[AT[j][2]].mul_add(displacement[6 + i], sum);
            }
        }
        let (mut down, mut up) = (minus, plus);
        for i in 0..6 {
            down[i] = -minus[i];
            up[i] = -plus[i];
        }
        Stiffness { top, down, up }
    }
}

impl Stiffness {
    /// Two of these, one upon the other.
    #[inline(always)]
    fn doubled(&self) -> Self {
        let factor = Factor::new(&self.joint());
        let down = factor.forward(&full(&self.down));
        let up = factor.forward(&full(&self.up));
        let down_scaled = factor.scaled(&down);
        let up_scaled = factor.scaled(&up);
        let mut doubled =
            Self { top: self.top, down: [ComplexLanes::ZERO; 6], up: [ComplexLanes::ZERO; 6] };
        for i in 0..3 {
            for j in 0..3 {
                for m in 0..3 {
                    let at = &mut doubled.top[3 * i + j];
                    *at = down_scaled[3 * m + i].mul_sub_from(up[3 * m + j], *at);
                }
            }
            for j in i..3 {
                for m in 0..3 {
                    let at = &mut doubled.down[AT[i][j]];
                    *at = down_scaled[3 * m + i].mul_sub_from(down[3 * m + j], *at);
                    let at = &mut doubled.up[AT[i][j]];
                    *at = up_scaled[3 * m + i].mul_sub_from(up[3 * m + j], *at);
                }
            }
        }
        doubled
    }

    /// K_bb + K_tt of the joint between two equal layers.
    #[inline(always)]
    fn joint(&self) -> [ComplexLanes; 6] {
        let top = &self.top;
        [
            top[0] + top[0],
            top[1] + top[3],
            top[2] + top[6],
            top[4] + top[4],
            top[5] + top[7],
            top[8] + top[8],
        ]
    }

    /// Two of these, one upon the other, the lower face loaded by `load`: the last pivot of the
    /// elimination of all displacements but u3 of the upper face.
    #[inline(always)]
    fn closed(&self, load: ComplexLanes) -> ComplexLanes {
        let (down, up) = (full(&self.down), full(&self.up));
        // Lower face: (K_bb + load e3 e3ᵀ) u_bottom = -K_bt u_middle.
        let mut bottom = self.top;
        for i in 0..3 {
            for j in 0..3 {
                bottom[3 * i + j] = self.top[3 * j + i];
            }
        }
        bottom[8] = bottom[8] + load;
        let mut middle = full(&self.joint());
        subtract_schur(&mut middle, &down, &bottom, &up);
        let mut top = self.top;
        subtract_schur(&mut top, &down, &middle, &up);
        let factor = Lu::new(&top);
        factor.last_pivot
    }
}

/// target ← target - left pivot⁻¹ right.
#[inline(always)]
fn subtract_schur(
    target: &mut [ComplexLanes; 9],
    left: &[ComplexLanes; 9],
    pivot: &[ComplexLanes; 9],
    right: &[ComplexLanes; 9],
) {
    let solved = Lu::new(pivot).solve(right);
    for i in 0..3 {
        for j in 0..3 {
            let at = &mut target[3 * i + j];
            for m in 0..3 {
                *at = left[3 * i + m].mul_sub_from(solved[3 * m + j], *at);
            }
        }
    }
}

/// All nine entries of a symmetric matrix.
#[inline(always)]
fn full(entries: &[ComplexLanes; 6]) -> [ComplexLanes; 9] {
    let [a, b, c, d, e, f] = *entries;
    [a, b, c, b, d, e, c, e, f]
}

/// L D Lᵀ of a complex symmetric 3×3 matrix.
struct Factor {
    l10: ComplexLanes,
    l20: ComplexLanes,
    l21: ComplexLanes,
    /// Inverses of the pivots.
    inverse: [ComplexLanes; 3],
}

impl Factor {
    #[inline(always)]
    fn new(s: &[ComplexLanes; 6]) -> Self {
        let first = s[0].recip();
        let l10 = s[1] * first;
        let l20 = s[2] * first;
        let second = l10.mul_sub_from(s[1], s[3]).recip();
        let below = l20.mul_sub_from(s[1], s[4]);
        let l21 = below * second;
        let third = l21.mul_sub_from(below, l20.mul_sub_from(s[2], s[5])).recip();
        Self { l10, l20, l21, inverse: [first, second, third] }
    }

    /// L⁻¹ b.
    #[inline(always)]
    fn forward(&self, b: &[ComplexLanes; 9]) -> [ComplexLanes; 9] {
        let mut x = *b;
        for j in 0..3 {
            x[3 + j] = self.l10.mul_sub_from(x[j], x[3 + j]);
            x[6 + j] = self.l21.mul_sub_from(x[3 + j], self.l20.mul_sub_from(x[j], x[6 + j]));
        }
        x
    }

    /// D⁻¹ b.
    #[inline(always)]
    fn scaled(&self, b: &[ComplexLanes; 9]) -> [ComplexLanes; 9] {
        let mut x = *b;
        for i in 0..9 {
            x[i] = b[i] * self.inverse[i / 3];
        }
        x
    }
}

/// Inverse of a complex symmetric 3×3 matrix: L⁻ᵀ D⁻¹ L⁻¹.
#[inline(always)]
fn inverse(s: &[ComplexLanes; 6]) -> [ComplexLanes; 6] {
    let f = Factor::new(s);
    // L⁻¹ = [1; -l10 1; m20 -l21 1]
    let m20 = f.l10.mul_add(f.l21, -f.l20);
    let [d0, d1, d2] = f.inverse;
    let m20_d2 = m20 * d2;
    let l21_d2 = f.l21 * d2;
    let l10_d1 = f.l10 * d1;
    [
        m20_d2.mul_add(m20, l10_d1.mul_add(f.l10, d0)),
        -(m20_d2.mul_add(f.l21, l10_d1)),
        m20_d2,
        l21_d2.mul_add(f.l21, d1),
        -l21_d2,
        d2,
    ]
}

/// LU of a general complex 3×3 matrix without pivoting.
struct Lu {
    l: [ComplexLanes; 3],
    u: [ComplexLanes; 3],
    inverse: [ComplexLanes; 2],
    last_pivot: ComplexLanes,
}

impl Lu {
    #[inline(always)]
    fn new(a: &[ComplexLanes; 9]) -> Self {
        let first = a[0].recip();
        let (l10, l20) = (a[3] * first, a[6] * first);
        let pivot = l10.mul_sub_from(a[1], a[4]);
        let u12 = l10.mul_sub_from(a[2], a[5]);
        let second = pivot.recip();
        let l21 = l20.mul_sub_from(a[1], a[7]) * second;
        let last_pivot = l21.mul_sub_from(u12, l20.mul_sub_from(a[2], a[8]));
        Self { l: [l10, l20, l21], u: [a[1], a[2], u12], inverse: [first, second], last_pivot }
    }

    #[inline(always)]
    fn solve(&self, b: &[ComplexLanes; 9]) -> [ComplexLanes; 9] {
        let third = self.last_pivot.recip();
        let mut x = *b;
        for j in 0..3 {
            let y1 = self.l[0].mul_sub_from(x[j], x[3 + j]);
            let y2 = self.l[2].mul_sub_from(y1, self.l[1].mul_sub_from(x[j], x[6 + j]));
            let x2 = y2 * third;
            let x1 = self.u[2].mul_sub_from(x2, y1) * self.inverse[1];
            let x0 = self.u[0].mul_sub_from(x1, self.u[1].mul_sub_from(x2, x[j]));
            x[j] = x0 * self.inverse[0];
            x[3 + j] = x1;
            x[6 + j] = x2;
        }
        x
    }
}
