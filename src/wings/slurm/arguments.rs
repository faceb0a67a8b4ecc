//! Options of the commands that make or submit batch scripts of Slurm.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand};

use crate::arguments::{ClientArguments, SECONDS_MAX, age, job_name};

/// Largest number of workers that one command may ask for.
const WORKERS_MAX: i64 = 4096;

/// Arguments of `slurm`.
#[derive(Debug, Args)]
pub(crate) struct SlurmArguments {
    /// The script to print.
    #[command(subcommand)]
    pub(crate) command: SlurmCommand,
}

/// Kinds of scripts.
#[derive(Debug, Subcommand)]
pub(crate) enum SlurmCommand {
    /// Print a batch script that runs one job on several nodes: coordinator, workers and results
    ///
    /// Shortly before its time limit the job stops and is queued again; it continues from its store.
    /// The store and the results must be in directories that all nodes see.
    Script(JobScriptArguments),
    /// Print a batch script of workers that join a running coordinator: a job array
    Array(WorkerArrayArguments),
}

/// Arguments of `slurm script`.
#[derive(Debug, Args)]
pub(crate) struct JobScriptArguments {
    /// Job file (TOML or JSON)
    pub(crate) job: PathBuf,
    /// Run a propagation instead of an identification
    #[arg(long)]
    pub(crate) propagate: bool,
    /// Number of nodes
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=WORKERS_MAX))]
    pub(crate) nodes: u32,
    /// Number of processors on each node [default: all; the nodes are then used exclusively]
    #[arg(long, value_name = "C", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) cpus_per_node: Option<u32>,
    /// Time limit of one allocation: number and unit, e.g. 12h (s, min, h or d) [default: that of
    /// the partition]
    #[arg(long, value_name = "T", value_parser = age)]
    pub(crate) time_limit: Option<Duration>,
    /// Partition [default: Slurm's default]
    #[arg(long, value_name = "NAME")]
    pub(crate) partition: Option<String>,
    /// Directory of the coordinator's store, from which the job continues [default: the name of the
    /// job file with -store]
    #[arg(long, value_name = "DIR")]
    pub(crate) store: Option<PathBuf>,
    /// Directory for the results [default: the name of the job file]
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Name of the job, in Slurm's queue and in logs [default: the name of the job file]
    #[arg(long, value_name = "TEXT", value_parser = job_name)]
    pub(crate) name: Option<String>,
    /// How often the job may be queued again, after its time limit or the loss of a node
    #[arg(long, value_name = "N", default_value_t = 3,
          value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub(crate) max_requeues: u32,
    /// Time before the time limit at which the job stops and is queued again (seconds)
    #[arg(long, value_name = "S", default_value_t = 90,
          value_parser = clap::value_parser!(u32).range(60..=3600))]
    pub(crate) stop_before: u32,
    /// Program osteon, as the nodes see it [default: this program]
    #[arg(long, value_name = "FILE")]
    pub(crate) program: Option<PathBuf>,
    /// Further options of sbatch, e.g. -- --account=NAME
    #[arg(last = true, value_name = "SBATCH_OPTION")]
    pub(crate) further: Vec<String>,
}

/// Arguments of `slurm array`.
#[derive(Debug, Args)]
pub(crate) struct WorkerArrayArguments {
    /// Number of workers
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=WORKERS_MAX))]
    pub(crate) count: u32,
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// The allocation of each worker.
    #[command(flatten)]
    pub(crate) allocation: AllocationArguments,
}

/// The allocation of a worker.
#[derive(Debug, Args)]
pub(crate) struct AllocationArguments {
    /// Number of processors, and of threads, of each worker
    #[arg(long, value_name = "C", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) cpus_per_worker: u32,
    /// Time limit of each worker's allocation, at least 2min: number and unit (s, min, h or d). The
    /// worker leaves a minute before
    #[arg(long, value_name = "T", default_value = "1h", value_parser = allocation_time)]
    pub(crate) time_limit: Duration,
    /// Time over which the ends of workers that begin together are spread, at most half of the time
    /// limit [default: a tenth of it]
    #[arg(long, value_name = "T", value_parser = age)]
    pub(crate) stagger: Option<Duration>,
    /// Time without work, or without a coordinator, after which a worker ends
    #[arg(long, value_name = "T", default_value = "10min", value_parser = idle_time)]
    pub(crate) idle_timeout: Duration,
    /// Partition [default: Slurm's default]
    #[arg(long, value_name = "NAME")]
    pub(crate) partition: Option<String>,
    /// Program osteon, as the nodes see it [default: this program]
    #[arg(long, value_name = "FILE")]
    pub(crate) program: Option<PathBuf>,
    /// Further options of sbatch, e.g. -- --account=NAME
    #[arg(last = true, value_name = "SBATCH_OPTION")]
    pub(crate) further: Vec<String>,
}

/// Arguments of `worker slurm`.
#[derive(Debug, Args)]
pub(crate) struct ScalingArguments {
    /// Number of workers that are kept without work, too
    #[arg(long, value_name = "N", default_value_t = 0,
          value_parser = clap::value_parser!(u32).range(0..=WORKERS_MAX))]
    pub(crate) min: u32,
    /// Largest number of workers, those that wait in Slurm's queue included
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=WORKERS_MAX))]
    pub(crate) max: u32,
    /// Largest number of workers that wait in Slurm's queue
    #[arg(long, value_name = "N", default_value_t = 4,
          value_parser = clap::value_parser!(u32).range(1..=WORKERS_MAX))]
    pub(crate) backlog: u32,
    /// Number of realizations of an evaluation that make a thread worth while
    #[arg(long, value_name = "N", default_value_t = 16,
          value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) realizations_per_thread: u32,
    /// Time between two looks at coordinator and queue (seconds)
    #[arg(long, value_name = "S", default_value_t = 15,
          value_parser = clap::value_parser!(u32).range(1..=3600))]
    pub(crate) interval: u32,
    /// Print what would be done now, and the script that would be submitted; change nothing
    #[arg(long)]
    pub(crate) dry_run: bool,
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// The allocation of each worker.
    #[command(flatten)]
    pub(crate) allocation: AllocationArguments,
}

fn allocation_time(text: &str) -> Result<Duration, String> {
    let limit = age(text)?;
    match limit >= Duration::from_secs(120) {
        true => Ok(limit),
        false => Err("it must be at least 2min".to_owned()),
    }
}

fn idle_time(text: &str) -> Result<Duration, String> {
    let limit = age(text)?;
    match (1.0..=SECONDS_MAX).contains(&limit.as_secs_f64()) {
        true => Ok(limit),
        false => Err("it must be from 1s to 366d".to_owned()),
    }
}
