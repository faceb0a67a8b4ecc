//! The passes for one bone: which samplings and bands it needs, and in which order.

use std::ops::Range;

use osteon_common::outcome::FailureKind;
use osteon_common::sampling::{self, Grade};

use crate::exact::bin_tables::{Band, BinTables};
use crate::exact::blending;
use crate::exact::estimated::Estimated;
use crate::exact::grade_caches::GradeCaches;
use crate::exact::pass::{self, ExactWorkspace};
use crate::exact::plate::Plate;
use crate::exact::prepared_setup::PreparedSetup;
use crate::exact::response::Spectra;
use crate::exact::table_cache::TableCache;
use crate::exact::weights::{self, LARGE_ERROR, VERY_LARGE_ERROR, rise};
use crate::failure::Failure;
use crate::medium::Medium;

/// Number of thorough passes without an arrival after which there is none. (Of a quick grade, one
/// leads to the thorough grade.)
const THOROUGH_ATTEMPTS: usize = 2;

/// State of the passes for one bone.
pub(super) struct BonePasses<'a> {
    prepared: &'a PreparedSetup,
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
        prepared: &'a PreparedSetup,
        caches: &'a GradeCaches,
        medium: &'a Medium,
        speed: f64,
        bin: usize,
        workspace: &'a mut ExactWorkspace,
    ) -> Self {
        Self { prepared, caches, medium, speed, bin, workspace, count: 0, pairs: 0 }
    }

    /// Computes as many passes as the bone needs, in its speed bin and, near the edge, in the next.
    pub(super) fn in_bins(&mut self) -> Result<Estimated, Failure> {
        let found = self.run();
        let next = sampling::next_bin_weight(&self.prepared.setup, self.bin, self.speed);
        if next == 0.0 {
            return found;
        }
        self.bin += 1;
        let other = self.run();
        self.bin -= 1;
        blending::merged_if_possible(self.prepared, found, other, next)
    }

    /// Computes as many passes as the bone needs in one speed bin.
    fn run(&mut self) -> Result<Estimated, Failure> {
        let Self { prepared, caches, .. } = *self;
        if sampling::first_grade(&prepared.setup) == Grade::Thorough {
            let found = self.thorough(&caches.thorough, LARGE_ERROR.1);
            return self.completed(found, |found| weights::rough(prepared, found));
        }
        let mut thorough = None;
        let quick = self.quick(&caches.quick);
        let weight =
            quick.as_ref().map_or(0.0, |found| weights::replaced_by_plain(prepared, found));
        let plain = (weight > 0.0).then(|| self.plain(&caches.plain));
        let plain = plain.map(|found| self.checked(found, &mut thorough));
        // What the plain grade replaces as a whole need not be checked.
        let quick = if weight < 1.0 { self.checked(quick, &mut thorough) } else { quick };
        match plain {
            Some(plain) => blending::merged(prepared, quick, plain, weight),
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
        let Self { prepared, caches, speed, .. } = *self;
        let doubt = |found: &Estimated| {
            weights::coarse(prepared, found)
                .max(weights::useless(prepared, found))
                .max(weights::unreliable(prepared, found, speed))
        };
        let weight = found.as_ref().map_or(1.0, doubt);
        if weight == 0.0 {
            return found;
        }
        let thorough = thorough.get_or_insert_with(|| {
            let thorough = self.thorough(&caches.thorough, VERY_LARGE_ERROR.1);
            self.completed(thorough, |found| weights::coarse(prepared, found))
        });
        blending::merged(prepared, found, thorough.clone(), weight)
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
        blending::merged_if_possible(self.prepared, found, full, weight)
    }

    /// Makes the quick passes. Without an arrival, or where the plain grade replaces the result, a wider
    /// band is not tried.
    fn quick(&mut self, cache: &TableCache) -> Result<Estimated, Failure> {
        let prepared = self.prepared;
        self.fast(cache, |found, _| {
            if weights::small(prepared, found) < 1.0 {
                weights::inexact(prepared, found)
            } else {
                0.0
            }
        })
    }

    /// Makes the plain passes. Where the second band has not mended the sampling error, wider ones are
    /// not tried.
    fn plain(&mut self, cache: &TableCache) -> Result<Estimated, Failure> {
        let prepared = self.prepared;
        self.fast(cache, |found, widened| {
            let mended = if widened == 0 { 1.0 } else { 1.0 - weights::rough(prepared, found) };
            mended * weights::inexact(prepared, found)
        })
    }

    fn fast(
        &mut self,
        cache: &TableCache,
        weight: impl Fn(&Estimated, usize) -> f64,
    ) -> Result<Estimated, Failure> {
        let bin = &*cache.tables(self.bin, self.speed)?;
        self.prepared.fill_plate(self.medium, &mut self.workspace.fast);
        self.bands(bin, 1, weight, |workspace| (&mut workspace.fast, &mut workspace.spectra))
    }

    /// Makes the passes of a thorough grade; a sampling error of at least `limit` is left to the next
    /// grade.
    fn thorough(&mut self, cache: &TableCache, limit: f64) -> Result<Estimated, Failure> {
        let prepared = self.prepared;
        let bin = &*cache.tables(self.bin, self.speed)?;
        prepared.fill_plate(self.medium, &mut self.workspace.accurate);
        let weight = |found: &Estimated, _| {
            let is_vain = weights::counted(prepared, found.sampling_error) >= limit;
            if is_vain {
                0.0
            } else {
                rise(weights::counted(prepared, found.band_error), LARGE_ERROR)
            }
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
        let prepared = self.prepared;
        self.workspace.spectra.clear(&bin.tables);
        let fill = |passes: &mut Self, lines: Range<usize>| {
            let (plate, spectra) = parts(passes.workspace);
            passes.pairs += bin.tables.pairs(lines.clone());
            spectra.fill(prepared.isa, &bin.tables, passes.medium, plate, lines);
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
            .fold(last, |wider, (found, weight)| blending::merged(prepared, found, wider, weight))
    }

    fn pass(&mut self, bin: &BinTables, band: &Band) -> Result<Estimated, Failure> {
        self.count += 1;
        pass::observe(self.prepared, self.speed, bin, band, self.workspace)?;
        pass::picked(self.prepared, bin, band, self.workspace)
    }
}

/// Returns whether a wider band may find the arrival that a pass has not found.
fn may_yet_arrive(failure: &Failure) -> bool {
    matches!(failure.kind, FailureKind::NoArrival | FailureKind::InconsistentArrival)
}
