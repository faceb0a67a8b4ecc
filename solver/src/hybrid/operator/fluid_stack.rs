//! Fluids on one side of the bone, one on the other.
//!
//! Each has nodes of its own on both faces. On a joint each computes the acceleration of the pressure as if
//! the other were not there; together, both inertias 1/(ρ c²) move under both flows.

use super::fluid::FluidLayer;
use super::sink::Sink;
use crate::hybrid::element::Element;
use crate::hybrid::mesh::FluidMesh;
use crate::lanes::Lanes;
use crate::vector::Vector;

/// The fluids by ascending x3: at least one.
#[derive(Debug, Clone)]
pub(super) struct FluidStack {
    layers: Vec<FluidLayer>,
    /// Share of the lower fluid in the inertia of each joint, upwards.
    shares: Vec<f64>,
}

impl FluidStack {
    /// Creates the stack of fluids by ascending x3.
    pub(super) fn new(fluids: &[FluidMesh], element: &Element, scale: f64) -> Self {
        let layer = |one: &FluidMesh| FluidLayer::new(&one.fluid, &one.mesh, element, scale);
        let layers: Vec<_> = fluids.iter().map(layer).collect();
        // A drive is in inverse proportion to the inertia of a face.
        let share = |pair: &[FluidLayer]| pair[1].drive / (pair[0].drive + pair[1].drive);
        let shares = layers.windows(2).map(share).collect();
        Self { layers, shares }
    }

    /// Returns the drive of the lowest face.
    pub(super) fn lower_drive(&self) -> f64 {
        self.layers.first().map_or(0.0, |lowest| lowest.drive)
    }

    /// Returns the drive of the highest face.
    pub(super) fn upper_drive(&self) -> f64 {
        self.layers.last().map_or(0.0, |highest| highest.drive)
    }

    /// Returns the number of nodes.
    pub(super) fn nodes(&self) -> usize {
        self.layers.iter().map(FluidLayer::nodes).sum()
    }

    /// Computes `out` from `p`, with `C` numbers per node; the first of them is at `offset` in a
    /// state. The sink does not receive the nodes at both ends.
    #[inline(always)]
    pub(super) fn apply<const C: usize, V: Vector, S: Sink>(
        &self,
        k: Lanes,
        p: &[Lanes],
        out: &mut [Lanes],
        offset: usize,
        sink: &mut S,
    ) {
        let mut start = 0;
        for (index, layer) in self.layers.iter().enumerate() {
            let end = start + layer.nodes() * C;
            let (p, own) = (&p[start..end], &mut out[start..end]);
            layer.apply::<C, V, S>(k, p, own, offset + start, sink);
            if index > 0 {
                let joint = &mut out[start - C..start + C];
                join::<C>(self.shares[index - 1], joint);
                sink.take::<V>(offset + start - C, joint);
            }
            start = end;
        }
    }
}

/// Replaces the accelerations of both nodes on a joint by that of the joint.
#[inline(always)]
fn join<const C: usize>(share: f64, joint: &mut [Lanes]) {
    for c in 0..C {
        let rest = Lanes::splat(1.0 - share) * joint[C + c];
        joint[c] = Lanes::splat(share).mul_add(joint[c], rest);
        joint[C + c] = joint[c];
    }
}
