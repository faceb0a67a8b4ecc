//! What is stepped through time.

use super::sink::Sink;
use super::solid::Scratch;
use crate::lanes::Lanes;
use crate::vector::Vector;

/// An operator A of x_tt = A x + load.
pub(in crate::hybrid) trait System {
    /// Returns the number of real numbers (in each lane) of a state.
    fn len(&self) -> usize;

    /// Computes `out` = A `x` + the effect of `load`; `sink` receives every number of it once, as soon as it
    /// is final. Must be `#[inline(always)]`.
    fn apply<V: Vector, S: Sink>(
        &self,
        k: Lanes,
        x: &[Lanes],
        load: Lanes,
        scratch: &mut Scratch,
        out: &mut [Lanes],
        sink: &mut S,
    );
}
