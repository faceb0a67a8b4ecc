//! The command line as typed. What it means is decided in [`crate::resolved`].

mod check;
mod earlier;
mod inputs;
mod jobs;
mod modes;
mod noun;
mod operators;
mod pick;
mod realizations;
pub(crate) mod services;
mod tools;

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser, Subcommand, ValueEnum};
use osteon_transport::endpoint::Endpoint;

use crate::program;
use crate::wings::{ClusterWing, JobWing, ReportOption, RunPageOption};

pub(crate) use check::CheckArguments;
pub(crate) use earlier::EarlierCommand;
pub(crate) use inputs::{CaseFileArguments, JobFileArguments};
pub(crate) use jobs::{
    ExplainArguments, FetchArguments, JobArguments, JobCommand, JobListArguments, PruneArguments,
    SubmitArguments, WatchArguments,
};
pub(crate) use modes::ModesArguments;
pub(crate) use noun::Noun;
pub(crate) use operators::{
    BackupArguments, CoordinatorCommand, DrainArguments, HealthArguments, UnbanArguments,
    WorkerCommand, WorkerListArguments,
};
pub(crate) use pick::PickArguments;
pub(crate) use realizations::{
    DesignArguments, DrawArguments, ObserveArguments, PlaceArguments, SynthesizeArguments,
};
pub(crate) use services::{CoordinatorArguments, LogFormat, WorkerArguments};
pub(crate) use tools::{
    CiteArguments, CompletionArguments, DemoArguments, DoctorArguments, ManArguments,
    MaterialsArguments, SchemaArguments, SchemaFile, VerbosityArguments,
};

/// Identifies the elasticity of cortical bone from first-arriving-signal velocities.
#[derive(Debug, Parser)]
#[command(name = "osteon", version = program::version_line(), max_term_width = 80)]
pub(crate) struct Arguments {
    /// The command.
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Identify the porosity of bones from an example's velocities, and write a report of it
    Demo(DemoArguments),
    /// Write a first job file for a file of velocities, and say what was understood of it
    Init(InitArguments),
    /// Find the mean elasticity and dispersion that reproduce the measured velocities
    Identify(RunArguments),
    /// Evaluate the model at the given parameter values (no search)
    Propagate(RunArguments),
    /// Solve one case: picked times, velocity, and with --out the pressure traces
    Simulate(SimulateArguments),
    /// Pick the velocities of the first arriving signals in recorded or simulated signals
    Pick(PickArguments),
    /// Compute all guided waves of a case's bone at one or several frequencies
    Modes(ModesArguments),
    /// Check a job file, and estimate what the job costs on this machine
    Check(CheckArguments),
    /// Draw one random realization of a job and print it as a case file
    Draw(DrawArguments),
    /// Compute all observables of a job's realizations: velocities, decay, frequency
    Observe(ObserveArguments),
    /// Record what a probe would measure of bones drawn by a job's law: signals of a known truth
    Synthesize(SynthesizeArguments),
    /// Predict which further measurement would narrow most what is known
    Design(DesignArguments),
    /// Commands of wings.
    #[command(flatten)]
    JobWing(JobWing),
    /// Run a coordinator: accept jobs from clients and distribute them to workers, until interrupted.
    /// With a command: check or copy a running one
    Coordinator(Noun<CoordinatorArguments, CoordinatorCommand>),
    /// Run a worker: compute realizations for a coordinator, until interrupted. With a command: list,
    /// drain and manage the workers of a coordinator
    Worker(Noun<WorkerArguments, WorkerCommand>),
    /// Submit, list, follow, fetch and cancel the jobs of a coordinator
    #[command(subcommand)]
    Job(JobCommand),
    /// Commands of wings.
    #[command(flatten)]
    ClusterWing(ClusterWing),
    /// Create a certificate authority and certificates for coordinator, workers and clients
    Certs(CertsArguments),
    /// Create an access token and its entry for the coordinator's token list
    Token(TokenArguments),
    /// List published stiffness of cortical bone, which job and case files use by name
    Materials(MaterialsArguments),
    /// Print BibTeX of this program, of its method, and of the materials of a job or case
    Cite(CiteArguments),
    /// Print the JSON Schema of a job file or of result.json
    Schema(SchemaArguments),
    /// Examine this machine: cores, numerics, disk, limits; and a coordinator
    ///
    /// Each line begins with ok, warning or problem. The exit code is 1 if there is a problem, otherwise
    /// 0.
    Doctor(DoctorArguments),
    /// Print a script by which a shell completes commands and options
    ///
    /// bash: osteon completions bash > ~/.local/share/bash-completion/completions/osteon
    Completions(CompletionArguments),
    /// Write the manual pages, one for each command.
    #[command(hide = true)]
    Man(ManArguments),
    /// Earlier names of commands.
    #[command(flatten)]
    Earlier(EarlierCommand),
}

