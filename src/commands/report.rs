//! `report`: results as a page with figures.

use crate::arguments::ReportArguments;
use crate::exit_status::{CommandFailure, ExitStatus};
use crate::progress::say;
use crate::report_directory::{self, REPORT};

/// Reads the results, and writes their report.
pub(super) fn report(arguments: &ReportArguments) -> Result<ExitStatus, CommandFailure> {
    let directories = &arguments.directories;
    let out = match (&arguments.out, directories.first()) {
        (Some(out), _) => out.clone(),
        (None, first) => first.map(|first| first.join(REPORT)).unwrap_or_default(),
    };
    let runs = directories.iter().map(|directory| report_directory::read(directory));
    let runs = runs.collect::<Result<Vec<_>, _>>()?;
    let page = report_directory::write(&out, &runs)?;
    say(&page);
    Ok(ExitStatus::Done)
}
