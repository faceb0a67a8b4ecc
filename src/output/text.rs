//! Output as text for people.

mod check;
mod cost;
mod data_notes;
mod design;
mod details;
mod fit;
mod groups;
mod identified;
mod layout;
mod modes;
mod number;
mod observations;
pub(super) mod operators;
mod posterior;
mod result;
mod set_up;
mod simulation;
mod solver;

use std::io::{self, Write};
use std::path::Path;

use osteon_client::client;
use osteon_common::visible;
use osteon_proto::v1::{
    BackupEnd, BannedWorker, ExplainResponse, JobKind, JobSnapshot, JobState, ListWorkersResponse,
    WorkerSnapshot,
};

use self::layout::{WIDTH, aligned, glued};
use self::number::significant;
use super::{
    Output, ShownCost, ShownDesign, ShownModes, ShownObservations, ShownResult, ShownSimulation,
};
use crate::doctor::Diagnosis;
use crate::progress::{JobProgress, line, span};

pub(crate) use self::layout::wrapped;

/// Width of the time before a line of `watch`, in columns.
const TIME_WIDTH: usize = 9;

/// Output as text for people.
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
        self.verbatim(&simulation::table(simulation))
    }

    fn modes(&mut self, modes: &ShownModes<'_>) -> io::Result<()> {
        self.verbatim(&modes::table(modes))
    }

    fn cost(&mut self, cost: &ShownCost<'_>) -> io::Result<()> {
        self.verbatim(&cost::table(cost))
    }

    fn observations(&mut self, observations: &ShownObservations<'_>) -> io::Result<()> {
        self.verbatim(&observations::table(observations))
    }
    fn design(&mut self, design: &ShownDesign<'_>) -> io::Result<()> {
        self.verbatim(&design::table(design))
    }

    fn submitted(&mut self, job: &str) -> io::Result<()> {
        self.verbatim(&format!("{}\n", visible::line(job)))
    }

    fn jobs(&mut self, jobs: &[JobSnapshot], banned: &[BannedWorker]) -> io::Result<()> {
        if jobs.is_empty() {
            self.verbatim("no jobs\n")?;
            return self.verbatim(&ban_lines(banned));
        }
        self.verbatim(&operators::jobs(jobs))?;
        self.verbatim(&ban_lines(banned))
    }

    fn workers(
        &mut self,
        workers: &ListWorkersResponse,
        banned: &[BannedWorker],
    ) -> io::Result<()> {
        self.verbatim(&operators::workers(workers))?;
        self.verbatim(&ban_lines(banned))
    }

    fn worker(&mut self, worker: &WorkerSnapshot) -> io::Result<()> {
        self.verbatim(&operators::attached(std::slice::from_ref(worker)))
    }

    fn diagnoses(&mut self, diagnoses: &[Diagnosis]) -> io::Result<()> {
        let rows = diagnoses.iter().flat_map(|diagnosis| {
            let Diagnosis { check, verdict, found, advice } = diagnosis;
            let row =
                |first: &str, second: &str, third: &str| [first, second, third].map(str::to_owned);
            let advice = advice.as_ref().map(|advice| row("", "", advice));
            std::iter::once(row(verdict.name(), check, found)).chain(advice)
        });
        self.verbatim(&aligned(&rows.collect::<Vec<_>>()))
    }

    fn health(&mut self, not_serving: Option<&str>) -> io::Result<()> {
        self.verbatim(&not_serving.map_or("serving\n".to_owned(), |reason| format!("{reason}\n")))
    }

    fn backup(&mut self, file: &Path, copy: &BackupEnd) -> io::Result<()> {
        self.verbatim(&format!("{} ({} bytes)\n", visible::path(file), copy.length))
    }

    fn pruned(&mut self, jobs: &[String]) -> io::Result<()> {
        let line = |job: &String| format!("{}\n", visible::line(job));
        self.verbatim(&jobs.iter().map(line).collect::<String>())
    }

    fn explanation(&mut self, explained: &ExplainResponse) -> io::Result<()> {
        self.verbatim(&wrapped(&explained.text))
    }

    fn snapshot(&mut self, snapshot: &JobSnapshot) -> io::Result<()> {
        let time = glued(&format!("{:>7}  ", span(snapshot.elapsed_s)));
        // A job counts as running once it has an evaluation.
        let state = match snapshot.state() {
            JobState::Running => String::new(),
            _ => format!("{}: ", operators::state(snapshot)),
        };
        let text = match progress(snapshot, WIDTH - TIME_WIDTH - state.len()) {
            progress if progress.is_empty() => state.trim_end_matches(": ").to_owned(),
            progress => format!("{state}{progress}"),
        };
        self.verbatim(&wrapped(&format!("{time}{text}")))
    }

    fn verbatim(&mut self, text: &str) -> io::Result<()> {
        self.writer.write_all(text.as_bytes())?;
        self.writer.flush()
    }
}

/// Returns a line for each worker that was banned because it computed wrongly.
fn ban_lines(banned: &[BannedWorker]) -> String {
    let line = |worker: &BannedWorker| {
        let BannedWorker { host, process, reason, elapsed_s, .. } = worker;
        let (host, reason) = (visible::line(host), visible::line(reason));
        let ago = span(*elapsed_s);
        wrapped(&format!("banned {ago} ago: {host} (process {process}) {reason}"))
    };
    banned.iter().map(line).collect()
}

/// Returns `identification` or `propagation`.
pub(super) fn kind_name(snapshot: &JobSnapshot) -> &'static str {
    match snapshot.kind() {
        JobKind::Identification => "identification",
        JobKind::Propagation => "propagation",
        JobKind::Unspecified => "unknown",
    }
}

/// Returns `waiting`, `running` or `ended`.
pub(super) fn state_name(snapshot: &JobSnapshot) -> &'static str {
    match snapshot.state() {
        JobState::Waiting => "waiting",
        JobState::Running => "running",
        JobState::Ended => "ended",
        JobState::Unspecified => "unknown",
    }
}

/// Returns the name of the final status; `None` while the job has not ended.
pub(super) fn status_name(snapshot: &JobSnapshot) -> Option<&'static str> {
    client::job_status(snapshot).map(osteon_common::results::Status::name)
}

/// Returns the progress of a job in this many columns; a reason and what was found out about its hosts are not
/// shortened, however long they are.
fn progress(snapshot: &JobSnapshot, width: usize) -> String {
    // A case file may follow the first line of a reason.
    let reason = snapshot.reason.lines().next().unwrap_or_default();
    let progress = line(snapshot, &JobProgress::default(), width);
    let parts = [progress, reason.to_owned(), snapshot.integrity.clone()];
    parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; ")
}
