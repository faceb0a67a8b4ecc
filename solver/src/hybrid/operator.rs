//! The semi-discrete system x_tt = A x + load: spectral elements in depth, eight wavenumbers at a
//! time.
//!
//! Weak form, for one wavenumber k along x1, (A_jl)_im = c_ijml, test functions q and v:
//!
//! ```text
//! fluid 1: ∫ p1_tt q̄ / (ρ1 c1²) + (∂3 p1 ∂3 q̄ + k² p1 q̄) / ρ1 - u3_tt(0) q̄(0)            = 0
//! solid:   ∫ ρ u_tt·v̄ + ∂3v̄·(A33 ∂3u + ik A31 u) + v̄·(k² A11 u - ik A13 ∂3u)
//!                                           + (p1(0) + load) v̄3(0) - p2(-h) v̄3(-h)       = 0
//! fluid 2: ∫ p2_tt q̄ / (ρ2 c2²) + (∂3 p2 ∂3 q̄ + k² p2 q̄) / ρ2 + u3_tt(-h) q̄(-h)         = 0
//! ```
//!
//! Integration at the nodes makes the masses diagonal: first u_tt, then, with it, p_tt; nothing
//! is solved. Inside an element of half length J, row i divided by its mass is
//!
//! ```text
//! u_tt = -(E τ + k² A11 u - ik A13 y) / ρ,   y = D u / J,   τ = A33 y + ik A31 u,   E_ij = D_ji w_j / (w_i J)
//! ```
//!
//! and a node that two elements of a layer share takes the mean of the two. Displacements are
//! multiplied by a stiffness per length, which makes them comparable with pressures.

#![expect(
    clippy::manual_memcpy,
    reason = "a loop of constant length stays in registers, a copied slice goes through memory"
)]

use osteon_common::case::{Bone, Setup};
use osteon_common::layers::Fluid;

use super::element::Element;
use super::mesh::{LayerMesh, Mesh};
use crate::lanes::Lanes;

/// Real numbers per node of the solid: real and imaginary parts of three displacements.
pub(super) const SOLID: usize = 6;
/// Real numbers per node of fluid 2.
const MARROW: usize = 2;
/// Place of u3's real part in a node of the solid.
const U3: usize = 2;
/// The same of its imaginary part.
const U3_IM: usize = 5;
/// A node of the solid.
type Node = [Lanes; SOLID];
/// Rows of a solid element's matrix that are computed at a time.
const SOLID_ROWS: usize = 3;
/// The same of a fluid element.
const FLUID_ROWS: usize = 9;
/// A length by which displacements are scaled, m.
const LENGTH: f64 = 1e-3;

/// The operator A of one bone. A state is fluid 1, solid, fluid 2, each by ascending x3.
///
/// `COUPLING` numbers per node of fluid 1: its pressure is even in x1, so 1, its real part, is
/// enough; with 2 the imaginary part is computed, and comes out as zero.
#[derive(Debug, Clone)]
pub(super) struct Operator<const COUPLING: usize> {
    coupling: FluidLayer,
    solid: SolidLayer,
    marrow: FluidLayer,
}

#[derive(Debug, Clone)]
struct FluidLayer {
    elements: usize,
    /// Nodes of one element.
    count: usize,
    /// -c² E D / J: entry (i, j) at `[j * count + i]`.
    stiffness: Vec<f64>,
    /// -c², (m/s)².
    diagonal: f64,
    /// p_tt at the interface per (scaled) u3_tt there.
    drive: f64,
}

#[derive(Debug, Clone)]
struct SolidLayer {
    elements: usize,
    count: usize,
    /// D / J: entry (i, j) at `[j * count + i]`.
    derivative: Vec<f64>,
    /// -E in the same order.
    divergence: Vec<f64>,
    /// A33 / ρ, A31 / ρ, A11 / ρ by rows.
    a33: [[f64; 3]; 3],
    a31: [[f64; 3]; 3],
    a11: [[f64; 3]; 3],
    /// (Scaled) u3_tt at a face per pressure there.
    drive: f64,
}

/// Scratch memory of one element.
#[derive(Debug, Clone, Default)]
pub(super) struct Scratch {
    slope: Vec<Node>,
    traction: Vec<Node>,
    body: Vec<Node>,
}

