//! The best evaluation and the summary are necessary and sufficient for the output of a job.

use std::sync::Arc;
use std::time::Duration;

use osteon_common::case::Setup;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{Data, JobKind, MonteCarlo, Objective, Range, Search as SearchSettings};
use osteon_common::outcomes::Outcomes;
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::results::EstimatedError;
use osteon_common::systematic::Systematic;
use osteon_common::version::Program;
use osteon_search::{Ending, Search, Step};

use tokio::sync::{mpsc, oneshot};

use super::*;
use crate::core::effect::Record;
use crate::core::effect::RecordKey;
use crate::core::event::Event;
use crate::metrics::write_times::WriteTimes;
use crate::store::memory::MemoryStore;
use crate::store::thread::{StoreCommand, serve};
use crate::store::{EvaluationRecord, JobRecord};

const JOB: JobId = JobId(1);

/// Returns an ended search of eight evaluations, and the record of its best.
pub(crate) fn ended() -> (JobRecord, Search, EndRecord, EvaluationRecord) {
    let mut parameters =
        Range::of_bone([1598.8, 17.7e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.0].map(Range::Fixed));
    parameters[6] = Range::Free { start: 0.12, lower: 0.02, upper: 0.3 };
    let specification = Arc::new(JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(Data::from_moments(3900.0, 0.03)),
        parameters,
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo { realizations: 2, ..MonteCarlo::default() },
        objective: Objective::default(),
        search: SearchSettings { max_evaluations: 8, ..SearchSettings::default() },
        posterior: None,
    });
    let mut search = Search::new(specification.clone());
    let mut records = Vec::new();
    let ending = loop {
        match search.ask() {
            Step::Done(ending) => break ending,
            Step::Evaluate(point) => {
                let spread = 2000.0 * point.dispersion();
                let outcomes: Outcomes = [Ok(3900.0 - spread), Ok(3900.0 + spread)].into();
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
    let end = EndRecord::new(JOB, ending, Program::current(None), Duration::ZERO, 8, search.best());
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
    assert_eq!(left.result, search.result(&end.ending, &end.program));
    assert_eq!(left.history, search.history());
}

#[test]
fn what_is_missing_is_named() {
    let (record, search, end, best) = ended();
    let mut store = MemoryStore::new();
    let error = read(&mut store, &end).unwrap_err();
    assert!(matches!(error, OutputError::Pruned { job: JOB }), "{error}");
    store.put_job(&record).unwrap();
    let error = read(&mut store, &end).unwrap_err();
    assert!(matches!(error, OutputError::NoSummary { job: JOB }), "{error}");
    store.finish_job(&end, &search.summary()).unwrap();
    let later = EvaluationRecord { number: best.number + 1, ..best };
    store.put_evaluation(&later, false).unwrap();
    let error = read(&mut store, &end).unwrap_err();
    assert!(matches!(error, OutputError::NoBest { job: JOB, .. }), "{error}");
}

#[test]
fn a_path_without_an_evaluation_leaves_a_result() {
    let (record, _, end, _) = ended();
    let ending = Ending::from_search(osteon_common::results::Status::Cancelled, None);
    let end = EndRecord { ending, ..end };
    let mut store = MemoryStore::new();
    store.put_job(&record).unwrap();
    let search = Search::new(record.specification.clone());
    store.finish_job(&end, &osteon_search::Summary::empty()).unwrap();
    let left = read(&mut store, &end).unwrap();
    assert_eq!(left.result, search.result(&end.ending, &end.program));
}

/// Returns a store with an ended job.
fn with_ended() -> (MemoryStore, JobRecord, EndRecord) {
    let (record, search, end, best) = ended();
    let mut store = MemoryStore::new();
    store.put_job(&record).unwrap();
    store.put_evaluation(&best, false).unwrap();
    store.finish_job(&end, &search.summary()).unwrap();
    (store, record, end)
}

/// Serves a request at once and returns the reply.
fn served<T>(
    store: &mut MemoryStore,
    reading: impl FnOnce(Reply<T>) -> ReadRequest,
) -> Result<T, OutputError> {
    let (reply, mut read) = oneshot::channel();
    reading(reply).serve(store);
    read.try_recv().unwrap()
}

#[test]
fn a_job_that_is_pruned_while_it_is_read_is_said_to_be() {
    let (mut store, record, end) = with_ended();
    assert_eq!(served(&mut store, |reply| ReadRequest::Job(JOB, reply)).unwrap(), record);
    let summary = served(&mut store, |reply| ReadRequest::Summary(JOB, reply)).unwrap();
    let best = summary.best.unwrap();
    let outcomes = served(&mut store, |reply| ReadRequest::Outcomes(JOB, best, reply)).unwrap();
    assert_eq!(outcomes.len(), 2);
    let left = StoredOutput { end, specification: record.specification, summary };
    assert_eq!(left.result(Some(outcomes)), read(&mut store, &left.end).unwrap().result);

    store.delete_jobs(&[JOB]).unwrap();
    let errors = [
        served(&mut store, |reply| ReadRequest::Job(JOB, reply)).unwrap_err(),
        served(&mut store, |reply| ReadRequest::Summary(JOB, reply)).unwrap_err(),
        served(&mut store, |reply| ReadRequest::Outcomes(JOB, best, reply)).unwrap_err(),
    ];
    for error in errors {
        assert!(matches!(error, OutputError::Pruned { job: JOB }), "{error}");
    }
}

/// Many reads are waiting when a record is put and the job is deleted: neither command waits until
/// all records are read.
#[test]
fn a_fetch_lets_others_have_the_store_in_between() {
    let (mut store, record, _) = with_ended();
    let (sender, mut commands) = mpsc::channel(8);
    let (events, mut done) = mpsc::channel(8);
    let mut fetches = Vec::new();
    for _ in 0..3 {
        let (reply, fetched) = oneshot::channel();
        sender.try_send(StoreCommand::Fetch(ReadRequest::Summary(JOB, reply))).unwrap();
        fetches.push(fetched);
    }
    let other = JobRecord { job: JobId(2), ..record };
    sender.try_send(StoreCommand::Put(Record::Job(other))).unwrap();
    sender.try_send(StoreCommand::Prune { reply_id: None, jobs: vec![JOB] }).unwrap();
    drop(sender);
    serve(&mut store, &mut commands, &events, &WriteTimes::default());
    assert_eq!(done.try_recv().unwrap(), Event::Stored { job: JobId(2), key: RecordKey::Job });
    assert!(matches!(done.try_recv().unwrap(), Event::Pruned { outcome: Ok(()), .. }));
    let mut read = fetches.into_iter().map(|mut fetched| fetched.try_recv().unwrap());
    // One record is read between the two commands.
    assert!(read.next().unwrap().is_ok());
    for error in read.map(Result::unwrap_err) {
        assert!(matches!(error, OutputError::Pruned { job: JOB }), "{error}");
    }
}
