//! Spans of the computation of batches, for coordinators that trace them. They exist only if spans are
//! recorded.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use osteon_proto::batch::Work;
use osteon_proto::spans::{AttributeValue, OpenSpan, SpanRecorder, TraceContext};
use osteon_proto::v1::attach_response::Message as Response;

use crate::backend::{Computed, Task};
use crate::state::Event;

/// The traced batches that this worker holds.
#[derive(Debug)]
pub(crate) struct BatchSpans {
    recorder: Arc<dyn SpanRecorder>,
    /// Context of the batch in the message that is being handled.
    arrived: Option<TraceContext>,
    /// Context and size of each batch.
    held: BTreeMap<Task, (TraceContext, u32)>,
}

impl BatchSpans {
    pub(crate) fn new(recorder: Arc<dyn SpanRecorder>) -> Self {
        Self { recorder, arrived: None, held: BTreeMap::new() }
    }

    /// Sees an event before the reaction to it.
    pub(crate) fn observe(&mut self, event: &Event, now: SystemTime) {
        self.arrived = None;
        match event {
            Event::Message(message) => {
                if let Response::Batch(batch) = &**message {
                    self.arrived = TraceContext::of_batch(batch);
                }
            }
            Event::Computed(task, computed) => {
                if let Some((context, count)) = self.held.remove(task)
                    && let Computed::Complete { elapsed_s, .. } = computed
                {
                    self.record(context, count, *elapsed_s, now);
                }
            }
            _ => {}
        }
    }

    /// Notes that a batch is computed.
    pub(crate) fn begin(&mut self, task: Task, work: &Work) {
        if let Some(context) = self.arrived.take() {
            self.held.insert(task, (context, work.count));
        }
    }

    /// Notes that a batch is abandoned.
    pub(crate) fn abandon(&mut self, task: Task) {
        self.held.remove(&task);
    }

    /// Records a computation; the time before it, in which the batch waited, belongs to the
    /// coordinator's span alone.
    fn record(&self, parent: TraceContext, count: u32, elapsed_s: f64, now: SystemTime) {
        let elapsed = Duration::try_from_secs_f64(elapsed_s).unwrap_or_default();
        let start = now.checked_sub(elapsed).unwrap_or(now);
        if let Some(mut span) = OpenSpan::begin("osteon.compute", Some(parent), start) {
            span.set("realizations", AttributeValue::Count(count.into()));
            self.recorder.record(span.end(now, None));
        }
    }
}
