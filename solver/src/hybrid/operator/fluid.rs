//! Contribution of one fluid to the operator.

use osteon_common::fluid_sublayers::FluidSublayer;

use super::halves::{HALF, Halves};
use super::shared_node::average;
use super::sink::Sink;
use crate::hybrid::element::{Element, USUAL_NODES};
use crate::hybrid::mesh::LayerMesh;
use crate::lanes::Lanes;
use crate::vector::Vector;

/// -c² (E D / J + k²) in every element of a fluid.
#[derive(Debug, Clone)]
pub(super) struct FluidLayer {
    elements: usize,
    /// Nodes of one element.
    count: usize,
    /// Half of -c² E D / J, as the even and odd part of its result are added and subtracted.
    stiffness: Halves,
    /// Half of -c², (m/s)².
    diagonal: f64,
    /// p_tt at the interface per (scaled) u3_tt there.
    pub(super) drive: f64,
}

impl FluidLayer {
    pub(super) fn new(
        fluid: &FluidSublayer,
        mesh: &LayerMesh,
        element: &Element,
        scale: f64,
    ) -> Self {
        let half = 0.5 * mesh.size;
        let square = fluid.sound_speed * fluid.sound_speed;
        let stiffness = element.stiffness(half);
        Self {
            elements: mesh.elements,
            count: element.count(),
            stiffness: Halves::new(element.count(), |i, j| 0.5 * square * stiffness[i][j]),
            diagonal: -0.5 * square,
            drive: fluid.density * square / (element.weights[0] * half * scale),
        }
    }

    /// Returns the number of nodes.
    pub(super) fn nodes(&self) -> usize {
        self.elements * (self.count - 1) + 1
    }

    /// Computes `out` from `p`, with `C` numbers per node; the first of them is at `offset` in a
    /// state.
    #[inline(always)]
    pub(super) fn apply<const C: usize, V: Vector, S: Sink>(
        &self,
        k: Lanes,
        p: &[Lanes],
        out: &mut [Lanes],
        offset: usize,
        sink: &mut S,
    ) {
        if self.count == USUAL_NODES {
            self.elements::<C, USUAL_NODES, V, S>(k, p, out, offset, sink);
        } else {
            self.elements::<C, 0, V, S>(k, p, out, offset, sink);
        }
    }

    /// Processes elements of `N` nodes; 0 stands for any number.
    #[inline(always)]
    fn elements<const C: usize, const N: usize, V: Vector, S: Sink>(
        &self,
        k: Lanes,
        p: &[Lanes],
        out: &mut [Lanes],
        offset: usize,
        sink: &mut S,
    ) {
        let n = if N == 0 { self.count } else { N };
        let (p, _) = p.as_chunks::<C>();
        let (out, _) = out.as_chunks_mut::<C>();
        let diagonal = k * k * Lanes::splat(self.diagonal);
        for e in 0..self.elements {
            let start = e * (n - 1);
            let p = &p[start..start + n];
            let out = &mut out[start..start + n];
            let shared = out[0];
            for part in 0..V::PARTS {
                for c in 0..C {
                    self.element::<C, N, V>(V::load(&diagonal, part), p, out, (c, part));
                }
            }
            if e > 0 {
                average::<C, V>(&shared, &mut out[0]);
            }
            let first = usize::from(e == 0);
            sink.take::<V>(offset + (start + first) * C, out[first..n - 1].as_flattened());
        }
    }

    /// Processes one element, number `c` of every node.
    #[inline(always)]
    fn element<const C: usize, const N: usize, V: Vector>(
        &self,
        diagonal: V,
        p: &[[Lanes; C]],
        out: &mut [[Lanes; C]],
        (c, part): (usize, usize),
    ) {
        let n = if N == 0 { self.count } else { N };
        let (evens, odds) = (n.div_ceil(2), n / 2);
        let (mut even, mut odd) = ([V::splat(0.0); HALF], [V::splat(0.0); HALF]);
        let (mut even_out, mut odd_out) = (even, odd);
        for i in 0..evens {
            let (one, other) = (V::load(&p[i][c], part), V::load(&p[n - 1 - i][c], part));
            even[i] = one.add(other);
            odd[i] = one.sub(other);
            even_out[i] = diagonal.mul(even[i]);
            odd_out[i] = diagonal.mul(odd[i]);
        }
        for j in 0..evens {
            for i in 0..evens {
                even_out[i] = V::splat(self.stiffness.of_even[j][i]).mul_add(even[j], even_out[i]);
            }
        }
        for j in 0..odds {
            for i in 0..odds {
                odd_out[i] = V::splat(self.stiffness.of_odd[j][i]).mul_add(odd[j], odd_out[i]);
            }
        }
        for i in 0..odds {
            even_out[i].add(odd_out[i]).store(&mut out[i][c], part);
            even_out[i].sub(odd_out[i]).store(&mut out[n - 1 - i][c], part);
        }
        if evens > odds {
            even_out[odds].store(&mut out[odds][c], part);
        }
    }
}
