//! Exact layers in the (frequency, wavenumber) domain.
//!
//! A bone is computed in one or several passes (`passes.rs`). The first pass is quick and sufficient for
//! most bones. As long as its estimated error is large, the band is widened, and then the sampling is
//! made finer, as it is at once where the first arrival is small compared with later waves. If the pick
//! is unreliable (late, weak, off the line of the others, or missing), the bone is computed again with
//! a thorough sampling, whose band is widened if it finds nothing or its estimated error is large. So it
//! is if the sampling's part of the error is large, or the whole error remains large after all bands; if
//! the sampling's part is still large, the last passes are finer and leave nothing out.
//! The results of two passes are blended with a weight from 0 (the first pass is reliable) to 1
//! (the second replaces it). The tables are made for a geometric grid of speeds, whose intervals
//! are called speed bins; near the edge of a bin the results of both neighbours are blended, too.
//! So the velocity remains a continuous function of the bone. All of this depends on the bone
//! alone.

pub(crate) mod attenuation;
pub(crate) mod direct;
pub(crate) mod growth;
pub(crate) mod guided;
pub(crate) mod pass;
mod passes;
pub(crate) mod plate;
#[cfg(feature = "measure")]
pub(crate) mod quantities;
pub(crate) mod response;
pub(crate) mod series;
pub(crate) mod signal;
#[cfg(feature = "measure")]
pub mod stages;
pub(crate) mod table_cache;
pub(crate) mod tables;
pub(crate) mod tilted;
pub(crate) mod traces;

use std::sync::Arc;

use osteon_common::case::{Bone, Setup};
use osteon_common::outcome::FailureKind;
use osteon_common::probe::Place;
use osteon_common::sampling::{self, Grade, OuterFaces};

use crate::exact::pass::{Estimated, ExactWorkspace, slow_decay};
use crate::exact::passes::BonePasses;
use crate::exact::plate::Plate;
use crate::exact::table_cache::{PAIRS_MAX, TableCache, TableMemory, TablesRef};
use crate::isa::{Isa, Kernel};
use crate::medium::Medium;
use crate::picking::{self, Pick};
use crate::solver::{Arrival, Failure, check_direct_wave, readable, speed_not_finite};
use crate::vector::Vector;

/// Factor of the refinement in the last passes, at refinement 1 and below.
const LAST_REFINEMENT: f64 = 4.0;
/// Delays of a pick after the earliest possible arrival, in periods of the centre frequency,
/// between which the weight of the next pass rises: a quick sampling has room for packets up to
/// [`sampling::QUICK_LATEST`].
const LATE: (f64, f64) = (1.2, 1.3);
/// Times from a pick to the direct wave, in periods, between which the weight of the next pass
/// falls.
const NEAR_DIRECT_WAVE: (f64, f64) = (0.02, 0.05);
/// Ratios to the threshold between which the weight of the next pass falls.
const WEAK: (f64, f64) = (1.05, 1.1);
/// Ratios of a skipped extremum to the threshold between which the weight of the next pass rises.
const NEARLY_PICKED: (f64, f64) = (0.9, 0.95);
/// Times from a pick to the earliest possible echo, in periods, between which the weight of the
/// result without outer faces rises.
const BEFORE_ECHO: (f64, f64) = (0.0, 0.1);
/// Ratio of a pick to the largest wave in its window below which an echo may hide it as noise.
const FAINT: f64 = 10.0 * picking::FLOOR;
/// Distances from the line, in periods, between which the weight of the next pass rises.
const OFF_LINE: (f64, f64) = (0.02, 0.03);
/// Picks of two passes that differ by more than this, in periods, belong to different extrema.
const SAME_EXTREMUM: f64 = 0.05;

/// The exact method for one setup, with the tables that all its realizations share. Clones share
/// them.
#[derive(Debug, Clone)]
pub(crate) struct Exact {
    setup: Setup,
    /// Distances of the receivers along the probe, m.
    distances: Vec<f64>,
    places: Vec<Place>,
    isa: Isa,
    without_faces: Arc<GradeCaches>,
    with_faces: Arc<GradeCaches>,
}

/// The tables of every grade.
#[derive(Debug)]
struct GradeCaches {
    quick: TableCache,
    plain: TableCache,
    thorough: TableCache,
    full: TableCache,
}

impl Exact {
    /// Creates the method with `memory` for its tables.
    pub(crate) fn new(setup: &Setup, isa: Isa, memory: &Arc<TableMemory>) -> Self {
        Self {
            setup: *setup,
            distances: setup.probe.distances().collect(),
            places: setup.probe.places().collect(),
            isa,
            without_faces: Arc::new(GradeCaches::new(setup, OuterFaces::None, memory)),
            with_faces: Arc::new(GradeCaches::new(setup, OuterFaces::Audible, memory)),
        }
    }

    /// Returns the method for a setup that has the same tables ([`has_tables_of`]), and shares them.
    pub(crate) fn sharing(&self, setup: &Setup) -> Self {
        Self { setup: *setup, ..self.clone() }
    }

