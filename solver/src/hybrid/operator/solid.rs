//! The contribution of one sublayer of the bone to the operator.
//!
//! Displacements are taken along the principal axes of A33, where it is diagonal; masses are the
//! same along all axes. With W the weights of integration, E = W⁻¹ Dᵀ W / J, and at the nodes of
//! Gauss and Lobatto summation by parts is exact: Dᵀ W = B - W D, where B is -1 at the lower end, 1
//! at the upper one and 0 elsewhere. So
//!
//! ```text
//! u_tt = (-A33 E y + ik (A31 + A13) y - k² A11 u - ik A31 W⁻¹ B u / J) / ρ,
//! ```
//!
//! and the last term is the same, except for its sign, in two elements that share a node: it
//! remains only on the faces of the sublayer.

use osteon_common::case::Bone;

use super::axes::principal_axes;
use super::halves::{HALF, Halves};
use super::shared_node::average;
use super::sink::Sink;
use crate::hybrid::element::{Element, USUAL_NODES};
use crate::hybrid::mesh::LayerMesh;
use crate::lanes::Lanes;
use crate::medium::Matrix3;
use crate::vector::Vector;

/// Real numbers per node: real parts, then imaginary parts, of three displacements.
pub(in crate::hybrid) const SOLID: usize = 6;
pub(super) type ElementNode = [Lanes; SOLID];

/// One sublayer of the bone.
#[derive(Debug, Clone)]
pub(super) struct SolidLayer {
    pub(super) elements: usize,
    /// Nodes of one element.
    pub(super) count: usize,
    /// D / J.
    slope: Halves,
    /// -E D / J.
    bend: Halves,
    /// A33 / ρ, diagonal. This and the next two are halved, because the even and odd parts of their
    /// result are added and subtracted.
    a33: [f64; 3],
    /// (A31 + A13) / ρ.
    mixed: Matrix3,
    /// -A11 / ρ.
    a11: Matrix3,
    /// A31 / (ρ w J) at a face.
    edge: Matrix3,
    /// The principal axes, as columns.
    pub(super) axes: Matrix3,
    /// Mass of a node on a face, kg/m².
    pub(super) face_mass: f64,
    /// (Scaled) acceleration of a face per pressure there, along each principal axis.
    drive: [f64; 3],
}

/// The coefficients at eight wavenumbers, halved as above.
struct Coefficients {
    /// k (A31 + A13) / 2ρ.
    mixed: [[Lanes; 3]; 3],
    /// -k² A11 / 2ρ.
    a11: [[Lanes; 3]; 3],
}

/// Scratch memory of one element: even and odd parts of u, of its slope and of its bend.
#[derive(Debug, Clone)]
pub(in crate::hybrid) struct Scratch {
    even: [[ElementNode; 3]; HALF],
    odd: [[ElementNode; 3]; HALF],
}

impl Default for Scratch {
    fn default() -> Self {
        let zero = [[[Lanes::ZERO; SOLID]; 3]; HALF];
        Self { even: zero, odd: zero }
    }
}

impl SolidLayer {
    pub(super) fn new(bone: &Bone, mesh: &LayerMesh, element: &Element, scale: f64) -> Self {
        let half = 0.5 * mesh.size;
        let count = element.count();
        let axes = principal_axes(&block(bone, 2, 2));
        let along = |j: usize, l: usize| rotate_block(&axes, &block(bone, j, l));
        let (a33, a31, a11) = (along(2, 2), along(2, 0), along(0, 0));
        let at_face = 1.0 / (element.weights[0] * half);
        let each = |entry: &dyn Fn(usize, usize) -> f64| -> Matrix3 {
            std::array::from_fn(|i| std::array::from_fn(|m| entry(i, m)))
        };
        let stiffness = element.stiffness(half);
        Self {
            elements: mesh.elements,
            count,
            slope: Halves::new(count, |i, j| element.derivative[i][j] / half),
            bend: Halves::new(count, |i, j| stiffness[i][j]),
            a33: std::array::from_fn(|i| 0.5 * a33[i][i]),
            mixed: each(&|i, m| 0.5 * (a31[i][m] + a31[m][i])),
            a11: each(&|i, m| -0.5 * a11[i][m]),
            edge: each(&|i, m| at_face * a31[i][m]),
            axes,
            face_mass: bone.density / at_face,
            drive: axes[2].map(|axis| axis * scale * at_face / bone.density),
        }
    }

