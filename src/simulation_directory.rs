//! The directory of a simulation: it belongs to one case, as that of a run does to one job.
//!
//! `case.toml` is written first and `result.json` last, by rename. The same case is written again
//! to the same bytes; another one is refused.

use std::io::Write;
use std::path::Path;

use anyhow::anyhow;
use osteon_common::case::Case;
use osteon_common::{case_file, visible};

use crate::ending::Failure;
use crate::program;
use crate::result_files::{Origin, RESULT, ResultFiles};
use crate::results_directory::{CASE, JOB, ResultsDirectory, difference, given};

/// The file of the traces.
pub(crate) const TRACES: &str = "traces.csv";

/// What a directory of a simulation belongs to.
pub(crate) struct Simulated<'a> {
    /// The case.
    pub(crate) case: &'a Case,
    /// Duration of the traces, s.
    pub(crate) duration: f64,
    /// Time step of the traces, s.
    pub(crate) time_step: f64,
}

impl Simulated<'_> {
    /// The text of `case.toml`: the case with all defaults, below the command that makes the same
    /// files of it.
    fn text(&self) -> String {
        let Self { case, duration, time_step } = self;
        let command = format!(
            "# osteon simulate case.toml --duration {duration:?} --time-step {time_step:?}\n"
        );
        command + &case_file::to_toml(case)
    }

    /// Refuses a directory that belongs to something else.
    ///
    /// # Errors
    /// Bad input when another case, other traces, or a job was computed there; failed when it cannot
    /// be read.
    pub(crate) fn refuse_other(&self, directory: &Path) -> Result<(), Failure> {
        let there = |name: &str| directory.join(name).symlink_metadata().is_ok();
        let shown = visible::path(directory);
        let stored = given(&directory.join(CASE))?;
        let why = match stored {
            Some(stored) => match difference(&stored, &self.text()) {
                None => return Ok(()),
                Some(difference) => format!("{shown} belongs to a different case ({difference})"),
            },
            None if there(JOB) => format!("{shown} holds the results of a job, not of a case"),
            None => match [TRACES, RESULT].into_iter().find(|name| there(name)) {
                None => return Ok(()),
                Some(name) => {
                    format!(
                        "{shown} has a {name} but no {CASE}: of which case it is cannot be told"
                    )
                }
            },
        };
        Err(Failure::bad_input(anyhow!("{why}; choose another --out directory")))
    }

    /// Writes all files, `print` the traces.
    ///
    /// # Errors
    /// As [`refuse_other`](Self::refuse_other); failed when another process writes there, or it
    /// cannot be written.
    pub(crate) fn write(
        &self,
        directory: &Path,
        result: &str,
        print: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
    ) -> Result<(), Failure> {
        let _held = ResultsDirectory::open(directory)?;
        // Another process may have written between the first look and the lock.
        self.refuse_other(directory)?;
        let program = program::this();
        let origin = Origin { kind: "simulation", program: &program, digest: None, seed: None };
        let write = || {
            let mut files = ResultFiles::begin(directory)?;
            files.write(CASE, &self.text())?;
            files.write_by(TRACES, print)?;
            files.finish(result, &origin)
        };
        write().map_err(Failure::Failed)
    }
}
