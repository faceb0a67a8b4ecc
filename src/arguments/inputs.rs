//! The files that commands read, and settings that replace values of them.

use std::path::PathBuf;

use clap::Args;
use osteon_files::file_error::FileError;
use osteon_files::input_file::InputFile;
use osteon_files::setting::Setting;
use osteon_files::{case_file, job_file};

/// A job file, and settings that replace values of it.
#[derive(Debug, Clone, PartialEq, Args)]
pub(crate) struct JobFileArguments {
    /// Job file (TOML or JSON), or - to read the job from standard input
    pub(crate) job: PathBuf,
    /// Replace or add a value of the job file, e.g. --set search.max_evaluations=50; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = Setting::parse)]
    pub(crate) set: Vec<Setting>,
    /// Seed of the realizations; the same as --set monte_carlo.seed=N
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
}

impl JobFileArguments {
    /// Reads the text of the file, without parsing it.
    ///
    /// # Errors
    /// If it cannot be read.
    pub(crate) fn open(&self) -> Result<InputFile, FileError> {
        let seed = self.seed.map(Setting::seed);
        let settings = self.set.iter().cloned().chain(seed).collect();
        job_file::open(&self.job, settings)
    }
}

/// A case file, and settings that replace values of it.
#[derive(Debug, Clone, Args)]
pub(crate) struct CaseFileArguments {
    /// Case file (TOML or JSON), or - to read the case from standard input
    pub(crate) case: PathBuf,
    /// Replace or add a value of the case file, e.g. --set layers.bone.thickness=3e-3; may be
    /// repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = Setting::parse)]
    pub(crate) set: Vec<Setting>,
}

impl CaseFileArguments {
    /// Reads the text of the file, without parsing it.
    ///
    /// # Errors
    /// If it cannot be read.
    pub(crate) fn open(&self) -> Result<InputFile, FileError> {
        case_file::open(&self.case, self.set.clone())
    }
}