/// Arguments of `identify` and `propagate`.
#[derive(Debug, Args)]
pub(crate) struct RunArguments {
    /// The job.
    #[command(flatten)]
    pub(crate) job: JobFileArguments,
    /// Number of worker processes to start on this machine [default: 2]
    #[arg(long, value_name = "N", conflicts_with = "coordinator",
          value_parser = clap::value_parser!(u32).range(1..=256))]
    pub(crate) workers: Option<u32>,
    /// Number of threads of each worker [default: cores / N, at least 1]
    #[arg(long, value_name = "T", conflicts_with = "coordinator",
          value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) threads: Option<u32>,
    /// Run the job on this coordinator instead of on this machine: https://HOST:PORT,
    /// http://HOST:PORT or unix:PATH
    ///
    /// If omitted, the environment variable OSTEON_COORDINATOR is used, unless --workers or
    /// --threads is given, which run the job on this machine.
    #[arg(long, value_name = "URL")]
    pub(crate) coordinator: Option<Endpoint>,
    /// Credentials for the coordinator.
    #[command(flatten)]
    pub(crate) credentials: CredentialArguments,
    /// Name of the job, shown by `osteon job list` and in logs (at most 256 bytes)
    #[arg(long, value_name = "TEXT", value_parser = job_name)]
    pub(crate) name: Option<String>,
    /// Directory for the results. Repeating the command resumes an interrupted run, or shows the
    /// results of a complete one
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// The report.
    #[command(flatten)]
    pub(crate) report: ReportOption,
    /// The live page.
    #[command(flatten)]
    pub(crate) page: RunPageOption,
    /// Do not print what usual errors of the setup would move, where the job says nothing of them
    #[arg(long)]
    pub(crate) no_budget: bool,
    /// Print the result as JSON
    #[arg(long)]
    pub(crate) json: bool,
    /// Format of the progress on stderr. text: for people; json: for programs, one object per line
    /// with the keys of `osteon job list --json`, below the key `progress`. With json the run ends when
    /// stderr is closed
    #[arg(
        long,
        value_enum,
        value_name = "FORMAT",
        default_value = "text",
        hide_possible_values = true
    )]
    pub(crate) progress: ProgressFormat,
    /// How much is shown.
    #[command(flatten)]
    pub(crate) verbosity: VerbosityArguments,
}

/// Format of a run's progress on stderr.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ProgressFormat {
    /// A few lines on a terminal, otherwise one line a minute.
    #[value(help = None)]
    Text,
    /// One JSON object per line whenever the job changes.
    #[value(help = None)]
    Json,
}

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub(crate) struct SimulateArguments {
    /// The case.
    #[command(flatten)]
    pub(crate) case: CaseFileArguments,
    /// Directory for the case, the result and the pressure traces (traces.csv, always computed with
    /// the exact method). Each case needs its own directory
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// The report.
    #[command(flatten)]
    pub(crate) report: ReportOption,
    /// Print the result as JSON
    #[arg(long)]
    pub(crate) json: bool,
    /// Solve with both methods, and with the exact method at higher refinement, and show the
    /// differences
    #[arg(long)]
    pub(crate) check: bool,
    /// Duration of the traces (seconds)
    #[arg(long, value_name = "S", default_value = "16e-6", value_parser = positive)]
    pub(crate) duration: f64,
    /// Time step of the traces (seconds)
    #[arg(long, value_name = "S", default_value = "1e-8", value_parser = positive)]
    pub(crate) time_step: f64,
}

/// Credentials for a coordinator, and the authorities that certify it.
#[derive(Debug, Clone, Args)]
pub(crate) struct CredentialArguments {
    /// Certificates of the authorities that may sign the coordinator's certificate (PEM); for https
    /// [env: OSTEON_TLS_CA]
    #[arg(long, value_name = "FILE")]
    pub(crate) tls_ca: Option<PathBuf>,
    /// Client certificate (PEM) [env: OSTEON_TLS_CERT]
    #[arg(long, value_name = "FILE")]
    pub(crate) tls_cert: Option<PathBuf>,
    /// Private key of the certificate (PEM) [env: OSTEON_TLS_KEY]
    #[arg(long, value_name = "FILE")]
    pub(crate) tls_key: Option<PathBuf>,
    /// File with an access token [env: OSTEON_TOKEN_FILE]
    #[arg(long, value_name = "FILE")]
    pub(crate) token_file: Option<PathBuf>,
}

/// Arguments of every command that speaks to a coordinator.
#[derive(Debug, Clone, Args)]
pub(crate) struct ClientArguments {
    /// The coordinator: https://HOST:PORT, http://HOST:PORT or unix:PATH [env: OSTEON_COORDINATOR]
    #[arg(long, value_name = "URL")]
    pub(crate) coordinator: Option<Endpoint>,
    /// Credentials for the coordinator.
    #[command(flatten)]
    pub(crate) credentials: CredentialArguments,
}

