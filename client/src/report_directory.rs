//! Reports on disk: results are read from their directories, pages and figures written to another.

use std::fs;
use std::path::Path;

use anyhow::{Context as _, anyhow};
use osteon_common::visible;
use osteon_files::case_file;
use osteon_files::document::Format;
use osteon_files::report::{ReadError, ResultFile, Simulation};
use osteon_report::{JobTables, ReportedRun, TableError};

use crate::result_files::{self, RESULT, remove_if_there};
use crate::results_directory::{
    CASE, COMPARISON, HISTORY, JOB, POSTERIOR, REALIZATIONS, job_of, make_directory,
    read_named_file, read_result, result_path,
};
use crate::run_error::RunError;
use crate::simulation_directory::TRACES;

pub use osteon_report::{dispersion_figure, wave_image_figure};

/// Folder of a report within a directory of results.
pub const REPORT: &str = "report";
/// The page.
const PAGE: &str = "index.html";

/// Reads the results in `directory`.
///
/// # Errors
/// Bad input if there are none, or if a file of them is damaged.
pub fn read(directory: &Path) -> Result<ReportedRun, RunError> {
    let Some(text) = read_named_file(&directory.join(RESULT))? else {
        return Err(RunError::bad_input(anyhow!(
            "{} does not exist: {} holds no complete results; run `osteon identify`, `propagate` or \
             `simulate` with --out DIR first",
            result_path(directory),
            visible::path(directory)
        )));
    };
    // The name that people gave it, without what leads there: a report has no paths.
    let name = fs::canonicalize(directory).unwrap_or_else(|_| directory.to_owned());
    let name = name.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let text_of = |file: &str| read_named_file(&directory.join(file));
    let damaged = |error: TableError| {
        RunError::bad_input(anyhow!(
            "a table in {} is damaged: {error}; remove {RESULT} there and run it again",
            visible::path(directory)
        ))
    };
    if directory.join(CASE).exists() && !directory.join(JOB).exists() {
        return simulation(directory, name, &text)?.map_err(damaged);
    }
    let result = read_result(directory, &text).map_err(RunError::BadInput)?;
    let kind = result.kind();
    let specification = job_of(directory, kind).map_err(RunError::BadInput)?;
    let tables = JobTables {
        history: text_of(HISTORY)?,
        realizations: text_of(REALIZATIONS)?,
        posterior: text_of(POSTERIOR)?,
        comparison: text_of(COMPARISON)?,
    };
    match result {
        ResultFile::Identification(result) => {
            ReportedRun::identification(name, *result, specification, &tables)
        }
        ResultFile::Propagation(result) => {
            ReportedRun::propagation(name, *result, specification, &tables)
        }
    }
    .map_err(damaged)
}

/// Reads the results of a simulation.
fn simulation(
    directory: &Path,
    name: String,
    text: &str,
) -> Result<Result<ReportedRun, TableError>, RunError> {
    let unreadable = |error: ReadError| {
        RunError::bad_input(anyhow!("{} is not a result: {error}", result_path(directory)))
    };
    let result = Simulation::from_json(text).map_err(unreadable)?;
    let path = directory.join(CASE);
    let case = read_named_file(&path)?.unwrap_or_default();
    let case = case_file::parse(&case, Format::Toml)
        .with_context(|| format!("{} cannot be read", visible::path(&path)))
        .map_err(RunError::BadInput)?;
    let traces = read_named_file(&directory.join(TRACES))?;
    Ok(ReportedRun::simulation(name, result, case, traces.as_deref()))
}

/// Writes the report of these runs to `out`, and returns the path of its page. Figures of an earlier
/// report there are removed.
///
/// # Errors
/// If the directory cannot be written, or holds files that are not of a report.
pub fn write(out: &Path, runs: &[ReportedRun]) -> Result<String, RunError> {
    make_directory(out)?;
    let page = out.join(PAGE);
    if out.join(RESULT).exists() || out.join(JOB).exists() || out.join(CASE).exists() {
        return Err(RunError::bad_input(anyhow!(
            "{} is a directory of results, and a report needs one of its own; choose another --out \
             directory",
            visible::path(out)
        )));
    }
    let earlier = match read_named_file(&page)? {
        None => Vec::new(),
        Some(text) => osteon_report::files_of(&text).ok_or_else(|| {
            RunError::bad_input(anyhow!(
                "{} is not the page of a report and is not replaced; choose another --out directory",
                visible::path(&page)
            ))
        })?,
    };
    let report = osteon_report::report(runs);
    let write = || -> anyhow::Result<()> {
        for name in &earlier {
            remove_if_there(&out.join(name))?;
        }
        for figure in &report.figures {
            result_files::write(&out.join(&figure.name), &figure.text)?;
        }
        result_files::write(&page, &report.html)
    };
    write().map_err(RunError::Failed)?;
    Ok(visible::path(&page))
}
