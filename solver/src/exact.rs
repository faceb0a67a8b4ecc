//! Exact layers in the (frequency, wavenumber) domain.
//!
//! A bone is computed in several passes, called looks. The first look is quick and sufficient for
//! most bones. If its estimated error is large, the band is widened. If the first arrival is small
//! compared to later waves, the same is done without thinning. If a doubt remains (a late or weak
//! pick, picks off their line, no pick at all), the bone is computed again with a thorough
//! sampling, and if even that finds nothing or its estimated error is large, with a refined one.
//! The doubt is a number from 0 to 1, with which the results of two looks are blended; those of
//! neighbouring rungs of the speed ladder (a geometric grid of speeds) are blended, too. So the
//! velocity remains a continuous function of the bone. All of this depends on the bone alone.

pub(crate) mod direct;
pub(crate) mod growth;
pub(crate) mod ladder;
pub(crate) mod look;
pub(crate) mod plate;
#[cfg(feature = "measure")]
pub(crate) mod quantities;
pub(crate) mod response;
pub(crate) mod series;
pub(crate) mod signal;
#[cfg(feature = "measure")]
pub mod stages;
pub(crate) mod tables;
pub(crate) mod traces;

use osteon_common::case::{Bone, Setup};
use osteon_common::limits::SAMPLING_PAIRS_MAX;
use osteon_common::outcome::FailureKind;
use osteon_common::sampling::{self, Grade};

use crate::exact::ladder::{Held, KeptBytes, Ladder, PAIRS_MARGIN};
use crate::exact::look::{Estimated, ExactWorkspace, Look, Rung};
use crate::exact::plate::Plate;
use crate::isa::{Isa, Kernel};
use crate::medium::Medium;
use crate::picking::{self, Pick};
use crate::solver::{Arrival, Failure, check_direct_wave, readable, speed_not_finite};
use crate::vector::Vector;

/// Estimated errors, at refinement 1, between which the doubt whether the band is wide enough rises
/// from 0 to 1.
const NARROW_BAND: (f64, f64) = (4.5e-5, 7.5e-5);
/// The same for every other doubt.
const LARGE_ERROR: (f64, f64) = (7e-5, 1.2e-4);
/// Refinement of the last look.
const LAST_REFINEMENT: f64 = 4.0;
/// Delays of a pick after the earliest possible arrival, in periods of the centre frequency,
/// between which the doubt rises: a quick period has little room for a late packet.
const LATE: (f64, f64) = (0.62, 0.72);
/// Times from a pick to the direct wave, in periods, between which the doubt falls.
const NEAR_DIRECT_WAVE: (f64, f64) = (1.1, 1.25);
/// Ratios to the threshold between which the doubt falls.
const WEAK: (f64, f64) = (1.2, 1.6);
/// Distances from the line, in periods, between which the doubt rises.
const OFF_LINE: (f64, f64) = (0.02, 0.03);
/// Ratios of a pick to the largest wave in its window between which the doubt falls: the errors of
/// thinning and of leaving out slow waves reach some 1e-5 of that wave.
const SMALL: (f64, f64) = (0.02, 0.03);
/// Picks of two looks that differ by more than this, in periods, belong to different extrema.
const SAME_EXTREMUM: f64 = 0.05;

/// The exact method for one setup, with the tables that all its realizations share.
#[derive(Debug)]
pub(crate) struct Exact {
    setup: Setup,
    distances: Vec<f64>,
    isa: Isa,
    quick: Ladder,
    plain: Ladder,
    thorough: Ladder,
    refined: Ladder,
    kept: KeptBytes,
}

impl Exact {
    pub(crate) fn new(setup: &Setup, isa: Isa) -> Self {
        let mut refined = *setup;
        refined.solver.refinement *= LAST_REFINEMENT;
        Self {
            setup: *setup,
            distances: sampling::distances(setup).collect(),
            isa,
            quick: Ladder::new(setup, Grade::Quick),
            plain: Ladder::new(setup, Grade::Plain),
            thorough: Ladder::new(setup, Grade::Thorough),
            refined: Ladder::new(&refined, Grade::Thorough),
            kept: KeptBytes::default(),
        }
    }

