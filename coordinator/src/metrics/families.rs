//! The exported metrics: names, meanings and values. docs/metrics.md lists the same
//! (`tests/metrics.rs`).

use osteon_common::outcome::FailureKind;
use osteon_common::results::Status;
use osteon_common::version;

use super::process::ProcessUsage;
use crate::core::distribution::TimeDistribution;
use crate::core::measurements::StateMeasurements;
use crate::core::tally::{EventCounts, PURPOSES};

/// Everything that a scrape shows.
#[derive(Debug, Default)]
pub(crate) struct Scrape {
    pub(crate) counts: EventCounts,
    pub(crate) state: StateMeasurements,
    /// Times for which the core reacted to events.
    pub(crate) event_times: TimeDistribution,
    pub(crate) write_times: TimeDistribution,
    /// Messages that wait for the core.
    pub(crate) core_queue: u64,
    /// Commands that wait for the store's thread.
    pub(crate) store_queue: u64,
    pub(crate) process: ProcessUsage,
    /// Start of this process, s since the Unix epoch.
    pub(crate) started_s: f64,
}

/// One metric, with a value for each of its labels.
#[derive(Debug)]
pub(crate) struct MetricFamily {
    /// Complete name, except for the suffix `_total` of a counter.
    pub(crate) name: &'static str,
    pub(crate) help: &'static str,
    pub(crate) values: Values,
}

/// A label: its name and one of its fixed values. Neither can contain anything that a user wrote.
pub(crate) type Label = Option<(&'static str, &'static str)>;

/// Kind and values of a metric.
#[derive(Debug)]
pub(crate) enum Values {
    /// Never decreases while the process runs.
    Counter(Vec<(Label, f64)>),
    Gauge(Vec<(Label, f64)>),
    Histogram(TimeDistribution),
}

/// Returns all metrics in the order in which they are exported.
pub(crate) fn families(scrape: &Scrape) -> Vec<MetricFamily> {
    let mut all = state_families(&scrape.state);
    all.extend(limit_families(&scrape.state));
    all.extend(work_families(&scrape.counts));
    all.extend(worker_families(&scrape.counts));
    all.extend(coordinator_families(scrape));
    all.extend(process_families(scrape));
    all
}

/// Gauges of jobs, slots and workers.
fn state_families(state: &StateMeasurements) -> Vec<MetricFamily> {
    vec![
        gauges(
            "osteon_jobs",
            "Jobs by state",
            "state",
            &[
                ("waiting", state.jobs_waiting),
                ("running", state.jobs_running),
                ("ended", state.jobs_ended),
            ],
        ),
        gauge(
            "osteon_realizations_waiting",
            "Realizations of the evaluations under way that no worker holds",
            state.realizations_waiting as f64,
        ),
        gauges(
            "osteon_slots",
            "Slots of the attached workers by use",
            "state",
            &[
                ("busy", state.slots_busy),
                ("idle", state.slots_idle),
                ("unavailable", state.slots_unavailable),
            ],
        ),
        gauge(
            "osteon_slots_wanted",
            "Slots that the jobs which have not ended could keep busy, those that they have included",
            state.slots_wanted as f64,
        ),
        gauges(
            "osteon_workers",
            "Attached workers by state",
            "state",
            &[
                ("ok", state.workers_ok),
                ("draining", state.workers_draining),
                ("distrusted", state.workers_distrusted),
                ("probation", state.workers_on_probation),
            ],
        ),
        gauge(
            "osteon_workers_banned",
            "Workers that are refused because they returned wrong answers",
            state.workers_banned as f64,
        ),
        gauge(
            "osteon_batches_in_flight",
            "Batches that workers hold",
            state.batches_in_flight as f64,
        ),
        gauge(
            "osteon_oldest_batch_seconds",
            "Time since the oldest batch in flight was sent; 0 without one",
            state.oldest_batch.as_secs_f64(),
        ),
    ]
}

/// The used parts of all hard bounds.
fn bounds_family(state: &StateMeasurements) -> MetricFamily {
    let used = state.bounds_used.iter();
    let values = used.map(|(what, part)| (Some(("bound", what.name())), *part)).collect();
    MetricFamily {
        name: "osteon_bound_used_ratio",
        help: "Used part of what is allowed; at 1 more is refused, or has to wait",
        values: Values::Gauge(values),
    }
}

/// Gauges of the store and of all hard bounds.
fn limit_families(state: &StateMeasurements) -> Vec<MetricFamily> {
    vec![
        gauge(
            "osteon_store_refusing_seconds",
            "Time for which the store has refused a record; 0 if it accepts them",
            state.store_refusing.as_secs_f64(),
        ),
        gauge(
            "osteon_store_log_stuck_seconds",
            "Time for which the store's log could not be copied into its database; 0 if it could",
            state.log_stuck.as_secs_f64(),
        ),
        gauge(
            "osteon_store_log_stuck_bytes",
            "Length of a log that could not be copied; 0 if it could",
            state.log_stuck_bytes as f64,
        ),
        bounds_family(state),
    ]
}

