//! Groups: records that wait together share a transaction, and each still has its own outcome.

use tokio::sync::{mpsc, oneshot};

use super::*;
use crate::core::effect::{Record, RecordKey};
use crate::core::event::Event;
use crate::metrics::write_times::WriteTimes;
use crate::store::group::{GROUP_RECORDS_MAX, Group};
use crate::store::job_output::ReadRequest;
use crate::store::thread::{StoreCommand, serve};

/// Records of every kind that lasts by itself, none of which needs another of them; jobs 1 and 2 are stored before.
fn records() -> Vec<Record> {
    let evaluation = |job, number| {
        let record = evaluation(job, number);
        Record::Evaluation { record, deletes_later: number > 0 }
    };
    vec![
        evaluation(1, 0),
        Record::Job(job(3)),
        Record::End { end: end(2), summary: Arc::new(summary(2)) },
        Record::Ban(ban(1)),
        evaluation(1, 1),
        Record::Job(job(4)),
        Record::Job(job(5)),
        Record::Evaluations(vec![super::evaluation(1, 2), super::evaluation(1, 3)]),
        Record::Part(parts::part(1, 4)),
    ]
}

fn prepared(directory: &Path, journal: Journal) -> SqliteStore {
    let mut store = SqliteStore::open(directory).unwrap();
    store.put_job(&job(1)).unwrap();
    store.put_job(&job(2)).unwrap();
    match journal {
        Journal::WriteAhead => store,
        Journal::Rollback => {
            drop(store);
            with_rollback_journal(directory)
        }
    }
}

fn group(records: &[Record]) -> Group {
    let mut records = records.iter().cloned();
    let mut group = Group::new(records.next().unwrap());
    for record in records {
        assert_eq!(group.add(record), None, "no room in the group");
    }
    group
}

fn has(store: &mut SqliteStore, record: &Record) -> bool {
    match record {
        Record::Job(record) => store.job(record.job).unwrap().as_ref() == Some(record),
        Record::Evaluation { record, .. } => {
            store.evaluation(record.job, record.number).unwrap().as_ref() == Some(record)
        }
        Record::Evaluations(records) => records.iter().all(|record| {
            store.evaluation(record.job, record.number).unwrap().as_ref() == Some(record)
        }),
        Record::Part(record) => store.parts(record.job).unwrap().contains(record),
        Record::Piece { record, .. } => pieces::has(store, record),
        Record::End { end, summary } => {
            store.end(end.job).unwrap().as_ref() == Some(end)
                && store.summary(end.job).unwrap().as_ref() == Some(summary)
        }
        Record::Ban(record) => store.bans().unwrap().contains(record),
    }
}

/// Opens a copy of the files as they are now: what is left of a process that is killed.
fn killed(directory: &Path) -> (tempfile::TempDir, SqliteStore) {
    let copy = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(directory).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), copy.path().join(entry.file_name())).unwrap();
    }
    let store = SqliteStore::open(copy.path()).unwrap();
    (copy, store)
}

