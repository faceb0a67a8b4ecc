//! The sum over wavenumbers, which gives the spectrum of the pressure at every receiver.

use std::ops::Range;

use crate::complex::Complex;
use crate::exact::layer::Foundation;
use crate::exact::plate::Plate;
use crate::exact::plate_stack::PlateStack;
use crate::exact::tables::{Block, Line, Tables};
use crate::exact::tilted::SumTilted;
use crate::isa::{Isa, Kernel};
use crate::lanes::{ComplexLanes, LANES, Lanes};
use crate::media::Media;
use crate::vector::{ComplexVector, Vector};

/// Number of receivers that are summed side by side.
const GROUP: usize = 4;

/// Spectra of the pressure without the direct wave, not yet tapered: for each receiver a row of
/// runs of eight lines, zero where a line is not computed.
#[derive(Debug, Default)]
pub(crate) struct Spectra {
    rows: Vec<ComplexLanes>,
    runs: usize,
    /// Scratch memory of [`respond`].
    responses: Vec<ComplexLanes>,
    /// Scratch memory of the sum for tilted probes.
    sums: Vec<ComplexLanes>,
}

impl Spectra {
    /// Returns the spectrum at one receiver.
    pub(crate) fn receiver(&self, r: usize) -> &[ComplexLanes] {
        &self.rows[r * self.runs..(r + 1) * self.runs]
    }

    /// Returns whether every number is finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.rows.iter().all(|l| l.re.0.iter().chain(&l.im.0).all(|value| value.is_finite()))
    }

    /// Makes room for the spectra of one bone, and sets them to zero.
    pub(crate) fn clear(&mut self, tables: &Tables) {
        self.runs = tables.runs.len();
        self.rows.clear();
        self.rows.resize(tables.receivers() * self.runs, ComplexLanes::ZERO);
    }

    /// Computes some lines of the spectra of one bone.
    ///
    /// Its parts are separate kernels: in one large function the compiler would have too few
    /// registers for the innermost one.
    pub(crate) fn fill<const TERMS: usize>(
        &mut self,
        isa: Isa,
        tables: &Tables,
        media: &Media,
        plates: &mut PlateStack<TERMS>,
        lines: Range<usize>,
    ) {
        let mut responses = std::mem::take(&mut self.responses);
        for i in lines {
            respond(isa, tables, media, plates, &tables.lines[i], &mut responses);
            self.sum(isa, tables, i, &responses);
        }
        self.responses = responses;
    }

    /// Sums the responses of line `i` at every receiver.
    pub(crate) fn sum(&mut self, isa: Isa, tables: &Tables, i: usize, responses: &[ComplexLanes]) {
        if responses.is_empty() {
            return;
        }
        if tables.is_tilted() {
            let Self { rows, runs, sums, .. } = self;
            isa.run(SumTilted { tables, line: i, responses, rows, runs: *runs, sums });
        } else {
            isa.run(SumOverWavenumbers { tables, line: i, responses, spectra: self });
        }
    }
}

/// Computes the weights of the cosines of one frequency's wavenumbers.
pub(crate) fn respond<const TERMS: usize>(
    isa: Isa,
    tables: &Tables,
    media: &Media,
    plates: &mut PlateStack<TERMS>,
    line: &Line,
    responses: &mut Vec<ComplexLanes>,
) {
    responses.clear();
    let kept = tables.kept_line(line);
    let mut scratch = None;
    for b in 0..line.blocks {
        let k = tables.wavenumbers(b);
        plates.prepare(isa, media, line.lossless.bone, k);
        let (block, echo) = tables.block(line, kept, b, &mut scratch);
        let (inertia, mirror, plate) = (line.inertia, tables.mirror, &plates.uppermost);
        responses.push(match plates.foundation(isa, media, k, &block.load) {
            None => {
                let foundation = &block.load;
                isa.run(Respond { plate, k, foundation, block, echo, inertia, mirror })
            }
            Some(foundation) => {
                let foundation = &foundation;
                isa.run(Respond { plate, k, foundation, block, echo, inertia, mirror })
            }
        });
    }
}

