//! The passes for one bone: which samplings and bands it needs, and in which order.

use std::ops::Range;

use osteon_common::outcome::FailureKind;
use osteon_common::sampling::{self, Grade};

use crate::exact::pass::{Band, BinTables, Estimated, ExactWorkspace};
use crate::exact::plate::Plate;
use crate::exact::response::Spectra;
use crate::exact::table_cache::TableCache;
use crate::exact::{Exact, GradeCaches, rise};
use crate::medium::Medium;
use crate::picking::Pick;
use crate::solver::Failure;

/// Stated errors due to the band, or to the sampling, at refinement 1, between which the weight of the
/// pass with the next wider band, or of the next sampling, rises from 0 to 1.
const LARGE_ERROR: (f64, f64) = (2.1e-4, 2.9e-4);
/// The same of the errors due to the sampling, for the last two samplings, and of those due to the band
/// where the next sampling has no wider one.
const VERY_LARGE_ERROR: (f64, f64) = (2.3e-4, 3.4e-4);
/// Stated errors between which the weight of the thorough passes rises, even where the error is due to
/// the band: a short array needs times that are more accurate than usual.
const USELESS_ERROR: (f64, f64) = (5e-4, 8e-4);
/// Ratios of a pick to the largest wave in its window between which the weight of the next pass
/// falls, for an array of [`USUAL_ARRAY`]: the errors of thinning and of leaving out slow
/// waves reach some 1e-5 of that wave.
const SMALL: (f64, f64) = (0.01, 0.015);
/// Time from the first to the last pick, in periods, of the usual array: in a shorter one the same error
/// of a time is a larger one of the velocity.
const USUAL_ARRAY: f64 = 2.5;
/// Number of thorough passes without an arrival after which there is none. (Of a quick grade, one
/// leads to the thorough grade.)
const THOROUGH_ATTEMPTS: usize = 2;

/// State of the passes for one bone.
pub(super) struct BonePasses<'a> {
    exact: &'a Exact,
    pub(super) caches: &'a GradeCaches,
    medium: &'a Medium,
    /// Upper bound of every wave's speed, m/s.
    speed: f64,
    /// Index of the speed bin.
    bin: usize,
    workspace: &'a mut ExactWorkspace,
    /// Number of passes so far.
    pub(super) count: u32,
    /// Number of (frequency, wavenumber) pairs computed so far.
    pub(super) pairs: u64,
}

impl<'a> BonePasses<'a> {
    /// Begins with no pass; `speed` is the upper bound of every wave's speed, m/s, and `bin` its speed
    /// bin.
    pub(super) fn new(
        exact: &'a Exact,
        caches: &'a GradeCaches,
        medium: &'a Medium,
        speed: f64,
        bin: usize,
        workspace: &'a mut ExactWorkspace,
    ) -> Self {
        Self { exact, caches, medium, speed, bin, workspace, count: 0, pairs: 0 }
    }

    /// Computes as many passes as the bone needs, in its speed bin and, near the edge, in the next.
    pub(super) fn in_bins(&mut self) -> Result<Estimated, Failure> {
        let found = self.run();
        let next = sampling::next_bin_weight(&self.exact.setup, self.bin, self.speed);
        if next == 0.0 {
            return found;
        }
        self.bin += 1;
        let other = self.run();
        self.bin -= 1;
        self.exact.merged_if_possible(found, other, next)
    }

    /// Computes as many passes as the bone needs in one speed bin.
    fn run(&mut self) -> Result<Estimated, Failure> {
        let Self { exact, caches, .. } = *self;
        if sampling::first_grade(&exact.setup) == Grade::Thorough {
            let found = self.thorough(&caches.thorough, LARGE_ERROR.1);
            return self.completed(found, |found| exact.rough(found));
        }
        let mut thorough = None;
        let quick = self.quick(&caches.quick);
        let weight = quick.as_ref().map_or(0.0, |found| exact.replaced_by_plain(found));
        let plain = (weight > 0.0).then(|| self.plain(&caches.plain));
        let plain = plain.map(|found| self.checked(found, &mut thorough));
        // What the plain grade replaces as a whole need not be checked.
        let quick = if weight < 1.0 { self.checked(quick, &mut thorough) } else { quick };
        match plain {
            Some(plain) => exact.merged(quick, plain, weight),
            None => quick,
        }
    }

