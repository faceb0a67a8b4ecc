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
    /// What the cosines of one frequency's wavenumbers are weighted with.
    responses: Vec<ComplexLanes>,
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
            fill_responses(tables, frequency, medium, plate, &mut self.responses);
            for r in 0..receivers {
                let mut sum = ComplexLanes::ZERO;
                for (response, &cosine) in self.responses.iter().zip(tables.cosines(r)) {
                    sum.re = response.re.mul_add(cosine, sum.re);
                    sum.im = response.im.mul_add(cosine, sum.im);
                }
                self.values[r * self.frequencies + n] = Complex::new(sum.re.sum(), sum.im.sum());
            }
        }
    }
}

/// The responses of one frequency's wavenumbers, in ascending order.
#[inline(always)]
fn fill_responses(
    tables: &Tables,
    frequency: &Frequency,
    medium: &Medium,
    plate: &mut Plate,
    responses: &mut Vec<ComplexLanes>,
) {
    let inertia = ComplexLanes {
        re: Lanes::splat(frequency.inertia.re),
        im: Lanes::splat(frequency.inertia.im),
    };
    let mut scratch = None;
    responses.clear();
    for b in 0..frequency.blocks {
        let block = tables.block(frequency, b, &mut scratch);
        plate.prepare(medium, frequency.s, block.k.0[LANES - 1]);
        let impedance = plate.impedance(block.k, block.load);
        // R = (g d - q)/(g d + q), q = ρ1 s², d = -1/Y; R/(1 + R E2) with one division.
        let gd = block.g * impedance;
        let numerator = gd - inertia;
        let denominator = numerator.mul_add(block.echo, gd + inertia);
        responses.push(block.weight * numerator * denominator.recip());
    }
}
