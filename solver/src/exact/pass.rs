//! One pass in one band: the extrema of the signals, the pick among them, and the estimate of its error.

use osteon_common::case::Setup;
use osteon_common::line_fit::{mean, slope};
use osteon_common::probe::Place;
use osteon_common::sampling;

use crate::exact::bin_tables::{Band, BinTables};
use crate::exact::estimated::{Estimated, limit_to_one, root_sum_square};
use crate::exact::plate_stack::PlateStack;
use crate::exact::prepared_setup::PreparedSetup;
use crate::exact::response::Spectra;
use crate::exact::signal::{Signal, Slopes};
use crate::exact::tables::Tables;
use crate::failure::{Failure, pressure_not_finite};
use crate::isa::Kernel;
use crate::lanes::{ComplexLanes, LANES, Lanes};
use crate::picking::{Pick, Window, pick};
use crate::vector::Vector;

/// Ratio of the stated error of a band to the root mean square change of the velocity when the band is
/// cut by other tapers. Of 100 errors, 99 are smaller than stated.
const BAND_FACTOR: f64 = 4.9;
/// Largest [`slow_decay_factor`].
const SLOW_DECAY_MAX: f64 = 2.0;
/// Density of the marrow, kg/m³, above which [`slow_decay_factor`] grows.
const HEAVY_MARROW: f64 = 2000.0;
/// Number of times at which the noise is read, spread over one period before the earliest possible
/// arrival.
const NOISE_TIMES: usize = LANES - 1;
/// Ratio of the stated error of a sampling to the root mean square change of the velocity by the noise
/// that all receivers have at the same time before their earliest possible arrivals.
const NOISE_FACTOR: f64 = 4.6;
/// The same ratio, for noise that shifts the receivers' times in the least favourable way.
const WORST_NOISE_FACTOR: f64 = 0.75;
/// Rate at which noise is assumed to grow from where it is read to the pick, relative to the damping, if
/// a layer is attenuated: what the sums leave out is then larger compared with the arrival.
const NOISE_GROWTH: f64 = 0.9;

/// Scratch memory of one thread; its contents never reach a result.
#[derive(Debug, Default)]
pub(crate) struct ExactWorkspace {
    /// The plates of quick and plain passes.
    pub(crate) fast: PlateStack<8>,
    /// The plates of thorough passes.
    pub(crate) accurate: PlateStack<11>,
    pub(crate) spectra: Spectra,
    windows: Vec<Window>,
    slopes: Slopes,
    tapered: Vec<ComplexLanes>,
}

/// Finds the extrema of the signals whose spectra are in the workspace, and keeps them there.
///
/// # Errors
/// If a number is not finite.
pub(super) fn observe(
    prepared: &PreparedSetup,
    speed: f64,
    bin: &BinTables,
    band: &Band,
    workspace: &mut ExactWorkspace,
) -> Result<(), Failure> {
    if !workspace.spectra.is_finite() {
        return Err(pressure_not_finite());
    }
    let PreparedSetup { setup, places, isa, .. } = prepared;
    isa.run(Observe { setup, places, bin, band, speed, workspace });
    Ok(())
}

/// Picks one of the extrema in the workspace, and estimates its error.
///
/// # Errors
/// If there is no acceptable pick.
pub(super) fn pick_with_error(
    prepared: &PreparedSetup,
    bin: &BinTables,
    band: &Band,
    workspace: &ExactWorkspace,
) -> Result<Estimated, Failure> {
    let fc = prepared.setup.probe.center_frequency;
    let pick = pick(&prepared.criterion, fc, &prepared.distances, &workspace.windows)?;
    let moved = prepared.isa.run(Repick { bin, band, times: &pick.times, workspace });
    let changes: [f64; LANES] = std::array::from_fn(|taper| {
        let times: Vec<f64> = moved.iter().map(|times| times.0[taper]).collect();
        slope(&prepared.distances, &times) / pick.velocity - 1.0
    });
    let band_error = BAND_FACTOR * slow_decay_factor(&prepared.setup) * root_mean_square(&changes);
    let sampling_error = sampling_error(prepared, bin, band, &pick, workspace);
    Ok(Estimated {
        pick,
        band_error: limit_to_one(band_error),
        sampling_error: limit_to_one(sampling_error),
        sampled: band.sampled,
    })
}

/// Estimates the error that is due to the distances of samples and the ends of their sums.
///
/// Before the earliest possible arrival the true pressure is zero. What is computed there is noise:
/// waves that wrap round, and what the sums leave out. The noise continues under the arrival, and its
/// slope, divided by the curvature of the picked extremum, is the error of a time.
fn sampling_error(
    prepared: &PreparedSetup,
    bin: &BinTables,
    band: &Band,
    pick: &Pick,
    workspace: &ExactWorkspace,
) -> f64 {
    let PreparedSetup { setup, places, isa, .. } = prepared;
    let delays = isa.run(ReadNoise { setup, places, bin, band, times: &pick.times, workspace });
    let mean = mean(&pick.times);
    let spread = pick.times.iter().fold(0.0, |sum, t| (t - mean).mul_add(t - mean, sum));
    let (mut changes, mut worst) = ([0.0; NOISE_TIMES], 0.0);
    for (t, delays) in pick.times.iter().zip(&delays) {
        let weight = (t - mean) / spread;
        for (change, &delay) in changes.iter_mut().zip(delays) {
            *change = delay.mul_add(weight, *change);
        }
        worst = root_mean_square(delays).mul_add(weight.abs(), worst);
    }
    root_sum_square(NOISE_FACTOR * root_mean_square(&changes), WORST_NOISE_FACTOR * worst)
}

