//! The directory of a run: its files, and the order in which they are written.
//!
//! `job.toml` is written first, when the job is accepted, and `result.json` last, by rename: a
//! directory with a `result.json` is complete. The data needed to resume (`store`, `.request`) are
//! removed only after that, and only if the run cannot be resumed, i.e. unless the result is that
//! of a cancelled job.

use std::fs::{self, File, TryLockError};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow, bail};
use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::limits::{FILE_BYTES_MAX, REALIZATIONS_MAX};
use osteon_common::results::Status;
use osteon_common::visible;
use osteon_files::document::Format;
use osteon_files::report::{Group, ResultFile};
use osteon_files::{job_file, posterior_csv, results_csv, user_file};

use crate::fetched::Fetched;
use crate::listener::RunListener;
use crate::request_id::RequestId;
use crate::result_files::{self, RESULT, ResultFiles, ResultOrigin};
use crate::result_status;
use crate::run_error::RunError;

/// File of the job to which a directory belongs.
pub const JOB: &str = "job.toml";
/// File of the case to which a directory belongs.
pub const CASE: &str = "case.toml";
/// Table of the evaluated points.
pub const HISTORY: &str = "history.csv";
/// Table of the realizations at the best point.
pub const REALIZATIONS: &str = "realizations.csv";
/// Table of the posterior's draws.
pub const POSTERIOR: &str = "posterior.csv";
const GROUPS: &str = "groups.csv";
/// Table of the points at which both solver methods were compared.
pub const COMPARISON: &str = "comparison.csv";
const LOCK: &str = ".lock";
const REQUEST: &str = ".request";
const STORE: &str = "store";
/// Maximum number of attempts to lock a directory whose lock file is removed by one run after
/// another.
const LOCK_ATTEMPTS_MAX: u32 = 100;

/// A directory of results, locked by this process.
#[derive(Debug)]
pub struct ResultsDirectory {
    path: PathBuf,
    /// Held until the end, when its file is removed.
    _lock: File,
}

impl ResultsDirectory {
    /// Returns the result in `path` for `specification`, including that of a cancelled job; `None`
    /// if there is no run, or one that did not end.
    ///
    /// # Errors
    /// Bad input if the directory belongs to another specification, or if the file is not a result
    /// of this one; failed if it cannot be read.
    pub fn stored(
        path: &Path,
        specification: &JobSpecification,
    ) -> Result<Option<ResultFile>, RunError> {
        let job = path.join(JOB);
        if path.exists() && !path.is_dir() {
            return Err(RunError::bad_input(anyhow!(
                "{} is not a directory; choose another --out directory",
                visible::path(path)
            )));
        }
        let result = read_named_file(&path.join(RESULT))?;
        match read_named_file(&job)? {
            Some(stored) => check_same_job(&job, &stored, specification)?,
            None if result.is_some() && !path.join(CASE).exists() => {
                return Err(RunError::bad_input(anyhow!(
                    "{} has a {RESULT} but no {JOB}: its job is unknown; \
                     choose another --out directory",
                    visible::path(path)
                )));
            }
            None if path.join(CASE).exists() => {
                return Err(RunError::bad_input(anyhow!(
                    "{} holds the results of a simulation, not of a job; \
                     choose another --out directory",
                    visible::path(path)
                )));
            }
            None => {}
        }
        let Some(text) = result else { return Ok(None) };
        let result = read_result(path, &text).map_err(RunError::BadInput)?;
        if result.kind() != specification.kind {
            return Err(RunError::bad_input(anyhow!(
                "{} is the result of a {}, not of a {}; choose another --out directory",
                result_path(path),
                result.kind().name(),
                specification.kind.name()
            )));
        }
        Ok(Some(result))
    }

    /// Same as [`stored`](Self::stored), but only for runs that would end the same way again: such
    /// a result is shown instead of running the job.
    ///
    /// # Errors
    /// Same as [`stored`](Self::stored).
    pub fn finished(
        path: &Path,
        specification: &JobSpecification,
    ) -> Result<Option<ResultFile>, RunError> {
        Ok(Self::stored(path, specification)?
            .filter(|result| !result_status::is_worth_repeating(result)))
    }

    /// Creates the directory, if necessary, and locks it. By then the stored files may have changed
    /// since they were last read.
    ///
    /// # Errors
    /// If another process holds the lock, or if the directory cannot be written.
    pub fn open(path: &Path) -> Result<Self, RunError> {
        make_directory(path)?;
        let lock_path = path.join(LOCK);
        for _ in 0..LOCK_ATTEMPTS_MAX {
            let lock = user_file::create(&lock_path).map_err(|error| {
                RunError::unusable_path(
                    error,
                    format!("cannot write {}", visible::path(&lock_path)),
                )
            })?;
            match lock.try_lock() {
                // A run that ended meanwhile has removed the file, so this lock protects nothing.
                Ok(()) if !is_at(&lock, &lock_path) => {}
                Ok(()) => return Ok(Self { path: path.to_owned(), _lock: lock }),
                Err(TryLockError::WouldBlock) => break,
                Err(TryLockError::Error(error)) => {
                    let context = format!("cannot lock {}", visible::path(&lock_path));
                    return Err(RunError::failed(anyhow::Error::new(error).context(context)));
                }
            }
        }
        Err(RunError::failed(anyhow!("another osteon is running in {}", visible::path(path))))
    }