impl Scratch {
    /// Makes room for elements of `count` nodes.
    pub(super) fn resize(&mut self, count: usize) {
        for nodes in [&mut self.slope, &mut self.traction, &mut self.body] {
            nodes.resize(count, [Lanes::ZERO; SOLID]);
        }
    }
}

impl<const COUPLING: usize> Operator<COUPLING> {
    pub(super) fn new(setup: &Setup, bone: &Bone, mesh: &Mesh) -> Self {
        let element = &mesh.element;
        let scale = setup.layers.coupling.density
            * setup.layers.coupling.sound_speed
            * setup.layers.coupling.sound_speed
            / LENGTH;
        Self {
            coupling: FluidLayer::new(&setup.layers.coupling, &mesh.coupling, element, scale),
            solid: SolidLayer::new(bone, &mesh.bone, element, scale),
            marrow: FluidLayer::new(&setup.layers.marrow, &mesh.marrow, element, scale),
        }
    }

    /// Nodes of one element.
    pub(super) fn element_nodes(&self) -> usize {
        self.solid.count
    }

    /// Real numbers (in each lane) of a state.
    pub(super) fn len(&self) -> usize {
        let (coupling, solid, marrow) = self.lengths();
        coupling + solid + marrow
    }

    /// Real numbers of fluid 1, solid, fluid 2.
    pub(super) fn lengths(&self) -> (usize, usize, usize) {
        let nodes = |elements: usize, count: usize| elements * (count - 1) + 1;
        (
            nodes(self.coupling.elements, self.coupling.count) * COUPLING,
            nodes(self.solid.elements, self.solid.count) * SOLID,
            nodes(self.marrow.elements, self.marrow.count) * MARROW,
        )
    }

    /// `out` = A `x` + the effect of the pressure `load` on the upper face; `sink` sees every
    /// number of it once, as soon as it is final.
    #[inline(always)]
    pub(super) fn apply<S: Sink>(
        &self,
        k: Lanes,
        x: &[Lanes],
        load: Lanes,
        scratch: &mut Scratch,
        out: &mut [Lanes],
        sink: &mut S,
    ) {
        let (coupling, solid, marrow) = self.lengths();
        let (p1, rest) = x.split_at(coupling);
        let (u, p2) = rest.split_at(solid);
        let (p1_out, rest) = out.split_at_mut(coupling);
        let (u_out, p2_out) = rest.split_at_mut(solid);

        self.solid.apply(k, u, scratch, u_out, coupling, sink);
        let up = Lanes::splat(self.solid.drive);
        let down = -up;
        let top = solid - SOLID;
        u_out[top + U3] = down.mul_add(p1[0] + load, u_out[top + U3]);
        if COUPLING == 2 {
            u_out[top + U3_IM] = down.mul_add(p1[1], u_out[top + U3_IM]);
        }
        let face = marrow - MARROW;
        u_out[U3] = up.mul_add(p2[face], u_out[U3]);
        u_out[U3_IM] = up.mul_add(p2[face + 1], u_out[U3_IM]);
        sink.take(coupling, &u_out[..SOLID]);
        sink.take(coupling + top, &u_out[top..]);

        self.coupling.apply::<COUPLING, S>(k, p1, p1_out, 0, sink);
        let drive = Lanes::splat(self.coupling.drive);
        p1_out[0] = drive.mul_add(u_out[top + U3], p1_out[0]);
        if COUPLING == 2 {
            p1_out[1] = drive.mul_add(u_out[top + U3_IM], p1_out[1]);
        }
        let free = coupling - COUPLING;
        p1_out[free..].fill(Lanes::ZERO);
        sink.take(0, &p1_out[..COUPLING]);

        self.marrow.apply::<MARROW, S>(k, p2, p2_out, coupling + solid, sink);
        let drive = Lanes::splat(-self.marrow.drive);
        p2_out[face] = drive.mul_add(u_out[U3], p2_out[face]);
        p2_out[face + 1] = drive.mul_add(u_out[U3_IM], p2_out[face + 1]);
        p2_out[..MARROW].fill(Lanes::ZERO);
        sink.take(coupling + solid + face, &p2_out[face..]);
    }
}

/// What is done with A x while it is still in the fast memory.
///
/// The free ends of the fluids, where p = 0 for ever, are not shown.
pub(super) trait Sink {
    /// Numbers `start` … of A x are `values`. To be `#[inline(always)]`.
    fn take(&mut self, start: usize, values: &[Lanes]);
}

