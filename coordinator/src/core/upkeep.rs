//! Keeps the order of service up to date: [`State::reorder`] follows every change of a worker that its
//! place depends on.

use crate::core::batch::Purpose;
use crate::core::ids::WorkerId;
use crate::core::policy::{BATCHES_IN_FLIGHT_MAX, MANY_WORKERS};
use crate::core::service_order::ServicePlace;
use crate::core::state::{AttachedWorker, State};

impl State {
    /// Updates the places when a worker has come or gone.
    pub(crate) fn came_or_went(&mut self, worker: WorkerId) {
        self.fleet_changes += 1;
        self.reorder(worker);
        // It came and made them many, or went and made them few.
        if [MANY_WORKERS, MANY_WORKERS - 1].contains(&self.workers.len()) {
            self.reorder_all();
        }
    }

    /// Updates the place of a worker that has changed.
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
        let wrong = |worker: &WorkerId| self.order.place(*worker) != self.place(*worker);
        let listed = self.order.workers().chain(self.workers.keys().copied()).find(wrong);
        let stray = || {
            let unknown = |place: &ServicePlace| self.order.place(place.worker) != Some(*place);
            self.order.iter().find(unknown).map(|place| place.worker)
        };
        listed.or_else(stray)
    }

    /// Returns the number of batches that a worker holds, without speculative ones.
    pub(crate) fn held(&self, worker: &AttachedWorker) -> usize {
        worker.in_flight.len() - self.held_for(worker, Purpose::Speculative).count()
    }

    /// Returns the place of a worker; `None` if it cannot accept more: it is gone, drains, computes a
    /// quarantined realization, or holds as many batches as it may. One on probation must hold
    /// nothing, and so must one of many that holds a batch of a job at which its speed is not known.
    fn place(&self, id: WorkerId) -> Option<ServicePlace> {
        let worker: &AttachedWorker = self.workers.get(&id)?;
        let is_exclusive = self.held_for(worker, Purpose::Exclusive).next().is_some();
        let on_probation = self.probation.has(&worker.name);
        let in_flight = worker.in_flight.len();
        let held = self.held(worker);
        let is_tried = self.workers.len() >= MANY_WORKERS && self.is_tried(worker);
        let most = if on_probation || is_tried { 1 } else { BATCHES_IN_FLIGHT_MAX };
        let may = !worker.draining && held < most && !is_exclusive;
        may.then_some(ServicePlace { on_probation, held, in_flight, worker: id })
    }
    /// Returns whether a worker holds a batch of a job at which its speed is not known.
    fn is_tried(&self, worker: &AttachedWorker) -> bool {
        let held = worker.in_flight.iter().filter_map(|id| self.batches.get(id));
        held.map(|batch| batch.assignment.job).any(|job| !worker.rates.contains_key(&job))
    }
}
