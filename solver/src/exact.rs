//! Exact layers in (frequency, wavenumber).
//!
//! A bone is first computed with a quick sampling. Where that leaves a doubt (a large estimated
//! error, a ratio near the threshold, picks off their line, no pick at all) it is computed again
//! with a thorough one, which then decides; between doubt and none the two picks are blended, so that
//! the velocity stays a continuous function of the bone. All of this depends on the bone alone.

pub(crate) mod direct;
pub(crate) mod growth;
pub(crate) mod plate;
pub(crate) mod response;
pub(crate) mod series;
pub(crate) mod signal;
pub(crate) mod tables;
pub(crate) mod traces;

use std::sync::OnceLock;

use osteon_common::case::{Bone, Setup};
use osteon_common::limits::SAMPLING_PAIRS_MAX;
use osteon_common::outcome::FailureKind;
use osteon_common::sampling::{self, Grade, RUNGS, Sampling};

use crate::complex::Complex;
use crate::exact::plate::{AccuratePlate, FastPlate, Plate};
use crate::exact::response::Spectra;
use crate::exact::signal::{Grid, Signal, Slopes};
use crate::exact::tables::Tables;
use crate::isa::{Isa, Kernel};
use crate::lanes::{ComplexLanes, LANES, Lanes};
use crate::medium::Medium;
use crate::picking::{self, Pick, Window, pick};
use crate::solver::{Arrival, Failure, check_direct_wave, not_finite};
use crate::vector::{ComplexVector, Scalar, Vector};

/// A bone may need this many times the pairs of the setup's usual sampling limit before it fails.
const PAIRS_MARGIN: f64 = 8.0;
/// The tapers that the estimate of the error compares with: start and end over the band.
const NARROW_TAPERS: [(f64, f64); LANES] = [
    (0.4, 0.8),
    (0.5, 0.8),
    (0.6, 0.8),
    (0.4, 0.9),
    (0.5, 0.9),
    (0.6, 0.9),
    (0.4, 1.0),
    (0.7, 1.0),
];
/// Estimated error over the root mean square change of the velocity by the narrow tapers.
const ESTIMATE_FACTOR: f64 = 1.5;
/// Estimated errors, at refinement 1, between which a doubt grows from none to full.
const DOUBT_ERROR: (f64, f64) = (1e-4, 2e-4);
/// Delays of a pick after the earliest possible arrival, in periods of the centre frequency, between
/// which a doubt grows: a quick period has little room for a late packet.
const DOUBT_DELAY: (f64, f64) = (0.62, 0.72);
/// Times from a pick to the direct wave, in periods, between which a doubt shrinks.
const DOUBT_MARGIN: (f64, f64) = (1.1, 1.25);
/// Ratios over the threshold between which a doubt shrinks from full to none.
const DOUBT_RATIO: (f64, f64) = (1.2, 1.6);
/// Residuals, in periods of the centre frequency, between which a doubt grows.
const DOUBT_RESIDUAL: (f64, f64) = (0.02, 0.03);
/// Picks of two samplings that differ by more than this, in periods, are different extrema.
const SAME_EXTREMUM: f64 = 0.05;

/// The exact method for one setup, with the tables that all its realizations share.
#[derive(Debug)]
pub(crate) struct Exact {
    setup: Setup,
    distances: Vec<f64>,
    isa: Isa,
    /// One entry per rung of the speed ladder, made when a bone first needs it.
    quick: [OnceLock<Option<Box<Rung>>>; RUNGS],
    thorough: [OnceLock<Option<Box<Rung>>>; RUNGS],
}

/// Shared tables of one rung.
#[derive(Debug)]
struct Rung {
    tables: Tables,
    grid: Grid,
    taper: Vec<Lanes>,
    /// The tapers of the error estimate, side by side, per run and line.
    narrow: Vec<[Lanes; LANES]>,
}

