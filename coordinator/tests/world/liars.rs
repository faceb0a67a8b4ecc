//! Workers that return wrong answers.

use std::collections::BTreeSet;

use osteon_coordinator::core::event::Event;
use osteon_coordinator::core::ids::{BatchId, WorkerId};
use osteon_proto::batch::Work;

use super::World;
use super::faults::{BAD_PROCESSES, SILENT_PROCESSES};
use crate::fake;

/// Returns the hosts whose processes return wrong answers, if any. They are those of the first workers.
pub(super) fn some(draw: &mut impl FnMut(u64) -> u64) -> BTreeSet<u32> {
    match draw(6) {
        0 => [1].into(),
        1 => [1, 2].into(),
        2 => [2].into(),
        _ => BTreeSet::new(),
    }
}

impl World {
    /// Returns the process of a worker that arrives: a new one, or one that was attached before.
    pub(super) fn process(&mut self) -> u32 {
        let gone = |process: &u32| {
            let here = self.workers.values().any(|worker| worker.process == *process);
            !here && !self.banned.contains(&self.host_of(*process))
        };
        let gone: Vec<u32> = (1..=self.processes).filter(gone).collect();
        let returns = self.draw(2) == 0;
        match gone.last() {
            Some(process) if returns => *process,
            _ => loop {
                self.processes += 1;
                if !self.banned.contains(&self.host_of(self.processes)) {
                    return self.processes;
                }
            },
        }
    }

    /// Returns a worker's answer: liars answer every third batch wrongly.
    pub(super) fn answer(&mut self, worker: WorkerId, batch: BatchId, work: &Work) -> Event {
        let mut solved = fake::solved(work);
        let host = self.host_of(self.workers[&worker].process);
        if self.liars.contains(&host) && self.draw(3) == 0 {
            let at = self.draw(solved.len() as u64) as usize;
            // No two liars give the same answer.
            if self.draw(4) == 0 {
                solved[at].estimated_error += f64::from(host);
            } else {
                solved[at].outcome = Ok(4000.0 + f64::from(host));
            }
            self.note_lie(host, work);
        }
        Event::Answered { worker, batch, solved, elapsed_s: 0.01 }
    }

    pub(super) fn has_second_thoughts(&self, worker: WorkerId) -> bool {
        self.liars.contains(&self.host_of(self.workers[&worker].process))
    }

    /// Makes a worker answer a settled batch again, and differently.
    pub(super) fn lie(&mut self, worker: WorkerId, batch: BatchId, work: &Work) {
        let Some(known) = self.workers.get(&worker) else {
            return;
        };
        if !known.stalled && !known.holds.contains_key(&batch) {
            let mut solved = fake::solved(work);
            solved[0].outcome = Ok(1000.0);
            self.note_lie(self.host_of(known.process), work);
            self.message(worker, Event::Answered { worker, batch, solved, elapsed_s: 0.01 });
        }
    }

    /// Returns the number of a process's host.
    pub(super) fn host_of(&self, process: u32) -> u32 {
        match process {
            // All of a bad or silent node are on one host.
            SILENT_PROCESSES.. => SILENT_PROCESSES,
            BAD_PROCESSES.. => BAD_PROCESSES,
            process if self.hosts > 0 => (process - 1) % self.hosts + 1,
            process => process,
        }
    }

    fn note_lie(&mut self, host: u32, work: &Work) {
        self.counts.lies += 1;
        self.lies.insert((host, work.evaluation.germs.seed));
    }
}
