//! Options of the services: coordinator and worker.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use osteon_coordinator::ListenAddress;
use osteon_transport::endpoint::Endpoint;

use super::{CredentialArguments, age, seconds};
use crate::wings::PageOptions;

/// Arguments of `coordinator`.
#[derive(Debug, Args)]
pub(crate) struct CoordinatorArguments {
    /// Address to listen on: HOST:PORT (port 0 selects a free port) or unix:PATH
    #[arg(long, value_name = "ADDR")]
    pub(crate) listen: String,
    /// Directory of the store. The URL at which clients reach the coordinator is written to
    /// DIR/address
    #[arg(long, value_name = "DIR")]
    pub(crate) store: PathBuf,
    /// Serve on addresses other than loopback without TLS: anyone who can reach the address can use
    /// the coordinator
    #[arg(long, conflicts_with_all = ["tls_ca", "tls_cert", "tls_key", "tokens", "token_file"])]
    pub(crate) insecure: bool,
    /// Serve with TLS: certificates of the authorities that sign workers' certificates (PEM)
    #[arg(long, value_name = "FILE", requires_all = ["tls_cert", "tls_key"])]
    pub(crate) tls_ca: Option<PathBuf>,
    /// The coordinator's certificate (PEM)
    #[arg(long, value_name = "FILE", requires_all = ["tls_ca", "tls_key"])]
    pub(crate) tls_cert: Option<PathBuf>,
    /// Private key of the certificate (PEM)
    #[arg(long, value_name = "FILE", requires_all = ["tls_ca", "tls_cert"])]
    pub(crate) tls_key: Option<PathBuf>,
    /// List of the tokens that clients may use, one line NAME ROLE HASH each (see `osteon token`).
    /// On SIGHUP the coordinator reads the list and the certificates again
    #[arg(long, value_name = "FILE")]
    pub(crate) tokens: Option<PathBuf>,
    /// File with an additional client token, which has the role admin
    #[arg(long, value_name = "FILE")]
    pub(crate) token_file: Option<PathBuf>,
    /// Fraction (0 to 1) of the realizations that another host also computes, to detect machines that
    /// return wrong results
    #[arg(long, value_name = "F", default_value_t = osteon_coordinator::config::AUDIT_FRACTION,
          value_parser = fraction)]
    pub(crate) audit_fraction: f64,
    /// Do not compute in advance, on idle threads, points that a search may request next. Results
    /// are the same either way
    #[arg(long)]
    pub(crate) no_speculation: bool,
    /// Delete ended jobs (converged, failed or cancelled) after this long: number and unit, e.g. 90d
    /// (s, min, h or d) [default: never]
    #[arg(long, value_name = "AGE", value_parser = age)]
    pub(crate) keep_ended: Option<Duration>,
    /// Start even if the store has lost accepted jobs; without this option the coordinator refuses
    /// to start
    #[arg(long)]
    pub(crate) accept_lost_jobs: bool,
    /// Time without a message after which a worker's batches are reassigned (seconds, 1 to 3600).
    /// Heartbeats are sent five times per lease
    #[arg(long, value_name = "S", default_value = "10", value_parser = lease)]
    pub(crate) lease: Duration,
    /// Export metrics for Prometheus at http://ADDR/metrics (IP:PORT; port 0 selects a free port).
    /// They name no user, job or host; everyone who can reach the address can read them. The URL is
    /// written to DIR/metrics-address [default: none]
    #[arg(long, value_name = "ADDR", value_parser = tcp_address)]
    pub(crate) metrics: Option<SocketAddr>,
    /// The live page.
    #[command(flatten)]
    pub(crate) page: PageOptions,
    /// Format of the log on stderr
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t = LogFormat::Text)]
    pub(crate) log_format: LogFormat,
}

/// Arguments of `worker`.
#[derive(Debug, Args)]
pub(crate) struct WorkerArguments {
    /// The coordinator: https://HOST:PORT, http://HOST:PORT or unix:PATH [env: OSTEON_COORDINATOR]
    #[arg(long, value_name = "URL")]
    pub(crate) coordinator: Option<Endpoint>,
    /// Credentials for the coordinator.
    #[command(flatten)]
    pub(crate) credentials: CredentialArguments,
    /// Name of the machine: all its workers have one vote, and are banned together [env: OSTEON_HOST]
    /// [default: the host name]
    #[arg(long, value_name = "NAME", value_parser = clap::builder::NonEmptyStringValueParser::new())]
    pub(crate) host: Option<String>,
    /// Number of threads to compute on [default: all cores]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) threads: Option<u32>,
    /// Exit if no coordinator can be reached for this many seconds [default: never]
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub(crate) give_up_after: Option<f64>,
    /// Finish the current work and exit after this many seconds [default: never]
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub(crate) time_limit: Option<f64>,
    /// Exit after this many seconds without work, or without a coordinator [default: never]
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub(crate) idle_timeout: Option<f64>,
    /// Format of the log on stderr
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t = LogFormat::Text)]
    pub(crate) log_format: LogFormat,
}

/// Format of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum LogFormat {
    /// Lines for people.
    #[value(help = None)]
    Text,
    /// One JSON object in each line.
    #[value(help = None)]
    Json,
}

pub(super) fn lease(text: &str) -> Result<Duration, String> {
    match text.parse::<f64>() {
        Ok(number) if (1.0..=3600.0).contains(&number) => Ok(Duration::from_secs_f64(number)),
        _ => Err("it must be a number from 1 to 3600 (s)".to_owned()),
    }
}

fn tcp_address(text: &str) -> Result<SocketAddr, String> {
    only_tcp(text, "Prometheus")
}

/// Reads an address for `reader`, which cannot use a Unix socket.
pub(crate) fn only_tcp(text: &str, reader: &str) -> Result<SocketAddr, String> {
    match text.parse() {
        Ok(ListenAddress::Tcp(address)) => Ok(address),
        Ok(ListenAddress::Unix(_)) => {
            Err(format!("{reader} cannot read from a Unix socket; write IP:PORT"))
        }
        Err(error) => Err(error.to_string()),
    }
}

fn fraction(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (0.0..=1.0).contains(&number) => Ok(number),
        _ => Err("it must be a number from 0 to 1".to_owned()),
    }
}
