//! `umbridge`, with environment and defaults resolved.

use std::net::SocketAddr;

use anyhow::anyhow;
use osteon_proto::identity::host_name;
use osteon_solver::Isa;
use osteon_umbridge::OwnHosts;

use super::arguments::UmbridgeArguments;
use crate::arguments::JobFileArguments;
use crate::exit_status::CommandFailure;
use crate::process_context::{Locating, ProcessContext, RunLocation};

/// The protocol's usual port.
const PORT_DEFAULT: u16 = 4242;
/// The variable by which load balancers choose the port.
const PORT_VARIABLE: &str = "PORT";

/// A server of a job's models.
#[derive(Debug)]
pub(super) struct ModelService {
    /// The job file.
    pub(super) job: JobFileArguments,
    /// Address to listen on.
    pub(super) address: SocketAddr,
    /// Hosts that requests may name.
    pub(super) hosts: OwnHosts,
    /// Where points are evaluated.
    pub(super) location: RunLocation,
    /// The instruction set to compute single cases on.
    pub(super) isa: Isa,
}

/// Resolves the arguments.
pub(super) fn service(
    arguments: UmbridgeArguments,
    context: &ProcessContext,
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
    let location = context.locate(Locating { workers, threads, coordinator, credentials })?;
    let (address, hosts) = (SocketAddr::new(address, port), OwnHosts::new(host_name(), http_host));
    Ok(ModelService { job, address, hosts, location, isa: ProcessContext::isa()? })
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
