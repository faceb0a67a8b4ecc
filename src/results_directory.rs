//! The directory of a run: what stands in it, and in which order it is written.
//!
//! `job.toml` is written first, when the job is accepted, and `result.json` last, by rename: a
//! directory with a `result.json` is complete. What serves to continue (`store`, `.request`) goes
//! only after that, and only when there is nothing to continue: the result is not that of a
//! cancelled job.

use std::fs::{self, File, TryLockError};
use std::io::{BufWriter, IntoInnerError, Read as _, Write};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow, bail};
use osteon_common::document::Format;
use osteon_common::job::{Data, JobKind, JobSpecification};
use osteon_common::limits::FILE_BYTES_MAX;
use osteon_common::results::Status;
use osteon_common::{job_file, results_csv, results_json};

use crate::client::Fetched;
use crate::ending::Failure;
use crate::request::Request;
use crate::verdict;

const JOB: &str = "job.toml";
const RESULT: &str = "result.json";
const HISTORY: &str = "history.csv";
const REALIZATIONS: &str = "realizations.csv";
const GROUPS: &str = "groups.csv";
const COMPARISON: &str = "comparison.csv";
const LOCK: &str = ".lock";
const REQUEST: &str = ".request";
const STORE: &str = "store";
/// Most attempts to lock a directory whose lock is removed by one run after another.
const LOCK_ATTEMPTS_MAX: u32 = 100;

/// A directory of results, held by this process alone.
#[derive(Debug)]
pub(crate) struct ResultsDirectory {
    path: PathBuf,
    /// Held until the end, when its file is removed.
    _lock: File,
}

/// The object of `result.json` and `--json`.
pub(crate) fn result_json(kind: JobKind, fetched: &Fetched) -> String {
    match kind {
        JobKind::Identification => results_json::identification(&fetched.result),
        JobKind::Propagation => results_json::propagation(&fetched.result),
    }
}

impl ResultsDirectory {
    /// The text of `result.json` if `path` holds a result of `specification`, be it that of a
    /// cancelled job; `None` if there is no run, or one that did not end.
    ///
    /// # Errors
    /// Bad input when another specification was run there; failed when it cannot be read.
    pub(crate) fn stored(
        path: &Path,
        specification: &JobSpecification,
    ) -> Result<Option<String>, Failure> {
        let job = path.join(JOB);
        let result = read_if_there(&path.join(RESULT)).map_err(Failure::Failed)?;
        match read_if_there(&job).map_err(Failure::Failed)? {
            Some(stored) => same_job(&job, &stored, specification)?,
            None if result.is_some() => {
                return Err(Failure::bad_input(anyhow!(
                    "{} has a {RESULT} but no {JOB}: whose result it is cannot be told; \
                     choose another --out directory",
                    path.display()
                )));
            }
            None => {}
        }
        Ok(result)
    }

    /// As [`stored`](Self::stored), of runs only that would end the same way again: what a run
    /// shows instead of running.
    ///
    /// # Errors
    /// As [`stored`](Self::stored).
    pub(crate) fn finished(
        path: &Path,
        specification: &JobSpecification,
    ) -> Result<Option<String>, Failure> {
        Ok(Self::stored(path, specification)?.filter(|json| !verdict::may_end_otherwise(json)))
    }

    /// Makes the directory, if there is none, and holds it. What was stored there before may
    /// have changed by then.
    ///
    /// # Errors
    /// When another process holds it, or it cannot be written.
    pub(crate) fn open(path: &Path) -> Result<Self, Failure> {
        Self::lock(path).map_err(Failure::Failed)
    }

    fn lock(path: &Path) -> anyhow::Result<Self> {
        fs::create_dir_all(path)
            .with_context(|| format!("cannot create the directory {}", path.display()))?;
        let lock_path = path.join(LOCK);
        for _ in 0..LOCK_ATTEMPTS_MAX {
            let lock = File::create(&lock_path)
                .with_context(|| format!("cannot write {}", lock_path.display()))?;
            match lock.try_lock() {
                // A run that ended meanwhile has removed the file: its lock locks nothing.
                Ok(()) if !is_at(&lock, &lock_path) => {}
                Ok(()) => return Ok(Self { path: path.to_owned(), _lock: lock }),
                Err(TryLockError::WouldBlock) => break,
                Err(TryLockError::Error(error)) => {
                    return Err(anyhow::Error::new(error)
                        .context(format!("cannot lock {}", lock_path.display())));
                }
            }
        }
        bail!("another osteon is running in {}", path.display())
    }

    /// Where a store of this run is kept until it has ended.
    pub(crate) fn store(&self) -> PathBuf {
        self.path.join(STORE)
    }

    /// The request that stands for this directory, the same one at every call, on whatever host.
    pub(crate) fn request(&self) -> Result<Request, Failure> {
        let path = self.path.join(REQUEST);
        let stored = read_if_there(&path).map_err(Failure::Failed)?.unwrap_or_default();
        let mut lines = stored.lines().map(str::trim);
        if let Some(id) = lines.next().filter(|id| !id.is_empty()) {
            let request = Request::with_id(id.to_owned());
            // Whoever writes the file by hand may leave the client out.
            let client = lines.next().map_or(request.client, str::to_owned);
            return Ok(Request { client, ..request });
        }
        let request = Request::new();
        let text = format!("{}\n{}\n", request.id, request.client);
        write(&path, &text).map_err(Failure::Failed)?;
        Ok(request)
    }

    /// Makes the next [`request`](Self::request) a new one: the job of the present one has
    /// nothing more to give.
    pub(crate) fn forget_request(&self) {
        // A leftover does no harm but to show the same end again.
        drop(fs::remove_file(self.path.join(REQUEST)));
    }

