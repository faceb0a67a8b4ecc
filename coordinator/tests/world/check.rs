//! Checks of the answers to clients and of the output of jobs.

use std::collections::BTreeMap;
use std::sync::Arc;

use osteon_common::job::JobSpecification;
use osteon_common::results::{Evaluation, JobFailure, JobResult, Status};
use osteon_coordinator::core::effect::Answer;
use osteon_coordinator::core::ids::{JobId, ReplyId};
use osteon_coordinator::store::job_output;
use osteon_coordinator::store::{EndRecord, JobRecord, Store as _, StoredJob};
use osteon_proto::v1::JobState;
use osteon_search::{Ending, Search, Step};

use super::{World, point_key};
use crate::fake;

impl World {
    pub(super) fn answered(&mut self, reply_id: ReplyId, answer: &Answer) {
        if let Some(client) = self.submissions.remove(&reply_id) {
            match answer {
                Answer::Submitted(job) => {
                    assert!(self.stored(*job).is_some(), "not durable");
                    let known = self.clients[client].job.get_or_insert(*job);
                    assert_eq!(known, job, "one request, two jobs");
                }
                Answer::Refused(_) => {}
                other => panic!("{other:?} to a submission"),
            }
        } else if let Some(client) = self.cancellations.remove(&reply_id) {
            if self.clients[client].pruned {
                return;
            }
            let Answer::Snapshot(snapshot) = answer else {
                panic!("{answer:?} to a cancellation");
            };
            assert_eq!(snapshot.state(), JobState::Ended);
            let job = self.clients[client].job.unwrap();
            assert!(self.stored(job).unwrap().end.is_some(), "not durable");
            self.clients[client].wants_end = false;
        }
    }

    pub(super) fn check_results(&mut self) {
        let stored = self.store.jobs().unwrap();
        let pruned = self.clients.iter().filter(|client| client.pruned).count();
        assert_eq!(stored.len() + pruned, self.clients.len(), "a job too many or too few");
        for StoredJob { record, end, .. } in stored {
            self.check_result(&record, &end.unwrap());
        }
    }

    pub(super) fn check_result(&mut self, record: &JobRecord, end: &EndRecord) {
        let left = job_output::read(&mut self.store, end).unwrap();
        let seed = record.specification.monte_carlo.seed;
        let lied = self.lies.iter().any(|(_, of)| *of == seed);
        let expected = if end.ending.status == Status::Cancelled {
            let client = self.clients.iter().find(|client| client.request_id == record.request_id);
            assert!(client.unwrap().cancels, "nobody cancelled");
            self.counts.cancelled += 1;
            broken_run(&record.specification, left.history.len(), &end.ending)
        } else if end.ending.failure == Some(JobFailure::IntegrityError) {
            // Proofs are of the setup, which all jobs have in common.
            assert!(!self.lies.is_empty(), "nobody lied");
            self.counts.exposed += 1;
            broken_run(&record.specification, left.history.len(), &end.ending)
        } else {
            fake::plain_run(&record.specification)
        };
        self.count_ahead(&record.specification, &left.history, lied);
        // A faulty worker that is never found out may change a result.
        if !self.deceived.contains(&record.job) {
            self.counts.repaired += u64::from(lied && end.ending.status != Status::Failed);
            // Compared as text: an unknown standard error is NaN, which is not equal to itself.
            assert_eq!(format!("{:?}", left.result), format!("{expected:?}"));
        }
    }

    /// Counts points of a path that were sent before the one before them was durable, and points
    /// that were sent and are not on it.
    fn count_ahead(
        &mut self,
        specification: &JobSpecification,
        history: &[Evaluation],
        lied: bool,
    ) {
        let seed = specification.monte_carlo.seed;
        let mut sent: BTreeMap<u64, u64> = BTreeMap::new();
        for ((_, point), durable) in self.first_sent.range((seed, 0)..=(seed, u64::MAX)) {
            sent.insert(*point, *durable);
        }
        let on_path =
            history.iter().filter_map(|row| Some((row, sent.remove(&point_key(&row.point))?)));
        let ahead = on_path.filter(|(row, durable)| *durable < row.number).count() as u64;
        let several = Search::new(Arc::new(specification.clone())).parts() > 1;
        let wanted = self.config.speculation || (self.config.ahead && several);
        // On a path that results from a wrong answer a point may be asked for sooner.
        assert!(ahead == 0 || wanted || lied, "nobody wanted points to be computed ahead");
        self.counts.ahead += ahead;
        self.counts.dropped += u64::from(self.config.speculation) * sent.len() as u64;
    }

    fn stored(&self, job: JobId) -> Option<StoredJob> {
        self.store.clone().jobs().unwrap().into_iter().find(|stored| stored.record.job == job)
    }
}

/// Returns the result of the plain loop when it is stopped after so many evaluations.
fn broken_run(specification: &JobSpecification, evaluations: usize, ending: &Ending) -> JobResult {
    let mut search = Search::new(Arc::new(specification.clone()));
    let mut told = Vec::new();
    for _ in 0..evaluations {
        if let Step::Evaluate(point) = search.ask() {
            let (outcomes, estimated_error) = fake::evaluation(specification, point);
            told.push(outcomes.clone());
            search.tell(outcomes, estimated_error);
        }
    }
    fake::left_by(&search, specification, &told, ending)
}
