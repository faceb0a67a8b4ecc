//! Replay of stored evaluations: after a ban, and after a restart.

use std::collections::BTreeSet;

use super::*;
use crate::core::event::ReadFailure;
use crate::core::job::Stage;
use crate::core::notice::Notice;
use crate::core::reactor::Restored;
use crate::core::worker_name::WorkerName;
use crate::store::memory::MemoryStore;
use crate::store::{EvaluationRecord, Store as _};

/// Returns a rig with a search that has `evaluations` of one realization in the store, each
/// answered by one of these processes in turn, and then one under way.
fn rig(processes: &[u32], evaluations: u64) -> (Rig, MemoryStore) {
    let mut rig = Rig::new();
    rig.state.config.audit_fraction = 0.0;
    let mut store = MemoryStore::new();
    rig.event(submit(0, "", identification(1)));
    store.put_job(&rig.state.jobs[&JobId(1)].record).unwrap();
    rig.event(stored_event(1, RecordKey::Job));
    let turns = (0..evaluations).zip(processes.iter().cycle());
    for (worker, (number, process)) in (100..).zip(turns) {
        rig.event(hello_of(worker, *process, 1));
        let effects = react(&mut rig.state, answer_in(0.1, worker, number + 1, number, 1), rig.now);
        let [Effect::Store(Record::Evaluation { record, deletes_later: true })] = &effects[..]
        else {
            panic!("{effects:?}");
        };
        store.put_evaluation(record, true).unwrap();
        rig.event(end_of_stream(worker));
        rig.event(stored_event(1, RecordKey::Evaluation(number)));
    }
    (rig, store)
}

/// Answers a read request of a job from the store.
fn read(rig: &mut Rig, store: &MemoryStore, number: u64) -> Vec<String> {
    let found = Ok(store.clone().evaluation(JobId(1), number).unwrap());
    rig.event(Event::Read { job: JobId(1), number, found })
}

/// Returns a batch of a job that a worker holds.
fn batch_of(rig: &Rig, job: JobId) -> u64 {
    let held = rig.state.batches.iter().find(|(_, batch)| batch.assignment.job == job);
    held.map(|(id, _)| id.0).unwrap()
}

/// Lets a worker in `process` contradict itself.
fn expose(rig: &mut Rig, process: u32) -> Vec<String> {
    rig.accept(propagation(2));
    rig.event(hello_of(50, process, 1));
    let job = JobId(rig.state.next_job - 1);
    let batch = batch_of(rig, job);
    rig.event(answer(50, batch, 0, 1));
    // Were it the only host, the job would fail.
    rig.event(hello_on("other", 61, 61, 1));
    let effects = rig.event(answer(50, batch, 1, 1));
    rig.event(end_of_stream(61));
    effects
}

#[test]
fn a_restarted_job_reads_one_evaluation_after_another() {
    let (_, mut store) = rig(&[1], 3);
    let restored = Restored::load(&mut store).unwrap();
    let (state, effects) = State::restore(Config::default(), restored, Duration::ZERO);
    let mut rig = Rig { state, now: Duration::ZERO };
    let started = Effect::Note(Notice::JobStarted { job: JobId(1), stored: 3 });
    assert_eq!(effects, [started, Effect::Read { job: JobId(1), number: 0 }]);
    rig.check(hello(1, 1), &["welcome 1, lease 1"]);
    let snapshot = crate::core::snapshot::job_snapshot(&rig.state, JobId(1), rig.now).unwrap();
    assert_eq!(snapshot.evaluations, 3);
    assert_eq!(snapshot.waiting_for, "its stored evaluations, 0 of 3 are read again");
    assert_eq!(read(&mut rig, &store, 0), ["read job 1 evaluation 1"]);
    // A repeated answer is ignored.
    assert_eq!(read(&mut rig, &store, 0), [""; 0]);
    assert_eq!(read(&mut rig, &store, 1), ["read job 1 evaluation 2"]);
    assert_eq!(read(&mut rig, &store, 2), ["send 1: batch 1 = 0+1"]);
}