/// Counters of jobs, evaluations, realizations and batches.
fn work_families(counts: &EventCounts) -> Vec<MetricFamily> {
    let ended = Status::ALL.map(Status::name).into_iter().zip(counts.jobs_ended);
    let outcomes = ["ok"].into_iter().chain(FailureKind::ALL.map(FailureKind::name));
    let outcomes = outcomes.zip(counts.realizations);
    let sent = PURPOSES.into_iter().zip(counts.batches_sent);
    vec![
        counter("osteon_jobs_accepted", "Jobs accepted", counts.jobs_accepted),
        counters("osteon_jobs_ended", "Jobs ended, by status", "status", ended),
        counter("osteon_evaluations", "Evaluations completed and stored", counts.evaluations),
        MetricFamily {
            name: "osteon_evaluation_seconds",
            help: "Time of an evaluation: from the storing of the job's previous one, or from the job's \
                   start, to its own storing",
            values: Values::Histogram(counts.evaluation_times.clone()),
        },
        counters("osteon_realizations", "Realizations completed, by outcome", "outcome", outcomes),
        counters("osteon_batches_sent", "Batches sent to workers, by purpose", "purpose", sent),
        counter(
            "osteon_batches_duplicated",
            "Batches sent while another worker held the same, because that one was slow",
            counts.batches_duplicated,
        ),
        counter(
            "osteon_batches_reassigned",
            "Batches of departed workers, which others compute",
            counts.batches_reassigned,
        ),
        counter(
            "osteon_mismatches",
            "Answers that differ from the answer of another worker",
            counts.mismatches,
        ),
    ]
}

/// Counters of workers.
fn worker_families(counts: &EventCounts) -> Vec<MetricFamily> {
    vec![
        counter("osteon_workers_attached", "Workers that attached", counts.workers_attached),
        counter("osteon_workers_refused", "Workers that were refused", counts.workers_refused),
        counter(
            "osteon_workers_left",
            "Workers that left as announced, or held nothing",
            counts.workers_left,
        ),
        counter("osteon_workers_lost", "Workers lost with batches", counts.workers_lost),
        counter("osteon_bans", "Workers banned", counts.bans),
    ]
}

/// The coordinator's own work.
fn coordinator_families(scrape: &Scrape) -> Vec<MetricFamily> {
    vec![
        counter(
            "osteon_store_errors",
            "Operations that the store refused",
            scrape.counts.store_errors,
        ),
        MetricFamily {
            name: "osteon_store_write_seconds",
            help: "Time of a write to the store, with its sync",
            values: Values::Histogram(scrape.write_times.clone()),
        },
        MetricFamily {
            name: "osteon_core_event_seconds",
            help: "Time for which the core reacted to an event",
            values: Values::Histogram(scrape.event_times.clone()),
        },
        gauges(
            "osteon_queue_length",
            "Entries of the coordinator's queues",
            "queue",
            &[("core", scrape.core_queue), ("store", scrape.store_queue)],
        ),
        MetricFamily {
            name: "osteon_build_info",
            help: "Version of the program, in a label; the value is 1",
            values: Values::Gauge(vec![(Some(("version", version::VERSION)), 1.0)]),
        },
    ]
}

/// The process, by the names that are usual for every program.
fn process_families(scrape: &Scrape) -> Vec<MetricFamily> {
    let ProcessUsage { cpu_s, resident_bytes, open_files, open_files_max } = scrape.process;
    let known_gauge = |name, help, value: Option<u64>| Some(gauge(name, help, value? as f64));
    let cpu = MetricFamily {
        name: "process_cpu_seconds",
        help: "Processor time of the process",
        values: Values::Counter(vec![(None, cpu_s)]),
    };
    let started = gauge(
        "process_start_time_seconds",
        "Start of the coordinator in seconds since the Unix epoch",
        scrape.started_s,
    );
    let memory =
        known_gauge("process_resident_memory_bytes", "Memory of the process", resident_bytes);
    let files = known_gauge("process_open_fds", "Open files and connections", open_files);
    let most =
        known_gauge("process_max_fds", "Limit of open files and connections", open_files_max);
    [Some(cpu), Some(started), memory, files, most].into_iter().flatten().collect()
}

fn gauge(name: &'static str, help: &'static str, value: f64) -> MetricFamily {
    MetricFamily { name, help, values: Values::Gauge(vec![(None, value)]) }
}

fn gauges(
    name: &'static str,
    help: &'static str,
    label: &'static str,
    values: &[(&'static str, u64)],
) -> MetricFamily {
    let values = values.iter().map(|(value, number)| (Some((label, *value)), *number as f64));
    MetricFamily { name, help, values: Values::Gauge(values.collect()) }
}

fn counter(name: &'static str, help: &'static str, value: u64) -> MetricFamily {
    MetricFamily { name, help, values: Values::Counter(vec![(None, value as f64)]) }
}

fn counters(
    name: &'static str,
    help: &'static str,
    label: &'static str,
    values: impl Iterator<Item = (&'static str, u64)>,
) -> MetricFamily {
    let values = values.map(|(value, number)| (Some((label, value)), number as f64));
    MetricFamily { name, help, values: Values::Counter(values.collect()) }
}
