//! The only thread that uses the store. Records are written in the order of their arrival, those that
//! wait together as a group, and each is reported as an event; the output of ended jobs is read for
//! the clients that fetch it.

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
use crate::service::failure_reporter::Guard;
use crate::store::group::Group;
use crate::store::job_output::ReadRequest;
use crate::store::{Store, StoreError};

/// Maximum number of waiting commands: a record for every job, and some reads.
const COMMANDS_MAX: usize = JOBS_MAX + 64;

/// Maximum number of commands, or groups of records, that run between two pieces of a copy, so that
/// the copy finishes.
const COMMANDS_BETWEEN: usize = 64;

/// A command for the store.
pub(crate) enum StoreCommand {
    /// Make a record durable.
    Put(Record),
    /// Read an evaluation of a job.
    Read { job: JobId, number: u64 },
    /// Delete ended jobs.
    Prune { reply_id: Option<ReplyId>, jobs: Vec<JobId> },
    /// Make an ended job an unfinished one again.
    Reopen { reply_id: ReplyId, job: JobId },
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
    let mut inbox = Inbox { commands, next: None };
    let (readings, copies) = (VecDeque::new(), VecDeque::new());
    let mut desk =
        PendingWork { events, write_times, readings, copies, unsettled: false, stuck: None };
    loop {
        let mut command = inbox.take();
        if matches!(command, Err(TryRecvError::Empty)) && desk.is_empty() {
            if desk.unsettled {
                desk.unsettled = store.settle();
                desk.tell_of_log(store);
                continue;
            }
            command = inbox.wait().ok_or(TryRecvError::Disconnected);
        }
        let command = match command {
            Ok(command) => Some(command),
            Err(TryRecvError::Disconnected) if desk.is_empty() => return,
            Err(_) => None,
        };
        let others_first = matches!(command, Some(StoreCommand::Fetch(_)));
        if let Some(command) = command {
            desk.run(store, &mut inbox, command);
        }
        if others_first {
            continue;
        }
        desk.read_on(store);
        if let Some(reply) = desk.copies.pop_front() {
            desk.copy(store, &mut inbox, reply);
        }
    }
}

/// Commands in the order of their arrival.
struct Inbox<'a> {
    commands: &'a mut mpsc::Receiver<StoreCommand>,
    /// Taken from `commands`, and run before those.
    next: Option<StoreCommand>,
}

impl Inbox<'_> {
    /// Waits for a command; `None` when every sender is gone.
    fn wait(&mut self) -> Option<StoreCommand> {
        self.next.take().or_else(|| self.commands.blocking_recv())
    }

    /// Returns a command that has arrived.
    fn take(&mut self) -> Result<StoreCommand, TryRecvError> {
        self.next.take().map_or_else(|| self.commands.try_recv(), Ok)
    }

    /// Returns a record with those that have arrived after it, as many as fit in a group. It does not
    /// wait for more: while a group is written, the records of the next one arrive. A command that
    /// depends on the order ends the group; fetches, which let others go first, join `readings`.
    fn group(&mut self, first: Record, readings: &mut VecDeque<ReadRequest>) -> Group {
        let mut group = Group::new(first);
        while self.next.is_none() && !group.is_full() {
            match self.commands.try_recv() {
                Ok(StoreCommand::Put(record)) => {
                    self.next = group.add(record).map(StoreCommand::Put);
                }
                Ok(StoreCommand::Fetch(reading)) => readings.push_back(reading),
                Ok(other) => self.next = Some(other),
                Err(_) => break,
            }
        }
        group
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
    /// The store has work that no record waits for.
    unsettled: bool,
    /// Length of the store's log, bytes, if the core was told that it is stuck.
    stuck: Option<u64>,
}

impl PendingWork<'_> {
    /// Tells the core whether the log is copied, when that changes.
    fn tell_of_log(&mut self, store: &dyn Store) {
        let stuck = store.stuck_log();
        if stuck != self.stuck {
            self.stuck = stuck;
            let event = stuck.map_or(Event::LogCopied, |bytes| Event::LogStuck { bytes });
            // The receiver is gone when the coordinator has stopped.
            drop(self.events.blocking_send(event));
        }
    }

    fn is_empty(&self) -> bool {
        self.readings.is_empty() && self.copies.is_empty()
    }

    fn run(&mut self, store: &mut dyn Store, inbox: &mut Inbox<'_>, command: StoreCommand) {
        match command {
            StoreCommand::Put(record) => {
                let begun = Instant::now();
                let mut took = None;
                let mut report = |event| {
                    took.get_or_insert_with(|| begun.elapsed());
                    // The receiver is gone when the coordinator has stopped.
                    drop(self.events.blocking_send(event));
                };
                let group = inbox.group(record, &mut self.readings);
                group.write(store, &mut report);
                self.write_times.add(took.unwrap_or_else(|| begun.elapsed()));
                // A large record is often followed by the end of its job, which should not wait.
                self.unsettled = group.is_small();
            }
            StoreCommand::Read { job, number } => {
                let found = store.evaluation(job, number).map_err(|error| unread(job, error));
                drop(self.events.blocking_send(Event::Read { job, number, found }));
            }
            StoreCommand::Prune { reply_id, jobs } => {
                let outcome = store.delete_jobs(&jobs).map_err(|error| error.to_string());
                drop(self.events.blocking_send(Event::Pruned { reply_id, jobs, outcome }));
            }
            StoreCommand::Reopen { reply_id, job } => {
                let outcome = store.reopen_job(job).map_err(|error| error.to_string());
                drop(self.events.blocking_send(Event::Reopened { reply_id, job, outcome }));
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
    fn copy(&mut self, store: &mut dyn Store, inbox: &mut Inbox<'_>, reply: CopyReply) {
        let copied = store.copy(&mut |store: &mut dyn Store| {
            for _ in 0..COMMANDS_BETWEEN {
                match inbox.take() {
                    Ok(command) => self.run(store, inbox, command),
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
