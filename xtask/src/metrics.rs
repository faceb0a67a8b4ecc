//! Checks metrics, alert rules and dashboard: by the tests of `tests/metrics.rs`, and by promtool on
//! what these scraped.

use std::fs::{self, File};
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context as _, Result, bail};

use crate::places::{programs, root};
use crate::process::{cargo, cargo_command};

/// `cargo xtask test metrics`.
pub(crate) fn check(words: &[String]) -> Result<()> {
    if !words.is_empty() {
        bail!("usage: cargo xtask test metrics");
    }
    let directory = programs()?.with_file_name("metrics");
    // The files of an earlier run would be checked if the tests wrote none.
    drop(fs::remove_dir_all(&directory));
    let uncreated = || format!("cannot create {}", directory.display());
    fs::create_dir_all(&directory).with_context(uncreated)?;
    let mut test = cargo_command(&["test", "--workspace", "--test", "metrics"]);
    cargo(test.env("OSTEON_METRICS_DIRECTORY", &directory))?;
    let Some(promtool) = promtool()? else {
        eprintln!(
            "rules and metrics are not checked by promtool, which is not found (on Debian it is in \
             the package prometheus)"
        );
        return Ok(());
    };
    let promtool = |arguments: &[&str]| {
        let mut command = Command::new(&promtool);
        command.args(arguments).current_dir(root().join("deploy/prometheus"));
        command
    };
    let scraped = directory.join("scraped.txt");
    let scraped = File::open(&scraped).context("the tests have scraped nothing")?;
    cargo(promtool(&["check", "metrics"]).stdin(scraped))?;
    cargo(promtool(&["check", "rules"]).arg(directory.join("dashboard.yml")))?;
    cargo(&mut promtool(&["check", "rules", "alerts.yml"]))?;
    cargo(&mut promtool(&["test", "rules", "alerts_test.yml"]))
}

/// Returns the path of promtool: below the target directory, where CI puts it, or on the path.
fn promtool() -> Result<Option<PathBuf>> {
    let candidates = [programs()?.with_file_name("tools").join("bin/promtool"), "promtool".into()];
    let runs = |program: &PathBuf| {
        Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
    };
    Ok(candidates.into_iter().find(runs))
}
