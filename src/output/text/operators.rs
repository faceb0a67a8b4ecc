//! Tables of jobs and workers as text.

use osteon_client::client;
use osteon_common::results::Status;
use osteon_common::visible;
use osteon_proto::timestamp;
use osteon_proto::v1::{
    DepartedWorker, JobKind, JobSnapshot, JobState, ListWorkersResponse, WorkerSnapshot,
    WorkerState,
};

use unicode_width::UnicodeWidthStr as _;

use super::layout::{INDENT, WIDTH, glued, wrapped};
use super::{kind_name, progress, state_name};
use crate::output::times::utc;
use crate::progress::span;

/// A table of jobs. The progress of a job is shown below its row.
pub(super) fn jobs(jobs: &[JobSnapshot]) -> String {
    let header =
        ["ID", "NAME", "USER", "KIND", "PRIORITY", "STATE", "SUBMITTED", "TIME", "WORKERS"];
    let row = |job: &JobSnapshot| {
        let submitted = job.submit_time.as_ref().and_then(timestamp::from_message).and_then(utc);
        vec![
            job.job.clone(),
            job.name.clone(),
            job.client.clone(),
            kind_name(job).to_owned(),
            if job.priority == 0 { String::new() } else { job.priority.to_string() },
            state(job).to_owned(),
            submitted.unwrap_or_default(),
            span(job.elapsed_s),
            job.workers.to_string(),
        ]
    };
    let below = |job: &JobSnapshot| match progress(job, WIDTH - INDENT) {
        text if text.is_empty() => text,
        text => wrapped(&format!("{}{text}", glued(&" ".repeat(INDENT)))),
    };
    table(&header, jobs.iter().map(|job| (row(job), below(job))).collect())
}

/// State or ending of a job. A complete propagation is not said to have converged, and a job that
/// no worker computes is not said to run.
pub(super) fn state(job: &JobSnapshot) -> &'static str {
    match (client::job_status(job), job.kind(), job.state()) {
        (Some(Status::Converged), JobKind::Propagation, _) => "done",
        (Some(status), ..) => status.name(),
        (None, _, JobState::Running) if job.workers == 0 => "waiting",
        (None, ..) => state_name(job),
    }
}

/// The attached workers, and a line for each one that has left.
pub(super) fn workers(list: &ListWorkersResponse) -> String {
    let mut text = match list.workers.is_empty() {
        true => "no workers\n".to_owned(),
        false => attached(&list.workers),
    };
    text.extend(list.departed.iter().map(departed));
    text
}

/// A table of attached workers.
pub(super) fn attached(workers: &[WorkerSnapshot]) -> String {
    let header = [
        "NUMBER", "HOST", "PROCESS", "SLOTS", "VERSION", "ATTACHED", "HEARD", "RATE", "BATCHES",
        "OLDEST", "STATE",
    ];
    let row = |worker: &WorkerSnapshot| {
        let attached = worker.attach_time.as_ref().and_then(timestamp::from_message);
        vec![
            worker.worker.to_string(),
            worker.host.clone(),
            worker.process.to_string(),
            worker.slots.to_string(),
            worker.version.clone(),
            attached.and_then(utc).unwrap_or_default(),
            format!("{} ago", span(worker.silent_s)),
            format!("{:.0}/s", worker.realizations_per_second),
            worker.batches.to_string(),
            worker.oldest_batch_s.map(span).unwrap_or_default(),
            worker_state_name(worker).to_owned(),
        ]
    };
    table(&header, workers.iter().map(|worker| (row(worker), String::new())).collect())
}

fn departed(gone: &DepartedWorker) -> String {
    let when = gone.depart_time.as_ref().and_then(timestamp::from_message).and_then(utc);
    let held = match gone.batches {
        0 => String::new(),
        1 => "; others compute the batch it held".to_owned(),
        batches => format!("; others compute the {batches} batches it held"),
    };
    let DepartedWorker { worker, host, process, reason, .. } = gone;
    let line = format!("{host} (process {process}), worker {worker}: {reason}{held}");
    wrapped(&format!("left {}: {}", when.unwrap_or_default(), visible::line(&line)))
}

/// `ok`, `draining`, `distrusted` or `probation`.
pub(in crate::output) fn worker_state_name(worker: &WorkerSnapshot) -> &'static str {
    match worker.state() {
        WorkerState::Ok => "ok",
        WorkerState::Draining => "draining",
        WorkerState::Distrusted => "distrusted",
        WorkerState::Probation => "probation",
        WorkerState::Unspecified => "unknown",
    }
}