#[test]
fn a_store_that_cannot_be_read_is_asked_again() {
    let (_, mut store) = rig(&[1], 1);
    let restored = Restored::load(&mut store).unwrap();
    let (state, _) = State::restore(Config::default(), restored, Duration::ZERO);
    let mut rig = Rig { state, now: Duration::ZERO };
    rig.check(read_refused_event(0), &[]);
    let snapshot = crate::core::snapshot::job_snapshot(&rig.state, JobId(1), rig.now).unwrap();
    let waits = "the store cannot read a record; retrying: the cable is out (since 0 s)";
    assert_eq!(snapshot.waiting_for, waits);
    rig.check_after(Duration::from_secs(2), &["read job 1 evaluation 0"]);
    assert_eq!(read(&mut rig, &store, 0), [""; 0]);
    rig.check(hello(1, 1), &["welcome 1, lease 1", "send 1: batch 1 = 0+1"]);
}

/// Returns the event that the store could not be read.
fn read_refused_event(number: u64) -> Event {
    let found = Err(ReadFailure::Refused { error: "the cable is out".to_owned() });
    Event::Read { job: JobId(1), number, found }
}

/// Returns the event that the stored record is damaged.
fn read_damaged_event(number: u64) -> Event {
    Event::Read { job: JobId(1), number, found: Err(ReadFailure::Damaged) }
}

/// Returns a restarted coordinator with worker 1, about to read the first evaluation of a job.
fn restart(store: &mut MemoryStore) -> Rig {
    let restored = Restored::load(store).unwrap();
    let (state, _) = State::restore(Config::default(), restored, Duration::ZERO);
    let mut rig = Rig { state, now: Duration::ZERO };
    rig.event(hello(1, 1));
    rig
}

#[test]
fn a_damaged_evaluation_is_computed_again_and_no_other() {
    let (_, mut store) = rig(&[1], 3);
    let mut rig = restart(&mut store);
    read(&mut rig, &store, 0);
    rig.check(read_damaged_event(1), &["send 1: batch 1 = 0+1"]);
    let effects = react(&mut rig.state, answer(1, 1, 1, 1), rig.now);
    let Effect::Store(Record::Evaluation { record, deletes_later: false }) = &effects[0] else {
        panic!("{effects:?}");
    };
    assert_eq!(record.outcomes, store.evaluation(JobId(1), 1).unwrap().unwrap().outcomes);
    rig.check(stored_event(1, RecordKey::Evaluation(1)), &["read job 1 evaluation 2"]);
    assert_eq!(read(&mut rig, &store, 2), ["send 1: batch 2 = 0+1"]);
    assert_eq!(rig.state.jobs[&JobId(1)].search.evaluations(), 3);
}

#[test]
fn what_came_of_a_damaged_evaluation_that_was_wrong_is_computed_again() {
    let (_, mut store) = rig(&[1], 3);
    let mut rig = restart(&mut store);
    rig.check(read_damaged_event(0), &["send 1: batch 1 = 0+1"]);
    rig.event(answer(1, 1, 700, 1));
    rig.check(stored_event(1, RecordKey::Evaluation(0)), &["read job 1 evaluation 1"]);
    // The search takes another path: the second evaluation is at the same point, the third is not.
    let mut number = 1;
    let next = |number| [format!("read job 1 evaluation {}", number + 1)];
    let mut effects = read(&mut rig, &store, number);
    while effects == next(number) {
        number += 1;
        effects = read(&mut rig, &store, number);
    }
    // The rest of the old path is deleted before anything else: the coordinator may be killed now.
    let last = number - 1;
    assert_eq!(effects, [format!("store job 1 evaluation {last}")]);
    let Stage::StoringPrepared { records, deletes_later: true, .. } =
        &rig.state.jobs[&JobId(1)].stage
    else {
        panic!("{:?}", rig.state.jobs[&JobId(1)].stage);
    };
    let old = store.evaluation(JobId(1), last).unwrap().unwrap().outcomes;
    // Only the first was wrong.
    assert_eq!((records[0].number, records[0].outcomes == old), (last, last > 0));
    rig.event(stored_event(1, RecordKey::Evaluation(last)));
    assert_eq!(rig.state.jobs[&JobId(1)].stored, number);
    let batch = batch_of(&rig, JobId(1));
    let effects = react(&mut rig.state, answer(1, batch, number, 1), rig.now);
    let Effect::Store(Record::Evaluation { deletes_later: true, .. }) = &effects[0] else {
        panic!("{effects:?}");
    };
}

