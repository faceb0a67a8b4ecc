//! Checks the crates that osteon is built from with cargo-deny: licences, versions, sources and, if
//! the advisory database can be fetched, known vulnerabilities. The rules are in `deny.toml`.

use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, bail};

use crate::places::root;
use crate::process::cargo;
use crate::terminal::announce;
use crate::tools::install;

/// The version of cargo-deny for which the rules are written.
const VERSION: &str = "0.20.2";
/// Longest wait for the advisory database.
const FETCH_MAX: Duration = Duration::from_secs(60);
/// Interval at which the fetching process is polled.
const POLL: Duration = Duration::from_millis(100);

/// `cargo xtask lint deny`.
pub(crate) fn check(words: &[String]) -> Result<()> {
    if !words.is_empty() {
        bail!("usage: cargo xtask lint deny");
    }
    let program = install("cargo-deny", VERSION, &[])?;
    let deny = |arguments: &[&str]| {
        let mut command = Command::new(&program);
        command.args(arguments).current_dir(root());
        command
    };
    cargo(&mut deny(&["check", "licenses", "bans", "sources"]))?;
    if fetch_database(&mut deny(&["fetch", "db"]))? {
        return cargo(&mut deny(&["check", "--disable-fetch", "advisories"]));
    }
    eprintln!("advisories are not checked: their database cannot be had from here");
    Ok(())
}

/// Fetches the advisory database; returns whether that succeeded in time.
fn fetch_database(command: &mut Command) -> Result<bool> {
    announce(command);
    let mut child =
        command.stderr(Stdio::null()).spawn().with_context(|| format!("cannot run {command:?}"))?;
    let start = Instant::now();
    while start.elapsed() < FETCH_MAX {
        if let Some(status) = child.try_wait()? {
            return Ok(status.success());
        }
        thread::sleep(POLL);
    }
    child.kill()?;
    child.wait()?;
    Ok(false)
}