/// Columns of equal width with two spaces between them, and below each row its own text. A column
/// without any content is left out.
fn table(header: &[&str], rows: Vec<(Vec<String>, String)>) -> String {
    // Some cells contain names given by others.
    let cells =
        |row: Vec<String>| row.iter().map(|cell| visible::line(cell).into_owned()).collect();
    let rows: Vec<(Vec<String>, String)> =
        rows.into_iter().map(|(row, below)| (cells(row), below)).collect();
    let width = |column: usize| {
        let widths = rows.iter().filter_map(|(row, _)| row.get(column)).map(|cell| cell.width());
        widths.max().filter(|width| *width > 0).map(|width| width.max(header[column].len()))
    };
    let widths: Vec<Option<usize>> = (0..header.len()).map(width).collect();
    let header = (header.iter().map(|&cell| cell.to_owned()).collect(), String::new());
    let mut text = String::new();
    for (row, below) in std::iter::once(&header).chain(&rows) {
        let mut line = String::new();
        for (cell, width) in row.iter().zip(&widths) {
            if let Some(width) = width {
                line.push_str(cell);
                line.push_str(&" ".repeat(width - cell.width() + 2));
            }
        }
        text.push_str(line.trim_end());
        text.push('\n');
        text.push_str(below);
    }
    text
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use osteon_proto::v1::JobStatus;

    use super::*;

    fn worker(number: u64) -> WorkerSnapshot {
        WorkerSnapshot {
            worker: number,
            host: "node-7".to_owned(),
            process: 4711,
            slots: 64,
            version: "0.1.0".to_owned(),
            attach_time: Some(timestamp::to_message(Duration::from_secs(1_790_000_000))),
            silent_s: 0.5,
            realizations_per_second: 2811.4,
            batches: 2,
            oldest_batch_s: Some(0.25),
            state: WorkerState::Ok.into(),
        }
    }

    #[test]
    fn workers_are_a_table_and_those_that_went_a_line_each() {
        let idle = WorkerSnapshot {
            realizations_per_second: 0.0,
            batches: 0,
            oldest_batch_s: None,
            state: WorkerState::Draining.into(),
            ..worker(12)
        };
        let gone = DepartedWorker {
            worker: 3,
            host: "node-8".to_owned(),
            process: 5,
            depart_time: Some(timestamp::to_message(Duration::from_secs(1_790_000_060))),
            reason: "its connection ended".to_owned(),
            batches: 2,
        };
        let list = ListWorkersResponse { workers: vec![worker(1), idle], departed: vec![gone] };
        let expected = "\
NUMBER  HOST    PROCESS  SLOTS  VERSION  ATTACHED              HEARD      RATE    BATCHES  OLDEST  STATE
1       node-7  4711     64     0.1.0    2026-09-21T14:13:20Z  0.5 s ago  2811/s  2        0.2 s   ok
12      node-7  4711     64     0.1.0    2026-09-21T14:13:20Z  0.5 s ago  0/s     0                draining
left 2026-09-21T14:14:20Z: node-8 (process 5), worker 3: its connection ended;
  others compute the 2 batches it held
";
        assert_eq!(workers(&list), expected);
        assert_eq!(workers(&ListWorkersResponse::default()), "no workers\n");
    }

    #[test]
    fn a_column_that_says_nothing_is_left_out_and_names_write_no_lines_of_their_own() {
        let mut hostile = worker(1);
        hostile.version = "1\n2 \u{1b}[31m".to_owned();
        hostile.oldest_batch_s = None;
        let table = attached(&[hostile]);
        assert_eq!(table.lines().count(), 2, "{table}");
        assert!(table.contains("1\\n2 \\u{1b}[31m") && !table.contains("OLDEST"), "{table}");
    }

    #[test]
    fn a_state_says_what_a_person_would_say() {
        let job = |kind: JobKind, stands: JobState, status: JobStatus, workers| JobSnapshot {
            kind: kind.into(),
            state: stands.into(),
            status: status.into(),
            workers,
            ..JobSnapshot::default()
        };
        use JobState::{Ended, Running};
        let (search, propagation) = (JobKind::Identification, JobKind::Propagation);
        for (job, expected) in [
            (job(search, Running, JobStatus::Unspecified, 1), "running"),
            (job(search, Running, JobStatus::Unspecified, 0), "waiting"),
            (job(search, Ended, JobStatus::Converged, 0), "converged"),
            (job(propagation, Ended, JobStatus::Converged, 0), "done"),
            (job(search, Ended, JobStatus::NotMatched, 0), "not_matched"),
            (job(propagation, Ended, JobStatus::Failed, 0), "failed"),
        ] {
            assert_eq!(state(&job), expected);
        }
    }
}