    pub(crate) fn arrival(
        &self,
        bone: &Bone,
        workspace: &mut ExactWorkspace,
    ) -> Result<Arrival, Failure> {
        let (medium, speed) = self.solid(bone)?;
        let rung = sampling::rung(&self.setup, speed).ok_or_else(|| too_large(speed))?;
        let mut sight =
            Sight { exact: self, medium: &medium, speed, rung, workspace, count: 0, pairs: 0 };
        let mut found = sight.looks();
        let next = sampling::nearness_to_next(&self.setup, rung, speed);
        if next > 0.0 {
            sight.rung += 1;
            found = self.merged_if_possible(found, sight.looks(), next);
        }
        let Sight { count, pairs, .. } = sight;
        found.map(|found| found.arrival(count, pairs))
    }

    /// Returns the solid of a bone, and the upper bound of every wave's speed, m/s.
    fn solid(&self, bone: &Bone) -> Result<(Medium, f64), Failure> {
        let medium = self.isa.run(Solid(bone));
        let speed = medium.fastest.max(self.setup.layers.marrow.sound_speed);
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

    /// Returns the rung of a ladder that a bone with waves of up to `speed` (m/s) needs.
    fn rung<'a>(&self, ladder: &'a Ladder, index: usize, speed: f64) -> Result<Held<'a>, Failure> {
        ladder.rung(index, &self.kept).ok_or_else(|| too_large(speed))
    }

    /// Returns an estimated error as it compares with the constants above, which are meant for
    /// refinement 1: a user who sets a lower refinement accepts larger errors.
    fn counted(&self, error: f64) -> f64 {
        let refinement = self.setup.solver.refinement.min(1.0);
        error * refinement * refinement * refinement
    }

    /// Returns the doubt in a pick, from 0 to 1, as a continuous function.
    fn doubt(&self, found: &Estimated, speed: f64) -> f64 {
        let fc = self.setup.probe.center_frequency;
        let (mut delay, mut margin) = (0.0_f64, f64::INFINITY);
        for (&x, t) in self.distances.iter().zip(&found.pick.times) {
            delay = delay.max(t - sampling::earliest_arrival(&self.setup, x, speed));
            margin = margin.min(sampling::direct_arrival(&self.setup, x) - t);
        }
        let ratio = found.pick.ratio / self.setup.picking.threshold;
        rise(self.counted(found.error), LARGE_ERROR)
            .max(rise(delay * fc, LATE))
            .max(rise(found.pick.residual * fc, OFF_LINE))
            .max(1.0 - rise(margin * fc, NEAR_DIRECT_WAVE))
            .max(1.0 - rise(ratio, WEAK))
    }

    /// Blends the results of two looks at one bone, where the second has the doubt in the first as
    /// its weight.
    fn merged(
        &self,
        first: Result<Estimated, Failure>,
        second: Result<Estimated, Failure>,
        doubt: f64,
    ) -> Result<Estimated, Failure> {
        match (first, second) {
            (Ok(first), Ok(second)) if doubt < 1.0 && self.same_extremum(&first, &second) => {
                self.blended(&first, &second, doubt)
            }
            (_, second) => second,
        }
    }

    /// Same as [`merged`], unless the second look exceeds the limit of the computation: then the
    /// first result is kept, with its error.
    fn merged_if_possible(
        &self,
        first: Result<Estimated, Failure>,
        second: Result<Estimated, Failure>,
        doubt: f64,
    ) -> Result<Estimated, Failure> {
        match second {
            Err(Failure { kind: FailureKind::NoConvergence, .. }) => first,
            second => self.merged(first, second, doubt),
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
        let pairs = first.pick.times.iter().zip(&second.pick.times);
        let times: Vec<f64> = pairs.map(|(&a, &b)| blend(a, b)).collect();
        let fc = self.setup.probe.center_frequency;
        let (velocity, residual) = picking::line(&self.distances, &times, fc)?;
        let ratio = blend(first.pick.ratio, second.pick.ratio);
        let prominence = blend(first.pick.prominence, second.pick.prominence);
        let error = blend(first.error, second.error);
        let pick = Pick { velocity, times, ratio, residual, prominence };
        Ok(Estimated { pick, error, sampled: second.sampled })
    }
}

fn too_large(speed: f64) -> Failure {
    Failure {
        kind: FailureKind::NoConvergence,
        detail: format!(
            "waves of up to {} m/s need more than {:.0e} (frequency, wavenumber) pairs",
            readable(speed),
            PAIRS_MARGIN * SAMPLING_PAIRS_MAX
        ),
    }
}