impl ClientArguments {
    /// These, and where one is not given, that of `other`.
    pub(crate) fn or(self, other: Self) -> Self {
        let (own, others) = (self.credentials, other.credentials);
        Self {
            coordinator: self.coordinator.or(other.coordinator),
            credentials: CredentialArguments {
                tls_ca: own.tls_ca.or(others.tls_ca),
                tls_cert: own.tls_cert.or(others.tls_cert),
                tls_key: own.tls_key.or(others.tls_key),
                token_file: own.token_file.or(others.token_file),
            },
        }
    }
}

/// Arguments of `certs`.
#[derive(Debug, Args)]
pub(crate) struct CertsArguments {
    /// Directory in which to create the files; if one of them exists already, none is created
    #[arg(value_name = "DIR")]
    pub(crate) directory: PathBuf,
    /// Host name or IP address of the coordinator, besides localhost, 127.0.0.1 and ::1; may be
    /// repeated
    #[arg(long, value_name = "HOST")]
    pub(crate) host: Vec<String>,
    /// Number of days for which the certificates of coordinator, workers and clients are valid
    #[arg(long, value_name = "N", default_value_t = 365,
          value_parser = clap::value_parser!(u16).range(1..=3650))]
    pub(crate) days: u16,
    /// Sign with the authority in this directory instead of creating a new one
    #[arg(long, value_name = "DIR")]
    pub(crate) ca: Option<PathBuf>,
}

/// Arguments of `token`.
#[derive(Debug, Args)]
pub(crate) struct TokenArguments {
    /// Name of the token's holder, shown in logs (letters, digits and . _ - @)
    #[arg(value_name = "NAME")]
    pub(crate) name: String,
    /// Permissions of the token. read: list jobs and fetch results; submit: the same, and submit and
    /// cancel jobs; admin: everything
    #[arg(long, value_name = "ROLE", value_parser = ["read", "submit", "admin"])]
    pub(crate) role: String,
    /// Write the token to this new file, which only you can read
    #[arg(long, short, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Append the entry to this token list (the coordinator's --tokens file) instead of printing it
    #[arg(long, value_name = "FILE")]
    pub(crate) tokens: Option<PathBuf>,
}

/// Arguments of `init`.
#[derive(Debug, Args)]
pub(crate) struct InitArguments {
    /// File with a header and a velocity in each row: CSV in any of the usual formats, also packed by gzip, an
    /// Excel workbook (.xlsx), or a MATLAB or HDF5 file; if omitted, the
    /// job file has a placeholder for it
    #[arg(value_name = "CSV")]
    pub(crate) velocities: Option<PathBuf>,
    /// New job file, or - to print it [default: the CSV file's name with .toml, or job.toml]
    #[arg(long, short = 'o', value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Also write job.schema.json beside the job file, unless it is there, and name it in the job file's first line,
    /// so that editors complete and check the keys
    #[arg(long)]
    pub(crate) schema: bool,
}

/// Longest span that a command line may ask for, s: a year.
pub(crate) const SECONDS_MAX: f64 = 366.0 * 86_400.0;

/// Longest age that a command line may ask for, s: a century.
const AGE_S_MAX: f64 = 100.0 * SECONDS_MAX;

/// Longest distance that a command line may ask for, m.
const LENGTH_MAX: f64 = 1.0;

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err("it must be a number above 0 (s)".to_owned()),
    }
}

fn length(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number <= LENGTH_MAX => Ok(number),
        _ => Err(format!("it must be a number above 0 and at most {LENGTH_MAX} (m)")),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number <= SECONDS_MAX => Ok(number),
        _ => Err(format!("it must be a number above 0 and at most {SECONDS_MAX} (s)")),
    }
}

pub(crate) fn age(text: &str) -> Result<Duration, String> {
    let unit = text.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
    let seconds = match unit {
        "s" => 1.0,
        "min" => 60.0,
        "h" => 3600.0,
        "d" => 86_400.0,
        _ => f64::NAN,
    };
    let number: Option<f64> = text[..text.len() - unit.len()].parse().ok();
    number
        .map(|number| number * seconds)
        .filter(|age| *age <= AGE_S_MAX)
        .and_then(|age| Duration::try_from_secs_f64(age).ok())
        .ok_or_else(|| {
            "it must be a number with the unit s, min, h or d (for example 90min or \
                        30d)"
                .to_owned()
        })
}

pub(crate) fn job_name(text: &str) -> Result<String, String> {
    let max = osteon_common::limits::NAME_BYTES_MAX;
    if text.len() > max || text.chars().any(char::is_control) {
        return Err(format!("it must have at most {max} bytes and no control characters"));
    }
    Ok(text.to_owned())
}

fn probe_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (0.1..=60.0).contains(&number) => Ok(number),
        _ => Err("it must be a number from 0.1 to 60 (s)".to_owned()),
    }
}

fn request_id(text: &str) -> Result<String, String> {
    let max = osteon_common::limits::NAME_BYTES_MAX;
    if text.is_empty() || text.len() > max {
        return Err(format!("it must have 1 to {max} bytes"));
    }
    Ok(text.to_owned())
}

#[cfg(test)]
mod tests;
