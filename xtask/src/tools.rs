//! Programs of others that commands need.

use std::path::PathBuf;
use std::process::Command;

use anyhow::Result;

use crate::places::programs;
use crate::process::{cargo, cargo_command};

/// Installs this version of a program of crates.io below the target directory, with these options of
/// `cargo install`, unless it is there. Returns its path.
pub(crate) fn install(name: &str, version: &str, options: &[&str]) -> Result<PathBuf> {
    let tools = programs()?.with_file_name("tools");
    let program = tools.join("bin").join(name);
    let present = Command::new(&program).arg("--version").output().is_ok_and(|output| {
        let text = String::from_utf8_lossy(&output.stdout);
        // Some print `name 1.2.3`, others `name v1.2.3`.
        let last = text.trim().split(' ').next_back().unwrap_or_default();
        last.strip_prefix('v').unwrap_or(last) == version
    });
    if !present {
        let install = ["install", name, "--version", version, "--locked", "--force", "--root"];
        cargo(cargo_command(&install).arg(&tools).args(options))?;
    }
    Ok(program)
}
