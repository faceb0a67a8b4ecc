//! Events applied to a state: each must cause exactly the expected effects, and leave the whole
//! state consistent.

use std::sync::Arc;
use std::time::Duration;

use osteon_common::case::Setup;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{Data, JobKind, JobSpecification, MonteCarlo, Objective, Range, Search};
use osteon_common::outcome::{Outcome, RealizationResult};
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::systematic::Systematic;
use osteon_common::version;

use super::*;
use crate::config::Config;
use crate::core::effect::{Answer, Effect, Record, RecordKey, Refusal};

use crate::core::event::{Hello, Request};
use crate::core::ids::{BatchId, JobId, ReplyId, WorkerId};
use crate::core::sanity::sanity_check;

mod ahead;
mod checks;
mod completion;
mod concerns;
mod dispatch;
mod explain;
mod fairness;
mod jobs;
mod lost;
mod notices;
mod overdue;
mod pages;
mod prune;
mod replay;
mod saved;
mod speculation;
mod tally;
mod workers;

/// One minute.
const MINUTE: Duration = Duration::from_secs(60);

/// A coordinator with a clock that the test advances.
struct Rig {
    state: State,
    now: Duration,
}

impl Rig {
    fn new() -> Self {
        // Speculative batches and proofs would disturb most tests.
        let config =
            Config { active_jobs_max: 2, speculation: false, proofs: false, ..Config::default() };
        Self { state: State::new(config, Duration::ZERO), now: Duration::ZERO }
    }

    /// Returns a coordinator with speculation, where idle workers compute candidate points.
    fn speculating() -> Self {
        let mut rig = Self::new();
        rig.state.config.speculation = true;
        rig
    }

    /// Returns a rig with a propagation of so many realizations, job 1, and workers 1, 2, … with
    /// these numbers of threads, which hold their first batches.
    fn with(realizations: u64, threads: &[u32]) -> Self {
        let mut rig = Self::new();
        rig.accept(propagation(realizations));
        for (worker, threads) in (1..).zip(threads) {
            rig.event(hello(worker, *threads));
        }
        rig
    }

    /// Submits a job and stores it.
    fn accept(&mut self, specification: JobSpecification) -> JobId {
        let job = JobId(self.state.next_job);
        self.event(submit(0, "", specification));
        self.event(Event::Stored { job, key: RecordKey::Job });
        job
    }

    /// Applies an event and describes its effects.
    fn event(&mut self, event: Event) -> Vec<String> {
        let effects = react(&mut self.state, event, self.now);
        if let Err(insane) = sanity_check(&self.state) {
            panic!("{insane}\n{:#?}", self.state);
        }
        // Notices for the log, and what is saved of incomplete evaluations, have tests of their own.
        let aside = |effect: &&Effect| match effect {
            Effect::Note(_) => true,
            Effect::Store(record) => matches!(record, Record::Part(_) | Record::Piece { .. }),
            _ => false,
        };
        let acts = effects.iter().filter(|effect| !aside(effect));
        acts.map(describe).collect()
    }

    /// Asserts that an event causes exactly these effects.
    #[track_caller]
    fn check(&mut self, event: Event, expected: &[&str]) {
        let shown = format!("{event:?}");
        assert_eq!(self.event(event), expected, "after {shown}");
    }

    /// Advances the time and asserts the effects of the next tick, without snapshots and
    /// heartbeats.
    #[track_caller]
    fn check_after(&mut self, time: Duration, expected: &[&str]) {
        let mut effects = self.pass(time);
        effects.retain(|effect| !effect.starts_with("publish") && !effect.starts_with("beat"));
        assert_eq!(effects, expected);
    }

    /// Advances the time, with ticks at the interval of heartbeats; in one step if the time is
    /// long.
    fn pass(&mut self, time: Duration) -> Vec<String> {
        let end = self.now + time;
        let step = if time > MINUTE / 2 { time } else { self.state.config.heartbeat };
        let mut effects = Vec::new();
        while self.now + step < end {
            self.now += step;
            effects.extend(self.event(Event::Tick));
        }
        self.now = end;
        effects.extend(self.event(Event::Tick));
        effects
    }

    /// Applies a heartbeat of a worker.
    fn heartbeat(&mut self, worker: u64) {
        self.check(Event::Heartbeat { worker: WorkerId(worker) }, &[]);
    }
}

fn propagation(realizations: u64) -> JobSpecification {
    JobSpecification {
        kind: JobKind::Propagation,
        setup: Setup::default(),
        data: None,
        parameters: Range::of_bone(
            [1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029].map(Range::Fixed),
        ),
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo { realizations, ..MonteCarlo::default() },
        objective: Objective::default(),
        search: Search::default(),
        posterior: None,
    }
}

fn identification(realizations: u64) -> JobSpecification {
    let mut job = propagation(realizations);
    job.kind = JobKind::Identification;
    job.data = Some(Data::from_moments(3900.0, 0.03));
    job.parameters[6] = Range::Free { start: 0.1, lower: 0.02, upper: 0.3 };
    job
}

fn submit(reply_id: u64, request_id: &str, specification: JobSpecification) -> Event {
    submit_for("", reply_id, request_id, specification)
}

fn submit_for(
    client: &str,
    reply_id: u64,
    request_id: &str,
    specification: JobSpecification,
) -> Event {
    let request = Request::Submit {
        specification: Arc::new(specification),
        request_id: request_id.to_owned(),
        client: client.to_owned(),
        priority: 0,
        name: String::new(),
    };
    Event::Requested { reply_id: ReplyId(reply_id), request }
}

