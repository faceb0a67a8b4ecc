//! The dynamic stiffness of a bone at a complex wavenumber.
//!
//! `[t_top; t_bottom] = K [u_top; u_bottom]` as in [`crate::exact::layer`], for fields ∝ exp(st + ikx1) with
//! any s and k; the determinant below is the same for -k. With Y the block of the transfer matrix from the
//! tractions at the bottom to the displacements on top, det(K) det(Y) is an analytic function of k without
//! poles: det(Y) is zero where a wave fits between clamped faces, where K is infinite. It is multiplied up
//! while layers are put together.

use super::dense::{
    ComplexMatrix3, Scaled, UNIT, ZERO, determinant, inverse, minus_product, product,
};
use crate::complex::Complex;
use crate::isa::Kernel;
use crate::media::{Media, MediumLayer};
use crate::medium::Medium;
use crate::vector::Vector;

/// Number of terms of a slice's exponential series; with [`THICKEST`], the rest is below 1e-17.
const TERMS: usize = 24;
/// Largest growth or phase of waves across a slice.
pub(super) const THICKEST: f64 = 1.0;
/// Maximum number of doublings.
const DOUBLINGS_MAX: u32 = 40;

/// Stiffness of a layer between its faces, Pa/m.
struct LayerStiffness {
    top: ComplexMatrix3,
    /// Tractions on top by displacements of the bottom, and the opposite.
    down: ComplexMatrix3,
    up: ComplexMatrix3,
    bottom: ComplexMatrix3,
    /// det(Y).
    clamped: Scaled,
}

impl LayerStiffness {
    /// Puts this layer on another.
    #[inline(always)]
    fn on(&self, lower: &Self, components: &[usize]) -> Self {
        let mut joint = self.bottom;
        for i in 0..3 {
            for j in 0..3 {
                joint[i][j] = joint[i][j] + lower.top[i][j];
            }
        }
        let inverse = inverse(&joint);
        // Minus the displacements of the joint by those of the outer faces.
        let by_top = product(&inverse, &self.up);
        let by_bottom = product(&inverse, &lower.down);
        Self {
            top: minus_product(&self.top, &self.down, &by_top),
            down: minus_product(&ZERO, &self.down, &by_bottom),
            up: minus_product(&ZERO, &lower.up, &by_top),
            bottom: minus_product(&lower.bottom, &lower.up, &by_bottom),
            clamped: self.clamped.times(lower.clamped).times(determinant(&joint, components)),
        }
    }
}

/// Kernel that computes det(K + loads) det(Y) of a bone for some components of the displacement, which no
/// others are coupled to: zero where it has a wave of these.
pub(super) struct WaveDeterminant<'a> {
    pub(super) media: &'a Media,
    pub(super) components: &'a [usize],
    /// Complex frequency, 1/s.
    pub(super) s: Complex,
    /// Wavenumber, rad/m.
    pub(super) k: Complex,
    /// Stiffness of the fluids at the upper and at the lower face against displacements across it, Pa/m.
    pub(super) loads: [Complex; 2],
}

impl Kernel for WaveDeterminant<'_> {
    type Output = Scaled;

    #[inline(always)]
    fn run<V: Vector>(self) -> Scaled {
        wave_determinant(&self)
    }
}

/// The last joint is a part of the determinant and not eliminated before: where the whole bone has a wave between
/// clamped faces, its stiffness is singular. A wave of horizontal shear with free faces has the same wavenumber as
/// one with clamped faces.
#[inline(always)]
fn wave_determinant(asked: &WaveDeterminant<'_>) -> Scaled {
    let WaveDeterminant { media, components, s, k, loads } = *asked;
    let mut upper = layer_stiffness(&media.uppermost, components, s, k);
    let Some((lowest, between)) = media.lower.split_last() else {
        return determinant(
            &faces(&upper, loads),
            &rows_of::<6>(components)[..2 * components.len()],
        )
        .times(upper.clamped);
    };
    for layer in between {
        upper = upper.on(&layer_stiffness(layer, components, s, k), components);
    }
    let lower = layer_stiffness(lowest, components, s, k);
    let mut all = [[Complex::default(); 9]; 9];
    let [above, below] = [
        faces(&upper, [loads[0], Complex::default()]),
        faces(&lower, [Complex::default(), loads[1]]),
    ];
    for i in 0..6 {
        for j in 0..6 {
            all[i][j] = all[i][j] + above[i][j];
            all[i + 3][j + 3] = all[i + 3][j + 3] + below[i][j];
        }
    }
    determinant(&all, &rows_of::<9>(components)[..3 * components.len()])
        .times(upper.clamped)
        .times(lower.clamped)
}

