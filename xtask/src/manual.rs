//! Manual pages and completions for packages, written by the program itself.

use std::fs;

use anyhow::{Context as _, Result, bail};

use crate::places::programs;
use crate::process::{cargo, cargo_command, output};

/// Shells whose completions are packaged, and the names of their scripts.
const SHELLS: [(&str, &str); 3] =
    [("bash", "osteon.bash"), ("zsh", "_osteon"), ("fish", "osteon.fish")];

/// Builds the program for release, and writes its manual pages to `man` and its completions to
/// `completions` beside it.
pub(crate) fn write(words: &[String]) -> Result<()> {
    if !words.is_empty() {
        bail!("usage: cargo xtask package man");
    }
    cargo(&mut cargo_command(&["build", "--release", "--bin", "osteon"]))?;
    let release = programs()?.with_file_name("release");
    let run = ["run", "--release", "--quiet", "--bin", "osteon", "--"];
    cargo(cargo_command(&run).arg("man").arg(release.join("man")))?;
    let completions = release.join("completions");
    fs::create_dir_all(&completions)
        .with_context(|| format!("cannot create {}", completions.display()))?;
    for (shell, name) in SHELLS {
        let script = output(cargo_command(&run).args(["completions", shell]))?;
        let path = completions.join(name);
        fs::write(&path, script).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}
