//! Measures fleets of simulated workers at a real coordinator.

use anyhow::Result;

use crate::process::{cargo, cargo_command};

/// The benchmark, which checks the words itself.
const BENCH: [&str; 6] = ["bench", "--package", "osteon", "--bench", "fleet", "--"];

/// Passes `words` on to the benchmark.
pub(crate) fn bench(words: &[String]) -> Result<()> {
    cargo(cargo_command(&BENCH).args(words))
}