#[test]
fn a_job_whose_evaluations_cannot_be_read_is_cancelled_at_once() {
    let cancel = || request(7, Request::Cancel(JobId(1)));
    let end = ["store job 1 end: cancelled "];
    // Before the store has refused, after that, and when the stored record is damaged.
    let (_, mut store) = rig(&[1], 2);
    let mut rig = restart(&mut store);
    rig.check(cancel(), &[]);
    rig.check(read_refused_event(0), &end);
    rig.check(stored_event(1, RecordKey::End), &["answer 7: Ended Cancelled", "publish 1"]);
    let mut rig = restart(&mut store);
    rig.check(read_refused_event(0), &[]);
    rig.check(cancel(), &end);
    let mut rig = restart(&mut store);
    rig.check(cancel(), &[]);
    rig.check(read_damaged_event(0), &end);
}

#[test]
fn a_job_that_is_cancelled_before_its_turn_leaves_what_is_stored() {
    let (_, mut store) = rig(&[1], 2);
    let restored = Restored::load(&mut store).unwrap();
    let config = Config { active_jobs_max: 0, ..Config::default() };
    let (state, effects) = State::restore(config, restored, Duration::ZERO);
    assert_eq!(effects, []);
    let mut rig = Rig { state, now: Duration::ZERO };
    rig.check(request(7, Request::Cancel(JobId(1))), &["read job 1 evaluation 0"]);
    assert_eq!(read(&mut rig, &store, 0), ["read job 1 evaluation 1"]);
    assert_eq!(read(&mut rig, &store, 1), ["store job 1 end: cancelled "]);
    rig.check(stored_event(1, RecordKey::End), &["answer 7: Ended Cancelled", "publish 1"]);
    let snapshot = crate::core::snapshot::job_snapshot(&rig.state, JobId(1), rig.now).unwrap();
    assert_eq!(snapshot.evaluations, 2);
}

#[test]
fn the_evaluations_of_a_banned_worker_are_computed_again() {
    let (mut rig, store) = rig(&[1, 2], 3);
    let effects = expose(&mut rig, 2);
    assert!(effects[0].starts_with("store ban 1: node-2 (process 2)"), "{effects:?}");
    // Nothing is read before the ban is durable.
    assert!(!effects.iter().any(|effect| effect.starts_with("read")), "{effects:?}");
    rig.check_after(Duration::from_secs(2), &[]);
    rig.check(not_stored(2, RecordKey::Ban(1)), &[]);
    rig.check_after(Duration::ZERO, &[&effects[0]]);
    rig.check(stored_event(2, RecordKey::Ban(1)), &["read job 1 evaluation 0"]);
    assert_eq!(read(&mut rig, &store, 0), ["read job 1 evaluation 1"]);
    assert_eq!(read(&mut rig, &store, 1), [""; 0]);
    rig.event(hello_of(60, 3, 1));
    // The outcomes are the same: the evaluations stored after it are right, and read.
    let again = answer(60, batch_of(&rig, JobId(1)), 1, 1);
    let effects = react(&mut rig.state, again, rig.now);
    let Effect::Store(Record::Evaluation { record, deletes_later: false }) = &effects[0] else {
        panic!("{effects:?}");
    };
    let name = WorkerName::new("node-3", 3, 0);
    assert_eq!(record.workers, BTreeSet::from([name]));
    rig.check(stored_event(1, RecordKey::Evaluation(1)), &["read job 1 evaluation 2"]);
    read(&mut rig, &store, 2);
    assert_eq!(rig.state.jobs[&JobId(1)].search.evaluations(), 3);
}

