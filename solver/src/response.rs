//! The sum over wavenumbers: spectrum of the pressure at every receiver.

use crate::complex::Complex;
use crate::lanes::{ComplexLanes, LANES, Lanes};
use crate::medium::Medium;
use crate::plate::Plate;
use crate::tables::{Frequency, Tables};

/// Spectra of the pressure less the direct wave, at `[receiver * frequencies + n]`.
#[derive(Debug, Default)]
pub(crate) struct Spectra {
    values: Vec<Complex>,
    frequencies: usize,
    sums: Vec<ComplexLanes>,
}

impl Spectra {
    /// Spectrum at one receiver.
    pub(crate) fn receiver(&self, r: usize) -> &[Complex] {
        &self.values[r * self.frequencies..(r + 1) * self.frequencies]
    }

    /// Whether every number is finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.values.iter().all(|value| value.is_finite())
    }

    /// Computes the spectra of one plate.
    #[inline(always)]
    pub(crate) fn fill(&mut self, tables: &Tables, medium: &Medium, plate: &mut Plate) {
        let receivers = tables.receivers();
        self.frequencies = tables.frequencies.len();
        self.values.clear();
        self.values.resize(receivers * self.frequencies, Complex::default());
        for (n, frequency) in tables.frequencies.iter().enumerate() {
            self.sums.clear();
            self.sums.resize(receivers, ComplexLanes::ZERO);
            sum_wavenumbers(tables, frequency, medium, plate, &mut self.sums);
            for (r, sum) in self.sums.iter().enumerate() {
                self.values[r * self.frequencies + n] = Complex::new(sum.re.sum(), sum.im.sum());
            }
        }
    }
}

/// Adds the wavenumbers of one frequency to the sums of every receiver, lane by lane.
#[inline(always)]
fn sum_wavenumbers(
    tables: &Tables,
    frequency: &Frequency,
    medium: &Medium,
    plate: &mut Plate,
    sums: &mut [ComplexLanes],
) {
    let inertia = ComplexLanes {
        re: Lanes::splat(frequency.inertia.re),
        im: Lanes::splat(frequency.inertia.im),
    };
    let mut scratch = None;
    for b in 0..frequency.blocks {
        let block = tables.block(frequency, b, &mut scratch);
        plate.prepare(medium, frequency.s, block.k.0[LANES - 1]);
        let impedance = plate.impedance(block.k, block.load);
        // R = (g d - q)/(g d + q), q = ρ1 s², d = -1/Y; R/(1 + R E2) with one division.
        let gd = block.g * impedance;
        let numerator = gd - inertia;
        let denominator = numerator.mul_add(block.echo, gd + inertia);
        let response = block.weight * numerator * denominator.recip();
        for (sum, &cosine) in sums.iter_mut().zip(tables.cosines(b)) {
            sum.re = response.re.mul_add(cosine, sum.re);
            sum.im = response.im.mul_add(cosine, sum.im);
        }
    }
}
