//! The order in which workers are served, kept up to date as they change.
//!
//! Finding the next worker must not depend on how many are attached: with a thousand, each of their
//! answers would wait for a walk over all of them.

use std::collections::{BTreeMap, BTreeSet};

use crate::core::batch::Purpose;
use crate::core::ids::WorkerId;
use crate::core::state::{AttachedWorker, BATCHES_IN_FLIGHT_MAX, State};

/// Place of a worker that can accept more; the smallest is served first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    /// Workers on probation come last.
    pub(crate) on_probation: bool,
    /// Number of batches that it holds, without speculative ones.
    pub(crate) held: usize,
    /// Number of batches that it holds.
    pub(crate) in_flight: usize,
    /// Ties go to the first.
    pub(crate) worker: WorkerId,
}

/// The workers that can accept more.
#[derive(Debug, Default)]
pub(crate) struct ServiceOrder {
    places: BTreeMap<WorkerId, Place>,
    order: BTreeSet<Place>,
}

impl ServiceOrder {
    /// Returns the places in ascending order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = Place> + '_ {
        self.order.iter().copied()
    }

    /// Returns the workers that are not on probation and hold exactly this many batches, none of
    /// them speculative.
    pub(crate) fn holding(&self, batches: usize) -> impl Iterator<Item = WorkerId> + '_ {
        let place = |worker| Place {
            on_probation: false,
            held: batches,
            in_flight: batches,
            worker: WorkerId(worker),
        };
        self.order.range(place(0)..=place(u64::MAX)).map(|place| place.worker)
    }

    /// Gives a worker its place, or none.
    fn put(&mut self, worker: WorkerId, place: Option<Place>) {
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

impl State {
    /// Updates the place of a worker that has changed, come or gone.
    pub(crate) fn reorder(&mut self, worker: WorkerId) {
        let place = self.place(worker);
        self.order.put(worker, place);
    }

    /// Updates the places of all workers.
    pub(crate) fn reorder_all(&mut self) {
        let workers: Vec<WorkerId> = self.workers.keys().copied().collect();
        for worker in workers {
            self.reorder(worker);
        }
    }

    /// Returns a worker whose place is not the one that it should have, if there is one.
    pub(crate) fn misplaced(&self) -> Option<WorkerId> {
        let wrong =
            |worker: &WorkerId| self.order.places.get(worker) != self.place(*worker).as_ref();
        let listed = self.order.places.keys().chain(self.workers.keys()).find(|it| wrong(it));
        let stray = || {
            let known = |place: &&Place| self.order.places.get(&place.worker) != Some(*place);
            self.order.order.iter().find(known).map(|place| place.worker)
        };
        listed.copied().or_else(stray)
    }

    /// Returns the place of a worker; `None` if it cannot accept more: it is gone, drains, computes a
    /// quarantined realization, or holds as many batches as it may. One on probation must hold
    /// nothing.
    fn place(&self, id: WorkerId) -> Option<Place> {
        let worker: &AttachedWorker = self.workers.get(&id)?;
        let count = |purpose| self.held_for(worker, purpose).count();
        let on_probation = self.probation.has(&worker.name);
        let in_flight = worker.in_flight.len();
        let held = in_flight - count(Purpose::Speculative);
        let most = if on_probation { 1 } else { BATCHES_IN_FLIGHT_MAX };
        let may = !worker.draining && held < most && count(Purpose::Exclusive) == 0;
        may.then_some(Place { on_probation, held, in_flight, worker: id })
    }
}
