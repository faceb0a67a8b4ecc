//! The node that two elements of a layer share.

use crate::lanes::Lanes;
use crate::vector::Vector;

/// Returns the mean of the values of two elements at their shared node.
#[inline(always)]
pub(super) fn average<const C: usize, V: Vector>(below: &[Lanes; C], node: &mut [Lanes; C]) {
    let half = V::splat(0.5);
    for c in 0..C {
        for part in 0..V::PARTS {
            let sum = V::load(&node[c], part).add(V::load(&below[c], part));
            half.mul(sum).store(&mut node[c], part);
        }
    }
}