    pub(crate) fn arrival(
        &self,
        bone: &Bone,
        workspace: &mut ExactWorkspace,
    ) -> Result<Arrival, Failure> {
        let (medium, speed) = self.solid(bone)?;
        let bin = sampling::speed_bin(&self.setup, speed).ok_or_else(|| too_large(speed))?;
        let caches = &self.without_faces;
        let mut passes = BonePasses::new(self, caches, &medium, speed, bin, workspace);
        let mut found = passes.in_bins();
        if self.needs_faces(&found, speed) {
            passes.caches = &self.with_faces;
            found = self.with_echoes(found, passes.in_bins(), speed);
        }
        let BonePasses { count, pairs, .. } = passes;
        found.map(|found| found.arrival(count, pairs))
    }

    /// Returns the solid of a bone, and the upper bound of every wave's speed, m/s.
    fn solid(&self, bone: &Bone) -> Result<(Medium, f64), Failure> {
        let medium = self.isa.run(Solid(bone));
        let speed = sampling::fastest(&self.setup, medium.fastest);
        if !speed.is_finite() {
            return Err(speed_not_finite());
        }
        check_direct_wave(&self.setup, speed)?;
        Ok((medium, speed))
    }

    /// Fills `plate` for `medium`.
    fn fill_plate<const TERMS: usize>(&self, medium: &Medium, plate: &mut Plate<TERMS>) {
        let thickness = self.setup.layers.bone_thickness;
        self.isa.run(FillPlate { medium, thickness, plate });
    }

    /// Returns a cache's tables of a speed bin; `speed` (m/s) is named if they are too large.
    fn bin_tables<'a>(
        &self,
        cache: &'a TableCache,
        index: usize,
        speed: f64,
    ) -> Result<TablesRef<'a>, Failure> {
        cache.tables(index).ok_or_else(|| too_large(speed))
    }

    /// Returns a stated error as it compares with the constants above, which are meant for refinement
    /// 1 and a thick plate on light marrow: a user who sets a lower refinement accepts larger
    /// errors, and expects smaller ones of a higher refinement.
    fn counted(&self, error: f64) -> f64 {
        let refinement = self.setup.solver.refinement;
        let power = if refinement < 1.0 { 3.0 } else { 1.5 };
        error * libm::pow(refinement, power) / slow_decay(&self.setup).sqrt()
    }

    /// Returns whether reflections of the outer faces may change the pick that was found without
    /// them.
    fn needs_faces(&self, found: &Result<Estimated, Failure>, speed: f64) -> bool {
        let is_certain = |found: &Estimated| {
            self.time_to_echo(found, speed) > picking::PACKET_PERIODS
                && found.pick.prominence > FAINT
        };
        sampling::echoes_are_audible(&self.setup, speed) && !found.as_ref().is_ok_and(is_certain)
    }

    /// Chooses between the results without and with outer faces. The faces may change which extremum
    /// is picked, but not its time before the earliest echo, which is more accurate without the
    /// waves that they keep in the fluids.
    fn with_echoes(
        &self,
        without: Result<Estimated, Failure>,
        with: Result<Estimated, Failure>,
        speed: f64,
    ) -> Result<Estimated, Failure> {
        let time = without.as_ref().map_or(0.0, |found| self.time_to_echo(found, speed));
        let weight = 1.0 - rise(time, BEFORE_ECHO);
        self.merged(without, with, weight)
    }

    /// Returns the least time from a pick to the earliest possible echo, in periods.
    fn time_to_echo(&self, found: &Estimated, speed: f64) -> f64 {
        let echo = |&place: &Place| sampling::earliest_echo(&self.setup, place, speed);
        let echoes = self.places.iter().map(echo);
        let times = echoes.zip(&found.pick.times).map(|(echo, t)| echo - t);
        times.fold(f64::INFINITY, f64::min) * self.setup.probe.center_frequency
    }

    /// Returns the weight of the thorough pass, a continuous function of how unreliable a pick is:
    /// 0 keeps the pick, and 1 replaces it.
    fn fallback_weight(&self, found: &Estimated, speed: f64) -> f64 {
        let fc = self.setup.probe.center_frequency;
        let (mut delay, mut margin) = (0.0_f64, f64::INFINITY);
        for (&place, t) in self.places.iter().zip(&found.pick.times) {
            delay = delay.max(t - sampling::earliest_arrival(&self.setup, place, speed));
            margin = margin.min(sampling::direct_arrival(&self.setup, place) - t);
        }
        let ratio = found.pick.ratio / self.setup.picking.threshold;
        let skipped = found.pick.skipped / self.setup.picking.threshold;
        rise(delay * fc, LATE)
            .max(rise(found.pick.residual * fc, OFF_LINE))
            .max(rise(skipped, NEARLY_PICKED))
            .max(1.0 - rise(margin * fc, NEAR_DIRECT_WAVE))
            .max(1.0 - rise(ratio, WEAK))
    }

    /// Blends the results of two passes for one bone; `weight` is that of the second.
    fn merged(
        &self,
        first: Result<Estimated, Failure>,
        second: Result<Estimated, Failure>,
        weight: f64,
    ) -> Result<Estimated, Failure> {
        match (first, second) {
            (Ok(first), Ok(second)) if weight < 1.0 && self.same_extremum(&first, &second) => {
                self.blended(&first, &second, weight)
            }
            (_, second) => second,
        }
    }

    /// Same as [`merged`], unless the second pass exceeds the limit of the computation: then the
    /// first result is kept, with its error.
    fn merged_if_possible(
        &self,
        first: Result<Estimated, Failure>,
        second: Result<Estimated, Failure>,
        weight: f64,
    ) -> Result<Estimated, Failure> {
        match second {
            Err(Failure { kind: FailureKind::NoConvergence, .. }) => first,
            second => self.merged(first, second, weight),
        }
    }

    fn same_extremum(&self, first: &Estimated, second: &Estimated) -> bool {
        let most = SAME_EXTREMUM / self.setup.probe.center_frequency;
        first.pick.times.iter().zip(&second.pick.times).all(|(a, b)| (a - b).abs() <= most)
    }

    fn blended(
        &self,
        first: &Estimated,
        second: &Estimated,
        weight: f64,
    ) -> Result<Estimated, Failure> {
        let blend = |a: f64, b: f64| (b - a).mul_add(weight, a);
        let blend_all = |first: &[f64], second: &[f64]| -> Vec<f64> {
            first.iter().zip(second).map(|(&a, &b)| blend(a, b)).collect()
        };
        let times = blend_all(&first.pick.times, &second.pick.times);
        let amplitudes = blend_all(&first.pick.amplitudes, &second.pick.amplitudes);
        let fc = self.setup.probe.center_frequency;
        let (velocity, residual) = picking::line(&self.distances, &times, fc)?;
        let ratio = blend(first.pick.ratio, second.pick.ratio);
        let skipped = blend(first.pick.skipped, second.pick.skipped);
        let prominence = blend(first.pick.prominence, second.pick.prominence);
        let band_error = blend(first.band_error, second.band_error);
        let sampling_error = blend(first.sampling_error, second.sampling_error);
        let pick = Pick { velocity, times, amplitudes, ratio, skipped, residual, prominence };
        Ok(Estimated { pick, band_error, sampling_error, sampled: second.sampled })
    }
}

