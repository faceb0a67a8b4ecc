//! Large evaluations, whose outcomes are in several rows.

use super::super::columns::pack_outcomes;
use super::*;
use crate::store::{PIECE_OUTCOMES, PieceRecord};

/// An evaluation with so many outcomes, of which some are failures.
fn large(number: u64, count: usize) -> EvaluationRecord {
    let outcome = |index: usize| match index % 1000 {
        7 => Err(FailureKind::NoArrival),
        _ => Ok(3000.0 + index as f64 / 64.0),
    };
    EvaluationRecord { outcomes: (0..count).map(outcome).collect(), ..evaluation(1, number) }
}

/// A piece of evaluation `number` of job 1, as in [`large`].
fn piece(number: u64, first: usize) -> PieceRecord {
    let all = large(number, first + PIECE_OUTCOMES).outcomes;
    let outcomes = all[first..].to_vec().into();
    PieceRecord { job: JobId(1), number, first: first as u64, outcomes }
}

/// Returns whether the store has a piece, as it is.
pub(super) fn has(store: &SqliteStore, record: &PieceRecord) -> bool {
    let sql = "SELECT outcomes FROM piece WHERE job = ?1 AND evaluation = ?2 AND first = ?3";
    let of = params![record.job.0, record.number, record.first];
    let found: Option<Vec<u8>> =
        store.connection.query_row(sql, of, |row| row.get(0)).optional().unwrap();
    found.is_some_and(|found| found == pack_outcomes(&record.outcomes, PerObservable::default()))
}

fn store() -> (tempfile::TempDir, SqliteStore) {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    store.put_job(&job(1)).unwrap();
    (directory, store)
}

fn rows(store: &SqliteStore, sql: &str) -> Vec<i64> {
    let mut read = store.connection.prepare(sql).unwrap();
    let rows = read.query_map([], |row| row.get(0)).unwrap();
    rows.map(Result::unwrap).collect()
}

#[test]
fn a_large_evaluation_is_read_as_it_was_written() {
    let (directory, mut store) = store();
    let decays = |record: &EvaluationRecord| -> Vec<f64> {
        record.outcomes.iter().map(|outcome| outcome.map_or(0.0, |v| v / 1000.0)).collect()
    };
    let counts = [1, PIECE_OUTCOMES, PIECE_OUTCOMES + 1, 2 * PIECE_OUTCOMES, 200_000];
    let mut records: Vec<EvaluationRecord> =
        (0..).zip(counts).map(|(number, count)| large(number, count)).collect();
    let mut with_decays = large(5, 150_000);
    let of_it = decays(&with_decays);
    with_decays.outcomes =
        with_decays.outcomes.with_observables(PerObservable::only(Observable::Decay, of_it));
    records.push(with_decays);
    for record in &records {
        store.put_evaluation(record, true).unwrap();
    }
    drop(store);
    let mut store = SqliteStore::open(directory.path()).unwrap();
    for record in &records {
        let read = store.evaluation(JobId(1), record.number).unwrap().unwrap();
        assert!(read == *record, "evaluation {} was read otherwise", record.number);
    }
    let sql = "SELECT count(first) FROM evaluation LEFT JOIN piece ON piece.job = evaluation.job
               AND piece.evaluation = evaluation.number GROUP BY number ORDER BY number";
    assert_eq!(rows(&store, sql), [0, 0, 1, 1, 3, 2]);
}

#[test]
fn pieces_go_with_their_evaluation() {
    let (_directory, mut store) = store();
    let pieces = |store: &SqliteStore| rows(store, "SELECT evaluation FROM piece ORDER BY 1");
    let put = |store: &mut SqliteStore, number, count, deletes_later| {
        store.put_evaluation(&large(number, count), deletes_later).unwrap();
    };
    for number in 0..4 {
        put(&mut store, number, PIECE_OUTCOMES + 1, true);
    }
    assert_eq!(pieces(&store), [0, 1, 2, 3]);
    put(&mut store, 1, 3 * PIECE_OUTCOMES, false);
    assert_eq!(pieces(&store), [0, 1, 1, 2, 3]);
    put(&mut store, 1, 3, false);
    assert_eq!(pieces(&store), [0, 2, 3]);
    put(&mut store, 1, PIECE_OUTCOMES + 1, true);
    assert_eq!(pieces(&store), [0, 1]);
    store.reset_job(JobId(1), "osteon 1.2.4 numerics 5").unwrap();
    assert_eq!(pieces(&store), [] as [i64; 0]);
    put(&mut store, 0, PIECE_OUTCOMES + 1, true);
    store.finish_job(&end(1), &summary(1)).unwrap();
    store.delete_jobs(&[JobId(1)]).unwrap();
    assert_eq!(pieces(&store), [] as [i64; 0]);
}

#[test]
fn pieces_that_are_stored_before_are_used_if_they_are_the_same() {
    let (_directory, mut store) = store();
    let whole = large(0, 3 * PIECE_OUTCOMES + 5);
    let same = piece(0, PIECE_OUTCOMES);
    let other =
        PieceRecord { outcomes: piece(0, PIECE_OUTCOMES).outcomes, ..piece(0, 2 * PIECE_OUTCOMES) };
    for record in [&same, &other, &same] {
        store.put_piece(record).unwrap();
        assert!(has(&store, record));
    }
    let jobs = store.jobs().unwrap();
    assert_eq!((jobs[0].evaluations, store.evaluation(JobId(1), 0).unwrap()), (0, None));
    let row = |store: &SqliteStore, first: usize| {
        let sql = format!("SELECT rowid FROM piece WHERE evaluation = 0 AND first = {first}");
        rows(store, &sql)[0]
    };
    let before = row(&store, PIECE_OUTCOMES);
    store.put_evaluation(&whole, true).unwrap();
    assert_eq!(row(&store, PIECE_OUTCOMES), before, "it was written again");
    assert!(store.evaluation(JobId(1), 0).unwrap().as_ref() == Some(&whole));
    // What may be damaged is written again, though its checksum is that of the new record.
    let sql = "UPDATE piece SET outcomes = zeroblob(9) WHERE first = 65536";
    store.connection.execute(sql, []).unwrap();
    store.evaluation(JobId(1), 0).unwrap_err();
    store.put_evaluation(&whole, true).unwrap();
    assert!(store.evaluation(JobId(1), 0).unwrap() == Some(whole));
}

