//! One evaluation under way: a slot for each index, and the indices that nobody computes.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use osteon_common::outcome::{Outcome, Solved, encode};
use osteon_common::parameters::Point;
use osteon_common::quantile;
use osteon_common::results::EstimatedError;

/// Consecutive indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Indices {
    /// The first.
    pub first: u64,
    /// How many, at least one.
    pub count: u64,
}

impl Indices {
    /// The index after the last.
    pub fn end(self) -> u64 {
        self.first + self.count
    }
}

/// Two answers for one index that differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contradiction {
    /// The index.
    pub index: u64,
    /// The answer that came first.
    pub earlier: Solved,
    /// The answer that came second.
    pub later: Solved,
}

/// The realizations of one point.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// Number of the evaluation, from 0.
    pub number: u64,
    /// The point.
    pub point: Point,
    /// What became of each index.
    pub(crate) slots: Vec<Option<Solved>>,
    /// How many slots are filled.
    pub(crate) filled: u64,
    /// Indices to hand out, from the front.
    pub(crate) queue: VecDeque<Indices>,
    /// Indices that were alone in a batch of a lost worker, with the number of workers that were
    /// lost while they held nothing else; those that wait are in `quarantine`.
    pub(crate) suspects: BTreeMap<u64, u32>,
    /// Suspects to hand out, each alone to a worker that holds nothing else.
    pub(crate) quarantine: VecDeque<u64>,
}

impl Evaluation {
    /// An evaluation of which nothing is known.
    pub fn new(number: u64, point: Point, realizations: u64) -> Self {
        let length = usize::try_from(realizations).unwrap_or(usize::MAX);
        Self {
            number,
            point,
            slots: vec![None; length],
            filled: 0,
            queue: VecDeque::from([Indices { first: 0, count: realizations }]),
            suspects: BTreeMap::new(),
            quarantine: VecDeque::new(),
        }
    }

    /// Realizations that have an outcome.
    pub fn filled(&self) -> u64 {
        self.filled
    }

    /// Realizations that nobody computes, the suspects aside.
    pub fn queued(&self) -> u64 {
        self.queue.iter().map(|indices| indices.count).sum()
    }

    /// Takes at most `most` indices from the front of the queue.
    pub fn take(&mut self, most: u64) -> Option<Indices> {
        let front = self.queue.front_mut()?;
        let taken = Indices { first: front.first, count: front.count.min(most.max(1)) };
        front.first += taken.count;
        front.count -= taken.count;
        if front.count == 0 {
            self.queue.pop_front();
        }
        Some(taken)
    }

    /// Puts the indices of a lost worker back, in halves, before all others.
    pub fn put_back_in_halves(&mut self, indices: Indices) {
        let half = indices.count.div_ceil(2);
        let rest = Indices { first: indices.first + half, count: indices.count - half };
        if rest.count > 0 {
            self.queue.push_front(rest);
        }
        self.queue.push_front(Indices { first: indices.first, count: half });
    }

    /// Puts one index that was alone in a batch of a lost worker into quarantine; `alone` when
    /// the worker held nothing else. Returns the number of workers lost while alone with it.
    pub fn suspect(&mut self, index: u64, alone: bool) -> u32 {
        let deaths = self.suspects.entry(index).or_default();
        *deaths += u32::from(alone);
        self.quarantine.push_back(index);
        *deaths
    }

    /// Fills the slots of `indices`.
    ///
    /// # Errors
    /// When a slot is filled already with other bits; slots before it are filled then.
    pub fn fill(&mut self, indices: Indices, solved: &[Solved]) -> Result<(), Contradiction> {
        for (index, &later) in (indices.first..indices.end()).zip(solved) {
            let slot = usize::try_from(index).ok().and_then(|index| self.slots.get_mut(index));
            match slot {
                None => {}
                Some(Some(earlier)) if same_bits(*earlier, later) => {}
                Some(Some(earlier)) => {
                    return Err(Contradiction { index, earlier: *earlier, later });
                }
                Some(slot) => {
                    *slot = Some(later);
                    self.filled += 1;
                }
            }
        }
        Ok(())
    }

    /// All outcomes in index order and the estimated errors of the successes, once there are all.
    pub fn complete(&self) -> Option<(Arc<[Outcome]>, Option<EstimatedError>)> {
        if self.filled < self.slots.len() as u64 {
            return None;
        }
        let outcomes: Option<_> = self.slots.iter().map(|slot| slot.map(|it| it.outcome)).collect();
        let successes = self.slots.iter().flatten().filter(|solved| solved.outcome.is_ok());
        let errors = successes.map(|solved| solved.estimated_error).collect();
        Some((outcomes?, quantile::estimated_error(errors)))
    }
}

fn same_bits(a: Solved, b: Solved) -> bool {
    let bits = |solved: Solved| {
        let (code, velocity) = encode(solved.outcome);
        (code, velocity.to_bits(), solved.estimated_error.to_bits())
    };
    bits(a) == bits(b)
}