/// Scratch memory of one thread; its contents never reach a result.
#[derive(Debug, Default)]
pub(crate) struct ExactWorkspace {
    plate: FastPlate,
    /// The plate of refinements above 1.
    accurate: AccuratePlate,
    spectra: Spectra,
    windows: Vec<Window>,
    slopes: Slopes,
    tapered: Vec<ComplexLanes>,
}

/// A pick with the estimate of its relative error.
struct Estimated {
    pick: Pick,
    error: f64,
}

impl Exact {
    pub(crate) fn new(setup: &Setup, isa: Isa) -> Self {
        Self {
            setup: *setup,
            distances: sampling::distances(setup).collect(),
            isa,
            quick: [const { OnceLock::new() }; RUNGS],
            thorough: [const { OnceLock::new() }; RUNGS],
        }
    }

    pub(crate) fn arrival(
        &self,
        bone: &Bone,
        workspace: &mut ExactWorkspace,
    ) -> Result<Arrival, Failure> {
        let thickness = self.setup.layers.bone_thickness;
        let grade = sampling::first_grade(&self.setup);
        let medium = match grade {
            Grade::Quick => {
                self.isa.run(FillPlate { bone, thickness, plate: &mut workspace.plate })
            }
            Grade::Thorough => {
                self.isa.run(FillPlate { bone, thickness, plate: &mut workspace.accurate })
            }
        };
        let speed = medium.fastest.max(self.setup.layers.marrow.sound_speed);
        if !speed.is_finite() {
            return Err(not_finite("the bone's wave speeds"));
        }
        check_direct_wave(&self.setup, speed)?;
        let first = self.picked(&medium, speed, grade, workspace);
        if grade == Grade::Thorough {
            return first.map(Estimated::arrival);
        }
        let doubt = first.as_ref().map_or(1.0, |first| self.doubt(first, speed));
        match first {
            Ok(first) if doubt == 0.0 => Ok(first.arrival()),
            first => {
                let second = self.picked(&medium, speed, Grade::Thorough, workspace)?;
                match first {
                    Ok(first) if self.same_extremum(&first.pick, &second.pick) => {
                        self.blended(&first, &second, doubt)
                    }
                    _ => Ok(second.arrival()),
                }
            }
        }
    }

    /// How much a quick pick is doubted, 0 to 1, continuously.
    fn doubt(&self, first: &Estimated, speed: f64) -> f64 {
        let fc = self.setup.probe.center_frequency;
        let (mut delay, mut margin) = (0.0_f64, f64::INFINITY);
        for (&x, t) in self.distances.iter().zip(&first.pick.times) {
            delay = delay.max(t - sampling::earliest_arrival(&self.setup, x, speed));
            margin = margin.min(sampling::direct_arrival(&self.setup, x) - t);
        }
        let ratio = first.pick.ratio / self.setup.picking.threshold;
        rise(first.error, DOUBT_ERROR)
            .max(rise(delay * fc, DOUBT_DELAY))
            .max(rise(first.pick.residual * fc, DOUBT_RESIDUAL))
            .max(1.0 - rise(margin * fc, DOUBT_MARGIN))
            .max(1.0 - rise(ratio, DOUBT_RATIO))
    }

    fn same_extremum(&self, first: &Pick, second: &Pick) -> bool {
        let most = SAME_EXTREMUM / self.setup.probe.center_frequency;
        first.times.iter().zip(&second.times).all(|(a, b)| (a - b).abs() <= most)
    }

    fn blended(
        &self,
        first: &Estimated,
        second: &Estimated,
        doubt: f64,
    ) -> Result<Arrival, Failure> {
        let blend = |a: f64, b: f64| (b - a).mul_add(doubt, a);
        let times: Vec<f64> =
            first.pick.times.iter().zip(&second.pick.times).map(|(&a, &b)| blend(a, b)).collect();
        let fc = self.setup.probe.center_frequency;
        let (velocity, _) = picking::line(&self.distances, &times, fc)?;
        Ok(Arrival { velocity, times, estimated_error: blend(first.error, second.error) })
    }

