//! Results of incomplete evaluations.

use osteon_common::outcome::RealizationResult;

use super::*;
use crate::store::{PartPiece, PartRecord};

/// A part of the evaluation with this number, in two pieces.
pub(super) fn part(job: u64, number: u64) -> PartRecord {
    let result = |k: u32| RealizationResult {
        outcome: if k == 1 { Err(FailureKind::NoArrival) } else { Ok(3900.0 + f64::from(k)) },
        estimated_error: if k == 1 { 0.0 } else { 1e-5 * f64::from(k) },
        observables: ObservedValues::NONE,
    };
    let piece = |first: u64, process| PartPiece {
        first,
        by: WorkerName::new("a node", process, 1 << 63),
        results: (0..3).map(result).collect(),
    };
    let point = evaluation(job, number).point;
    PartRecord { job: JobId(job), point, pieces: vec![piece(0, 7), piece(40, 8)] }
}

fn store() -> (tempfile::TempDir, SqliteStore) {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    for id in [1, 2] {
        store.put_job(&job(id)).unwrap();
        for number in [0, 1] {
            store.put_part(&part(id, number)).unwrap();
        }
    }
    (directory, store)
}

/// Observables are stored with their outcomes, and a blob without them has no byte of them.
#[test]
fn observables_are_kept() {
    let (directory, mut store) = store();
    let mut with = part(1, 2);
    with.pieces[0].results[0].observables[Observable::Decay] = 4.625;
    with.pieces[0].results[2].observables[Observable::Decay] = -0.5;
    store.put_part(&with).unwrap();
    let mut record = evaluation(1, 0);
    record.outcomes = record
        .outcomes
        .with_observables(PerObservable::only(Observable::Decay, vec![4.6, 0.0, -0.5]));
    store.put_evaluation(&record, true).unwrap();
    store.settle();
    drop(store);
    store = SqliteStore::open(directory.path()).unwrap();
    assert_eq!(store.parts(JobId(1)).unwrap(), [part(1, 1), with]);
    assert_eq!(store.evaluation(JobId(1), 0).unwrap(), Some(record.clone()));
    let lengths = |sql: &str| -> Vec<usize> {
        let mut read = store.connection.prepare(sql).unwrap();
        let rows = read.query_map([], |row| row.get(0)).unwrap();
        rows.map(Result::unwrap).collect()
    };
    assert_eq!(lengths("SELECT length(outcomes) FROM evaluation"), [2 + 3 * 17]);
    // The parts of the evaluation that is stored are gone.
    let parts = lengths("SELECT length(results) FROM part WHERE job = 1 ORDER BY number");
    assert_eq!(parts, [51, 51, 2 + 3 * 25, 51]);
    // The outcome without a velocity has a decay.
    record.outcomes = record
        .outcomes
        .with_observables(PerObservable::only(Observable::Decay, vec![4.6, 1.0, -0.5]));
    store.put_evaluation(&record, true).unwrap();
    let damaged = store.evaluation(JobId(1), 0).unwrap_err();
    assert!(matches!(damaged, StoreError::Damaged { .. }), "{damaged}");
}

#[test]
fn parts_last_until_their_evaluation_is_stored() {
    let (directory, mut store) = store();
    drop(store);
    store = SqliteStore::open(directory.path()).unwrap();
    assert_eq!(store.parts(JobId(1)).unwrap(), [part(1, 0), part(1, 1)]);
    store.put_evaluation(&evaluation(1, 1), true).unwrap();
    assert_eq!(store.parts(JobId(1)).unwrap(), [part(1, 0)]);
    store.finish_job(&end(1), &summary(1)).unwrap();
    assert_eq!(store.parts(JobId(1)).unwrap(), []);
    assert_eq!(store.parts(JobId(2)).unwrap(), [part(2, 0), part(2, 1)]);
    store.reset_job(JobId(2), "osteon 1.2.4 numerics 5").unwrap();
    assert_eq!(store.parts(JobId(2)).unwrap(), []);
    store.put_part(&part(2, 0)).unwrap();
    store.delete_jobs(&[JobId(2)]).unwrap();
    assert_eq!(store.parts(JobId(2)).unwrap(), []);
}

#[test]
fn what_is_damaged_or_of_other_numerics_is_left_out() {
    for sql in [
        "UPDATE part SET point = zeroblob(56) WHERE number = 1",
        "UPDATE part SET worker = '9/0 b' WHERE number = 1",
        "UPDATE part SET first = 1 WHERE number = 1",
        "UPDATE part SET results = zeroblob(51) WHERE number = 1",
        "UPDATE part SET fingerprint = 'osteon 0.0.0 numerics 0' WHERE number = 1",
        "UPDATE part SET checksum = x'' WHERE number = 1",
    ] {
        let (_directory, mut store) = store();
        assert_eq!(store.connection.execute(sql, []).unwrap(), 1, "{sql}");
        let mut first = part(1, 0);
        first.pieces.remove(0);
        assert_eq!(store.parts(JobId(1)).unwrap(), [first, part(1, 1)], "{sql}");
    }
}

#[test]
fn stale_parts_are_deleted_when_there_is_time() {
    let (directory, mut store) = store();
    let rows = |store: &SqliteStore| -> Vec<u64> {
        let mut select = store.connection.prepare("SELECT job FROM part ORDER BY job").unwrap();
        select.query_map([], |row| row.get(0)).unwrap().map(Result::unwrap).collect()
    };
    let all = rows(&store);
    let (of_one, of_two) = all.split_at(all.iter().filter(|job| **job == 1).count());
    assert!(!store.settle() && rows(&store) == all, "what is needed stays");

    store.put_evaluation(&evaluation(1, 1), true).unwrap();
    assert_eq!(rows(&store), all, "the record does not wait");
    assert!(!store.settle());
    assert!(rows(&store).len() < all.len());
    store.finish_job(&end(1), &summary(1)).unwrap();
    store.settle();
    assert_eq!(rows(&store), of_two);

    // Nobody may have had time for it.
    store.finish_job(&end(2), &summary(1)).unwrap();
    assert!(!of_one.is_empty() && rows(&store) == of_two);
    drop(store);
    let store = SqliteStore::open(directory.path()).unwrap();
    assert!(rows(&store).is_empty());
}