/// Why a record cannot be written.
#[derive(Debug, Clone, Copy)]
enum Fault {
    /// The database refuses it; SQLite then undoes the statement or the whole transaction.
    Refused(&'static str),
    /// It is large, and the disk is almost full.
    Full,
}

impl Fault {
    /// Lets `record` fail.
    fn befall(self, store: &SqliteStore, record: &mut Record) {
        match self {
            Self::Refused(how) => {
                let (table, condition) = match record {
                    Record::Job(job) => ("job", format!("NEW.id = {}", job.job)),
                    Record::Evaluation { record, .. } => {
                        ("evaluation", format!("NEW.number = {}", record.number))
                    }
                    Record::Evaluations(records) => {
                        ("evaluation", format!("NEW.number = {}", records[0].number))
                    }
                    Record::Part(_) => ("part", "true".to_owned()),
                    Record::Piece { .. } => ("piece", "true".to_owned()),
                    Record::End { .. } => ("summary", "true".to_owned()),
                    Record::Ban(_) => ("ban", "true".to_owned()),
                };
                let sql = format!(
                    "CREATE TRIGGER refuse BEFORE INSERT ON {table} WHEN {condition}
                     BEGIN SELECT RAISE({how}, 'refused'); END"
                );
                store.connection.execute_batch(&sql).unwrap();
            }
            Self::Full => {
                let large = "x".repeat(1_000_000);
                match record {
                    Record::Job(job) => job.name = large,
                    Record::Evaluation { record, .. } => {
                        record.outcomes = vec![Ok(3900.0); 100_000].into();
                    }
                    Record::Evaluations(records) => {
                        records[0].outcomes = vec![Ok(3900.0); 100_000].into();
                    }
                    Record::Part(part) => {
                        let piece = &mut part.pieces[0];
                        piece.results = vec![piece.results[0]; 100_000];
                    }
                    Record::Piece { record, .. } => {
                        record.outcomes = vec![Ok(3900.0); 100_000].into();
                    }
                    Record::End { end, .. } => end.ending.reason = Some(large),
                    Record::Ban(ban) => ban.reason = large,
                }
                let pages: i64 =
                    store.connection.pragma_query_value(None, "page_count", |r| r.get(0)).unwrap();
                store.connection.pragma_update(None, "max_page_count", pages + 30).unwrap();
            }
        }
    }
}

fn check_fault(journal: Journal, fault: Fault, failing: usize) {
    let place = format!("{journal:?} {fault:?} {failing}");
    let directory = tempfile::tempdir().unwrap();
    let mut store = prepared(directory.path(), journal);
    let mut records = records();
    fault.befall(&store, &mut records[failing]);
    let mut told: Vec<(JobId, RecordKey, bool)> = Vec::new();
    let (mut looked, mut reported) = (0, 0);
    group(&records).write(&mut store, &mut |event| {
        told.push(match event {
            Event::Stored { job, key } => (job, key, true),
            Event::StoreFailed { job, key, .. } => (job, key, false),
            other => panic!("{place}: {other:?}"),
        });
        reported += 1;
        // A process that is killed now has lost nothing that it reported. Opening a store takes
        // several syncs, so not every moment is examined for every fault.
        if failing == 1 || reported == failing + 1 {
            let (_copy, mut left) = killed(directory.path());
            for (record, (.., stored)) in records.iter().zip(&told) {
                looked += u32::from(*stored);
                assert_eq!(has(&mut left, record), *stored, "{place}: {record:?}");
            }
        }
    });
    let expected = records.iter().enumerate().map(|(number, record)| {
        let (job, key) = record.key();
        (job, key, number != failing)
    });
    assert_eq!(told, expected.collect::<Vec<_>>(), "{place}");
    assert!(looked > 0 || failing == 0, "{place}");
    drop(store);
    let accepted = if failing == 6 { 4 } else { 5 };
    let mark = Mark::find(directory.path()).unwrap();
    assert!(matches!(mark, MarkFile::Job { last, .. } if last == accepted), "{place}: {mark:?}");
    let mut store = SqliteStore::open(directory.path()).unwrap();
    for (number, record) in records.iter().enumerate() {
        assert_eq!(has(&mut store, record), number != failing, "{place}: {record:?}");
    }
}

#[test]
fn a_record_that_cannot_be_written_fails_alone() {
    for journal in [Journal::WriteAhead, Journal::Rollback] {
        for fault in [Fault::Refused("ABORT"), Fault::Refused("ROLLBACK"), Fault::Full] {
            for failing in 0..records().len() {
                check_fault(journal, fault, failing);
            }
        }
    }
}

#[test]
fn where_the_mark_fails_jobs_are_refused_and_all_else_is_stored() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = prepared(directory.path(), Journal::WriteAhead);
    let mark = store.mark.replace(Mark::unwritable(directory.path(), 2));
    let mut told = Vec::new();
    group(&records()).write(&mut store, &mut |event| {
        told.push(matches!(event, Event::Stored { .. }));
    });
    let stored = |record: &Record| !matches!(record, Record::Job(_));
    assert_eq!(told, records().iter().map(stored).collect::<Vec<_>>());
    // The mark of a job whose sync failed may be on the disk all the same.
    store.mark.replace(mark);
    store.mark.borrow_mut().acknowledge(JobId(5)).unwrap();
    drop(store);
    let mut store = SqliteStore::open(directory.path()).unwrap();
    for record in records() {
        assert_eq!(has(&mut store, &record), stored(&record), "{record:?}");
    }
    assert_eq!(store.last_deleted_job().unwrap(), Some(JobId(5)));
}

/// Returns the number of transactions in the write-ahead log: the header of the last page of each
/// holds the size of the database.
fn transactions(directory: &Path) -> usize {
    let log = fs::read(directory.join("osteon.sqlite-wal")).unwrap();
    let number = |at: usize| u32::from_be_bytes(log[at..at + 4].try_into().unwrap());
    let (page, salt) = (number(8) as usize, log[16..24].to_vec());
    let frames = (32..log.len()).step_by(24 + page);
    frames.filter(|at| log[at + 8..at + 16] == salt && number(at + 4) > 0).count()
}

