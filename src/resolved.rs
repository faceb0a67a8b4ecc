//! The command line with environment and defaults resolved; files have not been read yet.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use osteon_client::client::Remote;
use osteon_client::environment::Unused;
use osteon_common::job::JobKind;
use osteon_solver::Isa;
use osteon_transport::credentials::{CredentialFiles, Credentials};
use osteon_worker::WorkerConfig;

use crate::arguments::{
    Arguments, BackupArguments, CertsArguments, CheckArguments, Command, CompletionArguments,
    CoordinatorArguments, CoordinatorCommand, DoctorArguments, DrainArguments, DrawArguments,
    HealthArguments, InitArguments, JobCommand, JobFileArguments, LogFormat, ManArguments,
    MaterialsArguments, Noun, ObserveArguments, ProgressFormat, RunArguments, SchemaArguments,
    SimulateArguments, TokenArguments, UnbanArguments, VerbosityArguments, WorkerArguments,
    WorkerCommand, WorkerListArguments,
};
use crate::doctor::Patient;
use crate::exit_status::CommandFailure;
use crate::process_context::{Locating, ProcessContext, RunLocation, WORKERS_DEFAULT};
use crate::wings::{ReportOption, WingCommand};

/// Format of the output on stdout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OutputFormat {
    /// Text for people.
    Text,
    /// JSON for programs.
    Json,
}

/// The command to be executed.
#[derive(Debug)]
pub(crate) enum Resolved {
    /// `identify`, `propagate`.
    Run {
        /// The run.
        run: Run,
        /// The instruction set to compute on, on this machine.
        isa: Option<Isa>,
    },
    /// `simulate`.
    Simulate {
        /// The case and the requested output.
        arguments: SimulateArguments,
        /// The instruction set to compute on.
        isa: Isa,
    },
    /// `check`.
    Check {
        /// The job.
        arguments: CheckArguments,
        /// The instruction set to compute on.
        isa: Isa,
        /// Number of this machine's cores.
        cores: u32,
    },
    /// `draw`.
    Draw(DrawArguments),
    /// `observe`.
    Observe {
        /// The job and the requested output.
        arguments: ObserveArguments,
        /// The instruction set to compute on.
        isa: Isa,
        /// Number of threads.
        threads: u32,
    },
    /// `coordinator`.
    Coordinator(CoordinatorArguments),
    /// `worker`.
    Worker {
        /// Configuration of the worker, still without credentials.
        config: WorkerConfig,
        /// The credential files.
        files: CredentialFiles,
        /// Environment variables that were not used for its coordinator.
        unused: Unused,
        /// Format of its log.
        log_format: LogFormat,
    },
    /// `certs`.
    Certs(CertsArguments),
    /// `token`.
    Token(TokenArguments),
    /// `init`.
    Init(InitArguments),
    /// Print a schema.
    Schema(SchemaArguments),
    /// `materials`.
    Materials(MaterialsArguments),
    /// `doctor`.
    Doctor {
        /// What is examined.
        patient: Patient,
        /// Output format.
        format: OutputFormat,
    },
    /// `completions`.
    Completions(CompletionArguments),
    /// `man`.
    Man(ManArguments),
    /// A command about jobs.
    Job {
        /// The command.
        command: JobCommand,
        /// The coordinator to ask.
        coordinator: Remote,
    },
    /// `worker list`.
    ListWorkers {
        /// The coordinator to ask.
        coordinator: Remote,
        /// Output format.
        format: OutputFormat,
    },
    /// `worker drain`.
    Drain {
        /// Number of the worker.
        worker: u64,
        /// The coordinator to ask.
        coordinator: Remote,
        /// Output format.
        format: OutputFormat,
    },
    /// `worker unban`.
    Unban {
        /// Name of the host.
        host: String,
        /// The coordinator to ask.
        coordinator: Remote,
    },
    /// `coordinator health`.
    Health {
        /// The coordinator to ask.
        coordinator: Remote,
        /// Longest wait for the answer.
        limit: Duration,
        /// Output format.
        format: OutputFormat,
    },
    /// `coordinator backup`.
    Backup {
        /// Directory for the copy.
        directory: PathBuf,
        /// The coordinator to ask.
        coordinator: Remote,
        /// Output format.
        format: OutputFormat,
    },
    /// A command of a wing.
    Wing(Box<dyn WingCommand>),
}

