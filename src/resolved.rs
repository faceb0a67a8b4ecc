//! The command line with environment and defaults resolved; files have not been read yet.

mod client;
mod slurm;
mod umbridge;

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::anyhow;
use osteon_client::client::{Remote, SubmitOptions};
use osteon_client::environment::{Environment, Unused};
use osteon_client::request_id::RequestId;
use osteon_common::job::JobKind;
use osteon_proto::credentials::{CredentialFiles, Credentials};
use osteon_proto::endpoint::Endpoint;
use osteon_slurm::follow::ScalingPlan;
use osteon_slurm::job_script::JobScript;
use osteon_solver::Isa;
use osteon_worker::WorkerConfig;

use crate::arguments::{
    Arguments, CertsArguments, CheckArguments, ClientArguments, Command, CompletionArguments,
    CoordinatorArguments, CredentialArguments, DoctorArguments, DrawArguments, InitArguments,
    JobFileArguments, LogFormat, ManArguments, MaterialsArguments, ObserveArguments,
    ProgressFormat, ReportArguments, RunArguments, SchemaArguments, SimulateArguments,
    TokenArguments, VerbosityArguments, WorkerArguments,
};
use crate::doctor::Patient;
use crate::exit_status::CommandFailure;

pub(crate) use slurm::WorkerArray;
pub(crate) use umbridge::ModelService;

/// Default number of worker processes of a run on this machine.
const WORKERS_DEFAULT: u32 = 2;

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
    /// `report`.
    Report(ReportArguments),
    /// `observe`.
    Observe {
        /// The job and the requested output.
        arguments: ObserveArguments,
        /// The instruction set to compute on.
        isa: Isa,
        /// Number of threads.
        threads: u32,
    },
    /// `umbridge`.
    Umbridge(Box<ModelService>),
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
    /// `submit`.
    Submit {
        /// The job file.
        job: JobFileArguments,
        /// Kind of the job.
        kind: JobKind,
        /// The request, which makes the submission idempotent.
        request: RequestId,
        /// Further properties of the job.
        options: SubmitOptions,
        /// The coordinator to submit to.
        coordinator: Remote,
        /// Output format.
        format: OutputFormat,
    },
    /// `jobs`.
    Jobs {
        /// The coordinator to ask.
        coordinator: Remote,
        /// Output format.
        format: OutputFormat,
    },
    /// `jobs prune`.
    Prune {
        /// Only jobs that ended longer ago than this.
        older_than: Option<Duration>,
        /// Number of most recently ended jobs that are kept.
        keep_last: Option<u64>,
        /// The coordinator to ask.
        coordinator: Remote,
        /// Output format.
        format: OutputFormat,
    },
    /// `workers`.
    Workers {
        /// The coordinator to ask.
        coordinator: Remote,
        /// Output format.
        format: OutputFormat,
    },
    /// `workers drain`.
    DrainWorker {
        /// Number of the worker.
        worker: u64,
        /// The coordinator to ask.
        coordinator: Remote,
        /// Output format.
        format: OutputFormat,
    },
    /// `workers slurm`.
    ScaleWorkers {
        /// What is followed, and how.
        plan: Box<ScalingPlan>,
        /// Whether nothing is to be changed.
        dry_run: bool,
    },
    /// `slurm script`.
    JobScript(Box<JobScript>),
    /// `slurm array`.
    WorkerArray(Box<WorkerArray>),
    /// `health`.
    Health {
        /// The coordinator to ask.
        coordinator: Remote,
        /// Longest wait for the answer.
        limit: Duration,
        /// Output format.
        format: OutputFormat,
    },
    /// `backup`.
    Backup {
        /// Directory for the copy.
        directory: PathBuf,
        /// The coordinator to ask.
        coordinator: Remote,
        /// Output format.
        format: OutputFormat,
    },
    /// `watch`.
    Watch {
        /// Id of the job.
        job: String,
        /// The coordinator to ask.
        coordinator: Remote,
        /// Output format.
        format: OutputFormat,
    },
    /// `explain`.
    Explain {
        /// Id of the job.
        job: String,
        /// The coordinator to ask.
        coordinator: Remote,
        /// Output format.
        format: OutputFormat,
    },
    /// `recheck`.
    Recheck {
        /// Id of the job.
        job: String,
        /// The coordinator.
        coordinator: Remote,
        /// Output format.
        format: OutputFormat,
    },
    /// `workers unban`.
    Unban {
        /// The host.
        host: String,
        /// The coordinator.
        coordinator: Remote,
    },
    /// `cancel`.
    Cancel {
        /// Id of the job.
        job: String,
        /// The coordinator to ask.
        coordinator: Remote,
    },
    /// `fetch`.
    Fetch {
        /// Id of the job.
        job: String,
        /// The coordinator to ask.
        coordinator: Remote,
        /// Directory for the results.
        out: PathBuf,
    },
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
    pub(crate) report: bool,
    /// Address of its live page, if it has one.
    pub(crate) page: Option<SocketAddr>,
    /// Output format.
    pub(crate) format: OutputFormat,
    /// Format of the progress.
    pub(crate) progress: ProgressFormat,
    /// How much is shown.
    pub(crate) verbosity: VerbosityArguments,
}

