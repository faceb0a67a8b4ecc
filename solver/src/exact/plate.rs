//! Admittance of the plate by doubling.
//!
//! A slice of thickness d = h/2ⁿ has its dynamic stiffness from its transfer matrix; doublings make the
//! half plate of it (`layer.rs`). The end is an elimination upwards from what the plate lies on: of the
//! uppermost plate to the scalar 1/Y, Y = û3(0)/p̂(0), of those below to the impedance of their upper
//! face. There are no roots to find, no branches and no degenerate solids.

use crate::complex::Complex;
use crate::exact::factors::{Lu, Matrix, dot, inverse};
use crate::exact::growth::Growth;
use crate::exact::layer::{Foundation, Layer};
use crate::exact::series::{Polynomials, Series};
use crate::isa::Kernel;
use crate::lanes::Lanes;
use crate::medium::Medium;
use crate::vector::{ComplexVector, Vector};

/// Maximum number of doublings: a plate of 2⁴⁰ slices is beyond every admissible input.
const DOUBLINGS_MAX: u32 = 40;

/// A plate of one solid, with the quantities computed for the current frequency.
#[derive(Debug)]
pub(crate) struct Plate<const TERMS: usize> {
    series: Series<TERMS>,
    growth: Growth,
    polynomials: Polynomials,
    growth_max: f64,
    thickness: f64,
    /// Least number of doublings.
    doublings_min: u32,
    /// Frequency and slice for which the polynomials were summed.
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

/// Frequency and slice of the current polynomials.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Prepared {
    s: Complex,
    doublings: u32,
    /// Thickness of the slice, m.
    slice: f64,
    /// The stiffness, Pa/m, that corresponds to a scaled stiffness of one.
    stiffness: f64,
}

/// The slice of which a plate is made.
pub(crate) struct Slice<V> {
    pub(crate) layer: Layer<V>,
    /// Number of doublings that make the plate.
    pub(crate) doublings: u32,
    /// The stiffness, Pa/m, that corresponds to a scaled stiffness of one.
    pub(crate) stiffness: f64,
}

impl<const TERMS: usize> Plate<TERMS> {
    /// Creates a plate. `growth_max` is the largest |λ| d of a slice; it is below π, where the
    /// block that is inverted becomes singular.
    fn new(growth_max: f64) -> Self {
        Self {
            series: Series::default(),
            growth: Growth::default(),
            polynomials: Polynomials::default(),
            growth_max,
            thickness: 0.0,
            doublings_min: 1,
            prepared: None,
        }
    }

    /// Fills the plate for `medium`; `thickness` in m.
    #[inline(always)]
    fn fill<V: Vector>(&mut self, medium: &Medium, thickness: f64, doublings_min: u32) {
        self.series.fill(medium);
        self.growth.fill::<V>(medium);
        self.thickness = thickness;
        self.doublings_min = doublings_min;
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
        let mut doublings = self.doublings_min;
        let mut slice = if doublings == 0 { self.thickness } else { 0.5 * self.thickness };
        while growth * slice > self.growth_max && doublings < DOUBLINGS_MAX {
            doublings += 1;
            slice *= 0.5;
        }
        if self.prepared.is_some_and(|p| p.s == s && p.doublings == doublings) {
            return;
        }
        let stiffness = medium.stiffness / slice;
        let sigma = (s * s).scale(medium.density * slice / stiffness);
        self.series.at_frequency::<V>(sigma, &mut self.polynomials);
        self.prepared = Some(Prepared { s, doublings, slice, stiffness });
    }

