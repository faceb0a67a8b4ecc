//! What the words of a command line are resolved against: the environment of this process, and its
//! machine.

use anyhow::anyhow;
use osteon_client::client::Remote;
use osteon_client::environment::Environment;
use osteon_solver::Isa;
use osteon_transport::credentials::CredentialFiles;
use osteon_transport::endpoint::Endpoint;

use crate::arguments::{ClientArguments, CredentialArguments};
use crate::exit_status::CommandFailure;

/// Default number of worker processes of a run on this machine.
pub(crate) const WORKERS_DEFAULT: u32 = 2;

/// The environment of this process, and its machine.
pub(crate) struct ProcessContext {
    /// The environment.
    pub(crate) environment: Environment,
    /// Number of this machine's cores.
    pub(crate) cores: u32,
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

/// The options that say where a job is computed.
pub(crate) struct Locating {
    pub(crate) workers: Option<u32>,
    pub(crate) threads: Option<u32>,
    pub(crate) coordinator: Option<Endpoint>,
    pub(crate) credentials: CredentialArguments,
}

impl ProcessContext {
    /// Reads those of this process.
    ///
    /// # Errors
    /// When the environment holds something that cannot be meant.
    pub(crate) fn from_process() -> Result<Self, CommandFailure> {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let cores = u32::try_from(cores).unwrap_or(1);
        Ok(Self { environment: Environment::from_process()?, cores })
    }

    /// Returns the instruction set to compute on.
    ///
    /// # Errors
    /// When the environment names one that this machine has not.
    pub(crate) fn isa() -> Result<Isa, CommandFailure> {
        Isa::chosen(std::env::var_os(Isa::VARIABLE)).map_err(CommandFailure::bad_input)
    }

    /// Finds the coordinator that the arguments or the environment name.
    ///
    /// # Errors
    /// When neither names one.
    pub(crate) fn remote(&self, client: ClientArguments) -> Result<Remote, CommandFailure> {
        let from_environment = client.coordinator.is_none();
        let endpoint = self.environment.required_coordinator(client.coordinator)?;
        let (files, unused) = self.environment.files(client.credentials.into(), &endpoint);
        Ok(Remote { endpoint, files, from_environment, unused })
    }

    /// Finds where a job is computed.
    ///
    /// # Errors
    /// When there are credentials, and no coordinator that they are for.
    pub(crate) fn locate(&self, options: Locating) -> Result<RunLocation, CommandFailure> {
        let Locating { workers, threads, coordinator, credentials } = options;
        let files = CredentialFiles::from(credentials);
        let local = workers.is_some() || threads.is_some();
        let from_environment = coordinator.is_none();
        let endpoint = match coordinator {
            None if !local => self.environment.coordinator()?,
            given => given,
        };
        match (endpoint, files.first_given()) {
            (Some(endpoint), _) => {
                let (files, unused) = self.environment.files(files, &endpoint);
                let remote = Remote { endpoint, files, from_environment, unused };
                Ok(RunLocation::Coordinator(remote))
            }
            (None, Some(option)) => Err(CommandFailure::bad_input(anyhow!(
                "{option} requires a coordinator; add --coordinator URL"
            ))),
            (None, None) => {
                let workers = workers.unwrap_or(WORKERS_DEFAULT);
                let threads = threads.unwrap_or((self.cores / workers).max(1));
                Ok(RunLocation::Local { workers, threads })
            }
        }
    }
}

impl From<CredentialArguments> for CredentialFiles {
    fn from(arguments: CredentialArguments) -> Self {
        let CredentialArguments { tls_ca, tls_cert, tls_key, token_file } = arguments;
        Self { ca: tls_ca, certificate: tls_cert, key: tls_key, token: token_file }
    }
}
