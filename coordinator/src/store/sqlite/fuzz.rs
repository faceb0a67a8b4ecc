//! Rows with damaged columns but valid checksums, as another program may write them. Reading one
//! must give a typed error or a record, never a panic, within a limit of processor time. A record
//! that is read is written and read again, unchanged.

use osteon_common::observables::PerObservable;
use osteon_fuzz::{CASES, bounded, bytes, check, damaged, here};
use osteon_proto::{history, v1};

use super::columns::{evaluation_checksum, pack_errors, pack_outcomes, pack_point, pack_workers};
use super::summary::summary_checksum;
use super::tests::{end, evaluation, job, summary};
use super::*;

/// The columns of an evaluation that are decoded.
const COLUMNS: [&str; 4] = ["point", "outcomes", "estimated_error", "workers"];
/// Maximum length of an error message, bytes.
const REFUSAL_BYTES_MAX: usize = 4096;
const JOB: JobId = JobId(1);

/// Returns a store with job 1, its evaluation 2 and its end, without protection against power loss.
fn store(directory: &Path) -> SqliteStore {
    let mut store = SqliteStore::open(directory).unwrap();
    store.connection.pragma_update(None, "synchronous", false).unwrap();
    store.put_job(&job(1)).unwrap();
    store.put_evaluation(&evaluation(1, 2), false).unwrap();
    store.finish_job(&end(1), &summary(1)).unwrap();
    store
}

/// Returns the record that was read, if any; an error must be typed and readable.
fn accepted<T>(read: Result<Option<T>, StoreError>) -> Option<T> {
    read.unwrap_or_else(|error| {
        let text = error.to_string();
        assert!(text.len() <= REFUSAL_BYTES_MAX && text.contains("osteon.sqlite"), "{text}");
        None
    })
}

/// Writes `damage` into one column of an evaluation and reads it.
fn check_evaluation(store: &mut SqliteStore, column: usize, damage: &[u8]) {
    let whole = evaluation(1, 2);
    let (point, outcomes) =
        (pack_point(whole.point), pack_outcomes(&whole.outcomes, PerObservable::default()));
    let errors = whole.estimated_error.map(pack_errors).unwrap_or_default();
    let workers = pack_workers(&whole.workers).into_bytes();
    let mut columns = [point, outcomes, errors, workers];
    columns[column] = damage.to_vec();
    let [point, outcomes, errors, workers] = &columns;
    // A column of text that is not valid UTF-8 is replaced for the checksum.
    let text = std::str::from_utf8(workers).unwrap_or_default();
    let checksum = evaluation_checksum((JOB, 2), point, (outcomes, &[]), Some(errors), text);
    let sql = "UPDATE evaluation SET point = ?1, outcomes = ?2, estimated_error = ?3,
               workers = CAST(?4 AS TEXT), checksum = ?5 WHERE job = 1 AND number = 2";
    let values = params![point, outcomes, errors, workers, checksum];
    assert_eq!(store.connection.execute(sql, values).unwrap(), 1);
    let read = bounded(damage.len(), || store.evaluation(JOB, 2));
    if let Some(record) = accepted(read) {
        store.put_evaluation(&record, false).unwrap();
        let again = store.evaluation(JOB, 2).unwrap().unwrap();
        // Compared as text, since NaN is not equal to itself.
        assert_eq!(format!("{again:?}"), format!("{record:?}"), "{}", COLUMNS[column]);
    }
}

/// Writes `damage` as the specification of a job and reads it.
fn check_specification(store: &mut SqliteStore, damage: &[u8]) {
    let record = job(1);
    let checksum = job_checksum(&job_columns(&record, damage));
    let sql = "UPDATE job SET specification = ?1, checksum = ?2 WHERE id = 1";
    assert_eq!(store.connection.execute(sql, params![damage, checksum]).unwrap(), 1);
    if let Some(record) = accepted(bounded(damage.len(), || store.job(JOB))) {
        assert!(record.specification.check().is_empty());
        let again = specification::to_message(&record.specification).encode_to_vec();
        let message = v1::JobSpecification::decode(again.as_slice()).unwrap();
        assert_eq!(specification::from_message(&message).unwrap(), *record.specification);
    }
}

/// Writes `damage` as the history of an ended job and reads it.
fn check_history(store: &mut SqliteStore, damage: &[u8]) {
    let Summary { digest, best, .. } = summary(1);
    let checksum = summary_checksum(JOB, &digest, best, damage);
    let sql = "UPDATE summary SET history = ?1, checksum = ?2 WHERE job = 1";
    assert_eq!(store.connection.execute(sql, params![damage, checksum]).unwrap(), 1);
    if let Some(read) = accepted(bounded(damage.len(), || store.summary(JOB))) {
        let again = |row| history::evaluation_from_message(&history::evaluation_to_message(row));
        let history: Result<Vec<_>, _> = read.history.iter().map(again).collect();
        assert_eq!(format!("{:?}", history.unwrap()), format!("{:?}", read.history));
    }
}

/// Checks every seed unchanged, then many damaged ones.
fn run(seeds: Vec<Vec<u8>>, mut check_one: impl FnMut(&mut SqliteStore, &[u8])) {
    let directory = tempfile::tempdir().unwrap();
    let store = std::cell::RefCell::new(store(directory.path()));
    for seed in &seeds {
        check_one(&mut store.borrow_mut(), seed);
    }
    let check_one = std::cell::RefCell::new(check_one);
    check(&here!(), CASES, damaged(seeds), |damage| {
        (check_one.borrow_mut())(&mut store.borrow_mut(), &damage);
        Ok(())
    });
}

/// The name by which `cargo xtask test random` finds these tests.
mod on_random_cases {
    use super::*;

    #[test]
    fn damaged_evaluations_are_refused_or_read() {
        for column in 0..COLUMNS.len() {
            run(bytes("store"), |store, damage| check_evaluation(store, column, damage));
        }
    }

    #[test]
    fn damaged_specifications_are_refused_or_read() {
        let mut seeds = bytes("store");
        let records = [1, 2].map(job);
        let encoded = |record: &JobRecord| specification::to_message(&record.specification);
        seeds.extend(records.iter().map(|record| encoded(record).encode_to_vec()));
        run(seeds, check_specification);
    }

    #[test]
    fn damaged_histories_are_refused_or_read() {
        let mut seeds = bytes("store");
        let rows = summary(1).history.iter().map(history::evaluation_to_message).collect();
        seeds.push(v1::HistoryBlock { rows, groups: Vec::new() }.encode_to_vec());
        run(seeds, check_history);
    }
}