/// Nothing is done.
pub(super) struct Keep;

impl Sink for Keep {
    #[inline(always)]
    fn take(&mut self, _: usize, _: &[Lanes]) {}
}

impl FluidLayer {
    fn new(fluid: &Fluid, mesh: &LayerMesh, element: &Element, scale: f64) -> Self {
        let half = 0.5 * mesh.size;
        let count = element.count();
        let square = fluid.sound_speed * fluid.sound_speed;
        let divergence = divergence(element, half);
        let mut stiffness = vec![0.0; count * count];
        for j in 0..count {
            for i in 0..count {
                let sum = (0..count).fold(0.0, |sum, m| {
                    divergence[m * count + i].mul_add(element.derivative[m][j] / half, sum)
                });
                stiffness[j * count + i] = square * sum;
            }
        }
        Self {
            elements: mesh.elements,
            count,
            stiffness,
            diagonal: -square,
            drive: fluid.density * square / (element.weights[0] * half * scale),
        }
    }

    #[inline(always)]
    fn apply<const C: usize, S: Sink>(
        &self,
        k: Lanes,
        p: &[Lanes],
        out: &mut [Lanes],
        offset: usize,
        sink: &mut S,
    ) {
        let n = self.count;
        let (p, _) = p.as_chunks::<C>();
        let (out, _) = out.as_chunks_mut::<C>();
        let diagonal = k * k * Lanes::splat(self.diagonal);
        for e in 0..self.elements {
            let start = e * (n - 1);
            let p = &p[start..start + n];
            let out = &mut out[start..start + n];
            let shared = out[0];
            let mut i = 0;
            while i + FLUID_ROWS <= n {
                fluid_rows::<FLUID_ROWS, C>(&self.stiffness, i, diagonal, p, out);
                i += FLUID_ROWS;
            }
            while i < n {
                fluid_rows::<1, C>(&self.stiffness, i, diagonal, p, out);
                i += 1;
            }
            if e > 0 {
                average(&shared, &mut out[0]);
            }
            let first = usize::from(e == 0);
            sink.take(offset + (start + first) * C, out[first..n - 1].as_flattened());
        }
    }
}

impl SolidLayer {
    fn new(bone: &Bone, mesh: &LayerMesh, element: &Element, scale: f64) -> Self {
        let half = 0.5 * mesh.size;
        let count = element.count();
        let mut derivative = vec![0.0; count * count];
        for j in 0..count {
            for i in 0..count {
                derivative[j * count + i] = element.derivative[i][j] / half;
            }
        }
        Self {
            elements: mesh.elements,
            count,
            derivative,
            divergence: divergence(element, half),
            a33: block(bone, 2, 2),
            a31: block(bone, 2, 0),
            a11: block(bone, 0, 0),
            drive: scale / (bone.density * element.weights[0] * half),
        }
    }

    #[inline(always)]
    fn apply<S: Sink>(
        &self,
        k: Lanes,
        u: &[Lanes],
        scratch: &mut Scratch,
        out: &mut [Lanes],
        offset: usize,
        sink: &mut S,
    ) {
        let n = self.count;
        let (u, _) = u.as_chunks::<SOLID>();
        let (out, _) = out.as_chunks_mut::<SOLID>();
        let slope = &mut scratch.slope[..n];
        let traction = &mut scratch.traction[..n];
        let body = &mut scratch.body[..n];
        for e in 0..self.elements {
            let start = e * (n - 1);
            let u = &u[start..start + n];
            let out = &mut out[start..start + n];
            let shared = out[0];
            product::<false>(&self.derivative, u, u, slope);
            for i in 0..n {
                self.node(k, &u[i], &slope[i], &mut traction[i], &mut body[i]);
            }
            product::<true>(&self.divergence, traction, body, out);
            if e > 0 {
                average(&shared, &mut out[0]);
            }
            let first = usize::from(e == 0);
            sink.take(offset + (start + first) * SOLID, out[first..n - 1].as_flattened());
        }
    }