/// Kernel that computes the weights of the cosines of one block of wavenumbers.
struct Respond<'a, F, const TERMS: usize> {
    /// The uppermost plate.
    plate: &'a Plate<TERMS>,
    k: &'a Lanes,
    /// What it lies on.
    foundation: &'a F,
    block: &'a Block,
    echo: &'a ComplexLanes,
    inertia: Complex,
    /// Share of the block's weights that are the mirror wave.
    mirror: f64,
}

impl<F: Foundation, const TERMS: usize> Kernel for Respond<'_, F, TERMS> {
    type Output = ComplexLanes;

    #[inline(always)]
    fn run<V: Vector>(self) -> ComplexLanes {
        let Self { plate, k, foundation, block, echo, inertia, mirror } = self;
        let inertia = ComplexVector { re: V::splat(inertia.re), im: V::splat(inertia.im) };
        let mut response = ComplexLanes::ZERO;
        for part in 0..V::PARTS {
            let impedance = plate.impedance::<V, F>(k, foundation, part);
            // R = (g d - q)/(g d + q), q = ρ1 s², d = -1/Y; half of (R + 1)/(1 + R E2) with one division,
            // and less one half with the mirror wave. Where the bone attenuates, both d and q are
            // divided by m(s).
            let gd = ComplexVector::load(&block.g, part).mul(impedance);
            let echo = ComplexVector::load(echo, part);
            let denominator = gd.sub(inertia).mul_add(echo, gd.add(inertia));
            let weight = ComplexVector::<V>::load(&block.weight, part);
            let mut whole = gd.mul(denominator.recip());
            whole.re = whole.re.sub(V::splat(mirror));
            weight.mul(whole).store(&mut response, part);
        }
        response
    }
}

/// Kernel that sums the responses of one line at every receiver.
struct SumOverWavenumbers<'a> {
    tables: &'a Tables,
    line: usize,
    responses: &'a [ComplexLanes],
    spectra: &'a mut Spectra,
}

impl Kernel for SumOverWavenumbers<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Spectra { rows, runs, .. } = self.spectra;
        let receivers = self.tables.receivers();
        let (run, lane) = (self.line / LANES, self.line % LANES);
        let mut r = 0;
        while r < receivers {
            let sums = cosine_sums::<V>(self.tables, r, self.responses);
            for j in 0..GROUP.min(receivers - r) {
                let row = &mut rows[(r + j) * *runs + run];
                row.re.0[lane] = sums[j].re.sum();
                row.im.0[lane] = sums[j].im.sum();
            }
            r += GROUP;
        }
    }
}

/// Returns Σ response cos(k x), lane by lane, at receivers `r` … `r` + 3; the last receiver is
/// repeated beyond the end.
#[inline(always)]
fn cosine_sums<V: Vector>(
    tables: &Tables,
    r: usize,
    responses: &[ComplexLanes],
) -> [ComplexLanes; GROUP] {
    let last = tables.receivers() - 1;
    let a = &tables.cosines(r.min(last))[..responses.len()];
    let b = &tables.cosines((r + 1).min(last))[..responses.len()];
    let c = &tables.cosines((r + 2).min(last))[..responses.len()];
    let d = &tables.cosines((r + 3).min(last))[..responses.len()];
    let mut sums = [ComplexLanes::ZERO; GROUP];
    for part in 0..V::PARTS {
        let mut sum = [ComplexVector::<V>::zero(); GROUP];
        for (i, response) in responses.iter().enumerate() {
            let (re, im) = (V::load(&response.re, part), V::load(&response.im, part));
            for (sum, cosines) in sum.iter_mut().zip([a, b, c, d]) {
                let cosine = V::load(&cosines[i], part);
                sum.re = re.mul_add(cosine, sum.re);
                sum.im = im.mul_add(cosine, sum.im);
            }
        }
        for i in 0..GROUP {
            sum[i].store(&mut sums[i], part);
        }
    }
    sums
}

/// Compile-time check of the width that the sums over lanes assume.
const _: () = assert!(LANES == 8 && size_of::<Lanes>() == 64);
