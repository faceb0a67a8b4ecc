//! Writing the files of a results directory: each by rename, followed by `provenance.json`, which
//! records the origin of all of them, and finally the result.

use std::fs;
use std::io::{self, BufWriter, IntoInnerError, Write};
use std::path::Path;

use anyhow::Context as _;
use osteon_common::version::{Program, RESULT_SCHEMA};
use osteon_common::visible;
use osteon_files::report::IntegrityReport;
use osteon_files::user_file;
use serde_json::{Value, json};

/// The result file, written last: a directory that contains it is complete.
pub const RESULT: &str = "result.json";
/// The file that records the origin of the other files.
pub const PROVENANCE: &str = "provenance.json";

/// Origin of the files of a directory.
pub struct ResultOrigin<'a> {
    /// Kind of the computation: `kind` of the result.
    pub kind: &'a str,
    /// The program that computed the result.
    pub program: &'a Program,
    /// Digest of the result, if it has one.
    pub digest: Option<&'a str>,
    /// Seed of the germs, if any were drawn.
    pub seed: Option<u64>,
    /// Set if a host that computed a part of the result was banned after the job had ended.
    pub integrity: Option<&'a IntegrityReport>,
}

/// Writer of the files of a directory, one after another.
pub struct ResultFiles<'a> {
    directory: &'a Path,
    written: Vec<Value>,
}

impl<'a> ResultFiles<'a> {
    /// Removes an old result: the directory is incomplete until [`finish`](Self::finish).
    pub fn begin(directory: &'a Path) -> anyhow::Result<Self> {
        for name in [RESULT, PROVENANCE] {
            remove_if_there(&directory.join(name))?;
        }
        Ok(Self { directory, written: Vec::new() })
    }

    /// Writes a file.
    pub fn write(&mut self, name: &str, text: &str) -> anyhow::Result<()> {
        self.write_by(name, |file| file.write_all(text.as_bytes()))
    }

    /// Same as [`write`](Self::write), for a text that `print` writes piece by piece.
    pub fn write_by(
        &mut self,
        name: &str,
        print: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> anyhow::Result<()> {
        let mut hash = blake3::Hasher::new();
        write_by(&self.directory.join(name), |file| print(&mut Hashing { file, hash: &mut hash }))?;
        self.note(name, &hash);
        Ok(())
    }

    /// Writes `provenance.json`, then the result.
    pub fn finish(mut self, result: &str, origin: &ResultOrigin<'_>) -> anyhow::Result<()> {
        let mut hash = blake3::Hasher::new();
        hash.update(result.as_bytes());
        self.note(RESULT, &hash);
        let Program { version, numerics, commit } = origin.program;
        let mut provenance = json!({
            "schema": RESULT_SCHEMA,
            "kind": origin.kind,
            "program": "osteon",
            "version": version,
            "numerics": numerics,
            "commit": commit,
            "digest": origin.digest,
            "seed": origin.seed,
            "files": self.written,
        });
        if let Some(integrity) = origin.integrity {
            provenance["integrity"] = json!(integrity);
        }
        write(&self.directory.join(PROVENANCE), &format!("{provenance:#}\n"))?;
        write(&self.directory.join(RESULT), result)
    }

    fn note(&mut self, name: &str, hash: &blake3::Hasher) {
        self.written.push(json!({
            "name": name,
            "blake3": hash.finalize().to_hex().as_str(),
            "bytes": hash.count(),
        }));
    }
}

/// Writer that also hashes the bytes written.
struct Hashing<'a> {
    file: &'a mut dyn Write,
    hash: &'a mut blake3::Hasher,
}

impl Write for Hashing<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.hash.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Writes `text` to `path` atomically: a reader sees either the previous content or all of the new
/// one.
pub fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    write_by(path, |file| file.write_all(text.as_bytes()))
}

fn write_by(
    path: &Path,
    print: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> anyhow::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = path.with_file_name(name);
    let write = || -> io::Result<()> {
        let mut file = BufWriter::new(user_file::create(&part)?);
        print(&mut file)?;
        file.into_inner().map_err(IntoInnerError::into_error)?.sync_all()?;
        fs::rename(&part, path)
    };
    write().with_context(|| format!("cannot write {}", visible::path(path)))
}

/// Removes a file, if it is there.
pub fn remove_if_there(path: &Path) -> anyhow::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("cannot replace {}", visible::path(path)))
        }
        _ => Ok(()),
    }
}
