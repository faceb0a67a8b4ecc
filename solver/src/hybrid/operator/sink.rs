//! What becomes of the numbers of A x as soon as they are final.

use crate::lanes::Lanes;
use crate::vector::Vector;

/// Processes A x while it is still in the fast memory.
///
/// The free ends of the fluids, where p = 0 always, are left out.
pub(in crate::hybrid) trait Sink {
    /// Receives numbers `start` … of A x in `values`. Must be `#[inline(always)]`.
    fn take<V: Vector>(&mut self, start: usize, values: &[Lanes]);
}

/// Does nothing.
pub(in crate::hybrid) struct Keep;

impl Sink for Keep {
    #[inline(always)]
    fn take<V: Vector>(&mut self, _: usize, _: &[Lanes]) {}
}
