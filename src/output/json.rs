//! Output for programs: one JSON value per command, without inf or NaN.

use std::io::{self, Write};
use std::path::Path;

use osteon_common::results_json;
use osteon_proto::timestamp;
use osteon_proto::v1::{
    BackupEnd, DepartedWorker, ExpelledWorker, JobSnapshot, ListWorkersResponse, WorkerSnapshot,
};
use osteon_solver::check::{Difference, Solution};
use serde_json::{Map, Value, json};

use super::{Output, ShownResult, ShownSimulation, solver_value};
use crate::output::text::operators::standing_name;
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
    fn result(&mut self, result: &ShownResult<'_>) -> io::Result<()> {
        self.verbatim(result.json)
    }

    fn simulation(&mut self, simulation: &ShownSimulation<'_>) -> io::Result<()> {
        self.value(&simulation_value(simulation))
    }

    fn submitted(&mut self, job: &str) -> io::Result<()> {
        self.value(&json!({ "job": job }))
    }

    fn jobs(&mut self, jobs: &[JobSnapshot], _: &[ExpelledWorker]) -> io::Result<()> {
        self.value(&jobs.iter().map(snapshot_value).collect())
    }

    fn workers(
        &mut self,
        workers: &ListWorkersResponse,
        expelled: &[ExpelledWorker],
    ) -> io::Result<()> {
        self.value(&json!({
            "workers": workers.workers.iter().map(worker_value).collect::<Vec<_>>(),
            "departed": workers.departed.iter().map(departed_value).collect::<Vec<_>>(),
            "expelled": expelled.iter().map(expelled_value).collect::<Vec<_>>(),
        }))
    }

    fn worker(&mut self, worker: &WorkerSnapshot) -> io::Result<()> {
        self.value(&worker_value(worker))
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

    fn snapshot(&mut self, snapshot: &JobSnapshot) -> io::Result<()> {
        self.value(&snapshot_value(snapshot))
    }

    fn verbatim(&mut self, text: &str) -> io::Result<()> {
        self.writer.write_all(text.as_bytes())?;
        self.writer.flush()
    }
}

/// The object of a simulation.
fn simulation_value(simulation: &ShownSimulation<'_>) -> Value {
    let ShownSimulation { setup, arrival, .. } = *simulation;
    let receivers = setup.probe.receivers.positions().enumerate().map(|(j, x1)| {
        let time = arrival.as_ref().ok().and_then(|arrival| arrival.times.get(j));
        json!({ "x1": x1, "time": time })
    });
    let mut object = Map::new();
    let mut put = |key: &str, value: Value| object.insert(key.to_owned(), value);
    results_json::head(&mut put, "simulation");
    put("velocity", json!(arrival.as_ref().ok().map(|arrival| arrival.velocity)));
    put("failure", json!(arrival.as_ref().err().map(|failure| failure.kind.name())));
    put("detail", json!(arrival.as_ref().err().map(|failure| failure.detail.as_str())));
    put("receivers", receivers.collect());
    put("picking", results_json::picking(&setup.picking));
    put("solver", solver_value(setup, arrival.as_ref().ok()));
    if let Some(check) = simulation.check {
        put("check", check.solutions().into_iter().map(solution_value).collect());
    }
    results_json::program(&mut put, &program::this());
    Value::Object(object)
}

/// The text of the object of a simulation, with a final newline.
pub(crate) fn simulation(simulation: &ShownSimulation<'_>) -> String {
    format!("{:#}\n", simulation_value(simulation))
}

/// The object `solver` of one solution, with what came out and how it differs from the refined one.
fn solution_value(solution: &Solution) -> Value {
    let arrival = solution.arrival.as_ref();
    let mut value = solver_value(&solution.setup, arrival.ok());
    value["velocity"] = json!(arrival.ok().map(|arrival| arrival.velocity));
    value["failure"] = json!(arrival.err().map(|failure| failure.kind.name()));
    value["same_pick"] = json!(solution.difference != Difference::Picks);
    value["time_difference"] = json!(solution.difference.time());
    value["relative_difference"] = json!(solution.difference.velocity());
    value
}

fn expelled_value(worker: &ExpelledWorker) -> Value {
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
        "threads": worker.threads,
        "version": worker.version,
        "attached": attached.and_then(utc),
        "silent_s": worker.silent_s,
        "realizations_per_second": worker.realizations_per_second,
        "batches": worker.batches,
        "oldest_batch_s": worker.oldest_batch_s,
        "standing": standing_name(worker),
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

fn snapshot_value(snapshot: &JobSnapshot) -> Value {
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
    })
}
