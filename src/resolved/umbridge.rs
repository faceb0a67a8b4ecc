//! `umbridge`, with environment and defaults resolved.

use std::net::SocketAddr;

use anyhow::anyhow;
use osteon_client::environment::Environment;
use osteon_http::OwnHosts;
use osteon_proto::credentials::CredentialFiles;
use osteon_proto::identity::host_name;
use osteon_solver::Isa;

use crate::arguments::{JobFileArguments, UmbridgeArguments};
use crate::exit_status::CommandFailure;

use super::{Locating, RunLocation};

/// The protocol's usual port.
const PORT_DEFAULT: u16 = 4242;
/// The variable by which load balancers choose the port.
const PORT_VARIABLE: &str = "PORT";

/// A server of a job's models.
#[derive(Debug)]
pub(crate) struct ModelService {
    /// The job file.
    pub(crate) job: JobFileArguments,
    /// Address to listen on.
    pub(crate) address: SocketAddr,
    /// Hosts that requests may name.
    pub(crate) hosts: OwnHosts,
    /// Where points are evaluated.
    pub(crate) location: RunLocation,
    /// The instruction set to compute single cases on.
    pub(crate) isa: Isa,
}

/// Resolves the arguments.
pub(super) fn service(
    arguments: UmbridgeArguments,
    environment: &Environment,
    cores: u32,
    isa: Isa,
) -> Result<ModelService, CommandFailure> {
    let UmbridgeArguments {
        job,
        port,
        address,
        http_host,
        workers,
        threads,
        coordinator,
        credentials,
    } = arguments;
    let port = match port {
        Some(port) => port,
        None => port_of(std::env::var(PORT_VARIABLE).ok())?,
    };
    let files = CredentialFiles::from(credentials);
    let location =
        Locating { workers, threads, coordinator, files }.location(cores, environment)?;
    let (address, hosts) = (SocketAddr::new(address, port), OwnHosts::new(host_name(), http_host));
    Ok(ModelService { job, address, hosts, location, isa })
}

/// Returns the port that the environment names; an empty variable counts as unset.
fn port_of(variable: Option<String>) -> Result<u16, CommandFailure> {
    match variable.filter(|text| !text.is_empty()) {
        None => Ok(PORT_DEFAULT),
        Some(text) => text.parse().map_err(|_| {
            CommandFailure::bad_input(anyhow!(
                "in {PORT_VARIABLE}: {text:?} is not a port, which is a whole number from 0 to 65535"
            ))
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_port_of_the_environment_is_a_port() {
        let port = |text: Option<&str>| port_of(text.map(str::to_owned)).ok();
        assert_eq!(port(None), Some(4242));
        assert_eq!(port(Some("")), Some(4242));
        assert_eq!(port(Some("0")), Some(0));
        assert_eq!(port(Some("50051")), Some(50051));
        for wrong in ["x", "65536", "-1", "80 "] {
            assert_eq!(port(Some(wrong)), None, "{wrong}");
        }
    }
}
