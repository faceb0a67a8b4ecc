//! The best evaluation and the summary are enough, and nothing less.

use std::sync::Arc;
use std::time::Duration;

use osteon_common::case::Setup;
use osteon_common::job::{Data, JobKind, MonteCarlo, Objective, Range, Search as SearchSettings};
use osteon_common::outcome::Outcome;
use osteon_common::results::EstimatedError;

use super::*;
use crate::search::{Ending, Search, Step};
use crate::store::memory::MemoryStore;
use crate::store::{EvaluationRecord, JobRecord};

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
