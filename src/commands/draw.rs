//! `draw`: one realization of a job as a complete case file.

use std::path::Path;

use anyhow::{Context as _, anyhow};
use osteon_common::case::Case;
use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::parameters::Point;
use osteon_files::{case_file, job_file, report};

use crate::arguments::DrawArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output;
use crate::resolved::OutputFormat;
use crate::results_directory;

/// Prints the case file.
pub(super) fn draw(arguments: &DrawArguments) -> Result<ExitStatus, CommandFailure> {
    let specification =
        job_file::read(&arguments.job, JobKind::Propagation).map_err(CommandFailure::bad_input)?;
    let (index, count) = (arguments.index, specification.monte_carlo.realizations);
    if index >= count {
        return Err(CommandFailure::bad_input(anyhow!(
            "--index {index} is beyond the job's {count} realizations; it must be 0 to {}",
            count - 1
        )));
    }
    let point = match &arguments.at {
        Some(directory) => {
            let group = arguments.group.as_deref();
            let point = best_point(directory, group).map_err(CommandFailure::BadInput)?;
            same_job(directory, &arguments.job, &specification)
                .map_err(CommandFailure::BadInput)?;
            point
        }
        None => specification.start(),
    };
    let ensemble = specification.ensemble(&point).map_err(CommandFailure::bad_input)?;
    let bone = ensemble.bone(index).map_err(|error| {
        CommandFailure::failed(anyhow::Error::new(error).context(format!(
            "realization {index} has no finite elasticity matrix (failure not_finite)"
        )))
    })?;
    let setup = ensemble.setup(index, &specification.setup);
    let text = case_file::to_toml(&Case { setup, bone });
    output::stdout(OutputFormat::Text).verbatim(&text).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// Refuses a directory whose results are not those of the job, since the realizations at its best
/// point would be different. If one of the two has no data, as the job of a propagation, everything
/// else is compared, which is what realizations depend on.
fn same_job(directory: &Path, job: &Path, specification: &JobSpecification) -> anyhow::Result<()> {
    let there = |kind| results_directory::job_of(directory, kind);
    let searched = job_file::read(job, JobKind::Identification).ok();
    let (here, there) = match searched.zip(there(JobKind::Identification).ok()) {
        Some(both) => both,
        None => {
            let there = there(JobKind::Propagation).with_context(|| {
                format!(
                    "cannot determine which job the results in {} belong to",
                    directory.display()
                )
            })?;
            (specification.clone(), there)
        }
    };
    let different =
        results_directory::difference(&job_file::to_toml(&there), &job_file::to_toml(&here));
    match different {
        None => Ok(()),
        Some(difference) => Err(anyhow!(
            "{} holds the results of another job than {} ({difference}); give the job that was run \
             there",
            directory.display(),
            job.display()
        )),
    }
}

/// Returns the best point of the result in `directory`, or that of one of its groups.
fn best_point(directory: &Path, group: Option<&str>) -> anyhow::Result<Point> {
    let result = results_directory::result_of(directory)?;
    let groups = result.groups();
    if group.is_none() && !groups.is_empty() {
        let names: Vec<String> = groups.iter().map(|group| group.name.clone()).collect();
        return Err(anyhow!(
            "{}: the result is for groups; choose one with --group: {}",
            results_directory::result_path(directory),
            report::listed(&names)
        ));
    }
    let point = result.best_point(group);
    point.with_context(|| results_directory::result_path(directory))
}