/// Returns the ratio of a band's error to the one that other tapers usually show: in a thin plate, or on
/// a heavy marrow, the error falls slowly as the band grows, which tapers do not show.
pub(crate) fn slow_decay_factor(setup: &Setup) -> f64 {
    let fluids = setup.layers.marrow_fluids();
    let densest = fluids.as_slice().iter().fold(0.0, |most: f64, fluid| fluid.density.max(most));
    let heaviness = (densest / HEAVY_MARROW).max(1.0);
    (sampling::thinness(setup) * heaviness).min(SLOW_DECAY_MAX)
}

fn root_mean_square(values: &[f64]) -> f64 {
    let square = values.iter().fold(0.0, |sum, value| value.mul_add(*value, sum));
    (square / values.len() as f64).sqrt()
}

/// Kernel that lists the extrema of the pressure at every receiver.
struct Observe<'a> {
    setup: &'a Setup,
    places: &'a [Place],
    bin: &'a BinTables,
    band: &'a Band,
    /// Upper bound of every wave's speed, m/s.
    speed: f64,
    workspace: &'a mut ExactWorkspace,
}

impl Kernel for Observe<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let ExactWorkspace { spectra, windows, slopes, tapered, .. } = self.workspace;
        let Tables { sampling, runs, .. } = &self.bin.tables;
        windows.resize_with(self.places.len(), Window::default);
        for (r, (window, &place)) in windows.iter_mut().zip(self.places).enumerate() {
            tapered.clear();
            for (run, &weights) in spectra.receiver(r).iter().zip(&self.band.taper) {
                tapered.push(ComplexLanes { re: run.re * weights, im: run.im * weights });
            }
            let signal = Signal { sampling, runs, spectrum: tapered };
            let from = sampling::earliest_arrival(self.setup, place, self.speed);
            let to = sampling::direct_arrival(self.setup, place);
            let last = signal.extrema::<V>(&self.bin.grid, from, to, slopes, &mut window.extrema);
            window.last = last.abs();
            window.drop_noise();
        }
    }
}

/// Kernel that finds the times of the picked extrema, s, when the spectra are cut by each of the other
/// tapers.
struct Repick<'a> {
    bin: &'a BinTables,
    band: &'a Band,
    times: &'a [f64],
    workspace: &'a ExactWorkspace,
}

impl Kernel for Repick<'_> {
    type Output = Vec<Lanes>;

    #[inline(always)]
    fn run<V: Vector>(self) -> Vec<Lanes> {
        let Tables { sampling, runs, .. } = &self.bin.tables;
        let mut moved = Vec::with_capacity(self.times.len());
        for (r, &time) in self.times.iter().enumerate() {
            let spectrum = &self.workspace.spectra.receiver(r)[..self.band.others.len()];
            let signal = Signal { sampling, runs, spectrum };
            moved.push(signal.moved_extrema::<V>(time, &self.band.others));
        }
        moved
    }
}

/// Kernel that reads the noise before the earliest possible arrivals. Returns the times, s, by which it
/// delays the picked extrema.
struct ReadNoise<'a> {
    setup: &'a Setup,
    places: &'a [Place],
    bin: &'a BinTables,
    band: &'a Band,
    times: &'a [f64],
    workspace: &'a ExactWorkspace,
}

impl Kernel for ReadNoise<'_> {
    type Output = Vec<[f64; NOISE_TIMES]>;

    #[inline(always)]
    fn run<V: Vector>(self) -> Vec<[f64; NOISE_TIMES]> {
        let Tables { sampling, runs, .. } = &self.bin.tables;
        let step = 1.0 / (NOISE_TIMES as f64 * self.setup.probe.center_frequency);
        let is_attenuated = self.setup.layers.attenuated().is_some();
        let growth = if is_attenuated { NOISE_GROWTH * sampling.damping } else { 0.0 };
        let mut delays = Vec::with_capacity(self.times.len());
        for (r, (&time, &place)) in self.times.iter().zip(self.places).enumerate() {
            let spectrum = &self.workspace.spectra.receiver(r)[..self.band.taper.len()];
            let signal = Signal { sampling, runs, spectrum };
            let earliest = sampling::earliest_arrival(self.setup, place, sampling.speed);
            // The last time is that of the pick.
            let mut times = Lanes([time; LANES]);
            for (i, t) in times.0[..NOISE_TIMES].iter_mut().enumerate() {
                *t = (i as f64 + 0.5).mul_add(-step, earliest);
            }
            let (slopes, curvatures) = signal.bends::<V>(&times, &self.band.taper);
            let delay = |i: usize| slopes.0[i] / curvatures.0[NOISE_TIMES];
            delays.push(std::array::from_fn(|i| match growth {
                0.0 => delay(i),
                growth => delay(i) * libm::exp(growth * (time - times.0[i])),
            }));
        }
        delays
    }
}