/// Returns 0 up to `from`, 1 from `to` on, and linear values between.
fn rise(value: f64, (from, to): (f64, f64)) -> f64 {
    ((value - from) / (to - from)).clamp(0.0, 1.0)
}

/// State of the computation of one bone.
struct Sight<'a> {
    exact: &'a Exact,
    medium: &'a Medium,
    /// Upper bound of every wave's speed, m/s.
    speed: f64,
    /// The rung that is used of every ladder.
    rung: usize,
    workspace: &'a mut ExactWorkspace,
    /// Number of looks so far.
    count: u32,
    /// Number of (frequency, wavenumber) pairs computed so far.
    pairs: u64,
}

impl Sight<'_> {
    /// Makes as many looks as the bone needs.
    fn looks(&mut self) -> Result<Estimated, Failure> {
        let exact = self.exact;
        if sampling::first_grade(&exact.setup) == Grade::Thorough {
            return self.thorough(&exact.thorough);
        }
        let mut found = self.quick(&exact.quick);
        let doubt = found.as_ref().map_or(0.0, |found| 1.0 - rise(found.pick.prominence, SMALL));
        if doubt > 0.0 {
            let plain = self.quick(&exact.plain);
            found = exact.merged(found, plain, doubt);
        }
        let doubt = found.as_ref().map_or(1.0, |found| exact.doubt(found, self.speed));
        if doubt > 0.0 {
            let last = self.careful();
            found = exact.merged(found, last, doubt);
        }
        found
    }

    /// Makes a look in the first band, and one in the whole band if that is needed.
    fn quick(&mut self, ladder: &Ladder) -> Result<Estimated, Failure> {
        let exact = self.exact;
        let rung = &*exact.rung(ladder, self.rung, self.speed)?;
        exact.fill_plate(self.medium, &mut self.workspace.fast);
        self.workspace.spectra.clear(&rung.tables);
        self.fill(rung, 0, rung.first.lines);
        let mut found = self.look(rung, &rung.first);
        let doubt =
            found.as_ref().map_or(1.0, |found| rise(exact.counted(found.error), NARROW_BAND));
        if doubt > 0.0 {
            self.fill(rung, rung.first.lines, rung.whole.lines);
            let wider = self.look(rung, &rung.whole);
            found = exact.merged(found, wider, doubt);
        }
        found
    }

    /// Makes a thorough look, and a refined one if that is needed.
    fn careful(&mut self) -> Result<Estimated, Failure> {
        let exact = self.exact;
        let thorough = self.thorough(&exact.thorough);
        let doubt = match &thorough {
            Ok(found) => rise(exact.counted(found.error), LARGE_ERROR),
            // Whether there is an arrival is decided by the best look.
            Err(Failure {
                kind: FailureKind::NoArrival | FailureKind::InconsistentArrival,
                ..
            }) => 1.0,
            Err(_) => 0.0,
        };
        if doubt == 0.0 {
            return thorough;
        }
        let refined = self.thorough(&exact.refined);
        exact.merged_if_possible(thorough, refined, doubt)
    }

    /// Makes one thorough look.
    fn thorough(&mut self, ladder: &Ladder) -> Result<Estimated, Failure> {
        let rung = &*self.exact.rung(ladder, self.rung, self.speed)?;
        let ExactWorkspace { accurate, spectra, .. } = &mut *self.workspace;
        self.exact.fill_plate(self.medium, accurate);
        spectra.clear(&rung.tables);
        spectra.fill(self.exact.isa, &rung.tables, self.medium, accurate, 0..rung.whole.lines);
        self.pairs += rung.whole.sampled.pairs;
        self.look(rung, &rung.whole)
    }

    /// Computes lines `from` … `to` - 1 of a quick sampling's spectra.
    fn fill(&mut self, rung: &Rung, from: usize, to: usize) {
        let ExactWorkspace { fast, spectra, .. } = &mut *self.workspace;
        spectra.fill(self.exact.isa, &rung.tables, self.medium, fast, from..to);
        self.pairs += rung.tables.pairs(from..to);
    }

    fn look(&mut self, rung: &Rung, look: &Look) -> Result<Estimated, Failure> {
        self.count += 1;
        self.exact.observe(self.speed, rung, look, self.workspace)?;
        self.exact.picked(rung, look, self.workspace)
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
