//! `cargo xtask` command that runs the storm of kills of `tests/chaos` for any number of kills.

use anyhow::{Context as _, Result, bail};

use crate::process::{cargo, cargo_command};

const USAGE: &str = "usage: cargo xtask test chaos [--kills N] [--seed S]";
/// Default number of kills of the coordinator, and of workers.
const KILLS: u64 = 200;
/// Name of the test.
const STORM: &str = "kills::killed_and_stopped_again_and_again_every_job_ends_with_its_digest";

/// Runs the storm with the number of kills and the seed in `words`.
pub(crate) fn storm(words: &[String]) -> Result<()> {
    let (mut kills, mut seed) = (KILLS, 1);
    let mut words = words.iter();
    while let Some(word) = words.next() {
        let number = words.next().context(USAGE)?.parse().context(USAGE)?;
        match word.as_str() {
            "--kills" => kills = number,
            "--seed" => seed = number,
            _ => bail!(USAGE),
        }
    }
    let arguments = ["test", "--package", "osteon", "--test", "chaos", "--", "--nocapture"];
    let mut command = cargo_command(&[&arguments[..], &["--exact", STORM]].concat());
    command.env("OSTEON_CHAOS_KILLS", kills.to_string());
    command.env("OSTEON_CHAOS_SEED", seed.to_string());
    cargo(&mut command)
}
