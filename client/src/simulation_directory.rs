//! The directory of a simulation, which belongs to one case, as the directory of a run belongs to
//! one job.
//!
//! `case.toml` is written first and `result.json` last, by rename. Simulating the same case again
//! writes the same bytes; another case is refused.

use std::io::Write;
use std::path::Path;

use anyhow::anyhow;
use osteon_common::case::Case;
use osteon_common::version::Program;
use osteon_common::visible;
use osteon_files::case_file;
use osteon_files::document::Format;

use crate::result_files::{RESULT, ResultFiles, ResultOrigin};
use crate::results_directory::{CASE, JOB, ResultsDirectory, difference, read_named_file};
use crate::run_error::RunError;

/// The file of the traces.
pub const TRACES: &str = "traces.csv";
/// Start of the first line of `case.toml`; the options of the traces follow.
const COMMAND: &str = "# osteon simulate case.toml --out again";
/// The same without the directory, as earlier versions wrote it.
const COMMAND_BEFORE: &str = "# osteon simulate case.toml";

/// The case and options to which a simulation's directory belongs.
pub struct SimulationKey<'a> {
    /// The case.
    pub case: &'a Case,
    /// Duration of the traces, s.
    pub duration: f64,
    /// Time step of the traces, s.
    pub time_step: f64,
}

impl SimulationKey<'_> {
    /// Returns the text of `case.toml`: the case with all defaults, below the command that creates
    /// the same files from it in another directory.
    fn text(&self) -> String {
        let Self { case, duration, time_step } = self;
        let command = format!("{COMMAND} --duration {duration:?} --time-step {time_step:?}\n");
        command + &case_file::to_toml(case)
    }

    /// Returns the first difference from the simulation described by `stored`, the text of a
    /// `case.toml`. Cases are compared after parsing: defaults may be left out, and keys may be in
    /// another order.
    fn difference_from(&self, stored: &str) -> Option<String> {
        let Some([duration, time_step]) = traces_of(stored) else {
            return Some(format!("its first line is not `{COMMAND} --duration S --time-step S`"));
        };
        let traces =
            [("duration", duration, self.duration), ("time step", time_step, self.time_step)];
        if let Some((name, there, here)) = traces.into_iter().find(|(_, there, here)| there != here)
        {
            return Some(format!("{name} {there:?} s there, {here:?} s here"));
        }
        let complete = case_file::parse(stored, Format::Toml)
            .map_or_else(|_| stored.to_owned(), |case| case_file::to_toml(&case));
        difference(&complete, &case_file::to_toml(self.case))
    }

    /// Refuses a directory that belongs to something else.
    ///
    /// # Errors
    /// Bad input if another case, other traces, or a job was computed there; failed if it cannot be
    /// read.
    pub fn refuse_other(&self, directory: &Path) -> Result<(), RunError> {
        let there = |name: &str| directory.join(name).symlink_metadata().is_ok();
        let shown = visible::path(directory);
        let stored = read_named_file(&directory.join(CASE))?;
        let why = match stored {
            Some(stored) => match self.difference_from(&stored) {
                None => return Ok(()),
                Some(difference) => format!("{shown} belongs to a different case ({difference})"),
            },
            None if there(JOB) => format!("{shown} holds the results of a job, not of a case"),
            None => match [TRACES, RESULT].into_iter().find(|name| there(name)) {
                None => return Ok(()),
                Some(name) => {
                    format!("{shown} has a {name} but no {CASE}: its case is unknown")
                }
            },
        };
        Err(RunError::bad_input(anyhow!("{why}; choose another --out directory")))
    }

    /// Writes all files; `print` writes the traces. The result was computed by `program`.
    ///
    /// # Errors
    /// Same as [`refuse_other`](Self::refuse_other); also failed if another process writes there,
    /// or if the directory cannot be written.
    pub fn write(
        &self,
        directory: &Path,
        program: &Program,
        result: &str,
        print: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
    ) -> Result<(), RunError> {
        let _held = ResultsDirectory::open(directory)?;
        // Another process may have written between the first check and the lock.
        self.refuse_other(directory)?;
        let origin =
            ResultOrigin { kind: "simulation", program, digest: None, seed: None, integrity: None };
        let write = || {
            let mut files = ResultFiles::begin(directory)?;
            files.write(CASE, &self.text())?;
            files.write_by(TRACES, print)?;
            files.finish(result, &origin)
        };
        write().map_err(RunError::Failed)
    }
}

/// Returns duration and time step, s, of the traces that belong to a `case.toml` with the text
/// `stored`.
fn traces_of(stored: &str) -> Option<[f64; 2]> {
    let line = stored.lines().next()?;
    let options = line.strip_prefix(COMMAND).or_else(|| line.strip_prefix(COMMAND_BEFORE))?;
    let (duration, time_step) =
        options.strip_prefix(" --duration ")?.split_once(" --time-step ")?;
    Some([duration.parse().ok()?, time_step.parse().ok()?])
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASE_TEXT: &str = include_str!("../../examples/cases/A.toml");

    #[test]
    fn the_same_simulation_is_known_in_other_words() {
        let case = case_file::parse(CASE_TEXT, Format::Toml).unwrap();
        let mine = SimulationKey { case: &case, duration: 3e-5, time_step: 1e-8 };
        assert!(mine.text().starts_with(
            "# osteon simulate case.toml --out again --duration 3e-5 --time-step 1e-8\n"
        ));
        let shorter = |command: &str| {
            format!("{command} --duration 3e-5 --time-step 0.00000001\n{CASE_TEXT}")
        };
        for stored in [mine.text(), shorter(COMMAND), shorter(COMMAND_BEFORE)] {
            assert_eq!(mine.difference_from(&stored), None, "{stored}");
        }
    }

    #[test]
    fn another_simulation_is_told_by_what_differs() {
        let case = case_file::parse(CASE_TEXT, Format::Toml).unwrap();
        let mine = SimulationKey { case: &case, duration: 3e-5, time_step: 1e-8 };
        let text = mine.text();
        for (stored, expected) in [
            (text.replace("3e-5", "4e-5"), "duration 4e-5 s there, 3e-5 s here"),
            (text.replace("1e-8", "2e-8"), "time step 2e-8 s there, 1e-8 s here"),
            (case_file::to_toml(&case), "its first line is not"),
            (format!("{text}\nthickness = 1"), "line "),
        ] {
            let difference = mine.difference_from(&stored).unwrap();
            assert!(difference.starts_with(expected), "{difference}");
        }
    }
}