    /// Returns -1/Y, Pa/m, at wavenumbers `k` (rad/m) of the plate on a foundation (Pa/m).
    ///
    /// [`Plate::prepare`] must have been called for these wavenumbers; otherwise the result is NaN.
    #[inline(always)]
    pub(crate) fn impedance<V: Vector, F: Foundation>(
        &self,
        k: &Lanes,
        foundation: &F,
        part: usize,
    ) -> ComplexVector<V> {
        let Some(prepared) = self.prepared else {
            let nan = V::splat(f64::NAN);
            return ComplexVector { re: nan, im: nan };
        };
        let k = V::load(k, part);
        let face = if F::IS_SOLID {
            self.scaled_face_in_stack(&prepared, k, foundation, part)
        } else {
            self.scaled_face(&prepared, k, foundation, part)
        };
        Lu::new(&face).last_pivot.scale(V::splat(prepared.stiffness))
    }

    /// Returns the impedance of the plate's upper face, Pa/m, under the same conditions.
    #[inline(always)]
    pub(crate) fn upper_face<V: Vector, F: Foundation>(
        &self,
        k: &Lanes,
        foundation: &F,
        part: usize,
    ) -> Matrix<V> {
        let Some(prepared) = self.prepared else {
            let nan = V::splat(f64::NAN);
            return [ComplexVector { re: nan, im: nan }; 9];
        };
        let mut face = self.scaled_face_in_stack(&prepared, V::load(k, part), foundation, part);
        for i in 0..9 {
            face[i] = face[i].scale(V::splat(prepared.stiffness));
        }
        face
    }

    /// Returns the impedance of the plate's upper face in units of the slice's stiffness.
    #[inline(always)]
    fn scaled_face<V: Vector, F: Foundation>(
        &self,
        prepared: &Prepared,
        k: V,
        foundation: &F,
        part: usize,
    ) -> Matrix<V> {
        let mut layer = slice::<TERMS, V>(&self.polynomials, k.mul(V::splat(prepared.slice)));
        for _ in 1..prepared.doublings {
            layer = layer.double();
        }
        layer.upper_face_of_two(foundation, part, V::splat(1.0 / prepared.stiffness))
    }

    /// The same for a plate that may be so thin that it needs no doubling. (The branch costs a thick plate
    /// registers.)
    #[inline(always)]
    fn scaled_face_in_stack<V: Vector, F: Foundation>(
        &self,
        prepared: &Prepared,
        k: V,
        foundation: &F,
        part: usize,
    ) -> Matrix<V> {
        if prepared.doublings > 0 {
            return self.scaled_face(prepared, k, foundation, part);
        }
        let layer = slice::<TERMS, V>(&self.polynomials, k.mul(V::splat(prepared.slice)));
        layer.upper_face(foundation, part, V::splat(1.0 / prepared.stiffness))
    }

    /// Returns the slice at wavenumbers `k` (rad/m); `None` without [`Plate::prepare`] for these
    /// wavenumbers.
    #[inline(always)]
    pub(crate) fn thinnest<V: Vector>(&self, k: V) -> Option<Slice<V>> {
        let prepared = self.prepared?;
        let layer = slice::<TERMS, V>(&self.polynomials, k.mul(V::splat(prepared.slice)));
        Some(Slice { layer, doublings: prepared.doublings, stiffness: prepared.stiffness })
    }
}

/// Returns the stiffness of a slice: with the blocks X and Y of the transfer matrix,
/// D = Y(-k)⁻¹, U = Y(k)⁻¹, A = (U X)ᵀ.
#[inline(always)]
fn slice<const TERMS: usize, V: Vector>(polynomials: &Polynomials, k: V) -> Layer<V> {
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

/// Kernel that computes the part common to all of a plate's admittances.
pub(crate) struct Fill<'a, const TERMS: usize> {
    pub(crate) medium: &'a Medium,
    /// Thickness, m.
    pub(crate) thickness: f64,
    /// Least number of doublings: one, or none of a plate in a stack.
    pub(crate) doublings_min: u32,
    pub(crate) plate: &'a mut Plate<TERMS>,
}

impl<const TERMS: usize> Kernel for Fill<'_, TERMS> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        self.plate.fill::<V>(self.medium, self.thickness, self.doublings_min);
    }
}