/// One run of a job, from its job file to its result.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Run {
    /// Kind of the job.
    pub(crate) kind: JobKind,
    /// The job file.
    pub(crate) job: JobFileArguments,
    /// Where the job is computed.
    pub(crate) location: RunLocation,
    /// Name of the job for display; may be empty.
    pub(crate) name: String,
    /// Directory for the results, if they are kept.
    pub(crate) out: Option<PathBuf>,
    /// Whether a report is written beside them.
    pub(crate) report: ReportOption,
    /// Address of its live page, if it has one.
    pub(crate) page: Option<SocketAddr>,
    /// Output format.
    pub(crate) format: OutputFormat,
    /// Format of the progress.
    pub(crate) progress: ProgressFormat,
    /// How much is shown.
    pub(crate) verbosity: VerbosityArguments,
}

impl Resolved {
    /// Resolves `arguments`.
    ///
    /// # Errors
    /// When the environment holds something that cannot be meant.
    pub(crate) fn from_arguments(arguments: Arguments) -> Result<Self, CommandFailure> {
        Self::from_command(arguments.command, &ProcessContext::from_process()?)
    }

    fn from_command(command: Command, context: &ProcessContext) -> Result<Self, CommandFailure> {
        let isa = ProcessContext::isa;
        Ok(match command {
            Command::Identify(arguments) => {
                run_command(JobKind::Identification, arguments, context)?
            }
            Command::Propagate(arguments) => run_command(JobKind::Propagation, arguments, context)?,
            Command::Simulate(arguments) => Self::Simulate { arguments, isa: isa()? },
            Command::Check(arguments) => {
                Self::Check { arguments, isa: isa()?, cores: context.cores }
            }
            Command::Draw(arguments) => Self::Draw(arguments),
            Command::Observe(arguments) => {
                let threads = arguments.threads.unwrap_or(context.cores);
                Self::Observe { arguments, isa: isa()?, threads }
            }
            Command::JobWing(command) => Self::Wing(command.resolve(context)?),
            Command::Coordinator(Noun::Service(arguments)) => Self::Coordinator(arguments),
            Command::Coordinator(Noun::Command(command)) => coordinator_command(command, context)?,
            Command::Worker(Noun::Service(arguments)) => {
                resolve_worker(arguments, context, isa()?)?
            }
            Command::Worker(Noun::Command(command)) => worker_command(command, context)?,
            Command::Certs(arguments) => Self::Certs(arguments),
            Command::Token(arguments) => Self::Token(arguments),
            Command::Init(arguments) => Self::Init(arguments),
            Command::Schema(arguments) => Self::Schema(arguments),
            Command::Materials(arguments) => Self::Materials(arguments),
            Command::Doctor(DoctorArguments { store, client, json }) => {
                let named =
                    client.coordinator.is_some() || context.environment.coordinator()?.is_some();
                let coordinator = named.then(|| context.remote(client)).transpose()?;
                let patient = Patient { store, coordinator, isa: isa()? };
                Self::Doctor { patient, format: format(json) }
            }
            Command::Completions(arguments) => Self::Completions(arguments),
            Command::Man(arguments) => Self::Man(arguments),
            Command::Job(command) => job_command(command, context)?,
            Command::Earlier(command) => Self::from_command(command.into(), context)?,
            Command::ClusterWing(command) => Self::Wing(command.resolve(context)?),
        })
    }

    /// Returns the format of the log: only services have a choice.
    pub(crate) fn log_format(&self) -> LogFormat {
        match self {
            Self::Coordinator(arguments) => arguments.log_format,
            Self::Worker { log_format, .. } => *log_format,
            _ => LogFormat::Text,
        }
    }

