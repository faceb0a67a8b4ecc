//! The directory of a run: what stands in it, and in which order it is written.
//!
//! `job.toml` is written first, when the job is accepted, and `result.json` last, by rename: a
//! directory with a `result.json` is complete.

use std::fs::{self, File, TryLockError};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow, bail};
use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::{job_file, results_csv, results_json};

use crate::client::Fetched;
use crate::ending::Failure;

const JOB: &str = "job.toml";
const RESULT: &str = "result.json";
const HISTORY: &str = "history.csv";
const REALIZATIONS: &str = "realizations.csv";
const LOCK: &str = ".lock";
const REQUEST: &str = ".request";
const STORE: &str = "store";

/// A directory of results, held by this process alone.
#[derive(Debug)]
pub(crate) struct ResultsDirectory {
    path: PathBuf,
    /// Held until the end.
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
    /// The text of `result.json` if `path` holds the finished run of `specification`; `None` if
    /// there is no run, or one that did not end.
    ///
    /// # Errors
    /// Bad input when another specification was run there; failed when it cannot be read.
    pub(crate) fn finished(
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

    /// Makes the directory, if there is none, and holds it.
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
        let lock = File::create(&lock_path)
            .with_context(|| format!("cannot write {}", lock_path.display()))?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { path: path.to_owned(), _lock: lock }),
            Err(TryLockError::WouldBlock) => {
                bail!("another osteon is running in {}", path.display())
            }
            Err(TryLockError::Error(error)) => {
                Err(anyhow::Error::new(error)
                    .context(format!("cannot lock {}", lock_path.display())))
            }
        }
    }

    /// Where a store of this run is kept until it has ended.
    pub(crate) fn store(&self) -> PathBuf {
        self.path.join(STORE)
    }

    /// The request that stands for this directory, the same one at every call.
    pub(crate) fn request_id(&self) -> Result<String, Failure> {
        let path = self.path.join(REQUEST);
        if let Some(id) = read_if_there(&path).map_err(Failure::Failed)?
            && !id.trim().is_empty()
        {
            return Ok(id.trim().to_owned());
        }
        let id = random_id();
        write(&path, &format!("{id}\n")).map_err(Failure::Failed)?;
        Ok(id)
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
            write(&self.path.join(JOB), &job_file::to_toml(&fetched.specification))?;
            if kind == JobKind::Identification {
                write(&self.path.join(HISTORY), &results_csv::history(&fetched.history))?;
            }
            let outcomes = fetched.result.best.as_ref().map(|best| best.outcomes.as_slice());
            let realizations = results_csv::realizations(outcomes.unwrap_or_default());
            write(&self.path.join(REALIZATIONS), &realizations)?;
            write(&self.path.join(RESULT), &text)
        };
        write_all().map_err(Failure::Failed)?;
        // What served only to continue is not needed any more; a leftover does no harm.
        for name in [REQUEST, LOCK] {
            drop(fs::remove_file(self.path.join(name)));
        }
        drop(fs::remove_dir_all(self.store()));
        Ok(text)
    }
}

/// Refuses a directory whose job is not `specification`, and says where they differ.
fn same_job(path: &Path, stored: &str, specification: &JobSpecification) -> Result<(), Failure> {
    let ours = job_file::to_toml(specification);
    if stored == ours {
        return Ok(());
    }
    let different = stored.lines().zip(ours.lines()).position(|(a, b)| a != b);
    let line = different.unwrap_or_else(|| stored.lines().count().min(ours.lines().count()));
    let shown = |text: &str| {
        let line = text.lines().nth(line).unwrap_or("(nothing)");
        line.chars().take(80).collect::<String>()
    };
    Err(Failure::bad_input(anyhow!(
        "{} belongs to a different specification (line {}: `{}` there, `{}` here); \
         choose another --out directory",
        path.display(),
        line + 1,
        shown(stored),
        shown(&ours)
    )))
}

/// Writes `text` to `path` so that a reader sees either what was there before, or all of it.
pub(crate) fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = path.with_file_name(name);
    let write = || -> std::io::Result<()> {
        let mut file = File::create(&part)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        fs::rename(&part, path)
    };
    write().with_context(|| format!("cannot write {}", path.display()))
}

fn read_if_there(path: &Path) -> anyhow::Result<Option<String>> {
    match fs::read_to_string(path) {
        Ok(text) => Ok(Some(text)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error).with_context(|| format!("cannot read {}", path.display())),
    }
}

/// 128 random bits in hexadecimal.
fn random_id() -> String {
    use std::hash::{BuildHasher as _, RandomState};
    let process = std::process::id();
    let half = |salt: u8| RandomState::new().hash_one((process, salt));
    format!("{:016x}{:016x}", half(0), half(1))
}
