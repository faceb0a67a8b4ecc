//! The names that commands had before they were ordered by nouns. They do the same.

use clap::{Args, Subcommand};

use super::{
    BackupArguments, Command, CoordinatorCommand, DrainArguments, ExplainArguments, FetchArguments,
    HealthArguments, JobArguments, JobCommand, JobListArguments, Noun, PruneArguments,
    SubmitArguments, WatchArguments, WorkerCommand, WorkerListArguments,
};

/// Commands by their earlier names.
#[derive(Debug, Subcommand)]
pub(crate) enum EarlierCommand {
    /// Same as `osteon job submit`
    #[command(hide = true)]
    Submit(SubmitArguments),
    /// Same as `osteon job list`; `prune` is `osteon job prune`
    #[command(hide = true)]
    Jobs(JobsArguments),
    /// Same as `osteon job watch`
    #[command(hide = true)]
    Watch(WatchArguments),
    /// Same as `osteon job explain`
    #[command(hide = true)]
    Explain(ExplainArguments),
    /// Same as `osteon job cancel`
    #[command(hide = true)]
    Cancel(JobArguments),
    /// Same as `osteon job fetch`
    #[command(hide = true)]
    Fetch(FetchArguments),
    /// Same as `osteon job recheck`
    #[command(hide = true)]
    Recheck(WatchArguments),
    /// Same as `osteon worker list`; the commands are those of `osteon worker`
    #[command(hide = true)]
    Workers(WorkersArguments),
    /// Same as `osteon coordinator health`
    #[command(hide = true)]
    Health(HealthArguments),
    /// Same as `osteon coordinator backup`
    #[command(hide = true)]
    Backup(BackupArguments),
}

/// Arguments of `jobs`, the earlier name of `job list`.
#[derive(Debug, Args)]
pub(crate) struct JobsArguments {
    /// The operation; without one they are listed.
    #[command(subcommand)]
    command: Option<JobsCommand>,
    /// What is listed.
    #[command(flatten)]
    list: JobListArguments,
}

/// Operations of `jobs`.
#[derive(Debug, Subcommand)]
enum JobsCommand {
    /// Delete ended jobs (without options, all of them) and print their ids
    Prune(PruneArguments),
}

/// Arguments of `workers`, the earlier name of `worker list`.
#[derive(Debug, Args)]
pub(crate) struct WorkersArguments {
    /// The operation; without one they are listed.
    #[command(subcommand)]
    command: Option<WorkerCommand>,
    /// What is listed. With an operation, what holds for it unless it says otherwise.
    #[command(flatten)]
    list: WorkerListArguments,
}

impl From<EarlierCommand> for Command {
    fn from(earlier: EarlierCommand) -> Self {
        match earlier {
            EarlierCommand::Submit(arguments) => Self::Job(JobCommand::Submit(arguments)),
            EarlierCommand::Jobs(arguments) => Self::Job(arguments.into()),
            EarlierCommand::Watch(arguments) => Self::Job(JobCommand::Watch(arguments)),
            EarlierCommand::Explain(arguments) => Self::Job(JobCommand::Explain(arguments)),
            EarlierCommand::Cancel(arguments) => Self::Job(JobCommand::Cancel(arguments)),
            EarlierCommand::Fetch(arguments) => Self::Job(JobCommand::Fetch(arguments)),
            EarlierCommand::Recheck(arguments) => Self::Job(JobCommand::Recheck(arguments)),
            EarlierCommand::Workers(arguments) => Self::Worker(Noun::Command(arguments.into())),
            EarlierCommand::Health(arguments) => {
                Self::Coordinator(Noun::Command(CoordinatorCommand::Health(arguments)))
            }
            EarlierCommand::Backup(arguments) => {
                Self::Coordinator(Noun::Command(CoordinatorCommand::Backup(arguments)))
            }
        }
    }
}

impl From<JobsArguments> for JobCommand {
    fn from(JobsArguments { command, list }: JobsArguments) -> Self {
        match command {
            None => Self::List(list),
            Some(JobsCommand::Prune(prune)) => {
                let (client, json) = (prune.client.or(list.client), prune.json || list.json);
                Self::Prune(PruneArguments { client, json, ..prune })
            }
        }
    }
}

impl From<WorkersArguments> for WorkerCommand {
    fn from(WorkersArguments { command, list: before }: WorkersArguments) -> Self {
        let Some(mut command) = command else { return Self::List(before) };
        let client = command.client_mut();
        *client = client.clone().or(before.client);
        if let Self::List(WorkerListArguments { json, .. })
        | Self::Drain(DrainArguments { json, .. }) = &mut command
        {
            *json |= before.json;
        }
        command
    }
}