fn request(reply_id: u64, request: Request) -> Event {
    Event::Requested { reply_id: ReplyId(reply_id), request }
}

fn stored_event(job: u64, key: RecordKey) -> Event {
    Event::Stored { job: JobId(job), key }
}

fn hello(worker: u64, threads: u32) -> Event {
    hello_on("node", worker, 42, threads)
}

/// Returns the hello event of a worker that runs in `process`, on a host of its own.
fn hello_of(worker: u64, process: u32, threads: u32) -> Event {
    hello_on(&format!("node-{process}"), worker, process, threads)
}

/// Returns the hello event of a worker that runs in `process` on `host`.
fn hello_on(host: &str, worker: u64, process: u32, threads: u32) -> Event {
    let hello = Hello {
        version: version::VERSION.to_owned(),
        fingerprint: version::fingerprint(),
        slots: threads,
        host: host.to_owned(),
        process,
        instance: 0,
    };
    Event::Hello { worker: WorkerId(worker), hello }
}

/// Returns an answer whose velocities follow from the indices, computed in `elapsed_s`.
fn answer_in(elapsed_s: f64, worker: u64, batch: u64, first: u64, count: u64) -> Event {
    let solved = |index| RealizationResult::solved(velocity(index).unwrap(), 0.0);
    let solved = (first..first + count).map(solved).collect();
    Event::Answered { worker: WorkerId(worker), batch: BatchId(batch), solved, elapsed_s }
}

fn answer(worker: u64, batch: u64, first: u64, count: u64) -> Event {
    answer_in(0.1, worker, batch, first, count)
}

fn velocity(index: u64) -> Outcome {
    Ok(3900.0 + index as f64)
}

fn end_of_stream(worker: u64) -> Event {
    Event::StreamEnded { worker: WorkerId(worker) }
}

fn describe(effect: &Effect) -> String {
    match effect {
        Effect::Welcome { worker, lease } => format!("welcome {worker}, lease {lease}"),
        Effect::Send { worker, batch, work } => {
            format!("send {worker}: batch {batch} = {}+{}", work.first, work.count)
        }
        Effect::Complete(completion) => format!("complete an evaluation of job {}", completion.job),
        Effect::Revoke { worker, batch } => format!("revoke {worker}: batch {batch}"),
        Effect::Drain { worker } => format!("drain {worker}"),
        Effect::Note(notice) => format!("note {notice:?}"),
        Effect::Heartbeat { worker } => format!("beat {worker}"),
        Effect::Close { worker, reason } => format!("close {worker}: {reason}"),
        Effect::Store(Record::Job(record)) => format!("store job {}", record.job),
        Effect::Store(Record::Evaluation { record, .. }) => {
            format!("store job {} evaluation {}", record.job, record.number)
        }
        Effect::Store(Record::Evaluations(records)) => {
            let numbers: Vec<String> = records.iter().map(|it| it.number.to_string()).collect();
            format!("store job {} evaluations {}", records[0].job, numbers.join(" "))
        }
        Effect::Store(Record::Part(record)) => {
            let count: usize = record.pieces.iter().map(|piece| piece.results.len()).sum();
            format!("save {count} of job {}", record.job)
        }
        Effect::Store(Record::Piece { record, .. }) => {
            format!("store job {} evaluation {} from {}", record.job, record.number, record.first)
        }
        Effect::Store(Record::Ban(record)) => {
            format!("store ban {}: {} {}", record.number, record.worker, record.reason)
        }
        Effect::Read { job, number } => format!("read job {job} evaluation {number}"),
        Effect::Prune { jobs, .. } => {
            format!("prune {}", jobs.iter().map(JobId::to_string).collect::<Vec<_>>().join(" "))
        }
        Effect::Store(Record::End { end, .. }) => {
            let reason = end.ending.reason.as_deref().unwrap_or_default();
            format!("store job {} end: {} {reason}", end.job, end.ending.status.name())
        }
        Effect::Answer { reply_id, answer } => {
            format!("answer {reply_id}: {}", describe_answer(answer))
        }
        Effect::Publish { job, .. } => format!("publish {job}"),
        Effect::ReportStoreFailure { error, waited } => {
            format!("give_up after {waited:?}: {error}")
        }
        Effect::Reopen { job, .. } => format!("reopen {job}"),
        Effect::Stop => "stop".to_owned(),
    }
}

fn describe_answer(answer: &Answer) -> String {
    match answer {
        Answer::Submitted(job) => format!("job {job}"),
        Answer::Snapshot(snapshot) => {
            format!("{:?} {:?}", snapshot.state(), snapshot.status())
        }
        Answer::Page { snapshots, more_after } => {
            let jobs: Vec<&str> = snapshots.iter().map(|snapshot| snapshot.job.as_str()).collect();
            format!("{jobs:?}, more after {more_after:?}")
        }
        Answer::Explained(explained) => format!("{:?}", explained.reason()),
        Answer::Followed(search) => format!("rows {}", search.rows.len()),
        Answer::Ended { end, .. } => format!("ended {}", end.job),
        Answer::Pruned(jobs) => format!("pruned {}", jobs.len()),
        Answer::Banned(banned) => format!("banned {}", banned.len()),
        Answer::Workers(list) => {
            format!("{} workers, {} departed", list.workers.len(), list.departed.len())
        }
        Answer::Unbanned(record) => format!("lifted {}", record.worker.host()),
        Answer::Worker(worker) => format!("worker {} {:?}", worker.worker, worker.state()),
        Answer::Concerns(concerns) => concerns.join(", "),
        Answer::Refused(refusal) => refusal.to_string(),
    }
}