    /// Returns the default log level: services log their events, commands only problems.
    pub(crate) fn default_log_level(&self) -> &'static str {
        match self {
            Self::Coordinator(_) | Self::Worker { .. } => "info",
            Self::Wing(command) => command.default_log_level(),
            _ => "warn",
        }
    }
}

/// Returns JSON or text.
pub(crate) fn format(json: bool) -> OutputFormat {
    if json { OutputFormat::Json } else { OutputFormat::Text }
}

fn run_command(
    kind: JobKind,
    arguments: RunArguments,
    context: &ProcessContext,
) -> Result<Resolved, CommandFailure> {
    let run = resolve_run(kind, arguments, context)?;
    // Workers read the variable again, but an invalid value is reported here, at once.
    let isa = match run.location {
        RunLocation::Local { .. } => Some(ProcessContext::isa()?),
        RunLocation::Coordinator(_) => None,
    };
    Ok(Resolved::Run { run, isa })
}

fn resolve_run(
    kind: JobKind,
    arguments: RunArguments,
    context: &ProcessContext,
) -> Result<Run, CommandFailure> {
    let RunArguments { job, threads, coordinator, credentials, out, report, .. } = arguments;
    let page = arguments.page.address();
    // A page of its own is one of a run on this machine.
    let workers = arguments.workers.or(page.map(|_| WORKERS_DEFAULT));
    Ok(Run {
        kind,
        job,
        location: context.locate(Locating { workers, threads, coordinator, credentials })?,
        name: arguments.name.unwrap_or_default(),
        out,
        report,
        page,
        format: format(arguments.json),
        progress: arguments.progress,
        verbosity: arguments.verbosity,
    })
}

fn job_command(command: JobCommand, context: &ProcessContext) -> Result<Resolved, CommandFailure> {
    let coordinator = context.remote(command.client())?;
    Ok(Resolved::Job { command, coordinator })
}

fn worker_command(
    command: WorkerCommand,
    context: &ProcessContext,
) -> Result<Resolved, CommandFailure> {
    Ok(match command {
        WorkerCommand::List(WorkerListArguments { client, json }) => {
            Resolved::ListWorkers { coordinator: context.remote(client)?, format: format(json) }
        }
        WorkerCommand::Drain(DrainArguments { worker, client, json }) => {
            Resolved::Drain { worker, coordinator: context.remote(client)?, format: format(json) }
        }
        WorkerCommand::Unban(UnbanArguments { host, client }) => {
            Resolved::Unban { host, coordinator: context.remote(client)? }
        }
        WorkerCommand::Wing(command) => Resolved::Wing(command.resolve(context)?),
    })
}

fn coordinator_command(
    command: CoordinatorCommand,
    context: &ProcessContext,
) -> Result<Resolved, CommandFailure> {
    Ok(match command {
        CoordinatorCommand::Health(HealthArguments { client, timeout, json }) => Resolved::Health {
            coordinator: context.remote(client)?,
            limit: Duration::from_secs_f64(timeout),
            format: format(json),
        },
        CoordinatorCommand::Backup(BackupArguments { directory, client, json }) => {
            Resolved::Backup {
                directory,
                coordinator: context.remote(client)?,
                format: format(json),
            }
        }
    })
}

fn resolve_worker(
    arguments: WorkerArguments,
    context: &ProcessContext,
    isa: Isa,
) -> Result<Resolved, CommandFailure> {
    let environment = &context.environment;
    let endpoint = environment.needed(arguments.coordinator)?;
    let (files, unused) = environment.files(arguments.credentials.into(), &endpoint);
    let config = WorkerConfig {
        spans: None,
        endpoint,
        credentials: Credentials::default(),
        host: arguments.host.or_else(|| environment.host()),
        threads: arguments.threads.unwrap_or(context.cores),
        isa,
        give_up_after: arguments.give_up_after.map(Duration::from_secs_f64),
        time_limit: arguments.time_limit.map(Duration::from_secs_f64),
        idle_timeout: arguments.idle_timeout.map(Duration::from_secs_f64),
    };
    Ok(Resolved::Worker { config, files, unused, log_format: arguments.log_format })
}

#[cfg(test)]
mod tests;
