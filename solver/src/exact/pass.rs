//! One pass: extrema of the signals in one band, the pick, and the
//! estimate of its error.

use std::sync::Arc;

use osteon_common::case::Setup;
use osteon_common::probe::Place;
use osteon_common::sampling::{self, Grade, RUN, WaveSampling, velocity_taper};

use crate::Failure;
use crate::exact::Exact;
use crate::exact::plate::{AccuratePlate, FastPlate};
use crate::exact::response::Spectra;
use crate::exact::signal::{Signal, Slopes, TimeGrid};
use crate::exact::table_cache::TableMemory;
use crate::exact::tables::{Tables, Waves};
use crate::isa::Kernel;
use crate::lanes::{ComplexLanes, LANES, Lanes};
use crate::picking::{self, Pick, Window, pick};
use crate::solver::{Arrival, PassSummary, Sampled, pressure_not_finite};
use crate::vector::Vector;

/// The tapers with which the error estimate compares: start and end, as multiples of the band. They
/// are sharper and narrower, since the error is the part of the pulse's kink that the smooth taper
/// removes.
const OTHER_TAPERS: [(f64, f64); LANES] = [
    (0.2, 1.0),
    (0.3, 0.7),
    (0.5, 0.6),
    (0.7, 0.8),
    (0.85, 0.9),
    (0.8, 1.0),
    (0.9, 1.0),
    (0.95, 1.0),
];
/// Parts of the other tapers in the own one of a quick or plain grade, the rest of which is the smooth
/// one: this weighs the upper end of the band more, and so makes up for some of what lies beyond it.
/// Fitted to the errors of the usual geometry at dispersions of 0.1 to 0.6 and with a plate of 1 mm,
/// whose largest 1 % become 10 to 30 % smaller by it.
const TAPER_PARTS: [f64; LANES] = [-0.1, 0.39, -0.47, -0.3, -0.39, 0.33, 0.24, 0.74];
/// Ratio of the stated error to the root mean square change of the velocity by the other tapers: 99 of
/// 100 errors are smaller.
const BAND_FACTOR: f64 = 4.9;
/// Largest further factor of thin plates and heavy marrows.
const SLOW_DECAY_MAX: f64 = 2.0;
/// Density of the marrow, kg/m³, above which the further factor grows.
const HEAVY_MARROW: f64 = 2000.0;
/// Ratio of the stated error of a wider band to that of a first one with the same changes: bones that
/// need a wider band converge more slowly.
const WIDER_FACTOR: f64 = 1.35;
/// Ratio of the least stated error to the change of the velocity by doubling the band.
const CHANGE_FACTOR: f64 = 0.45;
/// Number of times before the earliest possible arrival, spread over one period, at which the signal
/// is looked at.
const BEFORE: usize = LANES - 1;
/// Ratio of the stated error to the root mean square change of the velocity by the noise before the
/// earliest possible arrival, as receivers have it at the same time.
const NOISE_FACTOR: f64 = 4.6;
/// The same for noise that shifts the times in the least favourable way.
const WORST_NOISE_FACTOR: f64 = 0.75;
/// Rate at which noise grows from where it is looked at to the pick, relative to the damping, where a
/// layer is attenuated: what the sums leave out is then larger compared with the arrival.
const NOISE_GROWTH: f64 = 0.9;

/// Tables of one speed bin, shared by all bones.
#[derive(Debug)]
pub(crate) struct BinTables {
    pub(crate) tables: Tables,
    grid: TimeGrid,
    /// The band of the first pass.
    pub(crate) first: Band,
    /// The bands of further passes, each wider than the one before.
    pub(crate) wider: Vec<Band>,
}

/// One band of a bin.
#[derive(Debug)]
pub(crate) struct Band {
    pub(crate) sampled: Sampled,
    /// Number of lines that it needs, from the first on.
    pub(crate) lines: usize,
    /// One weight per line, for the runs that contain the lines.
    taper: Vec<Lanes>,
    /// The tapers of the error estimate, side by side, per run and line.
    others: Vec<[Lanes; LANES]>,
}

/// Scratch memory of one thread; its contents never reach a result.
#[derive(Debug, Default)]
pub(crate) struct ExactWorkspace {
    pub(crate) fast: FastPlate,
    /// The plate of thorough passes.
    pub(crate) accurate: AccuratePlate,
    pub(crate) spectra: Spectra,
    windows: Vec<Window>,
    slopes: Slopes,
    tapered: Vec<ComplexLanes>,
}

/// A pick with the estimate of its velocity's relative error.
#[derive(Debug, Clone)]
pub(crate) struct Estimated {
    pub(crate) pick: Pick,
    /// The part that is due to the band's end.
    pub(crate) band_error: f64,
    /// The part that is due to the samples' distances, and to where their sums end.
    pub(crate) sampling_error: f64,
    pub(crate) sampled: Sampled,
}