fn too_large(speed: f64) -> Failure {
    Failure {
        kind: FailureKind::NoConvergence,
        detail: format!(
            "waves of up to {} m/s need more than {:.0e} (frequency, wavenumber) pairs",
            readable(speed),
            PAIRS_MAX
        ),
    }
}

/// Returns 0 up to `from`, 1 from `to` on, and linear values between.
fn rise(value: f64, (from, to): (f64, f64)) -> f64 {
    ((value - from) / (to - from)).clamp(0.0, 1.0)
}

/// Returns whether two setups have the same tables: they describe coupling, marrow, probe and
/// sampling, not what is picked, and depend on the bone's thickness by the band that a thin plate needs
/// alone.
pub(crate) fn has_tables_of(setup: &Setup, other: &Setup) -> bool {
    let mut alike = *setup;
    alike.layers.bone_thickness = other.layers.bone_thickness;
    alike.picking = other.picking;
    alike == *other && sampling::thinness(setup).to_bits() == sampling::thinness(other).to_bits()
}

impl GradeCaches {
    fn new(setup: &Setup, faces: OuterFaces, memory: &Arc<TableMemory>) -> Self {
        let mut refined = *setup;
        if sampling::first_grade(setup) != Grade::Thorough {
            refined.solver.refinement *= LAST_REFINEMENT;
        }
        Self {
            quick: TableCache::new(setup, Grade::Quick, faces, memory),
            plain: TableCache::new(setup, Grade::Plain, faces, memory),
            thorough: TableCache::new(setup, Grade::Thorough, faces, memory),
            full: TableCache::new(&refined, Grade::Full, faces, memory),
        }
    }
}

/// Kernel that converts a tensor into the system's coefficients.
pub(crate) struct Solid<'a>(pub(crate) &'a Bone);

impl Kernel for Solid<'_> {
    type Output = Medium;

    #[inline(always)]
    fn run<V: Vector>(self) -> Medium {
        Medium::new(self.0)
    }
}

/// Kernel that computes the part common to all of a plate's admittances.
pub(crate) struct FillPlate<'a, const TERMS: usize> {
    pub(crate) medium: &'a Medium,
    pub(crate) thickness: f64,
    pub(crate) plate: &'a mut Plate<TERMS>,
}

impl<const TERMS: usize> Kernel for FillPlate<'_, TERMS> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        self.plate.fill::<V>(self.medium, self.thickness);
    }
}
