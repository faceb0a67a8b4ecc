//! Arguments of `umbridge`.

use std::net::IpAddr;

use clap::Args;
use osteon_transport::endpoint::Endpoint;

use crate::arguments::{CredentialArguments, JobFileArguments};
use crate::wings::host_name::host_name;

/// Arguments of `umbridge`.
#[derive(Debug, Args)]
pub(crate) struct UmbridgeArguments {
    /// The job.
    #[command(flatten)]
    pub(super) job: JobFileArguments,
    /// Port to listen on; 0 selects a free one [env: PORT] [default: 4242]
    #[arg(long, value_name = "PORT")]
    pub(super) port: Option<u16>,
    /// IP address to listen on. Anyone who can reach it can use the server: there is no encryption
    /// and no access control
    #[arg(long, value_name = "IP", default_value = "127.0.0.1")]
    pub(super) address: IpAddr,
    /// Answer requests that name this host, too, e.g. that of a container or a proxy; can be repeated.
    /// Addresses, localhost and the name of this machine are always answered
    #[arg(long, value_name = "NAME", value_parser = host_name)]
    pub(super) http_host: Vec<String>,
    /// Number of worker processes to start on this machine [default: 2]
    #[arg(long, value_name = "N", conflicts_with = "coordinator",
          value_parser = clap::value_parser!(u32).range(1..=256))]
    pub(super) workers: Option<u32>,
    /// Number of threads of each worker [default: cores / N, at least 1]
    #[arg(long, value_name = "T", conflicts_with = "coordinator",
          value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(super) threads: Option<u32>,
    /// Have points evaluated by this coordinator instead of on this machine, each as a job of its own:
    /// https://HOST:PORT, http://HOST:PORT or unix:PATH
    ///
    /// If omitted, the environment variable OSTEON_COORDINATOR is used, unless --workers or
    /// --threads is given.
    #[arg(long, value_name = "URL")]
    pub(super) coordinator: Option<Endpoint>,
    /// Credentials for the coordinator.
    #[command(flatten)]
    pub(super) credentials: CredentialArguments,
}
