//! Tables of jobs and workers for people.

use osteon_proto::timestamp;
use osteon_proto::v1::{
    DepartedWorker, JobKind, JobSnapshot, JobState, ListWorkersResponse, WorkerSnapshot,
    WorkerStanding,
};

use super::{kind_name, progress, state_name, status_name};
use crate::output::times::utc;
use crate::progress::span;

/// All jobs.
pub(super) fn jobs(jobs: &[JobSnapshot]) -> String {
    let header = [
        "ID",
        "NAME",
        "USER",
        "KIND",
        "PRIORITY",
        "STATE",
        "SUBMITTED",
        "ENDED",
        "TIME",
        "WORKERS",
        "PROGRESS",
    ];
    let row = |job: &JobSnapshot| {
        let time = |time: Option<std::time::Duration>| time.and_then(utc).unwrap_or_default();
        vec![
            job.job.clone(),
            job.name.clone(),
            job.client.clone(),
            kind_name(job).to_owned(),
            if job.priority == 0 { String::new() } else { job.priority.to_string() },
            state(job).to_owned(),
            time(job.submit_time.as_ref().and_then(timestamp::from_message)),
            time(job.end_time.as_ref().and_then(timestamp::from_message)),
            span(job.elapsed_s),
            job.workers.to_string(),
            progress(job),
        ]
    };
    table(&header, jobs.iter().map(row).collect())
}

/// How a job stands, or ended: a propagation that is complete has not converged to anything, and
/// one that no worker computes does not run.
pub(super) fn state(job: &JobSnapshot) -> &'static str {
    match (status_name(job), job.kind(), job.state()) {
        (Some("converged"), JobKind::Propagation, _) => "done",
        (Some(status), ..) => status,
        (None, _, JobState::Running) if job.workers == 0 => "waiting",
        (None, ..) => state_name(job),
    }
}

/// The attached workers, and a line for each that went.
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
        "NUMBER", "HOST", "PROCESS", "THREADS", "VERSION", "ATTACHED", "HEARD", "RATE", "BATCHES",
        "OLDEST", "STANDING",
    ];
    let row = |worker: &WorkerSnapshot| {
        let attached = worker.attach_time.as_ref().and_then(timestamp::from_message);
        vec![
            worker.worker.to_string(),
            worker.host.clone(),
            worker.process.to_string(),
            worker.threads.to_string(),
            worker.version.clone(),
            attached.and_then(utc).unwrap_or_default(),
            format!("{} ago", span(worker.silent_s)),
            format!("{:.0}/s", worker.realizations_per_second),
            worker.batches.to_string(),
            worker.oldest_batch_s.map(span).unwrap_or_default(),
            standing_name(worker).to_owned(),
        ]
    };
    table(&header, workers.iter().map(row).collect())
}

fn departed(gone: &DepartedWorker) -> String {
    let when = gone.depart_time.as_ref().and_then(timestamp::from_message).and_then(utc);
    let held = match gone.batches {
        0 => String::new(),
        batches => format!("; others compute the {batches} batches it held"),
    };
    let DepartedWorker { worker, host, process, reason, .. } = gone;
    let line = format!("{host} (process {process}), worker {worker}: {reason}{held}");
    format!("left {}: {}\n", when.unwrap_or_default(), one_line(&line))
}

/// `ok`, `draining` or `distrusted`.
pub(in crate::output) fn standing_name(worker: &WorkerSnapshot) -> &'static str {
    match worker.standing() {
        WorkerStanding::Ok => "ok",
        WorkerStanding::Draining => "draining",
        WorkerStanding::Distrusted => "distrusted",
        WorkerStanding::Unspecified => "unknown",
    }
}

/// Columns of equal width, two spaces between; a column in which no row has anything is left out.
fn table(header: &[&str], mut rows: Vec<Vec<String>>) -> String {
    rows.iter_mut().flatten().for_each(|cell| *cell = one_line(cell));
    let width = |column: usize| {
        let widths = rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count());
        widths.max().filter(|width| *width > 0).map(|width| width.max(header[column].len()))
    };
    let widths: Vec<Option<usize>> = (0..header.len()).map(width).collect();
    let header = header.iter().map(|&cell| cell.to_owned()).collect();
    let mut text = String::new();
    for row in std::iter::once(&header).chain(&rows) {
        let mut line = String::new();
        for (cell, width) in row.iter().zip(&widths) {
            if let Some(width) = width {
                line.push_str(&format!("{cell:<width$}  "));
            }
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

/// What others chose to call themselves shall not write lines of its own.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '?' } else { c }).collect()
}