    /// The pick of a plate that fills the workspace.
    fn picked(
        &self,
        medium: &Medium,
        speed: f64,
        grade: Grade,
        workspace: &mut ExactWorkspace,
    ) -> Result<Estimated, Failure> {
        let rung = self.rung(speed, grade)?;
        let ExactWorkspace { plate, accurate, spectra, .. } = workspace;
        match sampling::first_grade(&self.setup) {
            Grade::Quick => spectra.fill(self.isa, &rung.tables, medium, plate),
            Grade::Thorough => spectra.fill(self.isa, &rung.tables, medium, accurate),
        }
        if !spectra.is_finite() {
            return Err(not_finite("the pressure"));
        }
        self.isa.run(Observe { exact: self, rung, speed, workspace });
        let fc = self.setup.probe.center_frequency;
        let pick = pick(&self.setup.picking, fc, &self.distances, &workspace.windows)?;
        let moved = self.isa.run(Repick { rung, times: &pick.times, workspace });
        let mut square = 0.0;
        for taper in 0..LANES {
            let times: Vec<f64> = moved.iter().map(|times| times.0[taper]).collect();
            let change = picking::slope(&self.distances, &times) / pick.velocity - 1.0;
            square = change.mul_add(change, square);
        }
        let error = ESTIMATE_FACTOR * (square / LANES as f64).sqrt();
        // A signal that changes past recognition makes the largest error, not a failure.
        Ok(Estimated { pick, error: if error <= 1.0 { error } else { 1.0 } })
    }

    fn rung(&self, speed: f64, grade: Grade) -> Result<&Rung, Failure> {
        let too_large = || Failure {
            kind: FailureKind::NoConvergence,
            detail: format!(
                "waves of up to {speed:.0} m/s need more than {:.0e} (frequency, wavenumber) pairs",
                PAIRS_MARGIN * SAMPLING_PAIRS_MAX
            ),
        };
        let index = sampling::rung(&self.setup, speed).ok_or_else(too_large)?;
        let rungs = match grade {
            Grade::Quick => &self.quick,
            Grade::Thorough => &self.thorough,
        };
        let rung = rungs[index].get_or_init(|| {
            let sampling = Sampling::at_rung(&self.setup, index, grade);
            if sampling.pairs() > PAIRS_MARGIN * SAMPLING_PAIRS_MAX {
                return None;
            }
            // A velocity does not depend on the pulse's amplitude, not even in its last bit.
            let tables = Tables::new(&self.setup, sampling, 1.0);
            let grid = Grid::new(&self.setup, &tables);
            let taper = tables.taper(sampling.taper_start, sampling.band);
            let narrow = narrow_tapers(&tables);
            Some(Box::new(Rung { tables, grid, taper, narrow }))
        });
        rung.as_deref().ok_or_else(too_large)
    }
}

/// 0 up to `from`, 1 from `to` on, linear between.
fn rise(value: f64, (from, to): (f64, f64)) -> f64 {
    ((value - from) / (to - from)).clamp(0.0, 1.0)
}

impl Estimated {
    fn arrival(self) -> Arrival {
        let Self { pick, error } = self;
        Arrival { velocity: pick.velocity, times: pick.times, estimated_error: error }
    }
}

impl Rung {
    /// The signal at receiver `r` with its band cut by `taper`, in the memory of `tapered`.
    #[inline(always)]
    fn signal<'a>(
        &'a self,
        spectra: &Spectra,
        r: usize,
        taper: &[Lanes],
        tapered: &'a mut Vec<ComplexLanes>,
    ) -> Signal<'a> {
        tapered.clear();
        for (run, &weights) in spectra.receiver(r).iter().zip(taper) {
            tapered.push(ComplexLanes { re: run.re * weights, im: run.im * weights });
        }
        Signal { sampling: &self.tables.sampling, runs: &self.tables.runs, spectrum: tapered }
    }
}

