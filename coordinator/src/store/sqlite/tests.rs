//! The file: what is put is there after a reopening, what is damaged or foreign is refused.

use osteon_common::case::Setup;
use osteon_common::job::{Data, JobKind, JobSpecification, MonteCarlo, Objective, Range, Search};
use osteon_common::outcome::{FailureCounts, FailureKind};

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
        fingerprint: "osteon 1.2.3 numerics 4".to_owned(),
    }
}

fn evaluation(job: u64, number: u64) -> EvaluationRecord {
    EvaluationRecord {
        job: JobId(job),
        number,
        point: Point([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1 + number as f64]),
        outcomes: Arc::from([Ok(3900.1), Err(FailureKind::NoConvergence), Ok(f64::MIN_POSITIVE)]),
        // The second one as an older version would have put it.
        estimated_error: (number != 1)
            .then_some(EstimatedError { median: 2e-5, largest: f64::MIN_POSITIVE }),
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

fn evaluations(store: &mut SqliteStore, job: u64) -> Result<Vec<EvaluationRecord>, StoreError> {
    let mut all = Vec::new();
    store.evaluations(JobId(job), 0, &mut |record| {
        all.push(record);
        ControlFlow::Continue(())
    })?;
    Ok(all)
}

fn summary(job: u64) -> Summary {
    let row = |number| osteon_common::results::Evaluation {
        number,
        point: evaluation(job, number).point,
        moments: (number == 1).then_some(Moments { mean: 0.1, coefficient_of_variation: 0.3 }),
        cost: Some(if number == 1 { 1e-300 } else { f64::INFINITY }),
        failures: FailureCounts::of(&evaluation(job, number).outcomes),
        estimated_error: evaluation(job, number).estimated_error,
    };
    Summary { digest: format!("{job:064x}"), best: Some(1), history: (0..2).map(row).collect() }
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
        store.finish_job(&end(1), &summary(1)).unwrap();
    }
    drop(store);
    let mut store = SqliteStore::open(&directory.path().join("made/on/the/way")).unwrap();
    let expected =
        [StoredJob { record: job(1), end: Some(end(1)) }, StoredJob { record: job(2), end: None }];
    assert_eq!(store.jobs().unwrap(), expected);
    assert_eq!(evaluations(&mut store, 1).unwrap(), [evaluation(1, 0), evaluation(1, 1)]);
    assert_eq!(evaluations(&mut store, 2).unwrap(), [evaluation(2, 0)]);
    assert_eq!(evaluations(&mut store, 3).unwrap(), []);
    assert_eq!(store.summary(JobId(1)).unwrap(), Some(summary(1)));
    assert_eq!(store.summary(JobId(2)).unwrap(), None);
}

#[test]
fn a_second_coordinator_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let _first = SqliteStore::open(directory.path()).unwrap();
    let error = SqliteStore::open(directory.path()).unwrap_err();
    assert!(matches!(error, StoreError::InUse { .. }), "{error}");
}

#[test]
fn another_format_is_refused() {
    for (version, expected) in [
        (1, "has format 1 of an older version of osteon, this program writes format 3; finish"),
        (4, "has format 4, this program writes format 3; use a newer version of osteon"),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(directory.path()).unwrap();
        store.connection.execute("UPDATE format SET version = ?1", [version]).unwrap();
        drop(store);
        let error = SqliteStore::open(directory.path()).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    }
}

/// The table of evaluations as format 2 had it.
const EVALUATION_OF_FORMAT_2: &str = "
    DROP TABLE evaluation;
    CREATE TABLE evaluation (
        job INTEGER NOT NULL REFERENCES job(id),
        number INTEGER NOT NULL,
        point BLOB NOT NULL,
        outcomes BLOB NOT NULL,
        checksum BLOB NOT NULL,
        PRIMARY KEY (job, number)
    );
    UPDATE format SET version = 2;
";

#[test]
fn a_file_of_format_2_is_brought_up_to_date() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    store.put_job(&job(1)).unwrap();
    store.connection.execute_batch(EVALUATION_OF_FORMAT_2).unwrap();
    let old = evaluation(1, 1);
    let point: Vec<u8> = old.point.0.iter().flat_map(|value| value.to_le_bytes()).collect();
    let outcomes = pack_outcomes(&old.outcomes);
    let fields: [&[u8]; 4] = [&1_u64.to_le_bytes(), &1_u64.to_le_bytes(), &point, &outcomes];
    let sql = "INSERT INTO evaluation VALUES (1, 1, ?1, ?2, ?3)";
    store.connection.execute(sql, params![point, outcomes, checksum(&fields)]).unwrap();
    drop(store);
    for _ in 0..2 {
        let mut store = SqliteStore::open(directory.path()).unwrap();
        store.put_evaluation(&evaluation(1, 2)).unwrap();
        assert_eq!(evaluations(&mut store, 1).unwrap(), [old.clone(), evaluation(1, 2)]);
    }
}

