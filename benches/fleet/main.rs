//! Whether jobs get slower as workers are added: a fleet of simulated workers over real gRPC streams
//! at a real coordinator. `cargo xtask bench fleet --help`
//!
//! The coordinator is a process of its own with its durable store. The workers are tasks of this process,
//! each with its own connection and stream. They speak as `osteon worker` does, but compute nothing:
//! a batch is answered, with the velocities of a cheap function, when a worker's slots would have
//! computed it. A first job, which is not measured, shows the coordinator how fast its workers are,
//! as most evaluations of a search find them. All jobs of one call must have the same digest.
//!
//! Coordinator and fleet share the processors of this machine, so that a row's time is no less than
//! the processor time of both divided by their number.

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "the table, and how far it is")]

mod arguments;
#[path = "../../coordinator/tests/fake/mod.rs"]
#[expect(dead_code, clippy::unwrap_used, reason = "each benchmark uses a part of it")]
mod fake;
#[path = "../../coordinator/tests/fake/grouped.rs"]
mod grouped;
mod job;
mod measured;
mod process;
#[path = "../service/mod.rs"]
mod service;
mod slots;
mod worker;

use anyhow::{Result, ensure};
use clap::Parser as _;
use osteon_coordinator::service::open_files;

use arguments::FleetArguments;
use measured::{HEADER, measure};

#[tokio::main]
async fn main() -> Result<()> {
    let rows = FleetArguments::parse().rows()?;
    // A connection of each worker; the coordinator inherits the limit.
    open_files::raise_limit()?;
    println!("{HEADER}");
    let mut digest: Option<String> = None;
    for row in &rows {
        let measured = measure(row).await?;
        println!("{}", measured.row());
        let expected = digest.get_or_insert_with(|| measured.digest.clone());
        ensure!(
            measured.digest == *expected,
            "the digest of this row is {}, that of the first is {expected}",
            measured.digest
        );
    }
    if let Some(digest) = digest {
        eprintln!("{} jobs, each with the digest {digest}", rows.len());
    }
    Ok(())
}