#[test]
fn an_evaluation_that_changes_is_the_last_of_its_path() {
    let (mut rig, mut store) = rig(&[2], 3);
    expose(&mut rig, 2);
    rig.event(stored_event(2, RecordKey::Ban(1)));
    assert_eq!(read(&mut rig, &store, 0), [""; 0]);
    rig.event(hello_of(60, 3, 1));
    let different = answer(60, batch_of(&rig, JobId(1)), 77, 1);
    let effects = react(&mut rig.state, different, rig.now);
    let Effect::Store(Record::Evaluation { record, deletes_later: true }) = &effects[0] else {
        panic!("{effects:?}");
    };
    let EvaluationRecord { number: 0, .. } = record else { panic!("{record:?}") };
    store.put_evaluation(record, true).unwrap();
    assert_eq!(store.jobs().unwrap()[0].evaluations, 1);
    // The following evaluations are computed, not read.
    let effects = rig.event(stored_event(1, RecordKey::Evaluation(0)));
    assert!(effects.iter().all(|effect| effect.starts_with("send")), "{effects:?}");
}

#[test]
fn a_ban_that_the_store_refuses_for_too_long_is_despaired_of_and_tried_on() {
    let (mut rig, _) = rig(&[2], 1);
    rig.state.config.store_give_up_after = Some(Duration::from_secs(4));
    let banned = expose(&mut rig, 2).swap_remove(0);
    let failed = || Event::StoreFailed {
        job: JobId(2),
        key: RecordKey::Ban(1),
        error: "the disk is full".to_owned(),
    };
    for _ in 0..2 {
        rig.check(failed(), &[]);
        rig.check_after(Duration::from_secs(2), &[&banned]);
    }
    rig.check(failed(), &["give_up after 4s: the disk is full"]);
    rig.check_after(Duration::from_secs(2), &[&banned]);
    rig.check(stored_event(2, RecordKey::Ban(1)), &["read job 1 evaluation 0"]);
}

/// Returns a rig with a search of one evaluation, answered by process 2, whose end the store has
/// refused.
fn refused_end() -> Rig {
    let mut rig = Rig::new();
    rig.state.config.audit_fraction = 0.0;
    rig.accept(propagation(1));
    rig.event(hello_of(100, 2, 1));
    rig.check(answer(100, 1, 0, 1), &["store job 1 evaluation 0"]);
    let end = rig.event(stored_event(1, RecordKey::Evaluation(0)));
    assert_eq!(end, ["store job 1 end: converged "]);
    rig.event(end_of_stream(100));
    rig
}

fn not_stored(job: u64, key: RecordKey) -> Event {
    Event::StoreFailed { job: JobId(job), key, error: "the disk is full".to_owned() }
}

#[test]
fn an_end_that_the_store_refuses_is_taken_back_with_its_worker() {
    // Refused before the worker is banned.
    let mut rig = refused_end();
    rig.check(not_stored(1, RecordKey::End), &[]);
    expose(&mut rig, 2);
    rig.check(stored_event(2, RecordKey::Ban(1)), &["read job 1 evaluation 0"]);
    // No wrong end is written meanwhile.
    rig.check_after(Duration::from_secs(1), &[]);

    // On its way when the worker is banned, and refused after that.
    for again in [false, true] {
        let mut rig = refused_end();
        if again {
            rig.check(not_stored(1, RecordKey::End), &[]);
            rig.check_after(Duration::from_secs(2), &["store job 1 end: converged "]);
        }
        let effects = expose(&mut rig, 2);
        assert!(!effects.iter().any(|effect| effect.starts_with("read")), "{effects:?}");
        rig.check(not_stored(1, RecordKey::End), &[]);
        rig.check(stored_event(2, RecordKey::Ban(1)), &["read job 1 evaluation 0"]);
    }

    // On its way, and durable: the log names it.
    let mut rig = refused_end();
    expose(&mut rig, 2);
    rig.check(stored_event(1, RecordKey::End), &["publish 1"]);
    rig.check(stored_event(2, RecordKey::Ban(1)), &[]);
}
