//! Jobs, workers, explanations, figures and refusals as JSON for the page.

use std::collections::BTreeMap;

use axum::body::Body;
use axum::http::StatusCode;
use axum::http::header::{CONTENT_TYPE, HeaderValue, RETRY_AFTER};
use axum::response::Response;
use osteon_common::results::Status as JobEnding;
use osteon_proto::choice::{JOB_KIND, JOB_STATUS};
use osteon_proto::status;
use osteon_proto::v1::{
    DepartedWorker, ExplainResponse, JobSnapshot, JobState, ListWorkersResponse, WorkerState,
};
use osteon_report::LiveFigure;
use serde_json::{Map, Value, json};
use tonic::{Code, Status};

/// Maximum number of hosts that are listed, those with the most workers.
const HOSTS_MAX: usize = 40;
/// Maximum number of departed workers that are listed, the newest.
const DEPARTED_MAX: usize = 8;

/// Returns a time of a message in seconds since the Unix epoch, if there is one.
macro_rules! unix_s {
    ($time:expr) => {
        $time.as_ref().map(|time| time.seconds)
    };
}

pub(crate) fn answer(code: StatusCode, value: &Value) -> Response {
    let mut response = Response::new(Body::from(value.to_string()));
    *response.status_mut() = code;
    response.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static("application/json"));
    response
}

/// Returns the answer to a request that failed.
pub(crate) fn error(code: StatusCode, message: &str) -> Response {
    answer(code, &json!({ "error": message }))
}

/// Returns the answer to a request that a service refused.
pub(crate) fn refusal_response(refusal: &Status) -> Response {
    let code = match refusal.code() {
        Code::InvalidArgument => StatusCode::BAD_REQUEST,
        Code::NotFound => StatusCode::NOT_FOUND,
        Code::Unauthenticated => StatusCode::UNAUTHORIZED,
        Code::PermissionDenied => StatusCode::FORBIDDEN,
        Code::ResourceExhausted => StatusCode::TOO_MANY_REQUESTS,
        Code::Unavailable => StatusCode::SERVICE_UNAVAILABLE,
        Code::DeadlineExceeded => StatusCode::GATEWAY_TIMEOUT,
        _ => StatusCode::INTERNAL_SERVER_ERROR,
    };
    let mut response = error(code, refusal.message());
    if let Some(retry) = status::retry_after(refusal) {
        response.headers_mut().insert(RETRY_AFTER, HeaderValue::from(retry.as_secs()));
    }
    response
}

pub(crate) fn job(snapshot: &JobSnapshot) -> Value {
    let state = match snapshot.state() {
        JobState::Waiting => "waiting",
        JobState::Ended => "ended",
        JobState::Running | JobState::Unspecified => "running",
    };
    json!({
        "job": snapshot.job,
        "name": snapshot.name,
        "client": snapshot.client,
        "kind": JOB_KIND.value(snapshot.kind).map(|kind| kind.name()),
        "state": state,
        "status": JOB_STATUS.value(snapshot.status).map(JobEnding::name),
        "reason": snapshot.reason,
        "priority": snapshot.priority,
        "evaluations": snapshot.evaluations,
        "max_evaluations": snapshot.max_evaluations,
        "realizations_done": snapshot.realizations_done,
        "realizations": snapshot.realizations,
        "realizations_per_second": snapshot.realizations_per_second,
        "best_cost": snapshot.best_cost,
        "best_mean": snapshot.best_mean,
        "best_coefficient_of_variation": snapshot.best_coefficient_of_variation,
        "elapsed_s": snapshot.elapsed_s.floor(),
        "waiting_for": snapshot.waiting_for,
        "integrity": snapshot.integrity,
        "submit_time": unix_s!(snapshot.submit_time),
        "end_time": unix_s!(snapshot.end_time),
    })
}

/// Returns a page of jobs; `more_after` is the last one, if others follow.
pub(crate) fn jobs(snapshots: &[JobSnapshot], more_after: Option<String>) -> Value {
    json!({ "jobs": snapshots.iter().map(job).collect::<Vec<_>>(), "more_after": more_after })
}

/// Returns what decides how fast a job is.
pub(crate) fn explanation(explained: &ExplainResponse) -> Value {
    json!({
        "text": explained.text,
        "slots": explained.slots,
        "slots_used": explained.slots_used,
        "realizations_left": explained.realizations_left,
        "expected_s": explained.expected_s,
        "waiting_s": explained.waiting_s,
    })
}

