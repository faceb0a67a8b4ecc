//! Spans of jobs, their evaluations and batches, made from the events and effects of the core. They
//! exist only if spans are recorded; no decision depends on them.
//!
//! A job may have millions of batches. So only the first [`EVALUATIONS_MAX`] evaluations of a job have
//! spans, the first [`BATCHES_MAX`] batches of each of these, and [`BATCHES_OF_JOB_MAX`] batches of a
//! job; the span of the job says how many have none.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use osteon_proto::batch::Work;
use osteon_proto::spans::{AttributeValue, OpenSpan, SpanRecorder, TraceContext};

use crate::core::effect::{Answer, Effect};
use crate::core::event::Event;
use crate::core::ids::{BatchId, JobId, ReplyId, WorkerId};
use crate::core::notice::Notice;
use crate::core::state::State;

/// Maximum number of evaluations of a job that have a span.
const EVALUATIONS_MAX: u64 = 1000;
/// Maximum number of batches of an evaluation that have a span.
const BATCHES_MAX: u64 = 100;
/// Maximum number of batches of a job that have a span.
const BATCHES_OF_JOB_MAX: u64 = 10_000;

/// The spans that are open.
#[derive(Debug)]
pub(crate) struct JobSpans {
    recorder: Arc<dyn SpanRecorder>,
    /// Submissions that have not been answered: their begin, and the context of their clients.
    submissions: BTreeMap<ReplyId, (Duration, Option<TraceContext>)>,
    jobs: BTreeMap<JobId, JobSpan>,
    /// By the number of the attempt, which is unique over all jobs.
    evaluations: BTreeMap<u64, EvaluationSpan>,
    batches: BTreeMap<BatchId, BatchSpan>,
    /// Attempts that may have ended with the event under way.
    touched: BTreeSet<u64>,
}

#[derive(Debug)]
struct JobSpan {
    /// Absent if the client does not record its trace.
    span: Option<OpenSpan>,
    evaluations: u64,
    batches: u64,
    /// Number of evaluations and batches without a span.
    omitted: u64,
}

#[derive(Debug)]
struct EvaluationSpan {
    job: JobId,
    span: Option<OpenSpan>,
    batches: u64,
}

#[derive(Debug)]
struct BatchSpan {
    worker: WorkerId,
    attempt: u64,
    span: Option<OpenSpan>,
}

impl JobSpans {
    pub(crate) fn new(recorder: Arc<dyn SpanRecorder>) -> Self {
        Self {
            recorder,
            submissions: BTreeMap::new(),
            jobs: BTreeMap::new(),
            evaluations: BTreeMap::new(),
            batches: BTreeMap::new(),
            touched: BTreeSet::new(),
        }
    }

    /// Notes the context of a client that submits a job.
    pub(crate) fn note_submission(
        &mut self,
        reply_id: ReplyId,
        client: Option<TraceContext>,
        now: Duration,
    ) {
        self.submissions.insert(reply_id, (now, client));
    }

    /// Sees an event before the reaction to it.
    pub(crate) fn observe_event(&mut self, event: &Event, now: Duration) {
        self.touched.clear();
        if let Event::Answered { worker, batch, .. } = event
            && self.batches.get(batch).is_some_and(|held| held.worker == *worker)
        {
            self.end_batch(*batch, None, now);
        }
    }

    /// Sees the effects of the reaction, and the state after it.
    pub(crate) fn observe_reaction(&mut self, state: &State, effects: &[Effect], now: Duration) {
        for effect in effects {
            if let Effect::Answer { reply_id, answer } = effect {
                self.observe_answer(state, *reply_id, answer);
            }
        }
        for effect in effects {
            match effect {
                Effect::Send { worker, batch, work } => {
                    self.begin_batch(state, *worker, *batch, work, now);
                }
                Effect::Revoke { batch, .. } => self.end_batch(*batch, Some("revoked"), now),
                Effect::Note(Notice::WorkerDetached { worker, .. }) => {
                    self.end_batches_of(*worker, now);
                }
                Effect::Note(Notice::JobEnded { job, ending, .. }) => {
                    self.end_job(*job, ending.status.name(), ending.reason.clone(), now);
                }
                Effect::Stop => self.stop(now),
                _ => {}
            }
        }
        for attempt in std::mem::take(&mut self.touched) {
            if self.evaluations.get(&attempt).is_some_and(|it| !is_open(state, it.job, attempt)) {
                self.end_evaluation(attempt, None, now);
            }
        }
    }

