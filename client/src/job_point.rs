//! The point of a job whose realizations are drawn or observed.

use std::path::Path;

use anyhow::{Context as _, anyhow};
use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::parameters::Point;
use osteon_files::input_file::InputFile;
use osteon_files::{job_file, report};

use crate::results_directory;

/// Returns the best point of the results in `directory`, or of one of their groups, or else the fixed and
/// start values of the job in the file `job`.
///
/// # Errors
/// If the results are not those of the job, or have no such point.
pub fn choose(
    directory: Option<&Path>,
    group: Option<&str>,
    job: &InputFile,
    specification: &JobSpecification,
) -> anyhow::Result<Point> {
    let Some(directory) = directory else { return Ok(specification.start()) };
    let point = best_point(directory, group)?;
    check_same_job(directory, job, specification)?;
    Ok(point)
}

/// Refuses a directory whose results are not those of the job, since the realizations at its best
/// point would be different. If one of the two has no data, as the job of a propagation, everything
/// else is compared, which is what realizations depend on.
fn check_same_job(
    directory: &Path,
    job: &InputFile,
    specification: &JobSpecification,
) -> anyhow::Result<()> {
    let there = |kind| results_directory::job_of(directory, kind);
    let searched = job_file::of_input(job, JobKind::Identification).ok();
    let searched = searched.map(|noted| noted.specification);
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
            job.path().display()
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
