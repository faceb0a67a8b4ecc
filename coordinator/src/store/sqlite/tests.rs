//! The file: what is put is there after a reopening, what is damaged or foreign is refused.

use osteon_common::case::Setup;
use osteon_common::job::{Data, JobKind, JobSpecification, MonteCarlo, Objective, Range, Search};
use osteon_common::outcome::FailureKind;

use super::*;

fn job(id: u64) -> JobRecord {
    let mut parameters =
        [1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029].map(Range::Fixed);
    parameters[1] = Range::Free { start: 17.717e9, lower: 12e9, upper: 25e9 };
    let specification = JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(Data::Velocities(vec![3900.25, 3901.5])),
        parameters,
        monte_carlo: MonteCarlo::default(),
        objective: Objective::default(),
        search: Search::default(),
    };
    JobRecord {
        job: JobId(id),
        request_id: format!("request {id}"),
        specification: Arc::new(specification),
        accepted: Duration::from_nanos(1_763_000_000_123_456_789),
    }
}

fn evaluation(job: u64, number: u64) -> EvaluationRecord {
    EvaluationRecord {
        job: JobId(job),
        number,
        point: Point([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1 + number as f64]),
        outcomes: Arc::from([Ok(3900.1), Err(FailureKind::NoConvergence), Ok(f64::MIN_POSITIVE)]),
    }
}

fn end(job: u64) -> EndRecord {
    EndRecord {
        job: JobId(job),
        ending: Ending { status: Status::Failed, reason: Some("why".to_owned()) },
        version: "1.2.3".to_owned(),
        ended: Duration::from_secs(1_763_000_100),
        evaluations: 2,
        best_cost: None,
        best_moments: Some(Moments { mean: 3900.1, coefficient_of_variation: 0.1 }),
    }
}

#[test]
fn what_is_put_is_there_after_a_reopening() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(&directory.path().join("made/on/the/way")).unwrap();
    for _ in 0..2 {
        // Twice: a write whose report was lost is repeated.
        store.put_job(&job(1)).unwrap();
        store.put_job(&job(2)).unwrap();
        store.put_evaluation(&evaluation(2, 0)).unwrap();
        store.put_evaluation(&evaluation(1, 1)).unwrap();
        store.put_evaluation(&evaluation(1, 0)).unwrap();
        store.finish_job(&end(1)).unwrap();
    }
    drop(store);
    let mut store = SqliteStore::open(&directory.path().join("made/on/the/way")).unwrap();
    let expected =
        [StoredJob { record: job(1), end: Some(end(1)) }, StoredJob { record: job(2), end: None }];
    assert_eq!(store.jobs().unwrap(), expected);
    assert_eq!(store.evaluations(JobId(1)).unwrap(), [evaluation(1, 0), evaluation(1, 1)]);
    assert_eq!(store.evaluations(JobId(2)).unwrap(), [evaluation(2, 0)]);
    assert_eq!(store.evaluations(JobId(3)).unwrap(), []);
}

#[test]
fn a_second_coordinator_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let _first = SqliteStore::open(directory.path()).unwrap();
    let error = SqliteStore::open(directory.path()).unwrap_err();
    assert!(matches!(error, StoreError::InUse { .. }), "{error}");
}

#[test]
fn a_newer_format_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(directory.path()).unwrap();
    store.connection.execute("UPDATE format SET version = 2", []).unwrap();
    drop(store);
    let error = SqliteStore::open(directory.path()).unwrap_err();
    assert!(matches!(error, StoreError::Newer { found: 2, known: 1, .. }), "{error}");
}

#[test]
fn every_damaged_record_is_named() {
    for (sql, record) in [
        ("UPDATE job SET specification = x'00'", DamagedRecord::Specification),
        ("UPDATE job SET checksum = x''", DamagedRecord::Specification),
        ("UPDATE evaluation SET outcomes = zeroblob(27)", DamagedRecord::Evaluation(7)),
        ("UPDATE evaluation SET point = zeroblob(56)", DamagedRecord::Evaluation(7)),
        ("UPDATE evaluation SET number = 8", DamagedRecord::Evaluation(8)),
        ("UPDATE ending SET status = 'done'", DamagedRecord::End),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let mut store = SqliteStore::open(directory.path()).unwrap();
        store.put_job(&job(1)).unwrap();
        store.put_evaluation(&evaluation(1, 7)).unwrap();
        store.finish_job(&end(1)).unwrap();
        store.connection.execute(sql, []).unwrap();
        let jobs = store.jobs().map(|_| ());
        let error = jobs.and_then(|()| store.evaluations(JobId(1)).map(|_| ())).unwrap_err();
        assert!(
            matches!(&error, StoreError::Damaged { record: found, .. } if *found == record),
            "{sql}: {error}"
        );
    }
}

#[test]
fn a_file_that_is_no_store_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join(FILE), "not a database, whatever its name says").unwrap();
    let error = SqliteStore::open(directory.path()).unwrap_err();
    assert!(matches!(error, StoreError::Sqlite { .. }), "{error}");
    assert!(error.to_string().contains(FILE), "{error}");
}

#[test]
fn the_modes_are_those_that_make_records_durable() {
    let directory = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(directory.path()).unwrap();
    let pragma = |name| {
        let read = |row: &Row<'_>| row.get::<_, rusqlite::types::Value>(0);
        store.connection.pragma_query_value(None, name, read).unwrap()
    };
    assert_eq!(pragma("journal_mode"), "wal".to_owned().into());
    assert_eq!(pragma("locking_mode"), "exclusive".to_owned().into());
    assert_eq!(pragma("synchronous"), 2_i64.into());
}