    /// Returns the position of a batch that was just sent, if it has a span.
    pub(crate) fn context(&self, batch: BatchId) -> Option<TraceContext> {
        Some(self.batches.get(&batch)?.span.as_ref()?.context())
    }

    fn observe_answer(&mut self, state: &State, reply_id: ReplyId, answer: &Answer) {
        let Some((begun, client)) = self.submissions.remove(&reply_id) else {
            return;
        };
        if let Answer::Submitted(job) = answer
            && state.jobs.contains_key(job)
        {
            self.jobs.entry(*job).or_insert_with(|| JobSpan::begin(*job, client, begun));
        }
    }

    fn begin_batch(
        &mut self,
        state: &State,
        worker: WorkerId,
        id: BatchId,
        work: &Work,
        now: Duration,
    ) {
        let Some(batch) = state.batches.get(&id) else {
            return;
        };
        let (job_id, attempt) = (batch.assignment.job, batch.assignment.attempt);
        // A job that was there at the start of this process begins a trace of its own.
        let job = self.jobs.entry(job_id).or_insert_with(|| JobSpan::begin(job_id, None, now));
        let evaluation = self.evaluations.entry(attempt).or_insert_with(|| EvaluationSpan {
            job: job_id,
            span: job.evaluation(now),
            batches: 0,
        });
        let mut span = evaluation.batch(job, now);
        if let Some(span) = &mut span {
            let attributes = [("batch", id.0), ("worker", worker.0), ("first", work.first)];
            for (name, value) in attributes {
                span.set(name, AttributeValue::Count(value));
            }
            span.set("realizations", AttributeValue::Count(work.count.into()));
            span.set("purpose", AttributeValue::Text(batch.purpose.name().to_owned()));
        }
        self.batches.insert(id, BatchSpan { worker, attempt, span });
    }

    fn end_batches_of(&mut self, worker: WorkerId, now: Duration) {
        let held = self.batches.iter().filter(|(_, batch)| batch.worker == worker);
        for batch in Vec::from_iter(held.map(|(id, _)| *id)) {
            self.end_batch(batch, Some("the worker departed"), now);
        }
    }

    fn end_batch(&mut self, batch: BatchId, error: Option<&str>, now: Duration) {
        if let Some(BatchSpan { attempt, span, .. }) = self.batches.remove(&batch) {
            self.touched.insert(attempt);
            self.record(span, error.map(str::to_owned), now);
        }
    }

    fn end_evaluation(&mut self, attempt: u64, error: Option<&str>, now: Duration) {
        if let Some(EvaluationSpan { span, .. }) = self.evaluations.remove(&attempt) {
            self.record(span, error.map(str::to_owned), now);
        }
    }

    fn end_job(&mut self, job: JobId, status: &str, reason: Option<String>, now: Duration) {
        let open = self.evaluations.iter().filter(|(_, evaluation)| evaluation.job == job);
        for attempt in Vec::from_iter(open.map(|(attempt, _)| *attempt)) {
            self.end_evaluation(attempt, Some("not needed"), now);
        }
        let Some(JobSpan { span: Some(mut span), omitted, .. }) = self.jobs.remove(&job) else {
            return;
        };
        span.set("status", AttributeValue::Text(status.to_owned()));
        if omitted > 0 {
            span.set("omitted_spans", AttributeValue::Count(omitted));
        }
        self.record(Some(span), reason, now);
    }

