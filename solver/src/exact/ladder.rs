//! A ladder: a geometric grid of speeds, each rung with the sampling for waves up to its speed, and
//! a cache of the tables of those rungs that bones need.

use std::ops::Deref;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use osteon_common::case::Setup;
use osteon_common::limits::SAMPLING_PAIRS_MAX;
use osteon_common::sampling::{Grade, RUNGS, Sampling};

use crate::exact::look::Rung;

/// A bone may need this many times the maximum number of pairs of the setup's usual sampling before
/// it fails.
pub(crate) const PAIRS_MARGIN: f64 = 8.0;
/// Memory for tables that one solver keeps, bytes; those of further rungs are recomputed when
/// needed.
const KEPT_BYTES_MAX: u64 = 24_000_000;

/// Samplings of one grade, by speed.
#[derive(Debug)]
pub(crate) struct Ladder {
    setup: Setup,
    grade: Grade,
    /// Each slot is filled when a bone first needs it.
    slots: [OnceLock<Slot>; RUNGS],
}

/// Memory of the tables that all ladders of a solver keep, bytes.
#[derive(Debug, Default)]
pub(crate) struct KeptBytes(AtomicU64);

/// A rung that is kept, or was created for one look.
#[derive(Debug)]
pub(crate) enum Held<'a> {
    Kept(&'a Rung),
    Made(Box<Rung>),
}

/// The cached data of a rung.
#[derive(Debug)]
enum Slot {
    Rung(Box<Rung>),
    /// Only the sampling; its tables are recomputed whenever they are needed.
    Sampling(Box<Sampling>),
    /// The rung is too large to be computed.
    TooLarge,
}

impl Ladder {
    pub(crate) fn new(setup: &Setup, grade: Grade) -> Self {
        Self { setup: *setup, grade, slots: [const { OnceLock::new() }; RUNGS] }
    }

    /// Returns the rung at `index`, unless it is too large.
    pub(crate) fn rung(&self, index: usize, kept: &KeptBytes) -> Option<Held<'_>> {
        match self.slots.get(index)?.get_or_init(|| self.slot(index, kept)) {
            Slot::Rung(rung) => Some(Held::Kept(rung)),
            Slot::Sampling(sampling) => {
                Some(Held::Made(Box::new(Rung::new(&self.setup, **sampling, false))))
            }
            Slot::TooLarge => None,
        }
    }

    fn slot(&self, index: usize, kept: &KeptBytes) -> Slot {
        let sampling = Sampling::at_rung(&self.setup, index, self.grade);
        let pairs = sampling.pairs(sampling.band);
        if pairs > PAIRS_MARGIN * SAMPLING_PAIRS_MAX || pairs.is_nan() {
            return Slot::TooLarge;
        }
        if kept.take(Rung::bytes(&self.setup, &sampling, pairs)) {
            Slot::Rung(Box::new(Rung::new(&self.setup, sampling, true)))
        } else {
            Slot::Sampling(Box::new(sampling))
        }
    }
}

impl KeptBytes {
    /// Reserves this much memory; returns whether the limit allows it.
    fn take(&self, bytes: u64) -> bool {
        let may = self.0.fetch_add(bytes, Ordering::Relaxed) + bytes <= KEPT_BYTES_MAX;
        if !may {
            self.0.fetch_sub(bytes, Ordering::Relaxed);
        }
        may
    }
}

impl Deref for Held<'_> {
    type Target = Rung;

    fn deref(&self) -> &Rung {
        match self {
            Self::Kept(rung) => rung,
            Self::Made(rung) => rung,
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
    use crate::exact::look::ExactWorkspace;
    use crate::isa::Isa;

    const OPTIMUM: Point = Point([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.3]);

    fn bits(exact: &Exact, bones: &[Bone]) -> Vec<u64> {
        let mut workspace = ExactWorkspace::default();
        let velocity = |bone| exact.arrival(bone, &mut workspace).map(|found| found.velocity);
        bones.iter().map(velocity).map(|v| v.map_or(0, f64::to_bits)).collect()
    }

    #[test]
    fn tables_that_are_not_kept_give_the_same_bits() {
        let setup = Setup::default();
        let ensemble = Ensemble::new(&OPTIMUM, 7).unwrap();
        let bones: Vec<_> = (0..6).map(|index| ensemble.bone(index).unwrap()).collect();
        let (keeps, keeps_none) =
            (Exact::new(&setup, Isa::fastest()), Exact::new(&setup, Isa::fastest()));
        assert!(keeps_none.kept.take(KEPT_BYTES_MAX));
        assert_eq!(bits(&keeps_none, &bones), bits(&keeps, &bones));
        let kept = |exact: &Exact| {
            let slots = exact.quick.slots.iter().filter_map(OnceLock::get);
            slots.filter(|slot| matches!(slot, Slot::Rung(_))).count()
        };
        assert_eq!((kept(&keeps_none), kept(&keeps) > 0), (0, true));
        let held = |exact: &Exact| exact.kept.0.load(Ordering::Relaxed);
        assert_eq!(held(&keeps_none), KEPT_BYTES_MAX);
        assert!(held(&keeps) < KEPT_BYTES_MAX, "{}", held(&keeps));
    }
}
