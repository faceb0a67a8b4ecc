//! The fluids above a rigid bone, driven on their lowest face.

use super::fluid_stack::FluidStack;
use super::sink::Sink;
use super::solid::Scratch;
use super::system::System;
use crate::hybrid::element::Element;
use crate::hybrid::mesh::FluidMesh;
use crate::lanes::Lanes;
use crate::vector::Vector;

/// The operator of the fluids above a rigid bone; a load is a force on the lowest
/// face of the fluids, which lies on the bone.
#[derive(Debug, Clone)]
pub(in crate::hybrid) struct FluidColumn(FluidStack);

impl FluidColumn {
    /// Creates the operator of fluids by ascending x3.
    pub(in crate::hybrid) fn new(fluids: &[FluidMesh], element: &Element) -> Self {
        Self(FluidStack::new(fluids, element, 1.0))
    }
}

impl System for FluidColumn {
    fn len(&self) -> usize {
        self.0.nodes()
    }

    #[inline(always)]
    fn apply<V: Vector, S: Sink>(
        &self,
        k: Lanes,
        x: &[Lanes],
        load: Lanes,
        _: &mut Scratch,
        out: &mut [Lanes],
        sink: &mut S,
    ) {
        self.0.apply::<1, V, S>(k, x, out, 0, sink);
        // The stack leaves both ends to its owner, and gives all between them to the sink: the lowest is driven, the
        // highest is free (p = 0).
        out[0] = Lanes::splat(self.0.lower_drive()).mul_add(load, out[0]);
        let top = out.len() - 1;
        out[top] = Lanes::ZERO;
        sink.take::<V>(0, &out[..1]);
    }
}
