//! The sum over wavenumbers for a tilted probe, whose receivers are at different heights.
//!
//! From one receiver to the next higher one the part of a response that comes from below changes by
//! exp(-g d), with d the difference of their heights, and the part that the coupling's outer face
//! reflects by exp(g d). So the responses are those at the lowest receiver, and one complex factor
//! leads from each receiver to the next.

use crate::complex::Complex;
use crate::exact::tables::Tables;
use crate::isa::Kernel;
use crate::lanes::{ComplexLanes, LANES};
use crate::vector::{ComplexVector, Vector};

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

/// Kernel that sums the responses of one line at every receiver of a tilted probe.
pub(crate) struct SumTilted<'a> {
    pub(crate) tables: &'a Tables,
    /// Number of the line.
    pub(crate) line: usize,
    /// Weights of the cosines at the lowest receiver, by block.
    pub(crate) responses: &'a [ComplexLanes],
    /// Spectra of the receivers, `[r * runs + run]`.
    pub(crate) rows: &'a mut [ComplexLanes],
    pub(crate) runs: usize,
    /// Scratch memory.
    pub(crate) sums: &'a mut Vec<ComplexLanes>,
}

impl Kernel for SumTilted<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Self { tables, line, responses, rows, runs, sums } = self;
        let receivers = tables.receivers();
        sums.clear();
        sums.resize(receivers, ComplexLanes::ZERO);
        let kept = tables.kept(&tables.lines[line]);
        let mut scratch = None;
        for (b, response) in responses.iter().enumerate() {
            let factors = tables.height_factors(&tables.lines[line], kept, b, &mut scratch);
            for part in 0..V::PARTS {
                let from_below = ComplexVector::<V>::load(&factors.from_below, part);
                let from_above = ComplexVector::<V>::load(&factors.from_above, part);
                let mut below = ComplexVector::<V>::load(response, part);
                let mut above = below.mul(ComplexVector::load(&factors.image, part));
                for r in tables.upwards() {
                    let cosine = V::load(&tables.cosines(r)[b], part);
                    let pressure = below.sub(above);
                    let mut sum = ComplexVector::<V>::load(&sums[r], part);
                    sum.re = pressure.re.mul_add(cosine, sum.re);
                    sum.im = pressure.im.mul_add(cosine, sum.im);
                    sum.store(&mut sums[r], part);
                    below = below.mul(from_below);
                    above = above.mul(from_above);
                }
            }
        }
        let (run, lane) = (line / LANES, line % LANES);
        for (r, sum) in sums.iter().enumerate() {
            let row = &mut rows[r * runs + run];
            row.re.0[lane] = sum.re.sum();
            row.im.0[lane] = sum.im.sum();
        }
    }
}
