//! Caches of the tables of one solver. Speeds are divided into bins, a geometric grid; each bin has
//! a sampling for waves up to its upper edge, and its tables are made when a bone first needs them.

use std::ops::Deref;
use std::sync::{Arc, OnceLock};

use osteon_common::case::Setup;
use osteon_common::limits::SAMPLING_PAIRS_MAX;
use osteon_common::outcome::FailureKind;
use osteon_common::sampling::{BANDS, Grade, OuterFaces, SPEED_BINS, WaveSampling};

use crate::exact::bin_tables::BinTables;
use crate::exact::table_memory::TableMemory;
use crate::failure::{Failure, readable};

/// A bone may need this many times the maximum number of pairs of the setup's usual sampling before
/// it fails.
const PAIRS_MARGIN: f64 = 8.0;
/// Maximum number of pairs of a bone.
const PAIRS_MAX: f64 = PAIRS_MARGIN * SAMPLING_PAIRS_MAX;
/// Samplings of one grade, with or without outer faces, by speed.
#[derive(Debug)]
pub(crate) struct TableCache {
    setup: Setup,
    grade: Grade,
    faces: OuterFaces,
    memory: Arc<TableMemory>,
    /// Each slot is filled when a bone first needs it.
    slots: [OnceLock<Slot>; SPEED_BINS],
}

/// Tables that are cached, or that were made for one pass.
#[derive(Debug)]
pub(crate) enum TablesRef<'a> {
    Cached(&'a BinTables),
    Temporary(Box<BinTables>),
}

/// The cached data of a speed bin.
#[derive(Debug)]
enum Slot {
    Tables(Box<BinTables>),
    /// Only the sampling; its tables are recomputed whenever they are needed.
    SamplingOnly(Box<WaveSampling>),
    /// The bin is too large to be computed.
    TooLarge,
}

impl TableCache {
    /// Creates the cache of one grade; `memory` is that of all caches of a solver.
    pub(crate) fn new(
        setup: &Setup,
        grade: Grade,
        faces: OuterFaces,
        memory: &Arc<TableMemory>,
    ) -> Self {
        let memory = Arc::clone(memory);
        Self {
            setup: setup.clone(),
            grade,
            faces,
            memory,
            slots: [const { OnceLock::new() }; SPEED_BINS],
        }
    }

    /// Returns the tables of the speed bin at `index`; `speed` (m/s) is named if they are too large.
    pub(crate) fn tables(&self, index: usize, speed: f64) -> Result<TablesRef<'_>, Failure> {
        match self.slots.get(index).map(|slot| slot.get_or_init(|| self.slot(index))) {
            Some(Slot::Tables(bin)) => Ok(TablesRef::Cached(bin)),
            Some(Slot::SamplingOnly(sampling)) => {
                Ok(TablesRef::Temporary(Box::new(BinTables::new(&self.setup, **sampling, None))))
            }
            Some(Slot::TooLarge) | None => Err(too_large(speed)),
        }
    }

    fn slot(&self, index: usize) -> Slot {
        let mut sampling = WaveSampling::for_speed_bin(&self.setup, index, self.grade, self.faces);
        let mut pairs = sampling.pairs(sampling.whole_band());
        // The widest bands are left out where they are too large.
        for narrower in (0..BANDS - 1).rev() {
            if pairs > PAIRS_MAX {
                let band = sampling.bands[narrower];
                sampling.bands[narrower + 1..].fill(band);
                pairs = sampling.pairs(sampling.whole_band());
            }
        }
        if pairs > PAIRS_MAX || pairs.is_nan() {
            return Slot::TooLarge;
        }
        if self.memory.reserve(BinTables::bytes(&self.setup, &sampling)) {
            let memory = Some(Arc::clone(&self.memory));
            Slot::Tables(Box::new(BinTables::new(&self.setup, sampling, memory)))
        } else {
            Slot::SamplingOnly(Box::new(sampling))
        }
    }
}

/// Returns the failure of a bone whose waves of up to `speed` (m/s) need too large tables.
pub(crate) fn too_large(speed: f64) -> Failure {
    Failure {
        kind: FailureKind::NoConvergence,
        detail: format!(
            "waves of up to {} m/s need more than {:.0e} (frequency, wavenumber) pairs",
            readable(speed),
            PAIRS_MAX
        ),
    }
}

impl Deref for TablesRef<'_> {
    type Target = BinTables;

    fn deref(&self) -> &BinTables {
        match self {
            Self::Cached(bin) => bin,
            Self::Temporary(bin) => bin,
        }
    }
}

#[cfg(test)]
mod tests {
    use osteon_common::case::Bone;
    use osteon_common::parameters::Point;
    use osteon_common::realization::Ensemble;

    use super::*;
    use crate::exact::Exact;
    use crate::exact::pass::ExactWorkspace;
    use crate::exact::table_memory::TABLE_BYTES_MAX;
    use crate::isa::Isa;

    const OPTIMUM: Point =
        Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.3]);

    fn bits(exact: &Exact, bones: &[Bone]) -> Vec<u64> {
        let mut workspace = ExactWorkspace::default();
        let velocity =
            |bone: &Bone| exact.arrival(bone.into(), &mut workspace).map(|found| found.velocity);
        bones.iter().map(velocity).map(|v| v.map_or(0, f64::to_bits)).collect()
    }

    #[test]
    fn tables_that_are_not_kept_give_the_same_bits() {
        let setup = Setup::default();
        let ensemble = Ensemble::new(&OPTIMUM, 7).unwrap();
        let bones: Vec<_> = (0..6).map(|index| ensemble.bone(index).unwrap()).collect();
        let memory = Arc::new(TableMemory::default());
        let expected = bits(&Exact::new(&setup, Isa::fastest(), &memory), &bones);
        let needed = memory.reserved_bytes();
        assert!((1..TABLE_BYTES_MAX).contains(&needed), "{needed}");
        // No bin is kept; some bins and lines are.
        for free in [0, needed / 4, needed / 2] {
            let memory = Arc::new(TableMemory::default());
            assert!(memory.reserve(TABLE_BYTES_MAX - free));
            let keeps_few = Exact::new(&setup, Isa::fastest(), &memory);
            assert_eq!(bits(&keeps_few, &bones), expected, "{free} bytes free");
            assert!(memory.reserved_bytes() <= TABLE_BYTES_MAX, "{}", memory.reserved_bytes());
        }
    }
}
