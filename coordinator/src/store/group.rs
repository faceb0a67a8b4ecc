//! Records that are written together: many small ones share one sync. Each is reported with its own
//! outcome, in the order of arrival, and not before it is durable.

use osteon_common::job::{Data, VelocitySet};

use crate::core::effect::Record;
use crate::core::event::Event;
use crate::core::ids::JobId;
use crate::store::{DoubtRecord, Store, StoreError};

/// Maximum number of records in a group.
pub(crate) const GROUP_RECORDS_MAX: usize = 256;
/// Maximum size of a group of several records, bytes: a large record is written alone, so that small
/// ones do not wait for it.
const GROUP_BYTES_MAX: usize = 4 << 20;
/// Size up to which a group is small, bytes.
const SMALL_BYTES_MAX: usize = 64 << 10;
/// Approximate size of a saved result in the file, with observables, bytes.
const RESULT_BYTES: usize = 32;
/// Approximate size of a record without its lists, bytes.
const RECORD_BYTES: usize = 1 << 10;

/// Records in the order of arrival; at least one.
pub(crate) struct Group {
    records: Vec<Record>,
    bytes: usize,
}

impl Group {
    pub(crate) fn new(first: Record) -> Self {
        Self { bytes: bytes(&first), records: vec![first] }
    }

    /// Adds a record; returns it if there is no room for it.
    pub(crate) fn add(&mut self, record: Record) -> Option<Record> {
        let more = bytes(&record);
        if self.is_full() || self.bytes + more > GROUP_BYTES_MAX {
            return Some(record);
        }
        self.bytes += more;
        self.records.push(record);
        None
    }

    pub(crate) fn is_full(&self) -> bool {
        self.records.len() >= GROUP_RECORDS_MAX || self.bytes >= GROUP_BYTES_MAX
    }

    /// Returns whether nobody has waited long for it.
    pub(crate) fn is_small(&self) -> bool {
        self.bytes <= SMALL_BYTES_MAX
    }

    /// Makes the records durable, and reports each of them.
    pub(crate) fn write(&self, store: &mut dyn Store, report: &mut dyn FnMut(Event)) {
        write(store, &self.records, report);
    }
}

/// Writes records together or, if that fails, each half by itself: in the end a record that cannot be
/// written is alone, and fails alone.
fn write(store: &mut dyn Store, records: &[Record], report: &mut dyn FnMut(Event)) {
    if let [record] = records {
        let stored = put(store, record);
        if stored.is_ok() {
            report_doubts(store, record, report);
        }
        report(outcome(record, stored));
        return;
    }
    match store.together(&mut |store| records.iter().try_for_each(|record| put(store, record))) {
        Ok(()) => {
            for record in records {
                report_doubts(store, record, report);
                report(outcome(record, Ok(())));
            }
        }
        Err(error) => {
            tracing::debug!(records = records.len(), %error, "records are written in two halves");
            let (first, second) = records.split_at(records.len() / 2);
            write(store, first, report);
            write(store, second, report);
        }
    }
}

/// Reports the ended jobs that have become doubtful by a ban, if there are any.
fn report_doubts(store: &mut dyn Store, record: &Record, report: &mut dyn FnMut(Event)) {
    let Record::Ban(ban) = record else {
        return;
    };
    match store.doubts() {
        Ok(doubts) => {
            let of_ban = |doubt: &DoubtRecord| doubt.ban == ban.number;
            let jobs: Vec<JobId> =
                doubts.into_iter().filter(of_ban).map(|doubt| doubt.job).collect();
            if !jobs.is_empty() {
                report(Event::Doubted { ban: ban.number, jobs });
            }
        }
        Err(error) => tracing::error!(ban = ban.number, %error,
            "the ended jobs that the banned host contributed to cannot be read; they are named after a \
             restart"),
    }
}

fn outcome(record: &Record, put: Result<(), StoreError>) -> Event {
    let (job, key) = record.key();
    match put {
        Ok(()) => Event::Stored { job, key },
        Err(error) => {
            tracing::warn!(%job, %error, "a record could not be stored");
            Event::StoreFailed { job, key, error: error.to_string() }
        }
    }
}

fn put(store: &mut dyn Store, record: &Record) -> Result<(), StoreError> {
    match record {
        Record::Job(record) => store.put_job(record),
        Record::Evaluation { record, deletes_later } => {
            store.put_evaluation(record, *deletes_later)
        }
        Record::Evaluations(records) => store.put_evaluations(records),
        Record::Part(record) => store.put_part(record),
        Record::Piece { record, .. } => store.put_piece(record),
        Record::End { end, summary } => store.finish_job(end, summary),
        Record::Ban(record) => store.put_ban(record),
    }
}

/// Returns the approximate size of a record, bytes.
fn bytes(record: &Record) -> usize {
    let of_set =
        |set: VelocitySet<'_>| size_of_val(set.velocities) + set.subjects.map_or(0, size_of_val);
    let of_data = |data: &Data| -> usize {
        (0..data.sets()).filter_map(|set| data.set(set)).map(of_set).sum()
    };
    RECORD_BYTES
        + match record {
            Record::Job(record) => record.specification.data.as_ref().map_or(0, of_data),
            Record::Evaluation { record, .. } => size_of_val(&*record.outcomes),
            Record::Evaluations(records) => {
                records.iter().map(|it| RECORD_BYTES + size_of_val(&*it.outcomes)).sum()
            }
            Record::Part(record) => record
                .pieces
                .iter()
                .map(|piece| RECORD_BYTES + RESULT_BYTES * piece.results.len())
                .sum(),
            Record::Piece { record, .. } => size_of_val(&*record.outcomes),
            Record::End { summary, .. } => {
                size_of_val(&*summary.history) + size_of_val(&*summary.groups)
            }
            Record::Ban(_) => 0,
        }
}
