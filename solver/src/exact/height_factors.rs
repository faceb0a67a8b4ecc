//! Factors between the responses at neighbouring receivers of a tilted probe, whose heights differ.
//!
//! From one receiver to the next higher one, with d the difference of their heights, the part of a
//! response that comes from below is multiplied by exp(-g d), and the part that the coupling's outer
//! face, or the next of its fluids, reflects by exp(g d). So all responses in one fluid follow from the two
//! parts at the lowest receiver in it.

use crate::complex::Complex;
use crate::lanes::ComplexLanes;

/// Factors of eight neighbouring wavenumbers in one fluid.
#[derive(Debug)]
pub(crate) struct HeightFactors {
    /// Ratio of the part from below at the lowest receiver in the fluid to that at the lowest of all; not used
    /// where they are the same.
    pub(crate) start: ComplexLanes,
    /// exp(-g d): of the part from below.
    pub(crate) from_below: ComplexLanes,
    /// exp(g d): of the part that is reflected.
    pub(crate) from_above: ComplexLanes,
    /// Ratio of the latter part to the former at the lowest receiver in the fluid, with the opposite sign; below
    /// the outer face exp(-2 g (h1 - x3)), zero if no reflection of that can arrive in a window.
    pub(crate) image: ComplexLanes,
}

/// Returns the factors of both parts between receivers whose heights have this `difference` (m), from below
/// and from above; `g` is the vertical wavenumber (rad/m).
pub(crate) fn height_factors(g: Complex, difference: f64) -> [Complex; 2] {
    let growth = g.scale(difference).exp();
    let is_finite = growth.re.is_finite() && growth.im.is_finite();
    // All receivers are below the face. If the factor overflows, the part is negligible even at the
    // highest of them.
    let growth = if is_finite { growth } else { Complex::default() };
    [(-g.scale(difference)).exp(), growth]
}
