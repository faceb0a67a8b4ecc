//! The order in which workers are served, kept up to date as they change.
//!
//! Finding the next worker must not depend on how many are attached: with a thousand, each of their
//! answers would wait for a walk over all of them.

use std::collections::{BTreeMap, BTreeSet};

use crate::core::ids::WorkerId;

/// Place of a worker that can accept more; the smallest is served first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ServicePlace {
    /// Workers on probation come last.
    pub(crate) on_probation: bool,
    /// Number of batches that it holds, without speculative ones.
    pub(crate) held: usize,
    /// Number of batches that it holds.
    pub(crate) in_flight: usize,
    /// Among equal workers, the one that attached first.
    pub(crate) worker: WorkerId,
}

/// The workers that can accept more.
#[derive(Debug, Default)]
pub(crate) struct ServiceOrder {
    places: BTreeMap<WorkerId, ServicePlace>,
    order: BTreeSet<ServicePlace>,
}

impl ServiceOrder {
    pub(crate) fn place(&self, worker: WorkerId) -> Option<ServicePlace> {
        self.places.get(&worker).copied()
    }

    /// Returns the workers with a place.
    pub(crate) fn workers(&self) -> impl Iterator<Item = WorkerId> + '_ {
        self.places.keys().copied()
    }

    /// Returns the places in ascending order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = ServicePlace> + '_ {
        self.order.iter().copied()
    }

    /// Returns the workers that are not on probation and hold exactly this many batches, none of
    /// them speculative.
    pub(crate) fn holding(&self, batches: usize) -> impl Iterator<Item = WorkerId> + '_ {
        let place = |worker| ServicePlace {
            on_probation: false,
            held: batches,
            in_flight: batches,
            worker: WorkerId(worker),
        };
        self.order.range(place(0)..=place(u64::MAX)).map(|place| place.worker)
    }

    /// Returns the workers on probation that can accept more, in ascending order.
    pub(crate) fn on_probation(&self) -> impl Iterator<Item = WorkerId> + '_ {
        let first = ServicePlace { on_probation: true, held: 0, in_flight: 0, worker: WorkerId(0) };
        self.order.range(first..).map(|place| place.worker)
    }

    /// Gives a worker this place; with `None`, removes it from the order.
    pub(crate) fn set_place(&mut self, worker: WorkerId, place: Option<ServicePlace>) {
        let before = match place {
            Some(place) => self.places.insert(worker, place),
            None => self.places.remove(&worker),
        };
        if before != place {
            if let Some(before) = before {
                self.order.remove(&before);
            }
            self.order.extend(place);
        }
    }
}
