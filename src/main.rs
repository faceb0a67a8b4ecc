//! The command line of osteon: parses arguments, calls the other crates, prints results.
//!
//! Results go to stdout through [`output`], everything else to stderr. Exit codes: 0 done, 1 the
//! run failed or was cancelled, 2 bad usage or bad input, 77 this machine computes wrongly, 130 and 143 ended by
//! SIGINT and SIGTERM.

#![forbid(unsafe_code)]

mod arguments;
mod commands;
mod cost;
mod doctor;
mod exit_status;
#[cfg(test)]
mod fuzz;
mod listener_security;
mod log_filter;
mod logging;
mod manual;
mod new_files;
mod output;
mod prepared_command;
mod process_context;
mod program;
mod progress;
mod resolved;
#[cfg(test)]
#[path = "../client/src/sample_result.rs"]
mod sample_result;
mod signals;
mod telemetry;
mod unsearched_groups;
mod user;
mod usual_shifts;
mod warnings;
mod wings;

use std::process::ExitCode;

use clap::Parser as _;

use crate::arguments::{Arguments, LogFormat};
use crate::exit_status::{CommandFailure, ExitStatus};
use crate::telemetry::Telemetry;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    // Before the log is set up, failures are reported as text.
    let mut log_format = LogFormat::Text;
    match run(arguments, &mut log_format) {
        Ok(ExitStatus::Done) | Err(CommandFailure::ClosedPipe) => ExitCode::SUCCESS,
        Ok(ExitStatus::RunFailed) => ExitCode::from(1),
        Err(failure) => {
            logging::report(&failure, log_format);
            ExitCode::from(failure.exit_code())
        }
    }
}

fn run(arguments: Arguments, log_format: &mut LogFormat) -> Result<ExitStatus, CommandFailure> {
    let command = commands::prepare(arguments)?;
    logging::start(command.log_level, command.log_format)?;
    *log_format = command.log_format;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| {
            CommandFailure::failed(anyhow::Error::new(error).context("cannot start"))
        })?;
    runtime.block_on(async { signals::report_large_files() });
    // Its client needs the runtime, and outlives the command.
    let telemetry = runtime.block_on(async { Telemetry::start(command.name) })?;
    let result = runtime.block_on(command.perform());
    telemetry.end();
    // An abandoned computation may still occupy a thread; its result is not needed.
    runtime.shutdown_background();
    result
}