/// Where a job is computed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum RunLocation {
    /// Worker processes started by this process.
    Local {
        /// Number of worker processes.
        workers: u32,
        /// Number of threads of each worker.
        threads: u32,
    },
    /// A running coordinator.
    Coordinator(Remote),
}

impl Resolved {
    /// Resolves `arguments`.
    ///
    /// # Errors
    /// When the environment holds something that cannot be meant.
    pub(crate) fn from_arguments(arguments: Arguments) -> Result<Self, CommandFailure> {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let cores = u32::try_from(cores).unwrap_or(1);
        let environment = Environment::from_process()?;
        let remote = |client: ClientArguments| {
            let from_environment = client.coordinator.is_none();
            let endpoint = environment.needed(client.coordinator)?;
            let (files, unused) = environment.files(client.credentials.into(), &endpoint);
            Ok::<_, CommandFailure>(Remote { endpoint, files, from_environment, unused })
        };
        let isa =
            || Isa::chosen(std::env::var_os(Isa::VARIABLE)).map_err(CommandFailure::bad_input);
        let run = |kind, run| {
            let run = resolve_run(kind, run, cores, &environment)?;
            // Workers read the variable again, but an invalid value is reported here, at once.
            let isa = match run.location {
                RunLocation::Local { .. } => Some(isa()?),
                RunLocation::Coordinator(_) => None,
            };
            Ok::<_, CommandFailure>(Self::Run { run, isa })
        };
        Ok(match arguments.command {
            Command::Identify(arguments) => run(JobKind::Identification, arguments)?,
            Command::Propagate(arguments) => run(JobKind::Propagation, arguments)?,
            Command::Simulate(arguments) => Self::Simulate { arguments, isa: isa()? },
            Command::Check(arguments) => Self::Check { arguments, isa: isa()?, cores },
            Command::Draw(arguments) => Self::Draw(arguments),
            Command::Report(arguments) => Self::Report(arguments),
            Command::Observe(arguments) => {
                let threads = arguments.threads.unwrap_or(cores);
                Self::Observe { arguments, isa: isa()?, threads }
            }
            Command::Umbridge(arguments) => {
                let service = umbridge::service(arguments, &environment, cores, isa()?)?;
                Self::Umbridge(Box::new(service))
            }
            Command::Coordinator(arguments) => Self::Coordinator(arguments),
            Command::Worker(arguments) => resolve_worker(arguments, &environment, cores, isa()?)?,
            Command::Certs(arguments) => Self::Certs(arguments),
            Command::Token(arguments) => Self::Token(arguments),
            Command::Init(arguments) => Self::Init(arguments),
            Command::Schema(arguments) => Self::Schema(arguments),
            Command::Materials(arguments) => Self::Materials(arguments),
            Command::Doctor(DoctorArguments { store, client, json }) => {
                let named = client.coordinator.is_some() || environment.coordinator()?.is_some();
                let coordinator = named.then(|| remote(client)).transpose()?;
                let patient = Patient { store, coordinator, isa: isa()? };
                Self::Doctor { patient, format: format(json) }
            }
            Command::Completions(arguments) => Self::Completions(arguments),
            Command::Man(arguments) => Self::Man(arguments),
            Command::Job(command) => client::job(command, remote)?,
            Command::Earlier(command) => client::job(command.into(), remote)?,
            Command::Workers(arguments) => client::workers(arguments, remote)?,
            Command::Slurm(arguments) => slurm::scripts(arguments, remote)?,
            Command::Health(arguments) => client::health(arguments, remote)?,
            Command::Backup(arguments) => client::backup(arguments, remote)?,
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
            Self::Coordinator(_) | Self::Worker { .. } | Self::ScaleWorkers { .. } => "info",
            _ => "warn",
        }
    }
}

/// Returns JSON or text.
pub(crate) fn format(json: bool) -> OutputFormat {
    if json { OutputFormat::Json } else { OutputFormat::Text }
}

fn resolve_run(
    kind: JobKind,
    arguments: RunArguments,
    cores: u32,
    environment: &Environment,
) -> Result<Run, CommandFailure> {
    let RunArguments {
        job,
        workers,
        threads,
        coordinator,
        credentials,
        name,
        out,
        report,
        http,
        json,
        progress,
        verbosity,
    } = arguments;
    let files = CredentialFiles::from(credentials);
    // A page of its own is one of a run on this machine.
    let workers = workers.or(http.map(|_| WORKERS_DEFAULT));
    let location =
        Locating { workers, threads, coordinator, files }.location(cores, environment)?;
    Ok(Run {
        kind,
        job,
        location,
        name: name.unwrap_or_default(),
        out,
        report,
        page: http,
        format: format(json),
        progress,
        verbosity,
    })
}

/// The options that say where a job is computed.
struct Locating {
    workers: Option<u32>,
    threads: Option<u32>,
    coordinator: Option<Endpoint>,
    files: CredentialFiles,
}

impl Locating {
    fn location(
        self,
        cores: u32,
        environment: &Environment,
    ) -> Result<RunLocation, CommandFailure> {
        let Self { workers, threads, coordinator, files } = self;
        let local = workers.is_some() || threads.is_some();
        let from_environment = coordinator.is_none();
        let endpoint = match coordinator {
            None if !local => environment.coordinator()?,
            given => given,
        };
        match (endpoint, files.first_given()) {
            (Some(endpoint), _) => {
                let (files, unused) = environment.files(files, &endpoint);
                let remote = Remote { endpoint, files, from_environment, unused };
                Ok(RunLocation::Coordinator(remote))
            }
            (None, Some(option)) => Err(CommandFailure::bad_input(anyhow!(
                "{option} requires a coordinator; add --coordinator URL"
            ))),
            (None, None) => {
                let workers = workers.unwrap_or(WORKERS_DEFAULT);
                let threads = threads.unwrap_or((cores / workers).max(1));
                Ok(RunLocation::Local { workers, threads })
            }
        }
    }
}

fn resolve_worker(
    arguments: WorkerArguments,
    environment: &Environment,
    cores: u32,
    isa: Isa,
) -> Result<Resolved, CommandFailure> {
    let endpoint = environment.needed(arguments.coordinator)?;
    let (files, unused) = environment.files(arguments.credentials.into(), &endpoint);
    let config = WorkerConfig {
        spans: None,
        endpoint,
        credentials: Credentials::default(),
        host: arguments.host.or_else(|| environment.host()),
        threads: arguments.threads.unwrap_or(cores),
        isa,
        give_up_after: arguments.give_up_after.map(Duration::from_secs_f64),
        time_limit: arguments.time_limit.map(Duration::from_secs_f64),
        idle_timeout: arguments.idle_timeout.map(Duration::from_secs_f64),
    };
    Ok(Resolved::Worker { config, files, unused, log_format: arguments.log_format })
}

impl From<CredentialArguments> for CredentialFiles {
    fn from(arguments: CredentialArguments) -> Self {
        let CredentialArguments { tls_ca, tls_cert, tls_key, token_file } = arguments;
        Self { ca: tls_ca, certificate: tls_cert, key: tls_key, token: token_file }
    }
}

#[cfg(test)]
mod tests;
