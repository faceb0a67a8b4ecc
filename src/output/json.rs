//! Output for programs: one JSON value per command, without inf or NaN.

mod cost;
mod design;
mod modes;
mod observations;

use std::io::{self, Write};
use std::path::Path;

use osteon_proto::timestamp;
use osteon_proto::v1::{
    BackupEnd, BannedWorker, DepartedWorker, ExplainResponse, JobSnapshot, ListWorkersResponse,
    WorkerSnapshot,
};
use serde_json::{Value, json};

use super::{
    Output, ShownCost, ShownDesign, ShownModes, ShownObservations, ShownResult, ShownSimulation,
};
use crate::doctor::{self, Diagnosis};
use crate::output::text::operators::worker_state_name;
use crate::output::text::{kind_name, state_name, status_name};
use crate::output::times::utc;
use crate::program;

/// Output for programs.
pub(crate) struct JsonOutput<'a> {
    writer: Box<dyn Write + 'a>,
}

impl<'a> JsonOutput<'a> {
    pub(crate) fn new(writer: Box<dyn Write + 'a>) -> Self {
        Self { writer }
    }

    fn value(&mut self, value: &Value) -> io::Result<()> {
        writeln!(self.writer, "{value:#}")?;
        self.writer.flush()
    }
}

impl Output for JsonOutput<'_> {
    fn result(&mut self, shown: &ShownResult<'_>) -> io::Result<()> {
        self.verbatim(&shown.result.to_json())
    }

    fn simulation(&mut self, simulation: &ShownSimulation<'_>) -> io::Result<()> {
        self.verbatim(&simulation.solved.report(program::current()).to_json())
    }

    fn modes(&mut self, modes: &ShownModes<'_>) -> io::Result<()> {
        self.value(&modes::value(modes))
    }

    fn cost(&mut self, cost: &ShownCost<'_>) -> io::Result<()> {
        self.value(&cost::value(cost))
    }

    fn observations(&mut self, observations: &ShownObservations<'_>) -> io::Result<()> {
        self.value(&observations::value(observations))
    }
    fn design(&mut self, design: &ShownDesign<'_>) -> io::Result<()> {
        self.value(&design::value(design))
    }

    fn submitted(&mut self, job: &str) -> io::Result<()> {
        self.value(&json!({ "job": job }))
    }

    fn jobs(&mut self, jobs: &[JobSnapshot], _: &[BannedWorker]) -> io::Result<()> {
        self.value(&jobs.iter().map(snapshot_value).collect())
    }

    fn workers(
        &mut self,
        workers: &ListWorkersResponse,
        banned: &[BannedWorker],
    ) -> io::Result<()> {
        self.value(&json!({
            "workers": workers.workers.iter().map(worker_value).collect::<Vec<_>>(),
            "departed": workers.departed.iter().map(departed_value).collect::<Vec<_>>(),
            "banned": banned.iter().map(ban_value).collect::<Vec<_>>(),
        }))
    }

    fn worker(&mut self, worker: &WorkerSnapshot) -> io::Result<()> {
        self.value(&worker_value(worker))
    }

    fn diagnoses(&mut self, diagnoses: &[Diagnosis]) -> io::Result<()> {
        let check = |diagnosis: &Diagnosis| {
            json!({
                "check": diagnosis.check,
                "status": diagnosis.verdict.name(),
                "found": diagnosis.found,
                "advice": diagnosis.advice,
            })
        };
        self.value(&json!({
            "status": doctor::worst(diagnoses).name(),
            "checks": diagnoses.iter().map(check).collect::<Vec<_>>(),
        }))
    }

    fn health(&mut self, not_serving: Option<&str>) -> io::Result<()> {
        self.value(&json!({ "serving": not_serving.is_none(), "reason": not_serving }))
    }

    fn backup(&mut self, file: &Path, copy: &BackupEnd) -> io::Result<()> {
        self.value(&json!({
            "file": file.to_string_lossy(),
            "bytes": copy.length,
            "digest": copy.digest,
        }))
    }

    fn pruned(&mut self, jobs: &[String]) -> io::Result<()> {
        self.value(&json!({ "pruned": jobs }))
    }

    fn explanation(&mut self, explained: &ExplainResponse) -> io::Result<()> {
        self.value(&explanation_value(explained))
    }

    fn snapshot(&mut self, snapshot: &JobSnapshot) -> io::Result<()> {
        // On one line, because `watch` prints many of them.
        writeln!(self.writer, "{}", snapshot_value(snapshot))?;
        self.writer.flush()
    }

    fn verbatim(&mut self, text: &str) -> io::Result<()> {
        self.writer.write_all(text.as_bytes())?;
        self.writer.flush()
    }
}

