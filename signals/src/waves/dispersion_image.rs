//! The image of guided waves over wavenumber and frequency that an array sees.

use std::f64::consts::PI;

use osteon_common::case::Setup;
use osteon_files::probe_file::ProbeDescription;

use super::response_matrix::SideSignals;
use super::signal_subspace::SignalSubspace;
use super::wave_failure::WaveFailure;
use crate::array_signals::SignalSeries;

/// Frequencies and wavenumbers of the usual grid.
const FREQUENCIES: u32 = 120;
const WAVENUMBERS: u32 = 200;
/// It ends at this many centre frequencies, and at the wavenumber of this phase velocity there, m/s.
const HIGHEST: f64 = 2.0;
const SLOWEST: f64 = 1200.0;
/// Smallest signal at a frequency, relative to the largest at any, of which an image shows the waves.
const SMALLEST: f64 = 1e-3;

/// The frequencies and wavenumbers of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageGrid {
    /// Frequencies, Hz, in equal steps.
    pub frequencies: Vec<f64>,
    /// Wavenumbers, rad/m, in equal steps.
    pub wavenumbers: Vec<f64>,
}

/// The part, 0 to 1, of each plane wave that lies in the space of the signals: near 1 where there is a wave. Of
/// one source alone it is the spatial Fourier transform, squared, relative to all of the array at that frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct DispersionImage {
    grid: ImageGrid,
    /// For each frequency the sum over series and sides for each wavenumber.
    sums: Vec<Vec<f64>>,
    /// Number of terms for each frequency.
    counts: Vec<u32>,
}

impl ImageGrid {
    /// Returns the usual grid of a probe: to twice the centre frequency, and to the largest wavenumber that its
    /// pitch tells from others.
    pub fn usual(setup: &Setup) -> Self {
        let highest = HIGHEST * setup.probe.center_frequency;
        let step = highest / f64::from(FREQUENCIES);
        Self::of_frequencies(setup, (1..=FREQUENCIES).map(|j| f64::from(j) * step).collect())
    }

    /// Returns the grid of these frequencies, Hz, with the wavenumbers that a probe tells apart.
    pub fn of_frequencies(setup: &Setup, frequencies: Vec<f64>) -> Self {
        let highest = frequencies.iter().copied().fold(0.0, f64::max);
        let most = (2.0 * PI * highest / SLOWEST).min(2.0 * PI / setup.probe.receivers.pitch);
        let step = most / f64::from(WAVENUMBERS);
        let wavenumbers = (1..=WAVENUMBERS).map(|j| f64::from(j) * step).collect();
        Self { frequencies, wavenumbers }
    }
}

impl DispersionImage {
    /// Creates an image of no series.
    pub fn new(grid: ImageGrid) -> Self {
        let sums = vec![vec![0.0; grid.wavenumbers.len()]; grid.frequencies.len()];
        let counts = vec![0; grid.frequencies.len()];
        Self { grid, sums, counts }
    }

    /// Adds the signals of a series; an image of several is their mean.
    ///
    /// # Errors
    /// If the signals cannot be used; the image is then as before.
    pub fn add(
        &mut self,
        description: &ProbeDescription,
        series: &SignalSeries,
    ) -> Result<(), WaveFailure> {
        for side in SideSignals::of_series(description, series)? {
            let responses: Vec<_> =
                self.grid.frequencies.iter().map(|f| side.response(*f)).collect();
            let sizes: Vec<f64> = responses.iter().map(|response| response.size()).collect();
            let least = SMALLEST * sizes.iter().copied().fold(0.0, f64::max);
            let rows = self.sums.iter_mut().zip(&mut self.counts);
            for ((response, size), (sums, count)) in responses.into_iter().zip(sizes).zip(rows) {
                *count += 1;
                if size <= least {
                    continue;
                }
                let space =
                    SignalSubspace::new(&side.positions, response, description.waves.threshold);
                for (sum, k) in sums.iter_mut().zip(&self.grid.wavenumbers) {
                    *sum += space.norm(*k);
                }
            }
        }
        Ok(())
    }

    /// Returns its frequencies and wavenumbers.
    pub fn grid(&self) -> &ImageGrid {
        &self.grid
    }

    /// Returns for each frequency the values, 0 to 1, for each wavenumber; `None` if it is an image of no series.
    pub fn values(&self) -> Option<Vec<Vec<f64>>> {
        if self.counts.iter().all(|count| *count == 0) {
            return None;
        }
        let mean = |(sums, count): (&Vec<f64>, &u32)| -> Vec<f64> {
            sums.iter().map(|sum| sum / f64::from(*count)).collect()
        };
        Some(self.sums.iter().zip(&self.counts).map(mean).collect())
    }
}