pub(crate) fn figures(figures: &[LiveFigure]) -> Value {
    let figure = |figure: &LiveFigure| {
        let LiveFigure { name, title, svg, reading } = figure;
        json!({ "name": name, "title": title, "svg": svg, "reading": reading })
    };
    figures.iter().map(figure).collect()
}

/// Totals over the workers of one host.
#[derive(Debug, Default)]
struct HostLoad {
    workers: u64,
    threads: u64,
    batches: u64,
    rate: f64,
    silent_s: f64,
    unwell: u64,
}

/// Returns the workers, host by host: those with the most workers first, and the others counted.
pub(crate) fn workers(listed: &ListWorkersResponse) -> Value {
    let mut hosts: BTreeMap<&str, HostLoad> = BTreeMap::new();
    let mut rate = 0.0;
    for worker in &listed.workers {
        let load = hosts.entry(worker.host.as_str()).or_default();
        load.workers += 1;
        load.threads += u64::from(worker.slots);
        load.batches += u64::from(worker.batches);
        load.rate += worker.realizations_per_second;
        load.silent_s = load.silent_s.max(worker.silent_s);
        load.unwell += u64::from(worker.state() != WorkerState::Ok);
        rate += worker.realizations_per_second;
    }
    let count = hosts.len();
    let mut largest: Vec<(&str, HostLoad)> = hosts.into_iter().collect();
    // Of equal ones the first by name.
    largest.sort_by_key(|(_, load)| std::cmp::Reverse(load.workers));
    let host = |(host, load): &(&str, HostLoad)| {
        json!({
            "host": host,
            "workers": load.workers,
            "threads": load.threads,
            "batches": load.batches,
            "realizations_per_second": load.rate,
            "silent_s": load.silent_s.floor(),
            "not_ok": load.unwell,
        })
    };
    let departed_worker = |gone: &DepartedWorker| {
        json!({
            "host": gone.host,
            "process": gone.process,
            "reason": gone.reason,
            "batches": gone.batches,
            "depart_time": unix_s!(gone.depart_time),
        })
    };
    json!({
        "count": listed.workers.len(),
        "realizations_per_second": rate,
        "hosts": largest.iter().take(HOSTS_MAX).map(host).collect::<Vec<_>>(),
        "more_hosts": count.saturating_sub(HOSTS_MAX),
        "departed": listed.departed.iter().take(DEPARTED_MAX).map(departed_worker).collect::<Vec<_>>(),
    })
}

/// Returns counts by name.
pub(crate) fn counts(counts: impl IntoIterator<Item = (&'static str, u64)>) -> Map<String, Value> {
    counts.into_iter().map(|(name, count)| (name.to_owned(), count.into())).collect()
}

#[cfg(test)]
mod tests {
    use osteon_proto::v1::WorkerSnapshot;

    use super::*;

    #[test]
    fn a_thousand_workers_are_a_few_rows() {
        let worker = |number: u64| WorkerSnapshot {
            worker: number,
            host: format!("node{:03}", number % 100),
            slots: 4,
            batches: 2,
            realizations_per_second: 10.0,
            state: if number == 0 { WorkerState::Draining } else { WorkerState::Ok }.into(),
            ..WorkerSnapshot::default()
        };
        let workers = (0..1000).map(worker).collect();
        let shown = super::workers(&ListWorkersResponse { workers, departed: Vec::new() });
        assert_eq!(shown["count"], 1000);
        assert_eq!(shown["realizations_per_second"], 10_000.0);
        assert_eq!(shown["hosts"].as_array().unwrap().len(), HOSTS_MAX);
        assert_eq!(shown["more_hosts"], 60);
        let first = &shown["hosts"][0];
        assert_eq!([&first["workers"], &first["threads"], &first["not_ok"]], [10, 40, 1]);
        assert!(shown.to_string().len() < 10_000);
    }

    #[test]
    fn refusals_of_services_have_codes_of_http() {
        for (refusal, code) in [
            (Status::not_found("a"), 404),
            (Status::invalid_argument("a"), 400),
            (Status::unauthenticated("a"), 401),
            (Status::permission_denied("a"), 403),
            (Status::unavailable("a"), 503),
            (Status::internal("a"), 500),
        ] {
            assert_eq!(refusal_response(&refusal).status(), code, "{refusal}");
        }
        let full = status::resource_exhausted("a", std::time::Duration::from_secs(5));
        assert_eq!(refusal_response(&full).headers()[RETRY_AFTER], "5");
    }
}