/// Returns the stiffness of both faces with these loads.
#[inline(always)]
fn faces(layer: &LayerStiffness, loads: [Complex; 2]) -> [[Complex; 6]; 6] {
    let mut all = [[Complex::default(); 6]; 6];
    for i in 0..3 {
        for j in 0..3 {
            all[i][j] = layer.top[i][j];
            all[i][j + 3] = layer.down[i][j];
            all[i + 3][j] = layer.up[i][j];
            all[i + 3][j + 3] = layer.bottom[i][j];
        }
    }
    all[2][2] = all[2][2] + loads[0];
    all[5][5] = all[5][5] + loads[1];
    all
}

/// Returns the rows of these components in one place after the other, at the start.
#[inline(always)]
fn rows_of<const N: usize>(components: &[usize]) -> [usize; N] {
    let mut rows = [0; N];
    for place in 0..N / 3 {
        for (index, &component) in components.iter().enumerate() {
            rows[place * components.len() + index] = 3 * place + component;
        }
    }
    rows
}

#[inline(always)]
fn layer_stiffness(
    layer: &MediumLayer,
    components: &[usize],
    s: Complex,
    k: Complex,
) -> LayerStiffness {
    let MediumLayer { medium, thickness } = layer;
    let growth = growth(medium, s, k);
    let (mut slice, mut doublings) = (*thickness, 0);
    while growth * slice > THICKEST && doublings < DOUBLINGS_MAX {
        slice *= 0.5;
        doublings += 1;
    }
    let mut stiffness = slice_stiffness(medium, components, s, k, slice);
    for _ in 0..doublings {
        stiffness = stiffness.on(&stiffness, components);
    }
    stiffness
}

/// Returns a bound of the growth or phase of waves for each metre across a medium, rad/m.
#[inline(always)]
pub(super) fn growth(medium: &Medium, s: Complex, k: Complex) -> f64 {
    let coupling = medium.coupling.iter().flatten().fold(0.0_f64, |max, p| max.max(p.abs()));
    (1.0 + coupling) * k.abs() + s.abs() / medium.slowest_across()
}

/// Returns the stiffness of a thin slice from its transfer matrix [X, Y; W, V], from the bottom to the top:
/// K = [V Y⁻¹, W - V Y⁻¹ X; -Y⁻¹, Y⁻¹ X].
#[inline(always)]
fn slice_stiffness(
    medium: &Medium,
    components: &[usize],
    s: Complex,
    k: Complex,
    slice: f64,
) -> LayerStiffness {
    let unit = medium.stiffness / slice;
    let [x, y, w, v] = transfer(medium, s, k, slice);
    let inverse = inverse(&y);
    let top = product(&v, &inverse);
    let mut result = LayerStiffness {
        top,
        down: minus_product(&w, &top, &x),
        up: minus_product(&ZERO, &inverse, &UNIT),
        bottom: product(&inverse, &x),
        clamped: determinant(&y, components),
    };
    for block in [&mut result.top, &mut result.down, &mut result.up, &mut result.bottom] {
        for entry in block.iter_mut().flatten() {
            *entry = entry.scale(unit);
        }
    }
    for _ in components {
        result.clamped = result.clamped.times(Scaled::new(Complex::new(1.0 / unit, 0.0)));
    }
    result
}

/// Returns the blocks X, Y, W and V of exp(M d) by its series; tractions are in units of stiffness / d.
#[inline(always)]
pub(super) fn transfer(medium: &Medium, s: Complex, k: Complex, slice: f64) -> [ComplexMatrix3; 4] {
    let kappa = Complex::new(k.im, -k.re).scale(slice);
    let sigma = (s * s).scale(medium.density * slice * slice / medium.stiffness);
    let square = kappa * kappa;
    let mut system = [[Complex::default(); 6]; 6];
    for i in 0..3 {
        for j in 0..3 {
            let inertia = if i == j { sigma } else { Complex::default() };
            system[i][j] = kappa.scale(medium.coupling[i][j]);
            system[i][j + 3] = Complex::new(medium.compliance[i][j], 0.0);
            system[i + 3][j] = inertia - square.scale(medium.membrane[i][j]);
            system[i + 3][j + 3] = kappa.scale(medium.coupling[j][i]);
        }
    }
    let mut term = [[Complex::default(); 6]; 6];
    for i in 0..6 {
        term[i][i] = Complex::new(1.0, 0.0);
    }
    let mut sum = term;
    for n in 1..=TERMS {
        let mut next = [[Complex::default(); 6]; 6];
        for i in 0..6 {
            for m in 0..6 {
                let factor = term[i][m].scale(1.0 / n as f64);
                for j in 0..6 {
                    next[i][j] = next[i][j] + factor * system[m][j];
                }
            }
        }
        term = next;
        for i in 0..6 {
            for j in 0..6 {
                sum[i][j] = sum[i][j] + term[i][j];
            }
        }
    }
    let block = |row: usize, column: usize| {
        let mut result = [[Complex::default(); 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                result[i][j] = sum[3 * row + i][3 * column + j];
            }
        }
        result
    };
    [block(0, 0), block(0, 1), block(1, 0), block(1, 1)]
}