    /// Returns the directory of the run's store, which is kept until the run has ended.
    pub fn store(&self) -> PathBuf {
        self.path.join(STORE)
    }

    /// Returns the request of this directory, which is the same at every call and on every host.
    pub fn request(&self) -> Result<RequestId, RunError> {
        let path = self.path.join(REQUEST);
        let stored = read_if_there(&path).map_err(RunError::Failed)?.unwrap_or_default();
        let mut lines = stored.lines().map(str::trim);
        if let Some(id) = lines.next().filter(|id| !id.is_empty()) {
            let request = RequestId::with_id(id.to_owned());
            // A user who writes the file by hand may leave out the client.
            let client = lines.next().map_or(request.client, str::to_owned);
            return Ok(RequestId { client, ..request });
        }
        let request = RequestId::new().map_err(RunError::failed)?;
        let text = format!("{}\n{}\n", request.id, request.client);
        result_files::write(&path, &text).map_err(RunError::Failed)?;
        Ok(request)
    }

    /// Makes the next [`request`](Self::request) a new one, because the job of the present one
    /// cannot be continued.
    pub fn forget_request(&self) {
        // If removal fails, the only harm is that the same ending is shown again.
        drop(fs::remove_file(self.path.join(REQUEST)));
    }

    /// Writes `job.toml`: from now on the directory belongs to this specification.
    pub fn write_job(&self, specification: &JobSpecification) -> Result<(), RunError> {
        let text = job_file::to_toml(specification);
        result_files::write(&self.path.join(JOB), &text).map_err(RunError::Failed)
    }

    /// Writes all files of an ended job, `result.json` last. The listener learns what was left out.
    pub fn write_results(
        &self,
        fetched: &Fetched,
        listener: &dyn RunListener,
    ) -> Result<(), RunError> {
        let Fetched { specification, status, result, history, samples, .. } = fetched;
        let kind = result.kind();
        let write_all = || -> anyhow::Result<()> {
            let mut files = ResultFiles::begin(&self.path)?;
            files.write(JOB, &job_file::to_toml(specification))?;
            if kind == JobKind::Identification {
                files.write(HISTORY, &results_csv::history(specification, history))?;
            }
            let groups = result.groups();
            if !groups.is_empty() {
                files.write(GROUPS, &results_csv::groups(specification, groups, history))?;
                files.write(COMPARISON, &results_csv::comparison(groups))?;
            }
            files.write(REALIZATIONS, &realizations(fetched, listener))?;
            if specification.posterior.is_some() {
                let draws = samples.iter().map(|of_set| of_set.draws.as_slice());
                files.write(POSTERIOR, &posterior_csv::posterior(specification, draws))?;
            }
            files.finish(
                &result.to_json(),
                &ResultOrigin {
                    kind: kind.name(),
                    program: &result.program(),
                    digest: Some(result.digest()),
                    seed: Some(result.seed()),
                    integrity: result.integrity(),
                },
            )
        };
        write_all().map_err(RunError::Failed)?;
        if *status != Status::Cancelled {
            // The data for resuming are no longer needed; it does no harm if some remain.
            self.forget_request();
            drop(fs::remove_dir_all(self.store()));
        }
        Ok(())
    }
}

impl Drop for ResultsDirectory {
    fn drop(&mut self) {
        // Removed last and while still locked; a leftover file does no harm.
        drop(fs::remove_file(self.path.join(LOCK)));
    }
}

/// Creates a directory named by the user, if it does not exist.
///
/// # Errors
/// Bad input if the path cannot be a directory, failed if the machine has no room for it.
pub fn make_directory(path: &Path) -> Result<(), RunError> {
    // A link to nothing is there for the system, and nowhere for the user.
    if let Ok(target) = fs::read_link(path)
        && !path.exists()
    {
        let (shown, target) = (visible::path(path), visible::path(&target));
        return Err(RunError::bad_input(anyhow::anyhow!(
            "{shown} is a link to {target}, which does not exist; create that directory, or remove the link"
        )));
    }
    fs::create_dir_all(path).map_err(|error| {
        RunError::unusable_path(
            error,
            format!("cannot create the directory {}", visible::path(path)),
        )
    })
}

/// Returns the text of a file in a directory named by the user; `None` if there is no such file.
pub fn read_named_file(path: &Path) -> Result<Option<String>, RunError> {
    read_if_there(path).map_err(|error| match error.downcast::<std::io::Error>() {
        Ok(error) => RunError::unusable_path(error, format!("cannot read {}", visible::path(path))),
        Err(error) => RunError::Failed(error),
    })
}

