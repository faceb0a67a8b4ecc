//! Thinning of frequencies towards the top of the band.
//!
//! The sum over n is the trapezoidal rule of an integral over ω; a coarser step means a shorter
//! period. Low in the band the period must include every large wave. High in the band only the tail
//! of the pulse's kink remains. A wave that arrives τ later and wraps round keeps a fraction exp(-α
//! τ) of it, which is little for the large late waves; the early ones are small themselves.
//! Therefore the step doubles a few times on the way up. Between a doubling's two frequencies every
//! second sample fades out while its neighbours fade in, so that the sum of the weights remains
//! that of the integral.

use crate::sampling::WaveSampling;

/// Frequencies, as multiples of the centre frequency, between which the step doubles.
const DOUBLINGS: [(f64, f64); 4] = [(2.0, 2.75), (3.25, 4.0), (7.0, 8.5), (12.0, 14.0)];

/// Number of frequencies of a run.
pub const RUN: usize = 8;

/// Eight equidistant frequencies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrequencyRun {
    /// Number of its first frequency.
    pub first: usize,
    /// Distance of neighbours, a power of two.
    pub stride: usize,
}

impl FrequencyRun {
    /// Returns the numbers of its frequencies.
    pub fn frequencies(self) -> impl Iterator<Item = usize> {
        (0..RUN).map(move |i| self.first + i * self.stride)
    }
}

impl WaveSampling {
    /// Returns the frequencies of the whole band, in runs; [`WaveSampling::is_within`] tells which
    /// frequencies of a run are not needed.
    pub fn runs(&self) -> Vec<FrequencyRun> {
        let (mut first, mut stride) = (0, 1);
        let mut doublings = DOUBLINGS.into_iter().peekable();
        let mut runs = Vec::new();
        while first < self.frequencies() {
            while let Some(&(_, end)) = doublings.peek()
                && self.frequency(first) >= end * self.unit
                && first % (2 * stride) == 0
            {
                stride *= 2;
                doublings.next();
            }
            runs.push(FrequencyRun { first, stride });
            first += RUN * stride;
        }
        runs
    }

    /// Returns the weight of frequency `n` in the sum: 1 where none is left out.
    pub fn share(&self, n: usize) -> f64 {
        let mut share = 1.0;
        let mut stride = 1;
        for (from, to) in DOUBLINGS {
            if !n.is_multiple_of(stride) {
                break;
            }
            let thinned = smooth_step((self.frequency(n) / self.unit - from) / (to - from));
            let fades = !n.is_multiple_of(2 * stride);
            share *= if fades { 1.0 - thinned } else { 1.0 + thinned };
            stride *= 2;
        }
        share
    }

    fn frequency(&self, n: usize) -> f64 {
        n as f64 / self.period
    }
}

/// Returns 0 up to x = 0 and 1 from x = 1 on, infinitely smooth.
pub fn smooth_step(x: f64) -> f64 {
    if x <= 0.0 {
        0.0
    } else if x >= 1.0 {
        1.0
    } else {
        let (rising, falling) = (libm::exp(-1.0 / x), libm::exp(-1.0 / (1.0 - x)));
        rising / (rising + falling)
    }
}
