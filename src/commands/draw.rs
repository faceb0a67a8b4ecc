//! `draw`: one realization of a job as a complete case file.

use std::path::Path;

use anyhow::{Context as _, anyhow};
use osteon_common::case::Case;
use osteon_common::job::JobKind;
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_common::{case_file, job_file, results_json};

use crate::arguments::DrawArguments;
use crate::ending::{Ending, Failure, stdout_failure};
use crate::output;
use crate::resolved::Format;

/// Prints the case file.
pub(super) fn draw(arguments: &DrawArguments) -> Result<Ending, Failure> {
    let specification =
        job_file::read(&arguments.job, JobKind::Propagation).map_err(Failure::bad_input)?;
    let (index, count) = (arguments.index, specification.monte_carlo.realizations);
    if index >= count {
        return Err(Failure::bad_input(anyhow!(
            "--index {index} is beyond the job's {count} realizations; it must be 0 to {}",
            count - 1
        )));
    }
    let point = match &arguments.at {
        Some(directory) => best_point(directory).map_err(Failure::BadInput)?,
        None => specification.start(),
    };
    let ensemble =
        Ensemble::new(&point, specification.monte_carlo.seed).map_err(Failure::bad_input)?;
    let bone = ensemble.bone(index).map_err(|error| {
        Failure::failed(anyhow::Error::new(error).context(format!(
            "realization {index} is no elasticity in floating point (failure not_finite)"
        )))
    })?;
    let text = case_file::to_toml(&Case { setup: specification.setup, bone });
    output::stdout(Format::Text).verbatim(&text).map_err(stdout_failure)?;
    Ok(Ending::Done)
}

fn best_point(directory: &Path) -> anyhow::Result<Point> {
    let path = directory.join("result.json");
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("cannot read {}", path.display()))?;
    results_json::best_point(&text).with_context(|| path.display().to_string())
}
