//! What the command line means: environment and defaults resolved, files not yet read.

use std::path::PathBuf;
use std::time::Duration;

use osteon_common::job::JobKind;
use osteon_proto::endpoint::Endpoint;
use osteon_worker::WorkerConfig;

use crate::arguments::{
    Arguments, ClientArguments, Command, CoordinatorArguments, DrawArguments, RunArguments,
    SimulateArguments, SubmitArguments, WorkerArguments,
};
use crate::ending::Failure;

/// Worker processes of a run on this machine, unless given.
const WORKERS_DEFAULT: u32 = 2;

/// Format of what goes to stdout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    /// For people.
    Text,
    /// For programs.
    Json,
}

/// What is to be done.
#[derive(Debug)]
pub(crate) enum Resolved {
    /// `identify`, `propagate`.
    Run(Run),
    /// `simulate`.
    Simulate(SimulateArguments),
    /// `draw`.
    Draw(DrawArguments),
    /// `coordinator`.
    Coordinator(CoordinatorArguments),
    /// `worker`.
    Worker(WorkerConfig),
    /// `submit`.
    Submit {
        /// The job file.
        job: PathBuf,
        /// What the job does.
        kind: JobKind,
        /// Empty: a new job.
        request_id: String,
        /// Where to.
        coordinator: Endpoint,
        /// How to print.
        format: Format,
    },
    /// `jobs`.
    Jobs {
        /// Of whom.
        coordinator: Endpoint,
        /// How to print.
        format: Format,
    },
    /// `watch`.
    Watch {
        /// Id of the job.
        job: String,
        /// Of whom.
        coordinator: Endpoint,
    },
    /// `cancel`.
    Cancel {
        /// Id of the job.
        job: String,
        /// Of whom.
        coordinator: Endpoint,
    },
    /// `fetch`.
    Fetch {
        /// Id of the job.
        job: String,
        /// Of whom.
        coordinator: Endpoint,
        /// Where to.
        out: PathBuf,
    },
}

/// One run of a job, from its file to its result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Run {
    /// What the job does.
    pub(crate) kind: JobKind,
    /// The job file.
    pub(crate) job: PathBuf,
    /// Who computes.
    pub(crate) place: Place,
    /// Where results are kept, if anywhere.
    pub(crate) out: Option<PathBuf>,
    /// How to print.
    pub(crate) format: Format,
}

/// Who computes a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Place {
    /// Worker processes of this one.
    Here {
        /// How many.
        workers: u32,
        /// Threads of each.
        threads: u32,
    },
    /// A running coordinator.
    There(Endpoint),
}

impl Resolved {
    /// Resolves `arguments`.
    ///
    /// # Errors
    /// When the environment holds something that cannot be meant.
    pub(crate) fn from_arguments(arguments: Arguments) -> Result<Self, Failure> {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let cores = u32::try_from(cores).unwrap_or(1);
        let environment = std::env::var("OSTEON_COORDINATOR").ok();
        Ok(match arguments.command {
            Command::Identify(run) => {
                Self::Run(resolve_run(JobKind::Identification, run, cores, environment)?)
            }
            Command::Propagate(run) => {
                Self::Run(resolve_run(JobKind::Propagation, run, cores, environment)?)
            }
            Command::Simulate(arguments) => Self::Simulate(arguments),
            Command::Draw(arguments) => Self::Draw(arguments),
            Command::Coordinator(arguments) => Self::Coordinator(arguments),
            Command::Worker(arguments) => Self::Worker(resolve_worker(arguments, cores)),
            Command::Submit(arguments) => resolve_submit(arguments),
            Command::Jobs(arguments) => Self::Jobs {
                coordinator: arguments.client.coordinator,
                format: format(arguments.json),
            },
            Command::Watch(arguments) => {
                Self::Watch { job: arguments.job, coordinator: arguments.client.coordinator }
            }
            Command::Cancel(arguments) => {
                Self::Cancel { job: arguments.job, coordinator: arguments.client.coordinator }
            }
            Command::Fetch(arguments) => Self::Fetch {
                job: arguments.job,
                coordinator: arguments.client.coordinator,
                out: arguments.out,
            },
        })
    }

    /// Services tell what happens; commands only what is wrong.
    pub(crate) fn default_log_level(&self) -> &'static str {
        match self {
            Self::Coordinator(_) | Self::Worker(_) => "info",
            _ => "warn",
        }
    }
}