/// Returns the table of the realizations at the best point, or at those of the groups.
fn realizations(fetched: &Fetched, listener: &dyn RunListener) -> String {
    let Fetched { result, samples, .. } = fetched;
    let groups = result.groups();
    if groups.is_empty() {
        return results_csv::realizations(samples.first().map_or(&[], |of_set| &of_set.outcomes));
    }
    let tables = || groups.iter().zip(samples.iter().map(|of_set| of_set.outcomes.as_slice()));
    let is_left_out =
        |(group, outcomes): &(&Group, &[_])| group.best_point().is_some() && outcomes.is_empty();
    let left_out = tables().filter(is_left_out).count();
    if left_out > 0 {
        listener.note(&format!(
            "{REALIZATIONS} is without those of the last {left_out} groups: it has at most \
             {REALIZATIONS_MAX} rows"
        ));
    }
    results_csv::realizations_of_groups(tables().map(|(group, outcomes)| (&*group.name, outcomes)))
}

/// Returns whether `file` is still the file at `path`.
fn is_at(file: &File, path: &Path) -> bool {
    match (file.metadata(), fs::metadata(path)) {
        (Ok(ours), Ok(there)) => (ours.dev(), ours.ino()) == (there.dev(), there.ino()),
        _ => false,
    }
}

/// Returns the job whose results `directory` contains, read as one of `kind`.
///
/// # Errors
/// If there is none, or if it cannot be read.
pub(crate) fn job_of(directory: &Path, kind: JobKind) -> anyhow::Result<JobSpecification> {
    Ok(job_file::read(&directory.join(JOB), kind)?)
}

/// Refuses a directory whose job is not `specification`, and reports the first difference.
fn check_same_job(
    path: &Path,
    stored: &str,
    specification: &JobSpecification,
) -> Result<(), RunError> {
    // The comparison ignores formatting, and defaults that are left out.
    let directory = path.parent().unwrap_or(Path::new(""));
    // Only the job of an identification has data.
    let complete = [JobKind::Identification, JobKind::Propagation]
        .into_iter()
        .find_map(|kind| job_file::parse(stored, Format::Toml, directory, kind).ok())
        .map_or_else(|| stored.to_owned(), |there| job_file::to_toml(&there));
    match difference(&complete, &job_file::to_toml(specification)) {
        None => Ok(()),
        Some(difference) => Err(RunError::bad_input(anyhow!(
            "{} belongs to a different specification ({difference}); \
             choose another --out directory",
            visible::path(path)
        ))),
    }
}

/// Describes the first line in which the complete texts of two jobs differ.
pub(crate) fn difference(there: &str, here: &str) -> Option<String> {
    if there == here {
        return None;
    }
    let different = there.lines().zip(here.lines()).position(|(a, b)| a != b);
    let line = different.unwrap_or_else(|| there.lines().count().min(here.lines().count()));
    let shown = |text: &str| {
        let line = text.lines().nth(line).unwrap_or("(nothing)");
        line.chars().take(80).collect::<String>()
    };
    Some(format!("line {}: `{}` there, `{}` here", line + 1, shown(there), shown(here)))
}

/// Returns the result in `directory`.
///
/// # Errors
/// If there is none, or if it cannot be read.
pub(crate) fn result_of(directory: &Path) -> anyhow::Result<ResultFile> {
    let text = read_if_there(&directory.join(RESULT))?;
    let cannot = || format!("cannot read {}: no such file", result_path(directory));
    read_result(directory, &text.with_context(cannot)?)
}

/// Returns the path of the result in `directory`, for messages.
pub(crate) fn result_path(directory: &Path) -> String {
    visible::path(&directory.join(RESULT))
}

/// Parses a result; the error names the file that must be replaced.
pub(crate) fn read_result(directory: &Path, text: &str) -> anyhow::Result<ResultFile> {
    ResultFile::from_json(text).map_err(|error| {
        anyhow!(
            "{} is not the result of a job: {error}; remove the file and run the job again, or choose \
             another directory",
            result_path(directory)
        )
    })
}

/// Returns the text of a file of a run, of at most [`FILE_BYTES_MAX`] bytes; `None` if there is no
/// such file.
fn read_if_there(path: &Path) -> anyhow::Result<Option<String>> {
    let cannot = || format!("cannot read {}", visible::path(path));
    let read = match user_file::read(path, FILE_BYTES_MAX) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        read => read.with_context(cannot)?,
    };
    let Some(bytes) = read else {
        bail!(
            "{} is longer than {FILE_BYTES_MAX} bytes, which no result of osteon is; remove it, \
             or choose another directory",
            visible::path(path)
        );
    };
    Ok(Some(String::from_utf8(bytes).with_context(cannot)?))
}

#[cfg(test)]
pub(crate) mod tests;
