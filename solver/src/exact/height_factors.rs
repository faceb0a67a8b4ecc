//! Factors between the responses at neighbouring receivers of a tilted probe, whose heights differ.
//!
//! From one receiver to the next higher one, with d the difference of their heights, the part of a
//! response that comes from below is multiplied by exp(-g d), and the part that the coupling's outer
//! face reflects by exp(g d). So all responses follow from the two parts at the lowest receiver.

use crate::complex::Complex;
use crate::lanes::ComplexLanes;

/// Factors of eight neighbouring wavenumbers.
#[derive(Debug)]
pub(crate) struct HeightFactors {
    /// exp(-g d): of the part from below.
    pub(crate) from_below: ComplexLanes,
    /// exp(g d): of the part that the outer face reflects.
    pub(crate) from_above: ComplexLanes,
    /// Ratio of the latter part to the former at the lowest receiver, exp(-2 g (h1 - x3)); zero if no
    /// reflection of the outer face can arrive in a window.
    pub(crate) image: ComplexLanes,
}

/// Returns three numbers for one wavenumber: the factor of the part from below, the factor of the part
/// from above, and the ratio of the latter part to the former at the lowest receiver.
///
/// `g` is the vertical wavenumber (rad/m), `difference` that of the heights (m), and `below_face` the
/// distance (m) of the lowest receiver from the coupling's outer face; `None` if no reflection of that
/// can arrive in a window.
pub(crate) fn height_factors(g: Complex, difference: f64, below_face: Option<f64>) -> [Complex; 3] {
    let image = below_face.map_or(Complex::default(), |depth| (-g.scale(2.0 * depth)).exp());
    let growth = g.scale(difference).exp();
    let is_finite = growth.re.is_finite() && growth.im.is_finite();
    // All receivers are below the face. If the factor overflows, the part is negligible even at the
    // highest of them.
    let growth = if is_finite { growth } else { Complex::default() };
    [(-g.scale(difference)).exp(), growth, image]
}
