//! The live page: options of runs and of the coordinator.

use std::net::SocketAddr;

use clap::Args;
use osteon_coordinator::{Listener, PageBindError};

use super::host_name::host_name;
use crate::arguments::services::only_tcp;
use crate::exit_status::CommandFailure;

/// Option of a run.
#[derive(Debug, Clone, PartialEq, Eq, Args)]
pub(crate) struct RunPageOption {
    /// Show the run in a browser while it lasts: serve the live page at ADDR, a loopback address
    /// (127.0.0.1:PORT; port 0 selects a free port). Its URL is printed on stderr. The job is run on
    /// this machine
    #[arg(long, value_name = "ADDR", conflicts_with = "coordinator", value_parser = own_page_address)]
    http: Option<SocketAddr>,
}

impl RunPageOption {
    /// Returns the address of the page, if there is to be one.
    pub(crate) fn address(&self) -> Option<SocketAddr> {
        self.http
    }
}

/// Options of the coordinator.
#[derive(Debug, Args)]
pub(crate) struct PageOptions {
    /// Serve the live page at ADDR (IP:PORT; port 0 selects a free port), with the coordinator's
    /// certificates and for the holders of its tokens. Its URL is written to DIR/http-address
    /// [default: none]
    #[arg(long, value_name = "ADDR", value_parser = page_address)]
    http: Option<SocketAddr>,
    /// Answer browsers that ask for the live page by this name, too, e.g. that of a proxy. Only
    /// needed without tokens; can be repeated
    #[arg(long, value_name = "NAME", requires = "http", value_parser = host_name)]
    http_host: Vec<String>,
}

impl PageOptions {
    /// Adds the page to what a coordinator serves, if there is to be one.
    ///
    /// # Errors
    /// When its address cannot be served.
    pub(crate) async fn add_to(
        &self,
        to: Listener,
        insecure: bool,
    ) -> Result<Listener, CommandFailure> {
        let Some(address) = self.http else { return Ok(to) };
        to.with_page(address, insecure, self.http_host.clone()).await.map_err(|error| match error {
            PageBindError::Refused { .. } => CommandFailure::failed(error),
            _ => CommandFailure::bad_input(error),
        })
    }
}

fn page_address(text: &str) -> Result<SocketAddr, String> {
    only_tcp(text, "a browser")
}

/// Reads the address of the page of a run, which has no certificates.
fn own_page_address(text: &str) -> Result<SocketAddr, String> {
    let address = page_address(text)?;
    let advice = "a run shows its page on this machine only; write 127.0.0.1:PORT or [::1]:PORT, and \
                  reach it from elsewhere by ssh -L";
    if address.ip().is_loopback() { Ok(address) } else { Err(advice.to_owned()) }
}
