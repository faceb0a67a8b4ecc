//! The only thread that uses the store. Records are written in the order of their arrival, and each
//! is reported as an event; the output of ended jobs is read for the clients that fetch it.

use std::collections::VecDeque;
use std::fs::File;
use std::ops::ControlFlow;
use std::thread::{self, JoinHandle};
use std::time::Instant;

use osteon_common::limits::JOBS_MAX;
use tokio::sync::mpsc::error::TryRecvError;
use tokio::sync::{mpsc, oneshot};

use crate::core::effect::Record;
use crate::core::event::{Event, ReadFailure};
use crate::core::ids::{JobId, ReplyId};
use crate::metrics::write_times::WriteTimes;
use crate::service::failing::Guard;
use crate::store::job_output::ReadRequest;
use crate::store::{BanRecord, Store, StoreError};

/// Maximum number of waiting commands: a record for every job, and some reads.
const COMMANDS_MAX: usize = JOBS_MAX + 64;

/// Maximum number of commands that run between two pieces of a copy, so that the copy finishes.
const COMMANDS_BETWEEN: usize = 64;

/// A command for the store.
pub(crate) enum StoreCommand {
    /// Make a record durable.
    Put(Record),
    /// Read an evaluation of a job.
    Read { job: JobId, number: u64 },
    /// Delete ended jobs.
    Prune { reply_id: Option<ReplyId>, jobs: Vec<JobId> },
    /// Read a record of an ended job's output.
    Fetch(ReadRequest),
    /// Copy the whole store.
    Copy { reply: CopyReply },
}

/// Starts the thread. It ends when every sender of commands is gone.
pub(crate) fn start(
    mut store: Box<dyn Store + Send>,
    events: mpsc::Sender<Event>,
    write_times: WriteTimes,
    guard: Guard,
) -> std::io::Result<(mpsc::Sender<StoreCommand>, JoinHandle<()>)> {
    let (sender, mut commands) = mpsc::channel(COMMANDS_MAX);
    let serve = move || {
        let _guard = guard;
        serve(store.as_mut(), &mut commands, &events, &write_times);
    };
    let thread = thread::Builder::new().name("store".to_owned()).spawn(serve)?;
    Ok((sender, thread))
}

/// Runs commands until every sender of commands is gone. Fetches and copies are served one piece at
/// a time, and commands that arrive meanwhile run first: no record of a job under way waits for
/// longer than it takes to read one piece.
pub(crate) fn serve(
    store: &mut dyn Store,
    commands: &mut mpsc::Receiver<StoreCommand>,
    events: &mpsc::Sender<Event>,
    write_times: &WriteTimes,
) {
    let (readings, copies) = (VecDeque::new(), VecDeque::new());
    let mut desk = PendingWork { events, write_times, readings, copies };
    loop {
        let command = if desk.readings.is_empty() && desk.copies.is_empty() {
            match commands.blocking_recv() {
                Some(command) => Some(command),
                None => return,
            }
        } else {
            commands.try_recv().ok()
        };
        let others_first = matches!(command, Some(StoreCommand::Fetch(_)));
        if let Some(command) = command {
            desk.run(store, command);
        }
        if others_first {
            continue;
        }
        desk.read_on(store);
        if let Some(reply) = desk.copies.pop_front() {
            desk.copy(store, commands, reply);
        }
    }
}

/// Channel for the result of a copy; `None` inside if the receiver had gone.
pub(crate) type CopyReply = oneshot::Sender<Result<Option<File>, StoreError>>;

/// Work that is done piece by piece, between commands.
struct PendingWork<'a> {
    events: &'a mpsc::Sender<Event>,
    write_times: &'a WriteTimes,
    /// As many as there are fetches under way.
    readings: VecDeque<ReadRequest>,
    /// One copy, and perhaps another whose reader has gone.
    copies: VecDeque<CopyReply>,
}

impl PendingWork<'_> {
    fn run(&mut self, store: &mut dyn Store, command: StoreCommand) {
        match command {
            StoreCommand::Put(record) => {
                let begun = Instant::now();
                let stored = put(store, &record);
                self.write_times.add(begun.elapsed());
                // The receiver is gone when the coordinator has stopped.
                drop(self.events.blocking_send(stored));
            }
            StoreCommand::Read { job, number } => {
                let found = store.evaluation(job, number).map_err(|error| unread(job, error));
                drop(self.events.blocking_send(Event::Read { job, number, found }));
            }
            StoreCommand::Prune { reply_id, jobs } => {
                let outcome = store.delete_jobs(&jobs).map_err(|error| error.to_string());
                drop(self.events.blocking_send(Event::Pruned { reply_id, jobs, outcome }));
            }
            StoreCommand::Fetch(reading) => self.readings.push_back(reading),
            StoreCommand::Copy { reply } => self.copies.push_back(reply),
        }
    }

    /// Reads one record for a fetch.
    fn read_on(&mut self, store: &mut dyn Store) {
        if let Some(reading) = self.readings.pop_front() {
            reading.serve(store);
        }
    }

    /// Copies the store, and runs waiting commands between two pieces.
    fn copy(
        &mut self,
        store: &mut dyn Store,
        commands: &mut mpsc::Receiver<StoreCommand>,
        reply: CopyReply,
    ) {
        let copied = store.copy(&mut |store: &mut dyn Store| {
            for _ in 0..COMMANDS_BETWEEN {
                match commands.try_recv() {
                    Ok(command) => self.run(store, command),
                    Err(TryRecvError::Empty) => break,
                    // The coordinator is stopping.
                    Err(TryRecvError::Disconnected) => return ControlFlow::Break(()),
                }
            }
            self.read_on(store);
            if reply.is_closed() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        // The reader may have gone.
        drop(reply.send(copied));
    }
}

/// Returns the reason why an evaluation was not read: a damaged one is permanently unreadable.
fn unread(job: JobId, error: StoreError) -> ReadFailure {
    match error {
        StoreError::Damaged { .. } | StoreError::Corrupt { .. } => {
            tracing::error!(%job, %error, "a stored evaluation is damaged; it is computed again");
            ReadFailure::Damaged
        }
        _ => {
            tracing::warn!(%job, %error, "a stored evaluation cannot be read; it is tried again");
            ReadFailure::Refused { error: error.to_string() }
        }
    }
}

fn put(store: &mut dyn Store, record: &Record) -> Event {
    let (job, key) = record.key();
    let done = match record {
        Record::Job(record) => store.put_job(record),
        Record::Evaluation { record, is_last } => store.put_evaluation(record, *is_last),
        Record::End { end, summary } => store.finish_job(end, summary),
        Record::Ban(record) => ban(store, record),
    };
    match done {
        Ok(()) => Event::Stored { job, key },
        Err(error) => {
            tracing::warn!(%job, %error, "a record could not be stored");
            Event::StoreFailed { job, key, error: error.to_string() }
        }
    }
}

/// Stores a ban, and logs the ended jobs whose results can no longer be relied on.
fn ban(store: &mut dyn Store, record: &BanRecord) -> Result<(), StoreError> {
    store.put_ban(record)?;
    // Logging is a courtesy: if its query fails, the stored ban remains.
    let ended = store.ended_jobs_of(&record.worker).unwrap_or_default();
    if !ended.is_empty() {
        let jobs: Vec<String> = ended.iter().map(JobId::to_string).collect();
        tracing::error!(worker = %record.worker, jobs = jobs.join(" "),
            "these jobs ended before the worker was found to compute wrongly; run them again");
    }
    Ok(())
}
