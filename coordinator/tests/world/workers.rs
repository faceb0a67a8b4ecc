//! Workers: they attach, receive batches, answer them, and are lost.

use super::*;

impl World {
    pub(super) fn answer_all(&mut self, worker: WorkerId) {
        let known = &self.workers[&worker];
        let holds: Vec<_> =
            known.holds.iter().map(|(batch, work)| (*batch, work.clone())).collect();
        for (batch, work) in holds {
            let answer = self.answer(worker, batch, &work);
            self.within(50, Occurrence::Message(worker, answer));
        }
    }

    pub(super) fn attach(&mut self, process: u32) {
        let worker = WorkerId(self.number());
        let threads = 1 + self.draw(4) as u32;
        let host = format!("node-{}", self.host_of(process));
        let hello = Hello { slots: threads, host, ..fake::hello(process) };
        self.workers.insert(worker, Worker { process, heard: self.now, ..Worker::default() });
        self.react(Event::Hello { worker, hello });
    }

    pub(super) fn message(&mut self, worker: WorkerId, event: Event) {
        let known = self.workers.get_mut(&worker).unwrap();
        if let Event::Answered { batch, solved, .. } = &event {
            let held = known.holds.get(batch).cloned();
            let malformed = held.as_ref().is_some_and(|work| solved.len() != work.count as usize);
            if malformed && !self.may_die(worker) {
                let answer = self.answer(worker, *batch, &held.unwrap());
                self.message(worker, answer);
                return;
            }
            self.counts.late += u64::from(held.is_none());
            let known = self.workers.get_mut(&worker).unwrap();
            if !malformed && let Some(work) = known.holds.remove(batch) {
                self.answered_batches.insert(key(&work));
            }
        }
        self.workers.get_mut(&worker).unwrap().heard = self.now;
        self.react(event);
    }

    /// Returns whether the coordinator may lose this worker without a third loss over a quarantined
    /// realization, or on the bad node without so many that a loss elsewhere rightly fails the job.
    pub(super) fn may_die(&mut self, worker: WorkerId) -> bool {
        let Some(key) = self.held_alone(worker) else {
            return true;
        };
        let (lost, most) = match self.workers[&worker].bad {
            true => (&mut self.lost_bad, LOST_BAD_MAX),
            false => (&mut self.lost_alone, LOST_ALONE_MAX),
        };
        let lost = lost.entry(key).or_default();
        *lost += 1;
        *lost <= most
    }

    /// Returns the realization that a worker holds, if it holds nothing else.
    fn held_alone(&self, worker: WorkerId) -> Option<(u64, u64)> {
        let holds = &self.workers[&worker].holds;
        let work = holds.values().next().filter(|work| holds.len() == 1 && work.count == 1)?;
        let (seed, point) = (work.evaluation.germs.seed, work.evaluation.point);
        Some((point.0.iter().fold(seed, |key, x| fake::mix(key ^ x.to_bits())), work.first))
    }

    /// Removes a lost worker; another one replaces it.
    pub(super) fn remove_lost(&mut self, worker: WorkerId) {
        let gone = self.workers.remove(&worker).unwrap();
        self.counts.lost += 1;
        self.replace(&gone);
    }

    /// Schedules the arrival of a worker that replaces a lost one.
    pub(super) fn replace(&mut self, gone: &Worker) {
        let other = match gone.ignores_every {
            0 if gone.bad => Occurrence::ArriveBad,
            0 => Occurrence::Arrive,
            // It comes back itself, or as another process of its host.
            ignores_every => {
                Occurrence::ArriveSilent(gone.process + self.draw(2) as u32, ignores_every)
            }
        };
        self.within(if gone.bad { 100 } else { 500 }, other);
    }

    /// Handles a batch sent to a worker; a random number decides its fate.
    pub(super) fn sent(&mut self, worker: WorkerId, batch: BatchId, work: Work) {
        self.counts.checked += u64::from(self.answered_batches.contains(&key(&work)));
        let (seed, point, ..) = key(&work);
        let durable = self.durable.get(&seed).copied().unwrap_or(0);
        self.first_sent.entry((seed, point)).or_insert(durable);
        let known = self.workers.get_mut(&worker).unwrap();
        let bad = known.bad;
        assert!(known.holds.insert(batch, work.clone()).is_none(), "a number was given twice");
        // One more than it computes: its proof.
        assert!(known.holds.len() <= BATCHES_IN_FLIGHT_MAX + 1);
        if bad {
            self.within(50, Occurrence::Break(worker));
            return;
        }
        if self.ignores(worker, batch) {
            return;
        }
        let right = self.answer(worker, batch, &work);
        match self.draw(100) {
            0..3 => self.within(100, Occurrence::Break(worker)),
            3..5 => self.workers.get_mut(&worker).unwrap().stalled = true,
            5..10 => self.within(4000, Occurrence::Message(worker, right)),
            10..13 => {
                self.within(100, Occurrence::Message(worker, right.clone()));
                self.within(300, Occurrence::Message(worker, right));
            }
            13 => {
                let wrong = Work { count: work.count + 1, ..work };
                let event = self.answer(worker, batch, &wrong);
                self.within(100, Occurrence::Message(worker, event));
            }
            14 => {
                self.within(50, Occurrence::Message(worker, Event::WorkerDrains { worker }));
                self.within(100, Occurrence::Message(worker, right));
            }
            15..17 if self.has_second_thoughts(worker) => {
                self.within(100, Occurrence::Message(worker, right));
                self.within(300, Occurrence::Lie(worker, batch, work));
            }
            _ => self.within(150, Occurrence::Message(worker, right)),
        }
    }
}
