//! The best evaluation and the summary are enough, and nothing less.

use std::sync::Arc;
use std::time::Duration;

use osteon_common::case::Setup;
use osteon_common::job::{Data, JobKind, MonteCarlo, Objective, Range, Search as SearchSettings};
use osteon_common::outcome::Outcome;
use osteon_common::results::EstimatedError;

use tokio::sync::{mpsc, oneshot};

use super::*;
use crate::effect::Record;
use crate::event::{Event, RecordKey};
use crate::search::{Ending, Search, Step};
use crate::store::memory::MemoryStore;
use crate::store::{EvaluationRecord, JobRecord};
use crate::store_thread::{Command, serve};

const JOB: JobId = JobId(1);

/// An ended search of eight evaluations, and the record of its best.
fn ended() -> (JobRecord, Search, EndRecord, EvaluationRecord) {
    let mut parameters = [1598.8, 17.7e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.0].map(Range::Fixed);
    parameters[6] = Range::Free { start: 0.12, lower: 0.02, upper: 0.3 };
    let specification = Arc::new(JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(Data::Moments { mean: 3900.0, coefficient_of_variation: 0.03 }),
        parameters,
        monte_carlo: MonteCarlo { realizations: 2, ..MonteCarlo::default() },
        objective: Objective::default(),
        search: SearchSettings { max_evaluations: 8, ..SearchSettings::default() },
    });
    let mut search = Search::new(specification.clone());
    let mut records = Vec::new();
    let ending = loop {
        match search.ask() {
            Step::Done(ending) => break ending,
            Step::Evaluate(point) => {
                let spread = 2000.0 * point.dispersion();
                let outcomes: Arc<[Outcome]> = [Ok(3900.0 - spread), Ok(3900.0 + spread)].into();
                let number = search.evaluations();
                let estimated_error =
                    Some(EstimatedError { median: spread, largest: 2.0 * spread });
                search.tell(outcomes.clone(), estimated_error);
                let record = EvaluationRecord {
                    job: JOB,
                    number,
                    point,
                    outcomes,
                    estimated_error,
                    workers: [].into(),
                };
                records.push(record);
            }
        }
    };
    let record = JobRecord {
        name: String::new(),
        job: JOB,
        request_id: String::new(),
        specification,
        accepted: Duration::ZERO,
        fingerprint: String::new(),
        client: String::new(),
        priority: 0,
    };
    let end = EndRecord::new(JOB, ending, Duration::ZERO, 8, search.best());
    let best = search.best().unwrap().number as usize;
    assert!((1..8).contains(&best), "a search that finds nothing tests nothing");
    (record, search, end, records.swap_remove(best))
}

#[test]
fn the_summary_and_the_best_evaluation_are_enough() {
    let (record, search, end, best) = ended();
    let mut store = MemoryStore::new();
    store.put_job(&record).unwrap();
    store.put_evaluation(&best, false).unwrap();
    store.finish_job(&end, &search.summary()).unwrap();
    let left = read(&mut store, &end).unwrap();
    assert_eq!(left.result, search.result(&end.ending, &end.version));
    assert_eq!(left.history, search.history());
}

#[test]
fn what_is_missing_is_named() {
    let (record, search, end, best) = ended();
    let mut store = MemoryStore::new();
    let error = read(&mut store, &end).unwrap_err();
    assert!(matches!(error, ReadError::Pruned { job: JOB }), "{error}");
    store.put_job(&record).unwrap();
    let error = read(&mut store, &end).unwrap_err();
    assert!(matches!(error, ReadError::NoSummary { job: JOB }), "{error}");
    store.finish_job(&end, &search.summary()).unwrap();
    let later = EvaluationRecord { number: best.number + 1, ..best };
    store.put_evaluation(&later, false).unwrap();
    let error = read(&mut store, &end).unwrap_err();
    assert!(matches!(error, ReadError::NoBest { job: JOB, .. }), "{error}");
}

#[test]
fn a_path_without_an_evaluation_leaves_a_result() {
    let (record, _, end, _) = ended();
    let ending = Ending { status: osteon_common::results::Status::Cancelled, reason: None };
    let end = EndRecord { ending, ..end };
    let mut store = MemoryStore::new();
    store.put_job(&record).unwrap();
    let search = Search::new(record.specification.clone());
    store.finish_job(&end, &crate::search::Summary::empty()).unwrap();
    let left = read(&mut store, &end).unwrap();
    assert_eq!(left.result, search.result(&end.ending, &end.version));
}

/// A store with an ended job.
fn with_ended() -> (MemoryStore, JobRecord, EndRecord) {
    let (record, search, end, best) = ended();
    let mut store = MemoryStore::new();
    store.put_job(&record).unwrap();
    store.put_evaluation(&best, false).unwrap();
    store.finish_job(&end, &search.summary()).unwrap();
    (store, record, end)
}

#[test]
fn a_record_is_read_at_a_time() {
    let (mut store, _, end) = with_ended();
    let mut reading = Reading::new(end.clone());
    assert_eq!(reading.step(&mut store).unwrap(), None);
    assert_eq!(reading.step(&mut store).unwrap(), None);
    let whole = reading.step(&mut store).unwrap();
    assert_eq!(whole, Some(read(&mut store, &end).unwrap()));
}

#[test]
fn a_job_that_is_pruned_while_it_is_read_is_said_to_be() {
    for steps in 0..3 {
        let (mut store, _, end) = with_ended();
        let mut reading = Reading::new(end);
        for _ in 0..steps {
            assert_eq!(reading.step(&mut store).unwrap(), None);
        }
        store.forget_jobs(&[JOB]).unwrap();
        let error = reading.step(&mut store).unwrap_err();
        assert!(matches!(error, ReadError::Pruned { job: JOB }), "after {steps}: {error}");
    }
}

/// Two fetches are asked for, then a record is to be put and the job forgotten: neither waits until
/// all is read.
#[test]
fn a_fetch_lets_others_have_the_store_in_between() {
    let (mut store, record, end) = with_ended();
    let (sender, mut commands) = mpsc::channel(8);
    let (events, mut done) = mpsc::channel(8);
    let mut fetches = Vec::new();
    for _ in 0..2 {
        let (reply, fetched) = oneshot::channel();
        sender.try_send(Command::Fetch { end: end.clone(), reply }).unwrap();
        fetches.push(fetched);
    }
    let other = JobRecord { job: JobId(2), ..record };
    sender.try_send(Command::Put(Record::Job(other))).unwrap();
    sender.try_send(Command::Prune { token: None, jobs: vec![JOB] }).unwrap();
    drop(sender);
    serve(&mut store, &mut commands, &events);
    assert_eq!(done.try_recv().unwrap(), Event::Stored { job: JobId(2), key: RecordKey::Job });
    assert!(matches!(done.try_recv().unwrap(), Event::Pruned { outcome: Ok(()), .. }));
    for mut fetched in fetches {
        let error = fetched.try_recv().unwrap().unwrap_err();
        assert!(matches!(error, ReadError::Pruned { job: JOB }), "{error}");
    }
}
