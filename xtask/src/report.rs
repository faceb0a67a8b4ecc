//! Looks at reports and at the live page in a browser: `tests/browser/report.py` and `live.py`.

use std::process::Command;

use anyhow::{Context as _, Result, bail};

use crate::places::{programs, root};
use crate::process::{cargo, cargo_command};

/// Names of the browser, as Debian and others install it.
const BROWSERS: [&str; 2] = ["chromium", "chromium-browser"];

/// The checks.
const SCRIPTS: [&str; 2] = ["tests/browser/report.py", "tests/browser/live.py"];

/// `cargo xtask test report`: makes reports, and checks them in headless Chromium with the network off; then
/// uses the live page of a coordinator.
pub(crate) fn check(words: &[String]) -> Result<()> {
    if !words.is_empty() {
        bail!("usage: cargo xtask test report");
    }
    let runs = |name: &&str| {
        Command::new(name).arg("--version").output().is_ok_and(|run| run.status.success())
    };
    let browser = BROWSERS.into_iter().find(runs);
    let browser = browser.context("there is no Chromium (on Debian the package chromium)")?;
    cargo(&mut cargo_command(&["build", "--bin", "osteon"]))?;
    for script in SCRIPTS {
        let mut command = Command::new("python3");
        command.current_dir(root()).arg(script);
        command.arg("--osteon").arg(programs()?.join("osteon"));
        command.arg("--work").arg(programs()?.with_file_name("report"));
        cargo(command.args(["--chromium", browser])).context(
            "the check needs Python 3.10 or later with its module venv, and its requirements.txt",
        )?;
    }
    Ok(())
}
