//! Keeps the order of service up to date: whatever changes something that a worker's place depends on
//! calls [`State::reorder`].

use crate::core::batch::Purpose;
use crate::core::ids::WorkerId;
use crate::core::policy::{BATCHES_IN_FLIGHT_MAX, MANY_WORKERS};
use crate::core::service_order::ServicePlace;
use crate::core::state::{AttachedWorker, State};

impl State {
    /// Updates the places after a worker has come or gone.
    pub(crate) fn follow_fleet_change(&mut self, worker: WorkerId) {
        self.fleet_changes += 1;
        self.reorder(worker);
        // The places of all depend on whether there are many workers, which may have changed.
        if [MANY_WORKERS, MANY_WORKERS - 1].contains(&self.workers.len()) {
            self.reorder_all();
        }
    }

    /// Updates the place of a worker that has changed.
    pub(crate) fn reorder(&mut self, worker: WorkerId) {
        let place = self.place(worker);
        self.order.set_place(worker, place);
    }

    /// Updates the places of all workers.
    pub(crate) fn reorder_all(&mut self) {
        let workers: Vec<WorkerId> = self.workers.keys().copied().collect();
        for worker in workers {
            self.reorder(worker);
        }
    }

    /// Returns a worker whose place in the order is not the one that it should have, if there is one.
    pub(crate) fn find_misplaced(&self) -> Option<WorkerId> {
        let is_misplaced = |worker: &WorkerId| self.order.place(*worker) != self.place(*worker);
        let listed = self.order.workers().chain(self.workers.keys().copied()).find(is_misplaced);
        let find_stray = || {
            let is_stray = |place: &ServicePlace| self.order.place(place.worker) != Some(*place);
            self.order.iter().find(is_stray).map(|place| place.worker)
        };
        listed.or_else(find_stray)
    }

    /// Returns the number of batches that a worker holds, without speculative ones.
    pub(crate) fn batches_held(&self, worker: &AttachedWorker) -> usize {
        worker.in_flight.len() - self.held_for(worker, Purpose::Speculative).count()
    }

    /// Returns the place that a worker should have; `None` if it cannot accept more, because it is gone,
    /// drains, holds an exclusive batch, or holds as many batches as it may, speculative ones not counted. That
    /// is one if it is on probation, or if there are many workers and its speed at the job of a batch that it
    /// holds is not known.
    fn place(&self, id: WorkerId) -> Option<ServicePlace> {
        let worker: &AttachedWorker = self.workers.get(&id)?;
        let is_exclusive = self.held_for(worker, Purpose::Exclusive).next().is_some();
        let on_probation = self.probation.has(&worker.name);
        let in_flight = worker.in_flight.len();
        let held = self.batches_held(worker);
        let is_unknown = self.workers.len() >= MANY_WORKERS && self.has_unknown_speed(worker);
        let most = if on_probation || is_unknown { 1 } else { BATCHES_IN_FLIGHT_MAX };
        let may = !worker.draining && held < most && !is_exclusive;
        may.then_some(ServicePlace { on_probation, held, in_flight, worker: id })
    }

    /// Returns whether a worker holds a batch of a job at which its speed is not known.
    fn has_unknown_speed(&self, worker: &AttachedWorker) -> bool {
        let held = worker.in_flight.iter().filter_map(|id| self.batches.get(id));
        held.map(|batch| batch.assignment.job).any(|job| !worker.rates.contains_key(&job))
    }
}
