//! Slurm: batch scripts that run osteon, and the number of workers that a queue of jobs needs.
//!
//! [`job_script`] and [`worker_script`] are texts made from options, [`scaling`] decides what to
//! submit and cancel, and [`follow`] does it. Only `programs` runs anything.

#![forbid(unsafe_code)]

mod directives;
pub mod follow;
#[cfg(test)]
mod fuzz;
pub mod job_script;
mod programs;
mod queue;
pub mod scaling;
mod shell;
pub mod worker_script;

use std::path::PathBuf;

use thiserror::Error;

/// Reason why a script cannot be made, or why Slurm cannot be used.
#[derive(Debug, Error)]
pub enum SlurmError {
    /// A word after `--` is no option and follows none.
    #[error(
        "`{word}` after -- is not an option of sbatch; write for example -- --account=NAME or \
         -- -A NAME"
    )]
    NotAnOption {
        /// The word.
        word: String,
    },
    /// An option of sbatch on which the script relies.
    #[error("{option} cannot be given after --, because the script depends on it; {instead}")]
    OwnOption {
        /// The option.
        option: String,
        /// What to do instead.
        instead: &'static str,
    },
    /// A word that would end its line.
    #[error("`{word}` cannot be part of a script: it contains a line break or a control character")]
    ControlCharacter {
        /// The word, with visible escapes.
        word: String,
    },
    /// A path that is not text.
    #[error("the path {} cannot be part of a script, because it is not valid UTF-8", .0.display())]
    NotText(PathBuf),
    /// A program of Slurm is not there.
    #[error(
        "{program} was not found: run this where Slurm's commands are installed, usually a login \
         node, or add their directory to PATH"
    )]
    NotInstalled {
        /// The program.
        program: &'static str,
    },
    /// A program could not be run.
    #[error("cannot run {program}: {source}")]
    NotRun {
        /// The program.
        program: &'static str,
        /// The operating system's error.
        source: std::io::Error,
    },
    /// A program did not end in time.
    #[error(
        "{program} did not answer within {seconds} s; `scontrol ping` shows whether Slurm's controller is up"
    )]
    TimedOut {
        /// The program.
        program: &'static str,
        /// The time waited, s.
        seconds: u64,
    },
    /// A program failed.
    #[error("{program} failed: {message}")]
    Failed {
        /// The program.
        program: &'static str,
        /// What it said.
        message: String,
    },
    /// A program printed something else than it should.
    #[error("{program} printed `{line}`, which is not understood")]
    NotUnderstood {
        /// The program.
        program: &'static str,
        /// What it printed.
        line: String,
    },
}
