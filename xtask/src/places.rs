//! Where the workspace is, and what is built of it.

use std::env;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};

/// Returns the root of the workspace.
pub(crate) fn root() -> &'static Path {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here)
}

/// Returns the directory where cargo puts programs, including this one; its parent is the target
/// directory.
pub(crate) fn programs() -> Result<PathBuf> {
    let here = env::current_exe().context("cannot tell where xtask is")?;
    Ok(here.parent().context("xtask has no directory")?.to_owned())
}
