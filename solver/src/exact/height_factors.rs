//! What leads from a receiver of a tilted probe to the next higher one.
//!
//! From one receiver to the next higher one the part of a response that comes from below changes by
//! exp(-g d), with d the difference of their heights, and the part that the coupling's outer face
//! reflects by exp(g d). So the responses are those at the lowest receiver, and one complex factor
//! leads from each receiver to the next.

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

/// Returns the factors of one wavenumber, those of the part from below and of the part from above and
/// the ratio at the lowest receiver, for the vertical wavenumber `g` (rad/m) and a difference of heights
/// (m). `below_face` is the distance of the lowest receiver from the coupling's outer face, m; `None` if
/// no reflection of it can arrive in a window.
pub(crate) fn height_factors(g: Complex, difference: f64, below_face: Option<f64>) -> [Complex; 3] {
    let image = below_face.map_or(Complex::default(), |depth| (-g.scale(2.0 * depth)).exp());
    let growth = g.scale(difference).exp();
    let is_finite = growth.re.is_finite() && growth.im.is_finite();
    // All receivers are below the face, so that a part that grows beyond all numbers is negligible
    // at each of them.
    let growth = if is_finite { growth } else { Complex::default() };
    [(-g.scale(difference)).exp(), growth, image]
}