    /// Makes the thorough passes, once for both grades, if the pick of a quick or plain grade is
    /// unreliable or missing, or if its sampling error, or the whole error after all bands, is large.
    fn checked(
        &mut self,
        found: Result<Estimated, Failure>,
        thorough: &mut Option<Result<Estimated, Failure>>,
    ) -> Result<Estimated, Failure> {
        let Self { exact, caches, speed, .. } = *self;
        let doubt = |found: &Estimated| {
            exact.coarse(found).max(exact.useless(found)).max(exact.fallback_weight(found, speed))
        };
        let weight = found.as_ref().map_or(1.0, doubt);
        if weight == 0.0 {
            return found;
        }
        let thorough = thorough.get_or_insert_with(|| {
            let thorough = self.thorough(&caches.thorough, VERY_LARGE_ERROR.1);
            self.completed(thorough, |found| exact.coarse(found))
        });
        exact.merged(found, thorough.clone(), weight)
    }

    /// Makes the last passes if the weight of the error is not 0.
    fn completed(
        &mut self,
        found: Result<Estimated, Failure>,
        of_error: impl Fn(&Estimated) -> f64,
    ) -> Result<Estimated, Failure> {
        let weight = found.as_ref().map_or(0.0, of_error);
        if weight == 0.0 {
            return found;
        }
        let full = self.thorough(&self.caches.full, f64::INFINITY);
        self.exact.merged_if_possible(found, full, weight)
    }

    /// Makes the quick passes. Without an arrival, or where the plain grade replaces the result, a wider
    /// band is not tried.
    fn quick(&mut self, cache: &TableCache) -> Result<Estimated, Failure> {
        let exact = self.exact;
        self.fast(
            cache,
            |found, _| if exact.small(found) < 1.0 { exact.inexact(found) } else { 0.0 },
        )
    }

    /// Makes the plain passes. Where the second band has not mended the sampling error, wider ones are
    /// not tried.
    fn plain(&mut self, cache: &TableCache) -> Result<Estimated, Failure> {
        let exact = self.exact;
        self.fast(cache, |found, widened| {
            let mended = if widened == 0 { 1.0 } else { 1.0 - exact.rough(found) };
            mended * exact.inexact(found)
        })
    }

    fn fast(
        &mut self,
        cache: &TableCache,
        weight: impl Fn(&Estimated, usize) -> f64,
    ) -> Result<Estimated, Failure> {
        let bin = &*self.exact.bin_tables(cache, self.bin, self.speed)?;
        self.exact.fill_plate(self.medium, &mut self.workspace.fast);
        self.bands(bin, 1, weight, |workspace| (&mut workspace.fast, &mut workspace.spectra))
    }

    /// Makes the passes of a thorough grade; a sampling error of at least `limit` is left to the next
    /// grade.
    fn thorough(&mut self, cache: &TableCache, limit: f64) -> Result<Estimated, Failure> {
        let exact = self.exact;
        let bin = &*exact.bin_tables(cache, self.bin, self.speed)?;
        exact.fill_plate(self.medium, &mut self.workspace.accurate);
        let weight = |found: &Estimated, _| {
            let is_vain = exact.counted(found.sampling_error) >= limit;
            if is_vain { 0.0 } else { rise(exact.counted(found.band_error), LARGE_ERROR) }
        };
        self.bands(bin, THOROUGH_ATTEMPTS, weight, |workspace| {
            (&mut workspace.accurate, &mut workspace.spectra)
        })
    }

