//! `slurm script` and `slurm array`: print batch scripts.

use osteon_client::results_directory::ResultsDirectory;
use osteon_files::job_file;
use osteon_proto::credentials::Credentials;
use osteon_proto::endpoint::Endpoint;
use osteon_slurm::job_script::JobScript;
use osteon_slurm::worker_script::WorkerScript;

use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output;
use crate::progress::say;
use crate::resolved::{OutputFormat, WorkerArray};

/// Name of array workers in Slurm's queue.
const ARRAY_NAME: &str = "osteon-worker";

/// `slurm script`: checks the job file, and prints the script.
pub(super) fn job(script: &JobScript) -> Result<ExitStatus, CommandFailure> {
    // Errors are told here, and not by a job that has waited for its nodes.
    let specification =
        job_file::read(&script.job, script.kind).map_err(CommandFailure::bad_input)?;
    ResultsDirectory::stored(&script.out, &specification)?;
    print(&script.text().map_err(CommandFailure::bad_input)?)
}

/// `slurm array`: prints the script.
pub(super) fn array(array: &WorkerArray) -> Result<ExitStatus, CommandFailure> {
    let WorkerArray { script, count } = array;
    check_workers(script)?;
    print(&script.text(ARRAY_NAME, *count, false).map_err(CommandFailure::bad_input)?)
}

/// Checks what the workers will need: the files, and an address that other machines can reach.
pub(super) fn check_workers(script: &WorkerScript) -> Result<(), CommandFailure> {
    Credentials::load(&script.files, &script.endpoint).map_err(CommandFailure::bad_input)?;
    if script.endpoint.is_local() || matches!(script.endpoint, Endpoint::Unix(_)) {
        say(&format!(
            "warning: workers on other machines cannot reach {}; start the coordinator on an address \
             of the network (docs/network.md)",
            script.endpoint
        ));
    }
    Ok(())
}

/// Prints a text as it is.
pub(super) fn print(text: &str) -> Result<ExitStatus, CommandFailure> {
    output::stdout(OutputFormat::Text).verbatim(text).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}
