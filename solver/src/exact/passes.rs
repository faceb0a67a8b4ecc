//! The passes for one bone: which grades of sampling and which bands it needs, and in which order.

use std::ops::Range;

use osteon_common::outcome::FailureKind;
use osteon_common::sampling::{self, Grade};

use crate::exact::bin_tables::{Band, BinTables};
use crate::exact::blending;
use crate::exact::estimated::Estimated;
use crate::exact::grade_caches::GradeCaches;
use crate::exact::pass::{self, ExactWorkspace};
use crate::exact::plate_stack::PlateStack;
use crate::exact::prepared_setup::PreparedSetup;
use crate::exact::response::Spectra;
use crate::exact::table_cache::TableCache;
use crate::exact::weights::{self, LARGE_ERROR, VERY_LARGE_ERROR, rise};
use crate::failure::Failure;
use crate::media::Media;

/// Number of thorough passes that find no arrival before the bone is said to have none. (A single quick
/// or plain one leads to the thorough grade.)
const ACCURATE_ATTEMPTS: usize = 2;

/// State of the passes for one bone.
pub(super) struct BonePasses<'a> {
    prepared: &'a PreparedSetup,
    pub(super) caches: &'a GradeCaches,
    media: &'a Media,
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
    /// Creates the state before the first pass. No wave is faster than `speed` (m/s), and `bin` is the
    /// index of its speed bin.
    pub(super) fn new(
        prepared: &'a PreparedSetup,
        caches: &'a GradeCaches,
        media: &'a Media,
        speed: f64,
        bin: usize,
        workspace: &'a mut ExactWorkspace,
    ) -> Self {
        Self { prepared, caches, media, speed, bin, workspace, count: 0, pairs: 0 }
    }

    /// Makes as many passes as the bone needs in its speed bin. Near the edge of the bin, does the same
    /// in the next one, and blends both results.
    pub(super) fn run_in_bins(&mut self) -> Result<Estimated, Failure> {
        let found = self.run();
        let next = sampling::next_bin_weight(&self.prepared.setup, self.bin, self.speed);
        if next == 0.0 {
            return found;
        }
        self.bin += 1;
        let other = self.run();
        self.bin -= 1;
        blending::merge_unless_too_costly(self.prepared, found, other, next)
    }

    /// Makes as many passes as the bone needs in one speed bin.
    fn run(&mut self) -> Result<Estimated, Failure> {
        let Self { prepared, caches, .. } = *self;
        if sampling::first_grade(&prepared.setup) == Grade::Thorough {
            let found = self.make_accurate_passes(&caches.thorough, LARGE_ERROR.1);
            return self
                .complete(found, |found| weights::large_sampling_error_weight(prepared, found));
        }
        let mut thorough = None;
        let quick = self.make_quick_passes(&caches.quick);
        let weight =
            quick.as_ref().map_or(0.0, |found| weights::plain_grade_weight(prepared, found));
        let plain = (weight > 0.0).then(|| self.make_plain_passes(&caches.plain));
        let plain = plain.map(|found| self.replace_doubtful(found, &mut thorough));
        // A quick result that the plain one replaces as a whole needs no thorough passes.
        let quick = if weight < 1.0 { self.replace_doubtful(quick, &mut thorough) } else { quick };
        match plain {
            Some(plain) => blending::merge(prepared, quick, plain, weight),
            None => quick,
        }
    }

    /// Blends a quick or plain result with that of the thorough passes if the pick is unreliable or
    /// missing, if its sampling error is very large, or if its whole error is intolerable after all bands. The
    /// thorough passes are made once, at the first call, and kept in `thorough`.
    fn replace_doubtful(
        &mut self,
        found: Result<Estimated, Failure>,
        thorough: &mut Option<Result<Estimated, Failure>>,
    ) -> Result<Estimated, Failure> {
        let Self { prepared, caches, speed, .. } = *self;
        let doubt = |found: &Estimated| {
            weights::very_large_sampling_error_weight(prepared, found)
                .max(weights::intolerable_error_weight(prepared, found))
                .max(weights::unreliable_pick_weight(prepared, found, speed))
        };
        let weight = found.as_ref().map_or(1.0, doubt);
        if weight == 0.0 {
            return found;
        }
        let thorough = thorough.get_or_insert_with(|| {
            let thorough = self.make_accurate_passes(&caches.thorough, VERY_LARGE_ERROR.1);
            self.complete(thorough, |found| {
                weights::very_large_sampling_error_weight(prepared, found)
            })
        });
        blending::merge(prepared, found, thorough.clone(), weight)
    }

    /// Blends a thorough result with that of the passes of the full grade, if the weight of these is not
    /// 0. `full_weight` computes it from the result.
    fn complete(
        &mut self,
        found: Result<Estimated, Failure>,
        full_weight: impl Fn(&Estimated) -> f64,
    ) -> Result<Estimated, Failure> {
        let weight = found.as_ref().map_or(0.0, full_weight);
        if weight == 0.0 {
            return found;
        }
        let full = self.make_accurate_passes(&self.caches.full, f64::INFINITY);
        blending::merge_unless_too_costly(self.prepared, found, full, weight)
    }

    /// Makes the quick passes. No wider band is tried after a pass without an arrival, or if the pick is
    /// so small that the plain grade replaces the result anyway.
    fn make_quick_passes(&mut self, cache: &TableCache) -> Result<Estimated, Failure> {
        let prepared = self.prepared;
        self.make_fast_passes(cache, |found, _| {
            if weights::small_pick_weight(prepared, found) < 1.0 {
                weights::large_error_weight(prepared, found)
            } else {
                0.0
            }
        })
    }

    /// Makes the plain passes. If the sampling error is still large in the second band, no wider one is
    /// tried.
    fn make_plain_passes(&mut self, cache: &TableCache) -> Result<Estimated, Failure> {
        let prepared = self.prepared;
        self.make_fast_passes(cache, |found, widened| {
            let mended = if widened == 0 {
                1.0
            } else {
                1.0 - weights::large_sampling_error_weight(prepared, found)
            };
            mended * weights::large_error_weight(prepared, found)
        })
    }

    /// Makes the passes of the quick or the plain grade.
    fn make_fast_passes(
        &mut self,
        cache: &TableCache,
        weight: impl Fn(&Estimated, usize) -> f64,
    ) -> Result<Estimated, Failure> {
        let bin = &*cache.tables(self.bin, self.speed)?;
        self.workspace.fast.fill(self.prepared.isa, self.media);
        self.make_passes(bin, 1, weight, |workspace| (&mut workspace.fast, &mut workspace.spectra))
    }

    /// Makes the passes of the thorough or the full grade. No wider band is tried if the sampling error
    /// is at least `limit`: only the next grade makes that smaller.
    fn make_accurate_passes(
        &mut self,
        cache: &TableCache,
        limit: f64,
    ) -> Result<Estimated, Failure> {
        let prepared = self.prepared;
        let bin = &*cache.tables(self.bin, self.speed)?;
        self.workspace.accurate.fill(prepared.isa, self.media);
        let weight = |found: &Estimated, _| {
            let needs_next_grade =
                weights::comparable_error(prepared, found.sampling_error) >= limit;
            if needs_next_grade {
                0.0
            } else {
                rise(weights::comparable_error(prepared, found.band_error), LARGE_ERROR)
            }
        };
        self.make_passes(bin, ACCURATE_ATTEMPTS, weight, |workspace| {
            (&mut workspace.accurate, &mut workspace.spectra)
        })
    }

    /// Makes a pass in the first band of a bin, then passes in wider ones, and blends their results.
    ///
    /// `weight` is that of the next wider band, given the last result and the number of wider bands so
    /// far; no pass follows if it is 0, or once `attempts` passes have found no arrival. `parts` returns
    /// the plates and the spectra of a workspace that are used.
    fn make_passes<const TERMS: usize>(
        &mut self,
        bin: &BinTables,
        attempts: usize,
        weight: impl Fn(&Estimated, usize) -> f64,
        parts: fn(&mut ExactWorkspace) -> (&mut PlateStack<TERMS>, &mut Spectra),
    ) -> Result<Estimated, Failure> {
        let prepared = self.prepared;
        self.workspace.spectra.clear(&bin.tables);
        let fill = |passes: &mut Self, lines: Range<usize>| {
            let (plates, spectra) = parts(passes.workspace);
            passes.pairs += bin.tables.pairs(lines.clone());
            spectra.fill(prepared.isa, &bin.tables, passes.media, plates, lines);
        };
        fill(self, 0..bin.first.lines);
        let mut last = self.make_pass(bin, &bin.first);
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
            let wider = self.make_pass(bin, band).map(|wider| wider.widen_errors(&last));
            replaced.push((std::mem::replace(&mut last, wider), weight));
        }
        replaced
            .into_iter()
            .rev()
            .fold(last, |wider, (found, weight)| blending::merge(prepared, found, wider, weight))
    }

    /// Makes a pass in one band, with the spectra in the workspace.
    fn make_pass(&mut self, bin: &BinTables, band: &Band) -> Result<Estimated, Failure> {
        self.count += 1;
        pass::observe(self.prepared, self.speed, bin, band, self.workspace)?;
        pass::pick_with_error(self.prepared, bin, band, self.workspace)
    }
}

/// Returns whether a wider band may find the arrival that a pass has not found.
fn may_yet_arrive(failure: &Failure) -> bool {
    matches!(failure.kind, FailureKind::NoArrival | FailureKind::InconsistentArrival)
}