    /// Writes `job.toml`: from now on the directory belongs to this specification.
    pub(crate) fn write_job(&self, specification: &JobSpecification) -> Result<(), Failure> {
        write(&self.path.join(JOB), &job_file::to_toml(specification)).map_err(Failure::Failed)
    }

    /// Writes all that an ended job left, `result.json` last; its text.
    pub(crate) fn write_results(
        &self,
        kind: JobKind,
        fetched: &Fetched,
    ) -> Result<String, Failure> {
        let text = result_json(kind, fetched);
        let write_all = || -> anyhow::Result<()> {
            remove_if_there(&self.path.join(RESULT))?;
            write(&self.path.join(JOB), &job_file::to_toml(&fetched.specification))?;
            if kind == JobKind::Identification {
                let history = results_csv::history(&fetched.specification, &fetched.history);
                write(&self.path.join(HISTORY), &history)?;
            }
            if matches!(fetched.specification.data, Some(Data::Groups(_))) {
                write(&self.path.join(GROUPS), &results_csv::groups(&fetched.result))?;
                let comparison = results_csv::comparison(&fetched.result);
                write(&self.path.join(COMPARISON), &comparison)?;
            }
            let outcomes = fetched.result.best.as_ref().map(|best| best.outcomes.as_slice());
            let realizations = results_csv::realizations(outcomes.unwrap_or_default());
            write(&self.path.join(REALIZATIONS), &realizations)?;
            write(&self.path.join(RESULT), &text)
        };
        write_all().map_err(Failure::Failed)?;
        if fetched.result.status != Status::Cancelled {
            // What served only to continue is not needed any more; a leftover does no harm.
            self.forget_request();
            drop(fs::remove_dir_all(self.store()));
        }
        Ok(text)
    }
}

impl Drop for ResultsDirectory {
    fn drop(&mut self) {
        // Last of all, and still locked; a leftover does no harm.
        drop(fs::remove_file(self.path.join(LOCK)));
    }
}

/// Whether `file` is what stands at `path`.
fn is_at(file: &File, path: &Path) -> bool {
    match (file.metadata(), fs::metadata(path)) {
        (Ok(ours), Ok(there)) => (ours.dev(), ours.ino()) == (there.dev(), there.ino()),
        _ => false,
    }
}

/// The job whose results `directory` holds, read as one of `kind`.
///
/// # Errors
/// When there is none, or it cannot be read.
pub(crate) fn job_of(directory: &Path, kind: JobKind) -> anyhow::Result<JobSpecification> {
    Ok(job_file::read(&directory.join(JOB), kind)?)
}

/// Refuses a directory whose job is not `specification`, and says where they differ.
fn same_job(path: &Path, stored: &str, specification: &JobSpecification) -> Result<(), Failure> {
    // What is said in other words, or left out where it is the default, is the same job.
    let directory = path.parent().unwrap_or(Path::new(""));
    // Only that of an identification has data.
    let complete = [JobKind::Identification, JobKind::Propagation]
        .into_iter()
        .find_map(|kind| job_file::parse(stored, Format::Toml, directory, kind).ok())
        .map_or_else(|| stored.to_owned(), |there| job_file::to_toml(&there));
    match difference(&complete, &job_file::to_toml(specification)) {
        None => Ok(()),
        Some(difference) => Err(Failure::bad_input(anyhow!(
            "{} belongs to a different specification ({difference}); \
             choose another --out directory",
            path.display()
        ))),
    }
}

/// The first line in which the complete texts of two jobs differ, in words.
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

/// Writes `text` to `path` so that a reader sees either what was there before, or all of it.
pub(crate) fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    write_by(path, |file| file.write_all(text.as_bytes()))
}

/// The same for what `print` writes piece by piece.
pub(crate) fn write_by(
    path: &Path,
    print: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> anyhow::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = path.with_file_name(name);
    let write = || -> std::io::Result<()> {
        let mut file = BufWriter::new(File::create(&part)?);
        print(&mut file)?;
        file.into_inner().map_err(IntoInnerError::into_error)?.sync_all()?;
        fs::rename(&part, path)
    };
    write().with_context(|| format!("cannot write {}", path.display()))
}

fn remove_if_there(path: &Path) -> anyhow::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("cannot replace {}", path.display()))
        }
        _ => Ok(()),
    }
}

/// The text of `result.json` in `directory`.
///
/// # Errors
/// When there is none, or it cannot be read.
pub(crate) fn result_of(directory: &Path) -> anyhow::Result<String> {
    let path = directory.join(RESULT);
    let text = read_if_there(&path)?;
    text.with_context(|| format!("cannot read {}: there is no such file", path.display()))
}

/// The text of a file of a run, of at most [`FILE_BYTES_MAX`] bytes; `None` if there is no such file.
fn read_if_there(path: &Path) -> anyhow::Result<Option<String>> {
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => {
            return Err(error).with_context(|| format!("cannot read {}", path.display()));
        }
    };
    let cannot = || format!("cannot read {}", path.display());
    let mut bytes = Vec::new();
    let length = file.take(FILE_BYTES_MAX + 1).read_to_end(&mut bytes).with_context(cannot)?;
    if length as u64 > FILE_BYTES_MAX {
        bail!(
            "{} is longer than {FILE_BYTES_MAX} bytes, and osteon writes no such file; remove it, \
             or choose another directory",
            path.display()
        );
    }
    Ok(Some(String::from_utf8(bytes).with_context(cannot)?))
}

#[cfg(test)]
mod tests;
