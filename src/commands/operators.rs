//! `worker list`, `worker drain`, `coordinator health` and others: commands for operators of a coordinator.

use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use osteon_client::client::{Client, Remote};
use osteon_client::operators;
use osteon_common::visible;
use osteon_coordinator::store::sqlite::SqliteStore;
use osteon_proto::v1::BackupEnd;
use tempfile::NamedTempFile;

use crate::arguments::{
    BackupArguments, CoordinatorCommand, DrainArguments, HealthArguments, UnbanArguments,
    WorkerCommand, WorkerListArguments,
};
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output;
use crate::prepared_command::{Ended, PreparedCommand};
use crate::process_context::ProcessContext;
use crate::resolved::{OutputFormat, format};
use crate::user;

/// Name of a store's file in its directory, and of the files that SQLite keeps beside it.
const STORE: &str = "osteon.sqlite";
const BESIDE_STORE: [&str; 3] =
    ["osteon.sqlite-wal", "osteon.sqlite-journal", "osteon.acknowledged"];

/// Prepares a command about workers.
///
/// # Errors
/// When neither command line nor environment names a coordinator.
pub(super) fn prepare_for_worker(
    command: WorkerCommand,
    context: &ProcessContext,
) -> Result<PreparedCommand, CommandFailure> {
    let remote = |client| context.remote(client);
    Ok(match command {
        WorkerCommand::List(WorkerListArguments { client, json }) => {
            PreparedCommand::harmless(workers(remote(client)?, format(json)))
        }
        WorkerCommand::Drain(DrainArguments { worker, client, json }) => {
            let if_interrupted =
                "the worker may have been told to drain (see `osteon worker list`)";
            PreparedCommand::interruptible(
                if_interrupted,
                drain(worker, remote(client)?, format(json)),
            )
        }
        WorkerCommand::Unban(UnbanArguments { host, client }) => {
            let if_interrupted = "the ban may have been lifted (see `osteon worker list`)";
            PreparedCommand::interruptible(if_interrupted, unban(host, remote(client)?))
        }
        WorkerCommand::Wing(command) => command.prepare(context)?,
    })
}

/// Prepares a command about a running coordinator.
///
/// # Errors
/// When neither command line nor environment names a coordinator.
pub(super) fn prepare_for_coordinator(
    command: CoordinatorCommand,
    context: &ProcessContext,
) -> Result<PreparedCommand, CommandFailure> {
    Ok(match command {
        CoordinatorCommand::Health(HealthArguments { client, timeout, json }) => {
            let limit = Duration::from_secs_f64(timeout);
            PreparedCommand::harmless(health(context.remote(client)?, limit, format(json)))
        }
        CoordinatorCommand::Backup(BackupArguments { directory, client, json }) => {
            let copied = backup(directory, context.remote(client)?, format(json));
            PreparedCommand::interruptible("no copy was kept", copied)
        }
    })
}

/// `worker list`: prints the attached workers, those that left last, and those that are banned.
async fn workers(coordinator: Remote, format: OutputFormat) -> Ended {
    let mut client = user::connect(&coordinator).await?;
    let workers = client.workers().await?;
    let banned = client.banned().await?;
    output::stdout(format).workers(&workers, &banned).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// `worker drain`: prints the worker's state afterwards.
async fn drain(worker: u64, coordinator: Remote, format: OutputFormat) -> Ended {
    let worker = user::connect(&coordinator).await?.drain(worker).await?;
    output::stdout(format).worker(&worker).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// `worker unban`: prints the host whose ban is lifted.
async fn unban(host: String, coordinator: Remote) -> Ended {
    let worker = user::connect(&coordinator).await?.unban(&host).await?;
    let line = format!("{}\n", visible::line(&worker.host));
    output::stdout(OutputFormat::Text).verbatim(&line).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// `coordinator health`: prints whether a coordinator is serving; the exit code is 0 if it is.
async fn health(coordinator: Remote, limit: Duration, format: OutputFormat) -> Ended {
    let reason = match operators::health(&coordinator, limit, user::listener()).await {
        Ok(true) => None,
        Ok(false) => Some(anyhow!(
            "the coordinator at {} reports that it is not serving",
            coordinator.endpoint
        )),
        Err(error) if error.is_bad_input() => return Err(error.into()),
        Err(error) => Some(anyhow::Error::new(error)),
    };
    match (reason, format) {
        (Some(reason), OutputFormat::Text) => Err(CommandFailure::Failed(reason)),
        (reason, _) => {
            let reason = reason.map(|reason| reason.to_string());
            output::stdout(format).health(reason.as_deref()).map_err(stdout_failure)?;
            Ok(if reason.is_none() { ExitStatus::Done } else { ExitStatus::RunFailed })
        }
    }
}

/// `coordinator backup`: copies the store of a running coordinator, completely or not at all.
async fn backup(directory: PathBuf, coordinator: Remote, format: OutputFormat) -> Ended {
    let target = unused_copy_path(&directory)?;
    let mut client = user::connect(&coordinator).await?;
    let shown = visible::path(&directory);
    SqliteStore::make_directory(&directory).map_err(|error| {
        CommandFailure::unusable_path(error, format!("cannot create the directory {shown}"))
    })?;
    // Removed when it is dropped; others cannot read it.
    let file = tempfile::Builder::new().prefix(".osteon-backup-").tempfile_in(&directory);
    let mut file = file.map_err(|error| {
        CommandFailure::unusable_path(error, format!("cannot make a file in {shown}"))
    })?;
    let end = receive(&mut client, &mut file).await?;
    let unsynced = || format!("cannot write the copy in {shown} to the disk");
    file.as_file().sync_all().with_context(unsynced).map_err(CommandFailure::Failed)?;
    file.persist_noclobber(&target)
        .map_err(|error| error.error)
        .with_context(|| format!("cannot make {}", visible::path(&target)))
        .map_err(CommandFailure::Failed)?;
    // Syncs the directory, so that the file's name survives a power failure, too.
    let directory = File::open(&directory).and_then(|directory| directory.sync_all());
    directory.with_context(unsynced).map_err(CommandFailure::Failed)?;
    output::stdout(format).backup(&target, &end).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// Returns the path of the copy, after checking that neither it nor a file that SQLite would take
/// for a part of it exists.
fn unused_copy_path(directory: &Path) -> Result<PathBuf, CommandFailure> {
    for name in [STORE].iter().chain(&BESIDE_STORE) {
        let path = directory.join(name);
        if path.symlink_metadata().is_ok() {
            return Err(CommandFailure::bad_input(anyhow!(
                "{} already exists and is not overwritten; choose another directory",
                visible::path(&path)
            )));
        }
    }
    Ok(directory.join(STORE))
}

/// Writes the copy to `file`; returns its size and digest once they have been verified.
async fn receive(
    client: &mut Client,
    file: &mut NamedTempFile,
) -> Result<BackupEnd, CommandFailure> {
    let (mut length, mut digest) = (0, blake3::Hasher::new());
    let place = file.path().to_owned();
    let received = client.backup(|data| {
        length += data.len() as u64;
        digest.update(data);
        file.write_all(data)
            .with_context(|| format!("cannot write {}", visible::path(&place)))
            .map_err(CommandFailure::Failed)
    });
    let end = received.await??;
    let found = digest.finalize().to_hex().to_string();
    if (length, &found) != (end.length, &end.digest) {
        return Err(CommandFailure::failed(anyhow!(
            "the copy is damaged: {length} bytes with digest {found} were received, the \
             coordinator sent {} \
             bytes with digest {}; nothing was kept, try again",
            end.length,
            end.digest
        )));
    }
    Ok(end)
}
