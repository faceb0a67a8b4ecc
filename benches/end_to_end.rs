//! The whole program: wall time of `osteon propagate` from start to end, and the memory of a worker
//! over many realizations. `cargo bench -p osteon --bench end_to_end`
//!
//! Without `--bench`, as under `cargo test --benches`, it is a short run.

#![expect(clippy::print_stdout, reason = "the tables go to stdout")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context as _, Result, ensure};

mod service;

use service::{PROGRAM, Service};

/// The paper's optimum, N = 2747.
const JOB: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/optimum.toml");
fn main() -> Result<()> {
    let full = std::env::args().any(|argument| argument == "--bench");
    let (turns, counts) = if full { (20, [1_000, 100_000]) } else { (1, [10, 20]) };
    wall_time(turns)?;
    if Path::new("/proc/self/status").exists() {
        memory(&counts)?;
    }
    Ok(())
}

/// Wall time of the command, start of all its processes included: the shortest of some.
fn wall_time(turns: u32) -> Result<()> {
    let mut shortest = f64::INFINITY;
    for _ in 0..turns {
        let start = Instant::now();
        run(&["propagate", JOB, "--workers", "2", "--json"])?;
        shortest = shortest.min(start.elapsed().as_secs_f64());
    }
    println!(
        "`osteon propagate examples/optimum.toml --workers 2`: {shortest:.2} s from start to end"
    );
    Ok(())
}

/// Resident memory of one worker with two threads, after more and more realizations.
fn memory(counts: &[u32]) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let path = |name: &str| folder.path().join(name).display().to_string();
    let url = format!("unix:{}", path("socket"));
    let coordinator = Service::coordinator(&url, &folder.path().join("store"), &[])?;
    let worker = Service::start(&["worker", "--coordinator", &url, "--threads", "2"])?;
    let example = fs::read_to_string(JOB)?;
    println!("\n| realizations | worker, resident | largest |");
    println!("|--:|--:|--:|");
    for &count in counts {
        let job = PathBuf::from(path("job.toml"));
        let text = example.replace("realizations = 2747", &format!("realizations = {count}"));
        ensure!(text != example, "{JOB} has another number of realizations");
        fs::write(&job, text)?;
        run(&["propagate", &path("job.toml"), "--coordinator", &url, "--json"])?;
        let (now, largest) = (status(&worker, "VmRSS:")?, status(&worker, "VmHWM:")?);
        println!("| {count} | {now} | {largest} |");
    }
    drop(worker);
    drop(coordinator);
    Ok(())
}

fn run(arguments: &[&str]) -> Result<()> {
    let output = Command::new(PROGRAM).args(arguments).output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "osteon {}: {errors}", arguments.join(" "));
    Ok(())
}

/// A size that the system reports of a process.
fn status(service: &Service, key: &str) -> Result<String> {
    let text = fs::read_to_string(format!("/proc/{}/status", service.id()))?;
    let line = text.lines().find_map(|line| line.strip_prefix(key));
    Ok(line.with_context(|| format!("no {key}"))?.trim().to_owned())
}
