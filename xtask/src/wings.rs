//! Checks that the program can be built without each of its wings, and without all of them.

use std::fs;

use anyhow::{Context as _, Result, bail};

use crate::places::root;
use crate::process::{cargo, cargo_command};

/// `cargo xtask test wings`. Each check compiles the program alone, and the few crates whose features change
/// with the wing.
pub(crate) fn check(words: &[String]) -> Result<()> {
    if !words.is_empty() {
        bail!("usage: cargo xtask test wings");
    }
    let manifest = fs::read_to_string(root().join("Cargo.toml"))?;
    let wings = default_features(&manifest).context("Cargo.toml lists no default features")?;
    for absent in wings.iter().map(Some).chain([None]) {
        let others = wings.iter().filter(|wing| absent.is_some_and(|absent| absent != *wing));
        let features = others.copied().collect::<Vec<_>>().join(",");
        cargo(&mut cargo_command(&[
            "check",
            "--package",
            "osteon",
            "--bin",
            "osteon",
            "--no-default-features",
            "--features",
            &features,
        ]))?;
    }
    Ok(())
}

/// Returns the features that a manifest has by default, on one line.
fn default_features(manifest: &str) -> Option<Vec<&str>> {
    let list = manifest.lines().find_map(|line| line.strip_prefix("default = ["))?;
    let names = list.trim_end_matches(']').split(',');
    Some(names.map(|name| name.trim().trim_matches('"')).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wings_are_the_features_by_default() {
        let manifest = "[features]\ndefault = [\"live\", \"slurm\"]\nlive = []\n";
        assert_eq!(default_features(manifest), Some(vec!["live", "slurm"]));
    }
}
