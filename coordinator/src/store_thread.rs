//! The one thread that touches the store. Records are written in the order they come, each is
//! reported as an event; what ended jobs left is read for those who fetch it.

use std::thread::{self, JoinHandle};

use osteon_common::limits::JOBS_MAX;
use tokio::sync::{mpsc, oneshot};

use crate::effect::Record;
use crate::event::Event;
use crate::failing::Guard;
use crate::ids::{JobId, Token};
use crate::leftover::{self, Leftover, ReadError};
use crate::store::{EndRecord, ExpulsionRecord, Store, StoreError};

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
    /// Read what an ended job left.
    Fetch { end: EndRecord, reply: oneshot::Sender<Result<Leftover, ReadError>> },
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
        while let Some(command) = commands.blocking_recv() {
            match command {
                Command::Put(record) => {
                    // Nobody listens any more when the coordinator has stopped.
                    let _ = events.blocking_send(put(store.as_mut(), &record));
                }
                Command::Read { job, number } => {
                    let found = store.evaluation(job, number).map_err(|error| error.to_string());
                    let _ = events.blocking_send(Event::Read { job, number, found });
                }
                Command::Prune { token, jobs } => {
                    let outcome = store.forget_jobs(&jobs).map_err(|error| error.to_string());
                    let _ = events.blocking_send(Event::Pruned { token, jobs, outcome });
                }
                Command::Fetch { end, reply } => {
                    // The reader may have gone.
                    let _ = reply.send(leftover::read(store.as_mut(), &end));
                }
            }
        }
    };
    let thread = thread::Builder::new().name("store".to_owned()).spawn(serve)?;
    Ok((sender, thread))
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
