//! Checks that the digest of a batch is the same on every instruction set of this machine, in every
//! build.

use std::collections::{BTreeMap, BTreeSet};
use std::env;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Result, bail};

use crate::process::{cargo, cargo_command, output};
use crate::terminal::say;

/// The study that prints digests.
const STUDY: &str = "digest";
/// The target that is type-checked.
const AARCH64: &str = "aarch64-unknown-linux-gnu";

/// A build of `osteon-study`.
struct Build {
    name: &'static str,
    arguments: &'static [&'static str],
    /// Compiler flags that replace the user's own; such a build has its own target directory.
    flags: Option<&'static str>,
}

const BUILDS: [Build; 3] = [
    Build { name: "debug", arguments: &["run"], flags: None },
    Build { name: "release", arguments: &["run", "--release"], flags: None },
    Build {
        name: "release, -C target-cpu=native",
        arguments: &["run", "--release"],
        flags: Some("-C target-cpu=native"),
    },
];

/// Prints the digests of every build, and fails unless each batch has only one; `words` are passed
/// to the study, e.g. `--realizations 100`.
pub(crate) fn compare(words: &[String]) -> Result<()> {
    let mut batches: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for build in BUILDS {
        let mut run = cargo_command(build.arguments);
        run.args(["--quiet", "--package", "osteon-study"]);
        if let Some(flags) = build.flags {
            let usual = env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
            let apart = PathBuf::from(usual).join("native");
            run.env("RUSTFLAGS", flags).env("CARGO_TARGET_DIR", apart);
        }
        run.args(["--", STUDY]).args(words);
        let text = output(&mut run)?;
        say(&format!("{}:\n\n{text}", build.name))?;
        let found = digests(&text);
        if found.is_empty() {
            bail!("{} printed no digest", build.name);
        }
        for (batch, digest) in found {
            batches.entry(batch).or_default().insert(digest);
        }
    }
    for (batch, digests) in &batches {
        if digests.len() != 1 {
            bail!("plate and dispersion {batch}: {} different digests", digests.len());
        }
    }
    say("Every batch has one digest, whatever computed it.\n")?;
    check_aarch64()
}

/// Returns batch and digest of each row of a table whose last columns are instruction set and
/// digest.
fn digests(text: &str) -> Vec<(String, String)> {
    let rows = text.lines().filter_map(|line| {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let [batch @ .., _isa, digest] = cells.as_slice() else {
            return None;
        };
        let is_digest = digest.len() == 64 && digest.chars().all(|c| c.is_ascii_hexdigit());
        is_digest.then(|| (batch.join(", "), (*digest).to_owned()))
    });
    rows.collect()
}

/// Type-checks the solver for AArch64, if the target is installed.
fn check_aarch64() -> Result<()> {
    let listed = Command::new("rustup").args(["target", "list", "--installed"]).output();
    let installed = listed.is_ok_and(|output| {
        String::from_utf8_lossy(&output.stdout).lines().any(|target| target == AARCH64)
    });
    if !installed {
        return say(&format!(
            "AArch64: skipped, {AARCH64} is not installed (rustup target add {AARCH64})."
        ));
    }
    cargo(&mut cargo_command(&["check", "--target", AARCH64, "-p", "osteon-solver"]))?;
    say("AArch64: the solver type-checks.")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digests_are_read_by_batch() {
        let (one, two) = ("0a".repeat(32), "0b".repeat(32));
        let text = format!(
            "`osteon-study digest` (osteon 0.1.0)\n\n| plate (mm) | dispersion | instruction set | digest |\n\
             |--:|--:|--:|--:|\n|  4 | 0.1 | fma | {one} |\n|  1 | 0.4 | avx2 | {two} |\n"
        );
        let expected = [("4, 0.1".to_owned(), one), ("1, 0.4".to_owned(), two)];
        assert_eq!(digests(&text), expected);
    }
}