fn ban_value(worker: &BannedWorker) -> Value {
    json!({
        "host": worker.host,
        "process": worker.process,
        "job": worker.job,
        "reason": worker.reason,
        "elapsed_s": worker.elapsed_s,
    })
}

fn worker_value(worker: &WorkerSnapshot) -> Value {
    let attached = worker.attach_time.as_ref().and_then(timestamp::from_message);
    json!({
        "number": worker.worker,
        "host": worker.host,
        "process": worker.process,
        "slots": worker.slots,
        "version": worker.version,
        "attached": attached.and_then(utc),
        "silent_s": worker.silent_s,
        "realizations_per_second": worker.realizations_per_second,
        "batches": worker.batches,
        "oldest_batch_s": worker.oldest_batch_s,
        "state": worker_state_name(worker),
    })
}

fn departed_value(worker: &DepartedWorker) -> Value {
    let departed = worker.depart_time.as_ref().and_then(timestamp::from_message);
    json!({
        "number": worker.worker,
        "host": worker.host,
        "process": worker.process,
        "departed": departed.and_then(utc),
        "reason": worker.reason,
        "batches": worker.batches,
    })
}

fn explanation_value(explained: &ExplainResponse) -> Value {
    // The names are those of the messages, without the prefix of the type and in lower case.
    let reason = explained.reason().as_str_name().trim_start_matches("PACE_REASON_");
    json!({
        "job": explained.job,
        "reason": reason.to_ascii_lowercase(),
        "text": explained.text,
        "slots": explained.slots,
        "slots_used": explained.slots_used,
        "realizations": explained.realizations,
        "realizations_left": explained.realizations_left,
        "realizations_per_second": explained.realizations_per_second,
        "expected_s": explained.expected_s,
        "waiting_s": explained.waiting_s,
        "worker": explained.worker,
    })
}

/// Returns the state of a job.
pub(crate) fn snapshot_value(snapshot: &JobSnapshot) -> Value {
    let text = |text: &str| (!text.is_empty()).then(|| text.to_owned());
    let submitted = snapshot.submit_time.as_ref().and_then(timestamp::from_message);
    let ended = snapshot.end_time.as_ref().and_then(timestamp::from_message);
    json!({
        "job": snapshot.job,
        "name": text(&snapshot.name),
        "user": text(&snapshot.client),
        "priority": snapshot.priority,
        "submitted": submitted.and_then(utc),
        "ended": ended.and_then(utc),
        "kind": kind_name(snapshot),
        "state": state_name(snapshot),
        "status": status_name(snapshot),
        "reason": text(&snapshot.reason),
        "evaluations": snapshot.evaluations,
        "max_evaluations": snapshot.max_evaluations,
        "realizations_done": snapshot.realizations_done,
        "realizations": snapshot.realizations,
        "best_cost": snapshot.best_cost,
        "best_mean": snapshot.best_mean,
        "best_coefficient_of_variation": snapshot.best_coefficient_of_variation,
        "realizations_per_second": snapshot.realizations_per_second,
        "workers": snapshot.workers,
        "elapsed_s": snapshot.elapsed_s,
        "waiting_for": text(&snapshot.waiting_for),
        "integrity": text(&snapshot.integrity),
    })
}