/// A process that is killed before an evaluation is complete leaves pieces, and so does the end of a job.
#[test]
fn pieces_without_an_evaluation_do_not_stay() {
    for ends in [true, false] {
        let (directory, mut store) = store();
        store.put_evaluation(&large(0, 2 * PIECE_OUTCOMES), true).unwrap();
        let loose: Vec<PieceRecord> = (1..20).map(|k| piece(1, k * PIECE_OUTCOMES)).collect();
        for loose in &loose {
            store.put_piece(loose).unwrap();
            assert!(has(&store, loose));
        }
        if ends {
            store.settle();
            assert!(has(&store, &loose[0]), "it is deleted while its job goes on");
            store.finish_job(&end(1), &summary(1)).unwrap();
            // A few at a time.
            assert!(store.settle());
            assert!(has(&store, &loose[18]));
            while store.settle() {}
        } else {
            drop(store);
            store = SqliteStore::open(directory.path()).unwrap();
        }
        assert_eq!(rows(&store, "SELECT evaluation FROM piece"), [0]);
        assert!(store.evaluation(JobId(1), 0).unwrap().is_some());
    }
}

/// Early pieces have the decays of a job that measures them, as its record has.
#[test]
fn pieces_with_decays_agree_with_the_record() {
    let (_directory, mut store) = store();
    let whole = large(0, 3 * PIECE_OUTCOMES);
    let decays: Vec<f64> =
        whole.outcomes.iter().map(|outcome| outcome.map_or(0.0, |v| v / 1000.0)).collect();
    let early = PieceRecord {
        outcomes: piece(0, PIECE_OUTCOMES).outcomes.with_observables(PerObservable::only(
            Observable::Decay,
            decays[PIECE_OUTCOMES..2 * PIECE_OUTCOMES].to_vec(),
        )),
        ..piece(0, PIECE_OUTCOMES)
    };
    store.put_piece(&early).unwrap();
    let row = "SELECT rowid FROM piece WHERE first = 65536";
    let before = rows(&store, row);
    let whole = EvaluationRecord {
        outcomes: whole.outcomes.with_observables(PerObservable::only(Observable::Decay, decays)),
        ..large(0, 1)
    };
    store.put_evaluation(&whole, true).unwrap();
    assert_eq!(rows(&store, row), before, "it was written again");
    assert!(store.evaluation(JobId(1), 0).unwrap() == Some(whole));
}

#[test]
fn a_damaged_piece_is_damage_to_its_evaluation() {
    for sql in [
        "UPDATE piece SET outcomes = zeroblob(9) WHERE first = 65536",
        "UPDATE piece SET checksum = x'' WHERE first = 65536",
        "UPDATE piece SET first = 65537 WHERE first = 65536",
        "UPDATE piece SET first = -1 WHERE first = 65536",
        "DELETE FROM piece WHERE evaluation = 1 AND first = 131072",
        "DELETE FROM piece WHERE evaluation = 1",
        // Whole pieces of another evaluation.
        "UPDATE piece SET (outcomes, checksum) = (SELECT outcomes, checksum FROM piece AS other
         WHERE other.evaluation = 0 AND other.first = piece.first) WHERE evaluation = 1",
        "UPDATE evaluation SET checksum = (SELECT checksum FROM evaluation WHERE number = 0)",
    ] {
        let (_directory, mut store) = store();
        for number in [0, 1] {
            store.put_evaluation(&large(number, 3 * PIECE_OUTCOMES), true).unwrap();
        }
        assert!(store.connection.execute(sql, []).unwrap() > 0, "{sql}");
        let error = store.evaluation(JobId(1), 1).unwrap_err();
        let expected = DamagedRecord::Evaluation(1);
        assert!(
            matches!(&error, StoreError::Damaged { record, .. } if *record == expected),
            "{sql}: {error}"
        );
    }
}

#[test]
fn a_large_evaluation_replaces_another_whole_or_not_at_all() {
    let (_directory, mut store) = store();
    let before = large(0, PIECE_OUTCOMES + 5);
    store.put_evaluation(&before, true).unwrap();
    let pages: i64 = store.connection.pragma_query_value(None, "page_count", |r| r.get(0)).unwrap();
    store.connection.pragma_update(None, "max_page_count", pages + 50).unwrap();
    let larger = large(0, 10 * PIECE_OUTCOMES);
    let error = store.put_evaluation(&larger, true).unwrap_err();
    assert!(matches!(error, StoreError::Full { .. }), "{error}");
    assert!(store.evaluation(JobId(1), 0).unwrap() == Some(before));
    store.connection.pragma_update(None, "max_page_count", 1_000_000).unwrap();
    store.put_evaluation(&larger, true).unwrap();
    assert!(store.evaluation(JobId(1), 0).unwrap() == Some(larger));
}