    /// From u and its slope y at a node: τ, and the body force ik A13 y - k² A11 u.
    #[inline(always)]
    fn node(&self, k: Lanes, u: &Node, y: &Node, traction: &mut Node, body: &mut Node) {
        // k u and so on without the factor i, which swaps real and imaginary parts.
        let ku = [k * u[0], k * u[1], k * u[2], k * u[3], k * u[4], k * u[5]];
        for i in 0..3 {
            let (mut re, mut im) = (Lanes::ZERO, Lanes::ZERO);
            let (mut body_re, mut body_im) = (Lanes::ZERO, Lanes::ZERO);
            for m in 0..3 {
                let a33 = Lanes::splat(self.a33[i][m]);
                let a31 = Lanes::splat(self.a31[i][m]);
                let a13 = Lanes::splat(self.a31[m][i]);
                let a11 = Lanes::splat(self.a11[i][m]);
                re = a33.mul_add(y[m], (-a31).mul_add(ku[m + 3], re));
                im = a33.mul_add(y[m + 3], a31.mul_add(ku[m], im));
                body_re = a13.mul_add(y[m + 3], a11.mul_add(ku[m], body_re));
                body_im = a13.mul_add(y[m], (-a11).mul_add(ku[m + 3], body_im));
            }
            traction[i] = re;
            traction[i + 3] = im;
            body[i] = -(k * body_re);
            body[i + 3] = k * body_im;
        }
    }
}

/// A_jl / ρ, (m/s)².
fn block(bone: &Bone, j: usize, l: usize) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| {
        std::array::from_fn(|m| bone.elasticity.component(i, j, m, l) / bone.density)
    })
}

/// -E of an element of half length `half` (m): entry (i, j) at `[j * count + i]`.
fn divergence(element: &Element, half: f64) -> Vec<f64> {
    let count = element.count();
    let mut divergence = vec![0.0; count * count];
    for j in 0..count {
        for i in 0..count {
            divergence[j * count + i] =
                -(element.derivative[j][i] * element.weights[j] / (element.weights[i] * half));
        }
    }
    divergence
}

/// The mean of what two elements say of their shared node.
#[inline(always)]
fn average<const C: usize>(below: &[Lanes; C], node: &mut [Lanes; C]) {
    let half = Lanes::splat(0.5);
    for c in 0..C {
        node[c] = half * (node[c] + below[c]);
    }
}

/// `out` = matrix · `x` (+ `add` if `ADD`).
#[inline(always)]
fn product<const ADD: bool>(matrix: &[f64], x: &[Node], add: &[Node], out: &mut [Node]) {
    let mut i = 0;
    while i + SOLID_ROWS <= x.len() {
        solid_rows::<ADD, SOLID_ROWS>(matrix, i, x, add, out);
        i += SOLID_ROWS;
    }
    while i < x.len() {
        solid_rows::<ADD, 1>(matrix, i, x, add, out);
        i += 1;
    }
}

/// Rows `i` … `i + R` of [`product`]: all sums stay in registers.
#[inline(always)]
fn solid_rows<const ADD: bool, const R: usize>(
    matrix: &[f64],
    i: usize,
    x: &[Node],
    add: &[Node],
    out: &mut [Node],
) {
    let n = x.len();
    let mut sums = [[Lanes::ZERO; SOLID]; R];
    if ADD {
        for r in 0..R {
            sums[r] = add[i + r];
        }
    }
    for j in 0..n {
        let column = &matrix[j * n + i..j * n + i + R];
        let node = &x[j];
        for r in 0..R {
            let factor = Lanes::splat(column[r]);
            for c in 0..SOLID {
                sums[r][c] = factor.mul_add(node[c], sums[r][c]);
            }
        }
    }
    for r in 0..R {
        out[i + r] = sums[r];
    }
}

/// Rows `i` … `i + R` of a fluid's element: stiffness · `p` + diagonal `p`.
#[inline(always)]
fn fluid_rows<const R: usize, const C: usize>(
    matrix: &[f64],
    i: usize,
    diagonal: Lanes,
    p: &[[Lanes; C]],
    out: &mut [[Lanes; C]],
) {
    let n = p.len();
    let mut sums = [[Lanes::ZERO; C]; R];
    for r in 0..R {
        for c in 0..C {
            sums[r][c] = diagonal * p[i + r][c];
        }
    }
    for j in 0..n {
        let column = &matrix[j * n + i..j * n + i + R];
        let node = &p[j];
        for r in 0..R {
            let factor = Lanes::splat(column[r]);
            for c in 0..C {
                sums[r][c] = factor.mul_add(node[c], sums[r][c]);
            }
        }
    }
    for r in 0..R {
        out[i + r] = sums[r];
    }
}

#[cfg(test)]
mod tests;