    /// Ends all spans: the coordinator stops.
    fn stop(&mut self, now: Duration) {
        let why = || Some("the coordinator stopped".to_owned());
        let batches = std::mem::take(&mut self.batches).into_values().map(|batch| batch.span);
        let evaluations = std::mem::take(&mut self.evaluations).into_values().map(|it| it.span);
        let jobs = std::mem::take(&mut self.jobs).into_values().map(|job| job.span);
        for span in batches.chain(evaluations).chain(jobs) {
            self.record(span, why(), now);
        }
    }

    fn record(&self, span: Option<OpenSpan>, error: Option<String>, now: Duration) {
        if let Some(span) = span {
            self.recorder.record(span.end(time(now), error));
        }
    }
}

impl JobSpan {
    fn begin(job: JobId, client: Option<TraceContext>, now: Duration) -> Self {
        let mut span = OpenSpan::begin("osteon.job", client, time(now));
        if let Some(span) = &mut span {
            span.set("job", AttributeValue::Text(job.to_string()));
        }
        Self { span, evaluations: 0, batches: 0, omitted: 0 }
    }

    /// Begins the span of a further evaluation.
    fn evaluation(&mut self, now: Duration) -> Option<OpenSpan> {
        let parent = self.span.as_ref()?.context();
        if self.evaluations >= EVALUATIONS_MAX {
            self.omitted += 1;
            return None;
        }
        self.evaluations += 1;
        OpenSpan::begin("osteon.evaluation", Some(parent), time(now))
    }
}

impl EvaluationSpan {
    /// Begins the span of a further batch.
    fn batch(&mut self, job: &mut JobSpan, now: Duration) -> Option<OpenSpan> {
        let parent = match (&self.span, &job.span) {
            (Some(span), _) => span.context(),
            (None, Some(_)) => {
                job.omitted += 1;
                return None;
            }
            (None, None) => return None,
        };
        if self.batches >= BATCHES_MAX || job.batches >= BATCHES_OF_JOB_MAX {
            job.omitted += 1;
            return None;
        }
        self.batches += 1;
        job.batches += 1;
        OpenSpan::begin("osteon.batch", Some(parent), time(now))
    }
}

fn is_open(state: &State, job: JobId, attempt: u64) -> bool {
    let job = state.jobs.get(&job);
    job.is_some_and(|job| job.evaluations().any(|evaluation| evaluation.attempt == attempt))
}

/// Returns a time of the core's clock, which counts from the Unix epoch.
fn time(now: Duration) -> SystemTime {
    SystemTime::UNIX_EPOCH + now
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_spans_of_a_job_is_bounded() {
        let now = Duration::from_secs(1);
        let mut job = JobSpan::begin(JobId(1), None, now);
        let (mut evaluations, mut batches) = (0, 0);
        for _ in 0..2000 {
            let span = job.evaluation(now);
            evaluations += u64::from(span.is_some());
            let mut evaluation = EvaluationSpan { job: JobId(1), span, batches: 0 };
            let of_evaluation = (0..300).filter(|_| evaluation.batch(&mut job, now).is_some());
            let of_evaluation = of_evaluation.count() as u64;
            assert!(of_evaluation <= BATCHES_MAX);
            batches += of_evaluation;
        }
        assert_eq!((evaluations, batches), (EVALUATIONS_MAX, BATCHES_OF_JOB_MAX));
        assert_eq!(job.omitted, 2000 - evaluations + 2000 * 300 - batches);
    }

    #[test]
    fn a_client_that_records_nothing_has_no_spans() {
        let now = Duration::from_secs(1);
        let client = TraceContext { trace: 1, span: 1, sampled: false };
        let mut job = JobSpan::begin(JobId(1), Some(client), now);
        let span = job.evaluation(now);
        let mut evaluation = EvaluationSpan { job: JobId(1), span, batches: 0 };
        assert!(evaluation.batch(&mut job, now).is_none());
        assert!(job.span.is_none() && evaluation.span.is_none());
    }
}