    /// Makes a pass in the first band of a bin, and in wider ones: as long as `weight`, of a result and
    /// the number of wider bands so far, is not 0, and fewer than `attempts` passes found no arrival.
    /// `parts` returns the plate to be used, and the spectra.
    fn bands<const TERMS: usize>(
        &mut self,
        bin: &BinTables,
        attempts: usize,
        weight: impl Fn(&Estimated, usize) -> f64,
        parts: fn(&mut ExactWorkspace) -> (&mut Plate<TERMS>, &mut Spectra),
    ) -> Result<Estimated, Failure> {
        let exact = self.exact;
        self.workspace.spectra.clear(&bin.tables);
        let fill = |passes: &mut Self, lines: Range<usize>| {
            let (plate, spectra) = parts(passes.workspace);
            passes.pairs += bin.tables.pairs(lines.clone());
            spectra.fill(exact.isa, &bin.tables, passes.medium, plate, lines);
        };
        fill(self, 0..bin.first.lines);
        let mut last = self.pass(bin, &bin.first);
        let mut lines = bin.first.lines;
        let (mut replaced, mut failed) = (Vec::new(), 0);
        for (widened, band) in bin.wider.iter().enumerate() {
            let weight = match &last {
                Ok(found) => weight(found, widened),
                Err(failure) => {
                    failed += 1;
                    f64::from(failed < attempts && may_yet_arrive(failure))
                }
            };
            if weight == 0.0 {
                break;
            }
            fill(self, lines..band.lines);
            lines = band.lines;
            let wider = self.pass(bin, band).map(|wider| wider.after(&last));
            replaced.push((std::mem::replace(&mut last, wider), weight));
        }
        replaced
            .into_iter()
            .rev()
            .fold(last, |wider, (found, weight)| exact.merged(found, wider, weight))
    }

    fn pass(&mut self, bin: &BinTables, band: &Band) -> Result<Estimated, Failure> {
        self.count += 1;
        self.exact.observe(self.speed, bin, band, self.workspace)?;
        self.exact.picked(bin, band, self.workspace)
    }
}

/// Weights of further passes, from 0 (the result is sufficient) to 1 (the next replaces it).
impl Exact {
    /// Returns the weight of a finer sampling.
    fn rough(&self, found: &Estimated) -> f64 {
        rise(self.counted(found.sampling_error), LARGE_ERROR)
    }

    /// Returns the weight of a wider band or another sampling.
    fn inexact(&self, found: &Estimated) -> f64 {
        rise(self.counted(found.error()), LARGE_ERROR)
    }

    /// Returns the weight of the plain grade's passes after those of the quick one. If the quick band was
    /// as wide as theirs, only a finer sampling can be gained from them.
    fn replaced_by_plain(&self, found: &Estimated) -> f64 {
        let exhausted = found.sampled.band >= sampling::widest_band(&self.setup, Grade::Plain);
        let limits = if exhausted { VERY_LARGE_ERROR } else { LARGE_ERROR };
        rise(self.counted(found.error()), limits).max(self.small(found))
    }

    /// Returns the weight of the thorough and of the last passes.
    fn coarse(&self, found: &Estimated) -> f64 {
        rise(self.counted(found.sampling_error), VERY_LARGE_ERROR)
    }

    /// Returns the weight of the thorough passes where other bands have not helped.
    fn useless(&self, found: &Estimated) -> f64 {
        rise(self.counted(found.error()), USELESS_ERROR)
    }

    /// Returns the weight of a pass without thinning, which rises as the pick becomes small compared with
    /// the largest wave in its window.
    fn small(&self, found: &Estimated) -> f64 {
        let Pick { times, prominence, .. } = &found.pick;
        let (first, last) = times
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(first, last), &t| (first.min(t), last.max(t)));
        let periods = (last - first) * self.setup.probe.center_frequency;
        1.0 - rise(prominence * periods / USUAL_ARRAY, SMALL)
    }
}

/// Returns whether a wider band may find the arrival that a pass has not found.
fn may_yet_arrive(failure: &Failure) -> bool {
    matches!(failure.kind, FailureKind::NoArrival | FailureKind::InconsistentArrival)
}