    /// Returns the number of real numbers (in each lane) of its state.
    pub(super) fn len(&self) -> usize {
        (self.elements * (self.count - 1) + 1) * SOLID
    }

    /// Computes `out` from `u`, whose first number is at `offset` in a state; no pressure acts. The
    /// nodes on the faces are not passed to `sink`.
    #[inline(always)]
    pub(super) fn apply<V: Vector, S: Sink>(
        &self,
        k: Lanes,
        u: &[Lanes],
        scratch: &mut Scratch,
        out: &mut [Lanes],
        offset: usize,
        sink: &mut S,
    ) {
        if self.count == USUAL_NODES {
            self.elements::<USUAL_NODES, V, S>(k, u, scratch, out, offset, sink);
        } else {
            self.elements::<0, V, S>(k, u, scratch, out, offset, sink);
        }
        let (u, _) = u.as_chunks::<SOLID>();
        let (out, _) = out.as_chunks_mut::<SOLID>();
        let top = u.len() - 1;
        self.edge(k, &u[0], &mut out[0]);
        self.edge(-k, &u[top], &mut out[top]);
    }

    /// Processes elements of `N` nodes; 0 stands for any number.
    #[inline(always)]
    fn elements<const N: usize, V: Vector, S: Sink>(
        &self,
        k: Lanes,
        u: &[Lanes],
        scratch: &mut Scratch,
        out: &mut [Lanes],
        offset: usize,
        sink: &mut S,
    ) {
        let n = if N == 0 { self.count } else { N };
        let (u, _) = u.as_chunks::<SOLID>();
        let (out, _) = out.as_chunks_mut::<SOLID>();
        let each =
            |matrix: &Matrix3, factor| matrix.map(|row| row.map(|a| Lanes::splat(a) * factor));
        let coefficients =
            Coefficients { mixed: each(&self.mixed, k), a11: each(&self.a11, k * k) };
        for e in 0..self.elements {
            let start = e * (n - 1);
            let u = &u[start..start + n];
            let out = &mut out[start..start + n];
            let shared = out[0];
            for part in 0..V::PARTS {
                for c in 0..SOLID {
                    self.derivatives::<N, V>(u, scratch, (c, part));
                }
                self.forces::<N, V>(&coefficients, scratch, out, part);
            }
            if e > 0 {
                average::<SOLID, V>(&shared, &mut out[0]);
            }
            let first = usize::from(e == 0);
            sink.take::<V>(offset + (start + first) * SOLID, out[first..n - 1].as_flattened());
        }
    }

    /// Computes even and odd parts of number `c` of every node, of its slope and its bend.
    #[inline(always)]
    fn derivatives<const N: usize, V: Vector>(
        &self,
        u: &[ElementNode],
        scratch: &mut Scratch,
        (c, part): (usize, usize),
    ) {
        let n = if N == 0 { self.count } else { N };
        let (evens, odds) = (n.div_ceil(2), n / 2);
        let zero = [V::splat(0.0); HALF];
        let (mut even, mut odd) = (zero, zero);
        for i in 0..evens {
            let (one, other) = (V::load(&u[i][c], part), V::load(&u[n - 1 - i][c], part));
            even[i] = one.add(other);
            odd[i] = one.sub(other);
            even[i].store(&mut scratch.even[i][0][c], part);
            odd[i].store(&mut scratch.odd[i][0][c], part);
        }
        let (mut even_slope, mut even_bend) = (zero, zero);
        let (mut odd_slope, mut odd_bend) = (zero, zero);
        for j in 0..evens {
            for i in 0..odds {
                odd_slope[i] = V::splat(self.slope.of_even[j][i]).mul_add(even[j], odd_slope[i]);
            }
            for i in 0..evens {
                even_bend[i] = V::splat(self.bend.of_even[j][i]).mul_add(even[j], even_bend[i]);
            }
        }
        for j in 0..odds {
            for i in 0..evens {
                even_slope[i] = V::splat(self.slope.of_odd[j][i]).mul_add(odd[j], even_slope[i]);
            }
            for i in 0..odds {
                odd_bend[i] = V::splat(self.bend.of_odd[j][i]).mul_add(odd[j], odd_bend[i]);
            }
        }
        for i in 0..evens {
            even_slope[i].store(&mut scratch.even[i][1][c], part);
            even_bend[i].store(&mut scratch.even[i][2][c], part);
        }
        for i in 0..odds {
            odd_slope[i].store(&mut scratch.odd[i][1][c], part);
            odd_bend[i].store(&mut scratch.odd[i][2][c], part);
        }
    }

