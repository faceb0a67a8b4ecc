//! Output for people.

mod check;
mod groups;
mod identified;
pub(super) mod operators;
mod result;
mod solver;

use std::io::{self, Write};
use std::path::Path;

use osteon_proto::v1::{
    BackupEnd, ExpelledWorker, JobKind, JobSnapshot, JobState, ListWorkersResponse, WorkerSnapshot,
};

use super::{Output, ShownResult, ShownSimulation, solver_value};
use crate::client;
use crate::progress::{describe, span};

/// Output for people.
pub(crate) struct TextOutput<'a> {
    writer: Box<dyn Write + 'a>,
}

impl<'a> TextOutput<'a> {
    pub(crate) fn new(writer: Box<dyn Write + 'a>) -> Self {
        Self { writer }
    }
}

impl Output for TextOutput<'_> {
    fn result(&mut self, result: &ShownResult<'_>) -> io::Result<()> {
        self.verbatim(&result::table(result))
    }

    fn simulation(&mut self, simulation: &ShownSimulation<'_>) -> io::Result<()> {
        self.verbatim(&simulation_table(simulation))
    }

    fn submitted(&mut self, job: &str) -> io::Result<()> {
        self.verbatim(&format!("{job}\n"))
    }

    fn jobs(&mut self, jobs: &[JobSnapshot], expelled: &[ExpelledWorker]) -> io::Result<()> {
        if jobs.is_empty() {
            self.verbatim("no jobs\n")?;
            return self.verbatim(&expelled_lines(expelled));
        }
        self.verbatim(&operators::jobs(jobs))?;
        self.verbatim(&expelled_lines(expelled))
    }

    fn workers(
        &mut self,
        workers: &ListWorkersResponse,
        expelled: &[ExpelledWorker],
    ) -> io::Result<()> {
        self.verbatim(&operators::workers(workers))?;
        self.verbatim(&expelled_lines(expelled))
    }

    fn worker(&mut self, worker: &WorkerSnapshot) -> io::Result<()> {
        self.verbatim(&operators::attached(std::slice::from_ref(worker)))
    }

    fn health(&mut self, not_serving: Option<&str>) -> io::Result<()> {
        self.verbatim(&not_serving.map_or("serving\n".to_owned(), |reason| format!("{reason}\n")))
    }

    fn backup(&mut self, file: &Path, copy: &BackupEnd) -> io::Result<()> {
        self.verbatim(&format!("{} ({} bytes)\n", file.display(), copy.length))
    }

    fn pruned(&mut self, jobs: &[String]) -> io::Result<()> {
        self.verbatim(&jobs.iter().map(|job| format!("{job}\n")).collect::<String>())
    }

    fn snapshot(&mut self, snapshot: &JobSnapshot) -> io::Result<()> {
        let state = operators::state(snapshot);
        let time = span(snapshot.elapsed_s);
        let line = match progress(snapshot).as_str() {
            "" => format!("{time:>7}  {state}\n"),
            progress => format!("{time:>7}  {state}: {progress}\n"),
        };
        self.verbatim(&line)
    }

    fn verbatim(&mut self, text: &str) -> io::Result<()> {
        self.writer.write_all(text.as_bytes())?;
        self.writer.flush()
    }
}

/// A line for each worker that was found to compute wrongly.
fn expelled_lines(expelled: &[ExpelledWorker]) -> String {
    let line = |worker: &ExpelledWorker| {
        let ExpelledWorker { host, process, reason, elapsed_s, .. } = worker;
        format!("expelled {} ago: {host} (process {process}) {reason}\n", span(*elapsed_s))
    };
    expelled.iter().map(line).collect()
}

/// `identification` or `propagation`.
pub(super) fn kind_name(snapshot: &JobSnapshot) -> &'static str {
    match snapshot.kind() {
        JobKind::Identification => "identification",
        JobKind::Propagation => "propagation",
        JobKind::Unspecified => "unknown",
    }
}

/// `waiting`, `running` or `ended`.
pub(super) fn state_name(snapshot: &JobSnapshot) -> &'static str {
    match snapshot.state() {
        JobState::Waiting => "waiting",
        JobState::Running => "running",
        JobState::Ended => "ended",
        JobState::Unspecified => "unknown",
    }
}

/// How the job ended; `None` while it has not.
pub(super) fn status_name(snapshot: &JobSnapshot) -> Option<&'static str> {
    client::job_status(snapshot).map(osteon_common::results::Status::name)
}

fn progress(snapshot: &JobSnapshot) -> String {
    // A case file may follow the first line of a reason.
    let reason = snapshot.reason.lines().next().unwrap_or_default();
    let parts = [describe(snapshot), reason.to_owned()];
    parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; ")
}

fn simulation_table(simulation: &ShownSimulation<'_>) -> String {
    let picking = simulation.setup.picking;
    let mut text = match simulation.arrival {
        Ok(arrival) => format!(
            "velocity {} m/s ({} extremum, threshold {:?} of the packet's peak)\n",
            significant(arrival.velocity, 8),
            picking.extremum.name(),
            picking.threshold
        ),
        Err(failure) if failure.detail.is_empty() => {
            format!("no velocity: {}\n", failure.kind.name())
        }
        Err(failure) => format!("no velocity: {} ({})\n", failure.kind.name(), failure.detail),
    };
    if let Ok(arrival) = simulation.arrival {
        text.push_str("\nreceiver  x1 (mm)   time (µs)\n");
        let positions = simulation.setup.probe.receivers.positions();
        for (j, (x1, time)) in positions.zip(&arrival.times).enumerate() {
            text.push_str(&format!("{:>8}  {:>7.3}  {:>10.5}\n", j + 1, x1 * 1e3, time * 1e6));
        }
    }
    let solver = solver_value(simulation.setup, simulation.arrival.as_ref().ok());
    text.push_str(&format!("\n{}\n", solver::line(&solver)));
    if let Some(check) = simulation.check {
        text.push_str(&format!("\n{}", check::table(check)));
    }
    if let Some(path) = simulation.traces {
        text.push_str(&format!("\ntraces in {}\n", path.display()));
    }
    text
}

/// Columns of equal width, two spaces between.
pub(super) fn aligned<const COLUMNS: usize>(rows: &[[String; COLUMNS]]) -> String {
    let width =
        |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; COLUMNS] = std::array::from_fn(width);
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (cell, width) in row.iter().zip(widths) {
            line.push_str(&format!("{cell:<width$}  "));
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

/// A number with so many significant digits, without trailing zeros.
pub(super) fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    let exponent: i32 = scientific.split('e').nth(1).and_then(|e| e.parse().ok()).unwrap_or(0);
    if !(-4..=9).contains(&exponent) {
        return scientific;
    }
    let decimals = usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0);
    let plain = format!("{value:.decimals$}");
    if plain.contains('.') {
        plain.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        plain
    }
}
