//! A faulty node, and a coordinator that stops or pauses.

use std::time::Duration;

use osteon_coordinator::core::event::{Event, Hello};
use osteon_coordinator::core::ids::{BatchId, WorkerId};

use super::{HOUR, Occurrence, Worker, World};
use crate::fake;

/// Process numbers of the bad node are above this one.
pub(super) const BAD_PROCESSES: u32 = 1_000_000;
/// Process numbers of workers that do not answer are above this one.
pub(super) const SILENT_PROCESSES: u32 = 2_000_000;

impl World {
    /// Decides whether there is a bad node, and when the coordinator is stopped or pauses.
    pub(super) fn plan_faults(&mut self) {
        if self.draw(4) == 0 {
            self.within(500, Occurrence::ArriveBad);
            self.most = HOUR;
        }
        if self.draw(3) == 0 {
            // Half of them never answer.
            let ignores_every = [1, 1, 2, 5][self.draw(4) as usize];
            self.within(500, Occurrence::ArriveSilent(SILENT_PROCESSES, ignores_every));
        }
        if self.draw(3) == 0 {
            self.within(3000, Occurrence::Drain);
        }
        for _ in 0..self.draw(4) {
            self.within(3000, Occurrence::Pause);
        }
    }

    /// Pauses the coordinator for longer than a lease. It receives what arrives meanwhile when it
    /// continues, after its first tick. Some workers have given it up by then, and attach again.
    pub(super) fn pause(&mut self) {
        self.counts.pauses += 1;
        let until = self.now + self.config.expiry + Duration::from_millis(1 + self.draw(3000));
        let later = self.agenda.split_off(&(until, 0));
        for ((_, number), happening) in std::mem::replace(&mut self.agenda, later) {
            let number = if matches!(happening, Occurrence::Tick) { 0 } else { number };
            self.agenda.insert((until, number), happening);
        }
        self.now = until;
        let workers: Vec<(WorkerId, u32)> =
            self.workers.iter().map(|(id, worker)| (*id, worker.process)).collect();
        for (worker, process) in workers {
            let known = self.workers.get_mut(&worker).unwrap();
            known.heard = until;
            if !known.bad
                && known.ignores_every == 0
                && !self.banned.contains(&self.host_of(process))
                && self.draw(2) == 0
            {
                self.after(1, Occurrence::GiveUp(worker));
            }
        }
    }

    /// Makes a worker give up a silent coordinator, and connect again.
    pub(super) fn give_up(&mut self, worker: WorkerId) {
        if let Some(gone) = self.workers.remove(&worker) {
            self.react(Event::StreamEnded { worker });
            self.within(400, Occurrence::Return(gone.process));
        }
    }

    /// Attaches a process that sends heartbeats, and never answers one in `ignores_every` of its
    /// batches.
    pub(super) fn arrive_silent(&mut self, process: u32, ignores_every: u64) {
        let worker = WorkerId(self.number());
        let hello = Hello { host: "silent".to_owned(), slots: 2, ..fake::hello(process) };
        let known = Worker { process, ignores_every, heard: self.now, ..Worker::default() };
        self.workers.insert(worker, known);
        self.react(Event::Hello { worker, hello });
    }

    /// Returns whether a batch is one of those that its worker never answers.
    pub(super) fn ignores(&mut self, worker: WorkerId, batch: BatchId) -> bool {
        let ignores_every = self.workers[&worker].ignores_every;
        let ignored = ignores_every > 0 && batch.0.is_multiple_of(ignores_every);
        self.counts.ignored += u64::from(ignored);
        ignored
    }

    /// Attaches a process on a faulty node.
    pub(super) fn arrive_bad(&mut self) {
        let number = self.number();
        let (worker, process) = (WorkerId(number), BAD_PROCESSES + number as u32);
        let hello = Hello { host: "bad".to_owned(), ..fake::hello(process) };
        let known = Worker { process, bad: true, heard: self.now, ..Worker::default() };
        self.workers.insert(worker, known);
        self.react(Event::Hello { worker, hello });
    }
}
