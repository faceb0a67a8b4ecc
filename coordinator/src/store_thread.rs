//! The one thread that touches the store. Records are written in the order they come, each is
//! reported as an event; what ended jobs left is read for those who fetch it.

use std::collections::VecDeque;
use std::thread::{self, JoinHandle};

use osteon_common::limits::JOBS_MAX;
use tokio::sync::mpsc;

use crate::effect::Record;
use crate::event::{Event, Unread};
use crate::failing::Guard;
use crate::ids::{JobId, Token};
use crate::leftover::Reading;
use crate::store::{ExpulsionRecord, Store, StoreError};

/// Commands that may wait: a record for every job, and some readers.
const COMMANDS_MAX: usize = JOBS_MAX + 64;

/// Something to do with the store.
pub(crate) enum Command {
    /// Make a record durable.
    Put(Record),
    /// Read an evaluation of a job.
    Read { job: JobId, number: u64 },
    /// Forget ended jobs.
    Prune { token: Option<Token>, jobs: Vec<JobId> },
    /// Read a record of what an ended job left.
    Fetch(Reading),
}

/// Starts the thread. It ends when every sender of commands is gone.
pub(crate) fn start(
    mut store: Box<dyn Store>,
    events: mpsc::Sender<Event>,
    guard: Guard,
) -> std::io::Result<(mpsc::Sender<Command>, JoinHandle<()>)> {
    let (sender, mut commands) = mpsc::channel(COMMANDS_MAX);
    let serve = move || {
        let _guard = guard;
        serve(store.as_mut(), &mut commands, &events);
    };
    let thread = thread::Builder::new().name("store".to_owned()).spawn(serve)?;
    Ok((sender, thread))
}

/// Does what is asked for until every sender of commands is gone. Between two other commands one record
/// that is fetched is read: no record of a job under way waits for longer than it takes to read one.
pub(crate) fn serve(
    store: &mut dyn Store,
    commands: &mut mpsc::Receiver<Command>,
    events: &mpsc::Sender<Event>,
) {
    // As many as there are fetches at once.
    let mut readings = VecDeque::new();
    loop {
        let command = if readings.is_empty() {
            match commands.blocking_recv() {
                Some(command) => Some(command),
                None => return,
            }
        } else {
            commands.try_recv().ok()
        };
        match command {
            // Nobody listens any more when the coordinator has stopped.
            Some(Command::Put(record)) => drop(events.blocking_send(put(store, &record))),
            Some(Command::Read { job, number }) => {
                let found = store.evaluation(job, number).map_err(|error| unread(job, error));
                drop(events.blocking_send(Event::Read { job, number, found }));
            }
            Some(Command::Prune { token, jobs }) => {
                let outcome = store.forget_jobs(&jobs).map_err(|error| error.to_string());
                drop(events.blocking_send(Event::Pruned { token, jobs, outcome }));
            }
            Some(Command::Fetch(reading)) => {
                readings.push_back(reading);
                continue;
            }
            None => {}
        }
        if let Some(reading) = readings.pop_front() {
            reading.serve(store);
        }
    }
}

/// Why an evaluation was not read: what is damaged is not read another time either.
fn unread(job: JobId, error: StoreError) -> Unread {
    match error {
        StoreError::Damaged { .. } | StoreError::Corrupt { .. } => {
            tracing::error!(%job, %error, "a stored evaluation is damaged; it is computed again");
            Unread::Damaged
        }
        _ => {
            tracing::warn!(%job, %error, "a stored evaluation cannot be read; it is tried again");
            Unread::Refused { error: error.to_string() }
        }
    }
}

fn put(store: &mut dyn Store, record: &Record) -> Event {
    let (job, key) = record.key();
    let done = match record {
        Record::Job(record) => store.put_job(record),
        Record::Evaluation { record, is_last } => store.put_evaluation(record, *is_last),
        Record::End { end, summary } => store.finish_job(end, summary),
        Record::Expulsion(record) => expel(store, record),
    };
    match done {
        Ok(()) => Event::Stored { job, key },
        Err(error) => {
            tracing::warn!(%job, %error, "a record could not be stored");
            Event::StoreFailed { job, key, error: error.to_string() }
        }
    }
}

/// Stores an expulsion, and says whose results can no longer be relied on.
fn expel(store: &mut dyn Store, record: &ExpulsionRecord) -> Result<(), StoreError> {
    store.put_expulsion(record)?;
    // The log is a service: what it fails to say does not undo what is stored.
    let ended = store.ended_with(&record.worker).unwrap_or_default();
    if !ended.is_empty() {
        let jobs: Vec<String> = ended.iter().map(JobId::to_string).collect();
        tracing::error!(worker = %record.worker, jobs = jobs.join(" "),
            "these jobs ended before the worker was found to compute wrongly; run them again");
    }
    Ok(())
}
