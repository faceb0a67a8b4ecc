//! The sum over wavenumbers for a tilted probe, whose receivers are at different heights.

use crate::exact::tables::Tables;
use crate::isa::Kernel;
use crate::lanes::{ComplexLanes, LANES};
use crate::vector::{ComplexVector, Vector};

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
        let kept = tables.kept_line(&tables.lines[line]);
        let mut scratch = None;
        for (b, response) in responses.iter().enumerate() {
            let mut first = 0;
            for (fluid, &end) in tables.receivers_in_fluids().iter().enumerate() {
                let line = &tables.lines[line];
                let factors = tables.height_factors(line, kept, b, fluid, &mut scratch);
                for part in 0..V::PARTS {
                    let from_below = ComplexVector::<V>::load(&factors.from_below, part);
                    let from_above = ComplexVector::<V>::load(&factors.from_above, part);
                    let mut below = ComplexVector::<V>::load(response, part);
                    if first > 0 {
                        below = below.mul(ComplexVector::load(&factors.start, part));
                    }
                    let mut above = below.mul(ComplexVector::load(&factors.image, part));
                    for r in tables.upwards(first..end) {
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
                first = end;
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