/// Computes what a plate's admittances have in common.
pub(crate) struct FillPlate<'a, const TERMS: usize> {
    pub(crate) bone: &'a Bone,
    pub(crate) thickness: f64,
    pub(crate) plate: &'a mut Plate<TERMS>,
}

impl<const TERMS: usize> Kernel for FillPlate<'_, TERMS> {
    type Output = Medium;

    #[inline(always)]
    fn run<V: Vector>(self) -> Medium {
        let medium = Medium::new(self.bone);
        self.plate.fill::<V>(&medium, self.thickness);
        medium
    }
}

/// Lists the extrema of the pressure at every receiver.
struct Observe<'a> {
    exact: &'a Exact,
    rung: &'a Rung,
    /// Bound of every wave's speed, m/s.
    speed: f64,
    workspace: &'a mut ExactWorkspace,
}

impl Kernel for Observe<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let ExactWorkspace { spectra, windows, slopes, tapered, .. } = self.workspace;
        let setup = &self.exact.setup;
        windows.resize_with(self.exact.distances.len(), Window::default);
        for (r, (window, &x)) in windows.iter_mut().zip(&self.exact.distances).enumerate() {
            let signal = self.rung.signal(spectra, r, &self.rung.taper, tapered);
            let from = sampling::earliest_arrival(setup, x, self.speed);
            let to = sampling::direct_arrival(setup, x);
            let last = signal.extrema::<V>(&self.rung.grid, from, to, slopes, &mut window.extrema);
            window.last = last.abs();
            window.drop_noise();
        }
    }
}

/// The same extrema, s, of the spectra in the workspace cut by each of the narrow tapers.
struct Repick<'a> {
    rung: &'a Rung,
    times: &'a [f64],
    workspace: &'a ExactWorkspace,
}

impl Kernel for Repick<'_> {
    type Output = Vec<Lanes>;

    #[inline(always)]
    fn run<V: Vector>(self) -> Vec<Lanes> {
        let Tables { sampling, runs, .. } = &self.rung.tables;
        let mut moved = Vec::with_capacity(self.times.len());
        for (r, &time) in self.times.iter().enumerate() {
            let signal = Signal { sampling, runs, spectrum: self.workspace.spectra.receiver(r) };
            moved.push(signal.moved_extrema::<V>(time, &self.rung.narrow));
        }
        moved
    }
}

/// The tapers of the error estimate, side by side, per run and line.
fn narrow_tapers(tables: &Tables) -> Vec<[Lanes; LANES]> {
    let band = tables.sampling.band;
    let mut tapers = vec![[Lanes::ZERO; LANES]; tables.runs.len()];
    for (lane, (start, end)) in NARROW_TAPERS.into_iter().enumerate() {
        for (taper, weights) in tapers.iter_mut().zip(tables.taper(start * band, end * band)) {
            for (line, weight) in taper.iter_mut().zip(weights.0) {
                line.0[lane] = weight;
            }
        }
    }
    tapers
}

/// Admittance Y(k, s) = û3(0)/p̂(0), m/Pa, of the bone on its marrow.
///
/// `k` in rad/m, of either sign; `s` in 1/s with a positive real part.
pub fn admittance(setup: &Setup, bone: &Bone, k: f64, s: Complex) -> Complex {
    let medium = Medium::new(bone);
    let mut plate = AccuratePlate::default();
    plate.fill::<Scalar>(&medium, setup.layers.bone_thickness);
    plate.prepare::<Scalar>(&medium, s, (k.abs(), k.abs()));
    let load = tables::marrow_load(setup, s, k, true);
    let splat = |z: Complex| ComplexVector { re: Scalar::splat(z.re), im: Scalar::splat(z.im) };
    let mut impedance = ComplexLanes::ZERO;
    plate.impedance(Scalar::splat(k), splat(load)).store(&mut impedance, 0);
    -(Complex::new(1.0, 0.0) / Complex::new(impedance.re.0[0], impedance.im.0[0]))
}