#[test]
fn evaluations_are_shown_until_the_visitor_breaks() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    store.put_job(&job(1)).unwrap();
    for number in 0..4 {
        store.put_evaluation(&evaluation(1, number)).unwrap();
    }
    let mut shown = Vec::new();
    let mut visit = |record: EvaluationRecord| {
        shown.push(record.number);
        if shown.len() == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    store.evaluations(JobId(1), 1, &mut visit).unwrap();
    assert_eq!(shown, [1, 2]);
}

#[test]
fn a_job_that_begins_again_has_no_evaluation_and_new_numerics() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    for id in [1, 2] {
        store.put_job(&job(id)).unwrap();
        store.put_evaluation(&evaluation(id, 0)).unwrap();
    }
    store.begin_again(JobId(1), "osteon 2.0.0 numerics 5").unwrap();
    drop(store);
    let mut store = SqliteStore::open(directory.path()).unwrap();
    let again = JobRecord { fingerprint: "osteon 2.0.0 numerics 5".to_owned(), ..job(1) };
    let stored = |record| StoredJob { record, end: None };
    assert_eq!(store.jobs().unwrap(), [again, job(2)].map(stored));
    assert_eq!(evaluations(&mut store, 1).unwrap(), []);
    assert_eq!(evaluations(&mut store, 2).unwrap(), [evaluation(2, 0)]);
}

#[test]
fn every_damaged_record_is_named() {
    for (sql, record) in [
        ("UPDATE job SET specification = x'00'", DamagedRecord::Specification),
        ("UPDATE job SET checksum = x''", DamagedRecord::Specification),
        ("UPDATE job SET request_id = 'other'", DamagedRecord::Specification),
        ("UPDATE job SET accepted_ns = 1", DamagedRecord::Specification),
        ("UPDATE job SET fingerprint = 'other'", DamagedRecord::Specification),
        ("UPDATE evaluation SET outcomes = zeroblob(27)", DamagedRecord::Evaluation(7)),
        ("UPDATE evaluation SET point = zeroblob(56)", DamagedRecord::Evaluation(7)),
        ("UPDATE evaluation SET number = 8", DamagedRecord::Evaluation(8)),
        ("UPDATE evaluation SET estimated_error = zeroblob(16)", DamagedRecord::Evaluation(7)),
        ("UPDATE evaluation SET estimated_error = NULL", DamagedRecord::Evaluation(7)),
        ("UPDATE ending SET status = 'done'", DamagedRecord::End),
        ("UPDATE ending SET status = 'converged'", DamagedRecord::End),
        ("UPDATE ending SET reason = NULL", DamagedRecord::End),
        ("UPDATE ending SET reason = ''", DamagedRecord::End),
        ("UPDATE ending SET version = '1.2.4'", DamagedRecord::End),
        ("UPDATE ending SET ended_ns = 1", DamagedRecord::End),
        ("UPDATE ending SET evaluations = 3", DamagedRecord::End),
        ("UPDATE ending SET best_cost = 0.0", DamagedRecord::End),
        ("UPDATE ending SET best_mean = 3901.0", DamagedRecord::End),
        ("UPDATE ending SET best_coefficient_of_variation = 0.2", DamagedRecord::End),
        ("UPDATE ending SET checksum = x''", DamagedRecord::End),
        ("UPDATE summary SET digest = ''", DamagedRecord::Summary),
        ("UPDATE summary SET best = 0", DamagedRecord::Summary),
        ("UPDATE summary SET best = NULL", DamagedRecord::Summary),
        ("UPDATE summary SET history = x''", DamagedRecord::Summary),
        ("UPDATE summary SET checksum = x''", DamagedRecord::Summary),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let mut store = SqliteStore::open(directory.path()).unwrap();
        store.put_job(&job(1)).unwrap();
        store.put_evaluation(&evaluation(1, 7)).unwrap();
        store.finish_job(&end(1), &summary(1)).unwrap();
        store.connection.execute(sql, []).unwrap();
        let jobs = store.jobs().map(|_| ());
        let read = jobs.and_then(|()| evaluations(&mut store, 1).map(|_| ()));
        let error = read.and_then(|()| store.summary(JobId(1)).map(|_| ())).unwrap_err();
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