impl Estimated {
    pub(crate) fn error(&self) -> f64 {
        at_most_one(together(self.band_error, self.sampling_error))
    }

    /// States the larger errors of a wider band, and no less than a part of the change from the pass
    /// with the next narrower one.
    pub(crate) fn after(self, narrower: &Result<Self, Failure>) -> Self {
        let change = narrower
            .as_ref()
            .map_or(0.0, |narrower| (self.pick.velocity / narrower.pick.velocity - 1.0).abs());
        Self {
            band_error: at_most_one((WIDER_FACTOR * self.band_error).max(CHANGE_FACTOR * change)),
            sampling_error: at_most_one(WIDER_FACTOR * self.sampling_error),
            ..self
        }
    }

    /// Returns the arrival, found in `count` passes with this total number of pairs.
    pub(crate) fn arrival(self, count: u32, pairs_computed: u64) -> Arrival {
        let estimated_error = self.error();
        let Self { pick, sampled: last, .. } = self;
        Arrival {
            velocity: pick.velocity,
            directions: None,
            times: pick.times,
            amplitudes: pick.amplitudes,
            estimated_error,
            passes: Some(PassSummary { count, pairs_computed, last }),
        }
    }
}

impl BinTables {
    /// Returns the memory of a bin that is kept, without the contents of its lines, bytes.
    pub(crate) fn bytes(setup: &Setup, sampling: &WaveSampling) -> u64 {
        let lines = sampling.runs().len() * RUN;
        (Tables::bytes(setup, sampling) + TimeGrid::bytes(setup, lines)) as u64
    }

    /// Creates the tables of a bin, which are kept in `memory`, or recomputed whenever they are
    /// needed.
    pub(crate) fn new(
        setup: &Setup,
        sampling: WaveSampling,
        memory: Option<Arc<TableMemory>>,
    ) -> Self {
        let whole = velocity_taper(sampling.whole_band());
        // A velocity does not depend on the pulse's amplitude, not even in its last bit.
        let keep = memory.is_some();
        let tables = Tables::new(setup, sampling, Waves::Early, 1.0, whole, memory);
        let grid = TimeGrid::new(setup, &tables, keep);
        let first = Band::new(&tables, sampling.first_band());
        let wider = sampling.bands.windows(2).filter(|pair| pair[0] < pair[1]);
        let wider = wider.map(|pair| Band::new(&tables, pair[1])).collect();
        Self { tables, grid, first, wider }
    }
}

impl Band {
    fn new(tables: &Tables, band: f64) -> Self {
        let cut = velocity_taper(band);
        let lines = tables.lines_within(cut);
        let mut taper = tables.taper(cut);
        taper.truncate(lines.div_ceil(LANES));
        let mut others = vec![[Lanes::ZERO; LANES]; taper.len()];
        for (lane, (start, end)) in OTHER_TAPERS.into_iter().enumerate() {
            for (taper, weights) in others.iter_mut().zip(tables.taper((start * band, end * band)))
            {
                for (line, weight) in taper.iter_mut().zip(weights.0) {
                    line.0[lane] = weight;
                }
            }
        }
        if matches!(tables.sampling.grade, Grade::Quick | Grade::Plain) {
            add_parts(&mut taper, &others);
        }
        let pairs = tables.pairs(0..lines);
        let sampled = Sampled { band, period: tables.sampling.period, pairs };
        Self { sampled, lines, taper, others }
    }
}

/// Adds parts of the other tapers to the smooth one.
fn add_parts(smooth: &mut [Lanes], others: &[[Lanes; LANES]]) {
    for (taper, others) in smooth.iter_mut().zip(others) {
        for (own, weights) in taper.0.iter_mut().zip(others) {
            let parts = weights.0.iter().zip(TAPER_PARTS);
            *own += parts.fold(0.0, |sum, (other, part)| (other - *own).mul_add(part, sum));
        }
    }
}

impl Exact {
    /// Stores the extrema of the signals of its spectra in the workspace.
    ///
    /// # Errors
    /// If a number is not finite.
    pub(super) fn observe(
        &self,
        speed: f64,
        bin: &BinTables,
        band: &Band,
        workspace: &mut ExactWorkspace,
    ) -> Result<(), Failure> {
        if !workspace.spectra.is_finite() {
            return Err(pressure_not_finite());
        }
        let Self { setup, places, isa, .. } = self;
        isa.run(Observe { setup, places, bin, band, speed, workspace });
        Ok(())
    }

