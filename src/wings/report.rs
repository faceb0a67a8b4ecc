//! `report`: results as a page with figures.

use std::path::{Path, PathBuf};

use clap::Args;
use osteon_client::report_directory::{self, REPORT};

use crate::exit_status::{CommandFailure, ExitStatus};
use crate::prepared_command::Ended;
use crate::progress::say;

/// Arguments of `report`.
#[derive(Debug, Args)]
pub(crate) struct ReportArguments {
    /// Directory of results. Several are laid over each other and compared with the first
    #[arg(value_name = "DIR", required = true, num_args = 1..=16)]
    directories: Vec<PathBuf>,
    /// Directory for the report [default: the folder report in the first DIR]
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Option of commands that write results.
#[derive(Debug, Clone, PartialEq, Eq, Args)]
pub(crate) struct ReportOption {
    /// Also write a report of the results to DIR/report, as `osteon report DIR` does
    #[arg(long, requires = "out")]
    report: bool,
}

impl ReportOption {
    /// Writes the report of the results in `directory` to its folder `report`, and says where it is, if
    /// it is wanted.
    ///
    /// # Errors
    /// If the results cannot be read, or the report cannot be written.
    pub(crate) fn write(&self, directory: Option<&Path>) -> Result<(), CommandFailure> {
        let Some(directory) = directory.filter(|_| self.report) else { return Ok(()) };
        let page = report_directory::write(
            &directory.join(REPORT),
            &[report_directory::read(directory)?],
        )?;
        say(&format!("report: {page}"));
        Ok(())
    }
}

/// Returns a figure of phase velocities (m/s) over frequencies (Hz) as SVG, with a series for each name.
pub(crate) fn dispersion_figure(series: &[(&'static str, Vec<[f64; 2]>)]) -> Option<String> {
    Some(report_directory::dispersion_figure(series))
}

/// Returns a figure of an image of guided waves as SVG: frequencies (Hz), wavenumbers (rad/m) and for each frequency
/// the values; with the model's waves and those that were found, by frequency (Hz) and phase velocity (m/s).
pub(crate) fn wave_image_figure(
    image: (&[f64], &[f64], Vec<Vec<f64>>),
    families: &[(&'static str, Vec<[f64; 2]>)],
    found: &[[f64; 2]],
) -> Option<String> {
    Some(report_directory::wave_image_figure(image, families, found))
}

/// Reads the results, and writes their report.
pub(super) fn report(arguments: &ReportArguments) -> Ended {
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
