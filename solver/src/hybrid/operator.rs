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
//! (`solid.rs` says in which form it is computed), and a node that two elements of a layer share
//! takes the mean of the two. Between two sublayers of the bone masses and axes differ (`interface.rs`).
//! Displacements are multiplied by a stiffness per length, which makes
//! them comparable with pressures.

mod axes;
mod column;
mod fluid;
mod fluid_stack;
mod halves;
mod interface;
mod shared_node;
mod sink;
mod solid;
mod system;

use osteon_common::bone::{Sublayer, Sublayers};

pub(super) use self::column::FluidColumn;
use self::fluid_stack::FluidStack;
use self::interface::Interface;
pub(super) use self::sink::{Keep, Sink};
use self::solid::SolidLayer;
pub(super) use self::solid::{SOLID, Scratch};
pub(super) use self::system::System;
use super::mesh::{FluidMesh, Mesh};
use crate::lanes::Lanes;
use crate::vector::Vector;

/// Real numbers per node of fluid 2.
const MARROW: usize = 2;
/// A length by which displacements are scaled, m.
const LENGTH: f64 = 1e-3;

/// The operator A of one bone, loaded by a pressure on its upper face. A state consists of fluid 1, solid,
/// fluid 2, each by ascending x3. Each sublayer of any of them has nodes of its own on both faces.
///
/// `COUPLING` is the number of real numbers per node of fluid 1: its pressure is even in x1, so 1,
/// its real part, is sufficient; with 2 the imaginary part is computed, and comes out as zero.
#[derive(Debug, Clone)]
pub(super) struct Operator<const COUPLING: usize> {
    coupling: FluidStack,
    /// The lowest sublayer of the bone.
    lowest: SolidLayer,
    /// Those above it, upwards, each with what is below it.
    upper: Vec<(Interface, SolidLayer)>,
    marrow: FluidStack,
}

impl<const COUPLING: usize> Operator<COUPLING> {
    pub(super) fn new(bone: &Sublayers, mesh: &Mesh) -> Self {
        let element = &mesh.element;
        let modulus =
            |one: &FluidMesh| one.fluid.density * one.fluid.sound_speed * one.fluid.sound_speed;
        let scale = mesh.coupling.first().map_or(0.0, modulus) / LENGTH;
        let solid =
            |sublayer: &Sublayer, mesh| SolidLayer::new(&sublayer.solid, mesh, element, scale);
        // Sublayers are listed downwards.
        let mut lowest = solid(bone.uppermost(), &mesh.bone[0]);
        let mut upper = Vec::with_capacity(bone.lower().len());
        for (sublayer, mesh) in bone.lower().iter().zip(&mesh.bone[1..]) {
            let below = solid(sublayer, mesh);
            upper.push((Interface::new(&below, &lowest), std::mem::replace(&mut lowest, below)));
        }
        upper.reverse();
        Self {
            coupling: FluidStack::new(&mesh.coupling, element, scale),
            lowest,
            upper,
            marrow: FluidStack::new(&mesh.marrow, element, scale),
        }
    }

    /// Returns the number of real numbers of fluid 1, solid, fluid 2.
    pub(super) fn lengths(&self) -> (usize, usize, usize) {
        (
            self.coupling.nodes() * COUPLING,
            self.sublayers().map(|(_, sublayer)| sublayer.len()).sum(),
            self.marrow.nodes() * MARROW,
        )
    }

    /// Returns each sublayer with what is below it, upwards.
    #[inline(always)]
    fn sublayers(&self) -> impl Iterator<Item = (Option<&Interface>, &SolidLayer)> {
        let upper = self.upper.iter().map(|(interface, sublayer)| (Some(interface), sublayer));
        [(None, &self.lowest)].into_iter().chain(upper)
    }
}

impl<const COUPLING: usize> System for Operator<COUPLING> {
    fn len(&self) -> usize {
        let (coupling, solid, marrow) = self.lengths();
        coupling + solid + marrow
    }

    #[inline(always)]
    fn apply<V: Vector, S: Sink>(
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

        let (lowest, mut uppermost) = (&self.lowest, &self.lowest);
        let mut end = 0;
        for (below, sublayer) in self.sublayers() {
            let start = end;
            end += sublayer.len();
            let (u, out) = (&u[start..end], &mut u_out[start..end]);
            sublayer.apply::<V, S>(k, u, scratch, out, coupling + start, sink);
            if let Some(interface) = below {
                let faces = &mut u_out[start - SOLID..start + SOLID];
                let (lower, upper) = faces.split_at_mut(SOLID);
                interface.join(lower, upper);
                sink.take::<V>(coupling + start - SOLID, faces);
            }
            uppermost = sublayer;
        }
        let top = solid - SOLID;
        let face = marrow - MARROW;
        let on_top = [p1[0] + load, if COUPLING == 2 { p1[1] } else { Lanes::ZERO }];
        uppermost.push(&mut u_out[top..], on_top.map(|p| -p));
        lowest.push(&mut u_out[..SOLID], [p2[face], p2[face + 1]]);
        sink.take::<V>(coupling, &u_out[..SOLID]);
        sink.take::<V>(coupling + top, &u_out[top..]);

        self.coupling.apply::<COUPLING, V, S>(k, p1, p1_out, 0, sink);
        let drive = Lanes::splat(self.coupling.lower_drive());
        let moved = uppermost.component_across(&u_out[top..]);
        for c in 0..COUPLING {
            p1_out[c] = drive.mul_add(moved[c], p1_out[c]);
        }
        p1_out[coupling - COUPLING..].fill(Lanes::ZERO);
        sink.take::<V>(0, &p1_out[..COUPLING]);

        self.marrow.apply::<MARROW, V, S>(k, p2, p2_out, coupling + solid, sink);
        let drive = Lanes::splat(-self.marrow.upper_drive());
        let moved = lowest.component_across(&u_out[..SOLID]);
        for c in 0..MARROW {
            p2_out[face + c] = drive.mul_add(moved[c], p2_out[face + c]);
        }
        p2_out[..MARROW].fill(Lanes::ZERO);
        sink.take::<V>(coupling + solid + face, &p2_out[face..]);
    }
}

#[cfg(test)]
mod tests;
