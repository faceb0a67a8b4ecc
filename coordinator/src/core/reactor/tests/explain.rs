//! The facts by which a job is explained, from whole states.

use super::*;
use crate::core::explain::facts::JobFacts;

impl Rig {
    #[track_caller]
    fn check_reason(&mut self, job: u64, expected: &str) {
        let answer = format!("answer 7: {expected}");
        self.check(request(7, Request::Explain(JobId(job))), &[&answer]);
    }

    fn facts(&self, job: u64) -> JobFacts {
        JobFacts::new(&self.state, JobId(job), self.now).unwrap()
    }
}

#[test]
fn a_job_is_explained_from_its_acceptance_to_its_end() {
    let mut rig = Rig::new();
    rig.check_reason(1, &Refusal::NoJob { job: JobId(1) }.to_string());
    rig.event(submit(0, "", propagation(8)));
    // Until it is durable, no client knows it.
    rig.check_reason(1, &Refusal::NoJob { job: JobId(1) }.to_string());
    rig.event(stored_event(1, RecordKey::Job));
    rig.now += Duration::from_secs(9);
    rig.check_reason(1, "NoWorkers");
    assert_eq!(rig.facts(1).without_workers, Duration::from_secs(9));
    rig.event(hello(1, 8));
    rig.check_reason(1, "Computing");
    let facts = rig.facts(1);
    assert_eq!(
        (facts.slots, facts.slots_used, facts.queued, facts.lacking_realizations()),
        (8, 8.0, 0, 8)
    );
    rig.now += Duration::from_secs(2);
    rig.check_reason(1, "LastRealizations");
    let oldest = rig.facts(1).oldest.unwrap();
    assert_eq!((oldest.worker, oldest.count, oldest.out), (WorkerId(1), 8, Duration::from_secs(2)));
    rig.event(Event::WorkerDrains { worker: WorkerId(1) });
    rig.check_reason(1, "WorkersUnavailable");
    rig.event(answer(1, 1, 0, 8));
    rig.event(hello(2, 16));
    rig.check_reason(1, "FewRealizations");
    rig.now += Duration::from_secs(2);
    rig.check_reason(1, "StoreSlow");
    let error = "full".to_owned();
    rig.event(Event::StoreFailed { job: JobId(1), key: RecordKey::Evaluation(0), error });
    rig.check_reason(1, "StoreRefuses");
    rig.event(stored_event(1, RecordKey::Evaluation(0)));
    rig.event(stored_event(1, RecordKey::End));
    rig.check_reason(1, "Ended");
}

#[test]
fn the_slots_of_others_count() {
    let mut rig = Rig::with(1000, &[]);
    rig.state.jobs.get_mut(&JobId(1)).unwrap().record.priority = 1;
    rig.accept(propagation(1000));
    rig.event(hello(1, 4));
    // The job of higher priority has both batches.
    rig.check_reason(1, "Computing");
    rig.check_reason(2, "OtherJobs");
    let facts = rig.facts(2);
    assert_eq!((facts.slots_used, facts.slots_of_others, facts.higher), (0.0, 4.0, 1));
    // Two jobs run at a time.
    rig.accept(propagation(1000));
    rig.check_reason(3, "WaitingForTurn");
    assert_eq!((rig.facts(3).running, rig.facts(3).waiting), (2, 1));
}