/// Writes commands that all wait already; checks the number of transactions, that each record is
/// reported in the order of arrival, and how often the mark is written.
fn check_commands(commands: Vec<StoreCommand>, expected: usize, marks: u64) {
    let directory = tempfile::tempdir().unwrap();
    let mut store = prepared(directory.path(), Journal::WriteAhead);
    let MarkFile::Job { slot, .. } = Mark::find(directory.path()).unwrap() else { panic!("none") };
    let before = transactions(directory.path());
    let (sender, mut waiting) = mpsc::channel(commands.len());
    let (events, mut reports) = mpsc::channel(commands.len());
    let mut order = Vec::new();
    for command in commands {
        order.extend(match &command {
            StoreCommand::Put(record) => Some(record.key()),
            StoreCommand::Read { job, number } => Some((*job, RecordKey::Evaluation(*number))),
            StoreCommand::Prune { jobs, .. } => Some((jobs[0], RecordKey::End)),
            StoreCommand::Reopen { job, .. } => Some((*job, RecordKey::Job)),
            StoreCommand::Fetch(_) | StoreCommand::Copy { .. } => None,
        });
        assert!(sender.try_send(command).is_ok());
    }
    drop(sender);
    serve(&mut store, &mut waiting, &events, &WriteTimes::default());
    let mut told = Vec::new();
    while let Ok(event) = reports.try_recv() {
        told.push(match event {
            Event::Stored { job, key } => (job, key),
            Event::Read { job, number, found: Ok(Some(_)) } => (job, RecordKey::Evaluation(number)),
            Event::Pruned { jobs, outcome: Ok(()), .. } => (jobs[0], RecordKey::End),
            other => panic!("{other:?}"),
        });
    }
    assert_eq!(told, order);
    assert_eq!(transactions(directory.path()) - before, expected);
    let mark = Mark::find(directory.path()).unwrap();
    assert!(
        matches!(mark, MarkFile::Job { slot: last, .. } if last == (slot + marks) % 2),
        "{mark:?}"
    );
}

#[test]
fn records_that_wait_are_written_together_in_the_order_of_arrival() {
    let put = |ids: std::ops::Range<u64>| ids.map(|id| StoreCommand::Put(Record::Job(job(id))));
    let evaluation = |number, realizations| {
        let outcomes = vec![Ok(3900.0); realizations].into();
        let record = EvaluationRecord { outcomes, ..evaluation(1, number) };
        StoreCommand::Put(Record::Evaluation { record, deletes_later: false })
    };
    let full = GROUP_RECORDS_MAX as u64;
    check_commands(put(3..4).collect(), 1, 1);
    check_commands(put(3..20).collect(), 1, 1);
    check_commands(put(3..3 + full).collect(), 1, 1);
    check_commands(put(3..3 + 2 * full + 1).collect(), 3, 3);
    // A large record goes alone.
    check_commands(vec![evaluation(0, 3), evaluation(1, 300_000), evaluation(2, 3)], 3, 0);
    // What reads or deletes waits for what came before it, and comes before what follows.
    let mut commands = vec![evaluation(0, 3), evaluation(1, 3)];
    commands.push(StoreCommand::Read { job: JobId(1), number: 1 });
    commands.extend(put(3..6));
    commands.push(StoreCommand::Read { job: JobId(1), number: 0 });
    commands.extend([evaluation(2, 3), evaluation(3, 3)]);
    check_commands(commands, 3, 1);
    // A fetch lets the records go first that arrive after it.
    let (reply, mut fetched) = oneshot::channel();
    let mut commands: Vec<_> = put(3..6).collect();
    commands.push(StoreCommand::Fetch(ReadRequest::Job(JobId(8), reply)));
    commands.extend(put(6..9));
    check_commands(commands, 1, 1);
    assert_eq!(fetched.try_recv().unwrap().unwrap(), job(8));
}

#[test]
fn what_is_deleted_between_two_groups_is_gone_after_both() {
    let put = |id| StoreCommand::Put(Record::Job(job(id)));
    let prune = StoreCommand::Prune { reply_id: None, jobs: vec![JobId(3)] };
    let directory = tempfile::tempdir().unwrap();
    let mut store = prepared(directory.path(), Journal::WriteAhead);
    let (sender, mut waiting) = mpsc::channel(8);
    let (events, mut reports) = mpsc::channel(8);
    for command in [put(3), put(4), prune, put(5), put(6)] {
        assert!(sender.try_send(command).is_ok());
    }
    drop(sender);
    serve(&mut store, &mut waiting, &events, &WriteTimes::default());
    let stored = |id| Event::Stored { job: JobId(id), key: RecordKey::Job };
    let pruned = Event::Pruned { reply_id: None, jobs: vec![JobId(3)], outcome: Ok(()) };
    for expected in [stored(3), stored(4), pruned, stored(5), stored(6)] {
        assert_eq!(reports.try_recv().unwrap(), expected);
    }
    let ids: Vec<u64> = store.jobs().unwrap().iter().map(|job| job.record.job.0).collect();
    assert_eq!(ids, [1, 2, 4, 5, 6]);
}