/// Text or JSON.
pub(crate) fn format(json: bool) -> Format {
    if json { Format::Json } else { Format::Text }
}

fn resolve_run(
    kind: JobKind,
    arguments: RunArguments,
    cores: u32,
    environment: Option<String>,
) -> Result<Run, Failure> {
    let RunArguments { job, workers, threads, coordinator, out, json } = arguments;
    let here = workers.is_some() || threads.is_some();
    let environment = environment.filter(|url| !url.is_empty());
    let there = match (coordinator, environment) {
        (Some(endpoint), _) => Some(endpoint),
        (None, Some(url)) if !here => Some(url.parse::<Endpoint>().map_err(|error| {
            Failure::bad_input(anyhow::Error::new(error).context("in OSTEON_COORDINATOR"))
        })?),
        _ => None,
    };
    let place = there.map_or_else(
        || {
            let workers = workers.unwrap_or(WORKERS_DEFAULT);
            Place::Here { workers, threads: threads.unwrap_or((cores / workers).max(1)) }
        },
        Place::There,
    );
    Ok(Run { kind, job, place, out, format: format(json) })
}

fn resolve_worker(arguments: WorkerArguments, cores: u32) -> WorkerConfig {
    WorkerConfig {
        endpoint: arguments.coordinator,
        threads: arguments.threads.unwrap_or(cores),
        give_up_after: arguments.give_up_after.map(Duration::from_secs_f64),
        time_limit: arguments.time_limit.map(Duration::from_secs_f64),
    }
}

fn resolve_submit(arguments: SubmitArguments) -> Resolved {
    let SubmitArguments { job, client, propagate, request_id, json } = arguments;
    let ClientArguments { coordinator } = client;
    Resolved::Submit {
        job,
        kind: if propagate { JobKind::Propagation } else { JobKind::Identification },
        request_id: request_id.unwrap_or_default(),
        coordinator,
        format: format(json),
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;

    fn run(line: &str, cores: u32, environment: Option<&str>) -> Run {
        let words = line.split_whitespace();
        let command = Arguments::try_parse_from(words).unwrap().command;
        let (Command::Identify(arguments) | Command::Propagate(arguments)) = command else {
            panic!("{line} is no run");
        };
        let environment = environment.map(str::to_owned);
        resolve_run(JobKind::Identification, arguments, cores, environment).unwrap()
    }

    fn here(line: &str, cores: u32) -> (u32, u32) {
        match run(line, cores, None).place {
            Place::Here { workers, threads } => (workers, threads),
            Place::There(endpoint) => panic!("{endpoint}"),
        }
    }

    #[test]
    fn threads_share_the_cores() {
        assert_eq!(here("osteon identify a.toml", 8), (2, 4));
        assert_eq!(here("osteon identify a.toml", 1), (2, 1));
        assert_eq!(here("osteon identify a.toml --workers 3", 8), (3, 2));
        assert_eq!(here("osteon identify a.toml --workers 1", 8), (1, 8));
        assert_eq!(here("osteon propagate a.toml --threads 5", 8), (2, 5));
        assert_eq!(here("osteon identify a.toml --workers 16", 8), (16, 1));
    }

    #[test]
    fn the_flag_counts_before_the_environment() {
        let there = |line: &str, environment| match run(line, 2, environment).place {
            Place::There(endpoint) => Some(endpoint.to_string()),
            Place::Here { .. } => None,
        };
        let environment = Some("unix:/run/osteon");
        let flag = "osteon identify a.toml --coordinator http://a:1";
        assert_eq!(there("osteon identify a.toml", None), None);
        assert_eq!(there("osteon identify a.toml", Some("")), None);
        assert_eq!(there("osteon identify a.toml", environment), Some("unix:/run/osteon".into()));
        assert_eq!(there(flag, environment), Some("http://a:1".into()));
        assert_eq!(there("osteon identify a.toml --workers 1", environment), None);
    }

    #[test]
    fn an_environment_that_is_no_address_is_bad_input() {
        let words = ["osteon", "identify", "a.toml"];
        let Command::Identify(arguments) = Arguments::try_parse_from(words).unwrap().command else {
            panic!("no run");
        };
        let failure =
            resolve_run(JobKind::Identification, arguments, 2, Some("nowhere".to_owned()))
                .unwrap_err();
        assert_eq!(failure.exit_code(), 2);
        assert!(failure.to_string().contains("OSTEON_COORDINATOR"), "{failure}");
        assert!(failure.to_string().contains("`nowhere`"), "{failure}");
    }
}
