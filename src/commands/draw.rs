//! `draw`: one realization of a job as a complete case file.

use anyhow::anyhow;
use osteon_client::job_point;
use osteon_common::job::JobKind;
use osteon_files::{case_file, job_file};

use crate::arguments::{DrawArguments, PlaceArguments};
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output;
use crate::prepared_command::Ended;
use crate::resolved::OutputFormat;

/// Prints the case file.
pub(super) fn draw(arguments: &DrawArguments) -> Ended {
    let input = arguments.job.open().map_err(CommandFailure::bad_input)?;
    let noted =
        job_file::of_input(&input, JobKind::Propagation).map_err(CommandFailure::bad_input)?;
    let specification = noted.specification;
    let (index, count) = (arguments.index, specification.monte_carlo.realizations);
    if index >= count {
        return Err(CommandFailure::bad_input(anyhow!(
            "--index {index} is beyond the job's {count} realizations; it must be 0 to {}",
            count - 1
        )));
    }
    let PlaceArguments { at, group } = &arguments.place;
    let point = job_point::choose(at.as_deref(), group.as_deref(), &input, &specification)
        .map_err(CommandFailure::BadInput)?;
    let ensemble = specification.ensemble(&point).map_err(CommandFailure::bad_input)?;
    let drawn = ensemble.realization(index, &specification.setup).map_err(|error| {
        CommandFailure::failed(anyhow::Error::new(error).context(format!(
            "realization {index} has no finite elasticity matrix (failure not_finite)"
        )))
    })?;
    let text = case_file::to_toml(&drawn.into_case(&specification.setup));
    output::stdout(OutputFormat::Text).verbatim(&text).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}
