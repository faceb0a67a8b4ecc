//! The store: writes that are late, fail, or are lost with the coordinator.

use osteon_coordinator::core::effect::Record;
use osteon_coordinator::core::event::{Event, ReadFailure, Request, Retention};
use osteon_coordinator::core::ids::{JobId, ReplyId};
use osteon_coordinator::store::{BanRecord, EvaluationRecord, Store as _};

use super::{Occurrence, World};
use crate::fake;

impl World {
    /// Examines a record that the coordinator has decided to write.
    pub(super) fn look_at(&mut self, record: &Record) {
        match record {
            Record::Ban(record) => {
                let host = self.host_of(record.worker.process());
                let lied = self.lies.iter().any(|(liar, _)| *liar == host);
                assert!(lied, "{record:?}: it never lied");
                self.counts.banned += u64::from(self.banned.insert(host));
            }
            Record::End { end, .. } => {
                // The decision was checked when it was written first.
                if self.ends.insert(end.job, end.clone()).is_some_and(|before| before == *end) {
                    return;
                }
                let of_job = self.clients.iter().find(|client| client.job == Some(end.job));
                // The simulation knows the seed of a job only when its client has been answered.
                let seed = of_job.map(|client| client.specification.monte_carlo.seed);
                let at_large = |(liar, of): &(u32, u64)| {
                    seed.is_none_or(|seed| seed == *of) && !self.banned.contains(liar)
                };
                if self.lies.iter().any(at_large) {
                    self.deceived.insert(end.job);
                } else {
                    self.deceived.remove(&end.job);
                }
            }
            Record::Evaluation { record, deletes_later } => {
                self.look_at_evaluation(record, *deletes_later)
            }
            Record::Evaluations(records) => {
                self.counts.prepared += records.len() as u64;
                records.iter().for_each(|record| self.look_at_evaluation(record, true));
            }
            // Evaluations here are too small for pieces.
            Record::Job(_) | Record::Part(_) | Record::Piece { .. } => {}
        }
    }

    fn look_at_evaluation(&mut self, record: &EvaluationRecord, deletes_later: bool) {
        let before = self.store.evaluation(record.job, record.number).unwrap();
        if let Some(before) = before.filter(|before| before.workers != record.workers) {
            // On another path of the search a point may differ in its last bits only, and have
            // the same outcomes.
            let same = before.point == record.point && before.outcomes == record.outcomes;
            self.counts.replaced += u64::from(!same);
            self.counts.confirmed += u64::from(same);
            // The contents of a damaged record are unknown.
            let damaged = self.damaged.contains(&(record.job, record.number));
            assert!(damaged || deletes_later != same, "{record:?}");
        }
    }

    pub(super) fn write(&mut self, record: &Record) {
        let event = if self.refuses() {
            let (job, key) = record.key();
            Event::StoreFailed { job, key, error: "the disk is full".to_owned() }
        } else {
            let event = self.written(record);
            if let Record::Ban(BanRecord { number, .. }) = record {
                let doubts = self.store.doubts().unwrap();
                let of_ban = doubts.into_iter().filter(|doubt| doubt.ban == *number);
                let jobs = of_ban.map(|doubt| doubt.job).collect();
                self.react(Event::Doubted { ban: *number, jobs });
            }
            event
        };
        self.within(5, Occurrence::Report(event));
    }

    /// Handles a record that has become durable.
    pub(super) fn written(&mut self, record: &Record) -> Event {
        match record {
            Record::Evaluation { record, deletes_later } => {
                self.note_durable(record, *deletes_later)
            }
            Record::Evaluations(records) => {
                records.iter().for_each(|record| self.note_durable(record, true));
            }
            Record::Job(record) => {
                self.seeds.insert(record.job, record.specification.monte_carlo.seed);
            }
            Record::Part(_) => self.counts.saved += 1,
            Record::Piece { .. } | Record::End { .. } | Record::Ban(_) => {}
        }
        fake::written(&mut self.store, record)
    }

    /// Requests now and then that ended jobs are computed again that a banned host contributed to.
    pub(super) fn recheck(&mut self) {
        if self.draw(10) > 0 {
            return;
        }
        let doubts = self.store.doubts().unwrap();
        let open = doubts.into_iter().filter(|doubt| doubt.digest.is_none());
        for job in open.map(|doubt| doubt.job).collect::<Vec<_>>() {
            let reply_id = ReplyId(self.number());
            self.react(Event::Requested { reply_id, request: Request::Recheck(job) });
        }
    }

    /// Makes an ended job an unfinished one, or fails to.
    pub(super) fn reopen(&mut self, reply_id: ReplyId, job: JobId) {
        let outcome = if self.refuses() {
            Err("the disk is full".to_owned())
        } else {
            self.counts.rechecked += 1;
            self.ends.remove(&job);
            Ok(self.store.reopen_job(job).unwrap())
        };
        self.within(5, Occurrence::Report(Event::Reopened { reply_id, job, outcome }));
    }

    fn note_durable(&mut self, record: &EvaluationRecord, deletes_later: bool) {
        self.damaged.remove(&(record.job, record.number));
        if let Some(seed) = self.seeds.get(&record.job) {
            let durable = self.durable.entry(*seed).or_default();
            let before = if deletes_later { 0 } else { *durable };
            *durable = before.max(record.number + 1);
        }
    }

    pub(super) fn read(&mut self, job: JobId, number: u64) {
        let event = if self.refuses() {
            let found = Err(ReadFailure::Refused { error: "the cable is out".to_owned() });
            Event::Read { job, number, found }
        } else if self.draw(10) == 0 {
            self.counts.damaged += 1;
            self.damaged.insert((job, number));
            Event::Read { job, number, found: Err(ReadFailure::Damaged) }
        } else {
            fake::read(&mut self.store, job, number)
        };
        self.within(5, Occurrence::Report(event));
    }

    /// Requests the deletion of ended jobs, once every client has been answered.
    pub(super) fn prune(&mut self) {
        if self.clients.iter().all(|client| client.job.is_some()) {
            let reply_id = ReplyId(self.number());
            let retention = Retention::default();
            self.react(Event::Requested { reply_id, request: Request::Prune(retention) });
        }
        self.within(3000, Occurrence::Prune);
    }

    pub(super) fn forget(&mut self, reply_id: Option<ReplyId>, jobs: Vec<JobId>) {
        let outcome = if self.refuses() {
            Err("the disk is full".to_owned())
        } else {
            self.forget_now(&jobs);
            Ok(())
        };
        self.within(5, Occurrence::Report(Event::Pruned { reply_id, jobs, outcome }));
    }

    /// Checks the output of ended jobs, and deletes it.
    pub(super) fn forget_now(&mut self, jobs: &[JobId]) {
        for stored in self.store.jobs().unwrap() {
            let job = stored.record.job;
            if jobs.contains(&job) {
                let end = stored.end.unwrap();
                self.check_result(&stored.record, &end);
                self.counts.pruned += 1;
                for client in &mut self.clients {
                    if client.job == Some(job) {
                        client.pruned = true;
                        client.wants_end = false;
                    }
                }
            }
        }
        self.store.delete_jobs(jobs).unwrap();
    }

    fn refuses(&mut self) -> bool {
        let refuses = self.draw(30) == 0 || self.outage.contains(&self.now);
        self.counts.refusals += u64::from(refuses);
        refuses
    }
}