    /// Picks one of the extrema in the workspace, and estimates its error.
    ///
    /// # Errors
    /// If there is no acceptable pick.
    pub(super) fn picked(
        &self,
        bin: &BinTables,
        band: &Band,
        workspace: &ExactWorkspace,
    ) -> Result<Estimated, Failure> {
        let fc = self.setup.probe.center_frequency;
        let pick = pick(&self.setup.picking, fc, &self.distances, &workspace.windows)?;
        let moved = self.isa.run(Repick { bin, band, times: &pick.times, workspace });
        let changes: [f64; LANES] = std::array::from_fn(|taper| {
            let times: Vec<f64> = moved.iter().map(|times| times.0[taper]).collect();
            picking::slope(&self.distances, &times) / pick.velocity - 1.0
        });
        let band_error = BAND_FACTOR * slow_decay(&self.setup) * root_mean_square(&changes);
        let sampling_error = self.sampling_error(bin, band, &pick, workspace);
        Ok(Estimated {
            pick,
            band_error: at_most_one(band_error),
            sampling_error: at_most_one(sampling_error),
            sampled: band.sampled,
        })
    }

    /// Estimates the error that is due to the distances of samples and the ends of their sums.
    ///
    /// Before the earliest possible arrival the pressure is zero, except for waves that wrap round
    /// and for what the sums leave out. That noise goes on: its slope, divided by the curvature of the
    /// picked extremum, is the error of a time.
    fn sampling_error(
        &self,
        bin: &BinTables,
        band: &Band,
        pick: &Pick,
        workspace: &ExactWorkspace,
    ) -> f64 {
        let Self { setup, places, isa, .. } = self;
        let delays = isa.run(Listen { setup, places, bin, band, times: &pick.times, workspace });
        let mean = picking::mean(&pick.times);
        let spread = pick.times.iter().fold(0.0, |sum, t| (t - mean).mul_add(t - mean, sum));
        let (mut changes, mut worst) = ([0.0; BEFORE], 0.0);
        for (t, delays) in pick.times.iter().zip(&delays) {
            let weight = (t - mean) / spread;
            for (change, &delay) in changes.iter_mut().zip(delays) {
                *change = delay.mul_add(weight, *change);
            }
            worst = root_mean_square(delays).mul_add(weight.abs(), worst);
        }
        together(NOISE_FACTOR * root_mean_square(&changes), WORST_NOISE_FACTOR * worst)
    }
}

/// Returns the ratio of a band's error to what it would usually be with the same change by the other
/// tapers: in a thin plate, or on a heavy marrow, the error falls slowly with the band, which tapers do
/// not show.
pub(crate) fn slow_decay(setup: &Setup) -> f64 {
    let heaviness = (setup.layers.marrow.density / HEAVY_MARROW).max(1.0);
    (sampling::thinness(setup) * heaviness).min(SLOW_DECAY_MAX)
}

fn root_mean_square(values: &[f64]) -> f64 {
    let square = values.iter().fold(0.0, |sum, value| value.mul_add(*value, sum));
    (square / values.len() as f64).sqrt()
}

/// Returns the root of the sum of the squares of two errors.
fn together(one: f64, other: f64) -> f64 {
    one.mul_add(one, other * other).sqrt()
}

/// Returns an error; a signal that changes beyond recognition has the largest, not a failure.
fn at_most_one(error: f64) -> f64 {
    if error <= 1.0 { error } else { 1.0 }
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

/// Kernel that finds the times of the same extrema, s, with the spectra cut by each of the other
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

/// Kernel that looks at the signals before the earliest possible arrivals: the times, s, by which what
/// is there delays the picked extrema.
struct Listen<'a> {
    setup: &'a Setup,
    places: &'a [Place],
    bin: &'a BinTables,
    band: &'a Band,
    times: &'a [f64],
    workspace: &'a ExactWorkspace,
}

impl Kernel for Listen<'_> {
    type Output = Vec<[f64; BEFORE]>;

    #[inline(always)]
    fn run<V: Vector>(self) -> Vec<[f64; BEFORE]> {
        let Tables { sampling, runs, .. } = &self.bin.tables;
        let step = 1.0 / (BEFORE as f64 * self.setup.probe.center_frequency);
        let is_attenuated = self.setup.layers.attenuated().is_some();
        let growth = if is_attenuated { NOISE_GROWTH * sampling.damping } else { 0.0 };
        let mut delays = Vec::with_capacity(self.times.len());
        for (r, (&time, &place)) in self.times.iter().zip(self.places).enumerate() {
            let spectrum = &self.workspace.spectra.receiver(r)[..self.band.taper.len()];
            let signal = Signal { sampling, runs, spectrum };
            let earliest = sampling::earliest_arrival(self.setup, place, sampling.speed);
            // The last time is that of the pick.
            let mut times = Lanes([time; LANES]);
            for (i, t) in times.0[..BEFORE].iter_mut().enumerate() {
                *t = (i as f64 + 0.5).mul_add(-step, earliest);
            }
            let (slopes, curvatures) = signal.bends::<V>(&times, &self.band.taper);
            let delay = |i: usize| slopes.0[i] / curvatures.0[BEFORE];
            delays.push(std::array::from_fn(|i| match growth {
                0.0 => delay(i),
                growth => delay(i) * libm::exp(growth * (time - times.0[i])),
            }));
        }
        delays
    }
}
