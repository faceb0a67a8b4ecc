//! The overview of a coordinator: counts of jobs, workers host by host, failures, store and queues. It is
//! made at most once a second, for all pages together.

use std::sync::Arc;
use std::time::Duration;

use osteon_common::outcome::FailureKind;
use osteon_common::results::Status as JobEnding;
use serde_json::{Value, json};
use tokio::time::Instant;
use tonic::Status;

use crate::core::distribution::TimeDistribution;
use crate::live::json;
use crate::live::source::{Overview, PageSource};

/// Age from which on an overview is made again: a little less than the interval of the pages' updates,
/// so that none gets the same one twice.
const AGE_MAX: Duration = Duration::from_millis(900);

/// Returns the newest overview, as JSON.
pub(crate) async fn newest(source: &PageSource) -> Result<Arc<str>, Status> {
    let mut newest = source.newest.lock().await;
    if let Some(overview) = newest.as_ref().filter(|overview| overview.made.elapsed() < AGE_MAX) {
        return Ok(Arc::clone(&overview.text));
    }
    let text: Arc<str> = value(source).await?.to_string().into();
    *newest = Some(Overview { made: Instant::now(), text: Arc::clone(&text) });
    Ok(text)
}

async fn value(source: &PageSource) -> Result<Value, Status> {
    let (report, core_queue) = source.measure().await?;
    let concerns = source.concerns().await?;
    let (state, counts) = (&report.state, &report.counts);
    let mut workers = json::workers(&source.workers().await?);
    for (name, count) in [
        ("slots_busy", state.slots_busy),
        ("slots_idle", state.slots_idle),
        ("slots_unavailable", state.slots_unavailable),
        ("slots_wanted", state.slots_wanted),
        ("draining", state.workers_draining),
        ("distrusted", state.workers_distrusted),
        ("on_probation", state.workers_on_probation),
        ("banned", state.workers_banned),
        ("lost", counts.workers_lost),
    ] {
        workers[name] = count.into();
    }
    let [succeeded, failed @ ..] = counts.realizations;
    let failures = FailureKind::ALL.into_iter().map(FailureKind::name).zip(failed);
    let endings = JobEnding::ALL.into_iter().map(JobEnding::name).zip(counts.jobs_ended);
    let writes = source.write_times.read();
    Ok(json!({
        "version": env!("CARGO_PKG_VERSION"),
        "jobs": {
            "running": state.jobs_running,
            "waiting": state.jobs_waiting,
            "ended": state.jobs_ended,
            "ended_as": json::counts(endings),
        },
        "workers": workers,
        "realizations": { "succeeded": succeeded, "failed": json::counts(failures) },
        "mismatches": counts.mismatches,
        "concerns": concerns,
        "store": {
            "refusing_s": state.store_refusing.as_secs(),
            "queue": report.store_queue,
            "errors": counts.store_errors,
            "writes": writes.count(),
            "mean_write_s": mean(&writes),
        },
        "core": {
            "queue": core_queue,
            "batches": state.batches_in_flight,
            "oldest_batch_s": state.oldest_batch.as_secs(),
            "mean_event_s": mean(&report.event_times),
        },
    }))
}

/// Returns the mean of measured times, s; `None` if there are none.
fn mean(times: &TimeDistribution) -> Option<f64> {
    (times.count() > 0).then(|| times.sum_s() / times.count() as f64)
}