    /// Computes accelerations of an element's nodes from even and odd parts.
    #[inline(always)]
    fn forces<const N: usize, V: Vector>(
        &self,
        coefficients: &Coefficients,
        scratch: &Scratch,
        out: &mut [ElementNode],
        part: usize,
    ) {
        let n = if N == 0 { self.count } else { N };
        for i in 0..n / 2 {
            let even = self.force::<V>(coefficients, &scratch.even[i], part);
            let odd = self.force::<V>(coefficients, &scratch.odd[i], part);
            for c in 0..SOLID {
                even[c].add(odd[c]).store(&mut out[i][c], part);
                even[c].sub(odd[c]).store(&mut out[n - 1 - i][c], part);
            }
        }
        if n % 2 == 1 {
            let even = self.force::<V>(coefficients, &scratch.even[n / 2], part);
            for c in 0..SOLID {
                even[c].store(&mut out[n / 2][c], part);
            }
        }
    }

    /// Returns half of A33 z + ik (A31 + A13) y - k² A11 u, divided by ρ, of `[u, y, z]`.
    #[inline(always)]
    fn force<V: Vector>(
        &self,
        coefficients: &Coefficients,
        [u, y, z]: &[ElementNode; 3],
        part: usize,
    ) -> [V; SOLID] {
        let at = |node: &ElementNode, c: usize| V::load(&node[c], part);
        let mut force = [V::splat(0.0); SOLID];
        for i in 0..3 {
            let a33 = V::splat(self.a33[i]);
            let (mut re, mut im) = (a33.mul(at(z, i)), a33.mul(at(z, i + 3)));
            for m in 0..3 {
                let mixed = V::load(&coefficients.mixed[i][m], part);
                re = mixed.mul_sub_from(at(y, m + 3), re);
                im = mixed.mul_add(at(y, m), im);
            }
            for m in 0..3 {
                let a11 = V::load(&coefficients.a11[i][m], part);
                re = a11.mul_add(at(u, m), re);
                im = a11.mul_add(at(u, m + 3), im);
            }
            (force[i], force[i + 3]) = (re, im);
        }
        force
    }

    /// Adds the effect of the pressure `p` (real and imaginary part) on a face, which it pushes
    /// upwards.
    #[inline(always)]
    pub(super) fn push(&self, face: &mut [Lanes], p: [Lanes; 2]) {
        for i in 0..3 {
            let drive = Lanes::splat(self.drive[i]);
            face[i] = drive.mul_add(p[0], face[i]);
            face[i + 3] = drive.mul_add(p[1], face[i + 3]);
        }
    }

    /// Returns the component across the layers, its real and imaginary part.
    #[inline(always)]
    pub(super) fn component_across(&self, face: &[Lanes]) -> [Lanes; 2] {
        let mut across = [Lanes::ZERO; 2];
        for i in 0..3 {
            let depth = Lanes::splat(self.axes[2][i]);
            across[0] = depth.mul_add(face[i], across[0]);
            across[1] = depth.mul_add(face[i + 3], across[1]);
        }
        across
    }

    /// Adds ik A31 u / (ρ w J), the boundary term of the summation by parts at the lower face; with
    /// -k, at the upper.
    #[inline(always)]
    fn edge(&self, k: Lanes, u: &ElementNode, out: &mut ElementNode) {
        for i in 0..3 {
            for m in 0..3 {
                let edge = k * Lanes::splat(self.edge[i][m]);
                out[i] = (-edge).mul_add(u[m + 3], out[i]);
                out[i + 3] = edge.mul_add(u[m], out[i + 3]);
            }
        }
    }
}

/// Returns A_jl / ρ, (m/s)².
fn block(bone: &Bone, j: usize, l: usize) -> Matrix3 {
    std::array::from_fn(|i| {
        std::array::from_fn(|m| bone.elasticity.component(i, j, m, l) / bone.density)
    })
}

/// Returns Qᵀ `a` Q, where the columns of Q are `axes`.
fn rotate_block(axes: &Matrix3, a: &Matrix3) -> Matrix3 {
    std::array::from_fn(|i| {
        std::array::from_fn(|m| {
            let mut sum = 0.0;
            for p in 0..3 {
                for q in 0..3 {
                    sum = (axes[p][i] * a[p][q]).mul_add(axes[q][m], sum);
                }
            }
            sum
        })
    })
}
