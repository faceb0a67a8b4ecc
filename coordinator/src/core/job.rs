//! A job in the coordinator: its progress, and what is known of it when it has ended.

use std::collections::BTreeSet;
use std::time::Duration;

use osteon_common::job::{Data, Group, JobKind, JobSpecification, VelocitySet};
use osteon_common::parameters::Point;
use osteon_proto::specification;
use prost::Message as _;

use crate::config::Config;
use crate::core::ahead::Ahead;
use crate::core::doubts::Doubts;
use crate::core::evaluation::{PendingEvaluation, StoredRecord};
use crate::core::ids::{BatchId, ReplyId};
use crate::core::proofs::SetupKey;
use crate::core::rate::Rate;
use crate::core::realization_time::RealizationTime;
use crate::core::saved::SavedParts;
use crate::core::worker_name::WorkerName;
use crate::store::{EndRecord, EvaluationRecord, JobRecord};
use osteon_search::Search;

/// A job that has not ended.
#[derive(Debug)]
pub(crate) struct Job {
    pub(crate) record: JobRecord,
    /// Digest of its specification, to compare two submissions with the same request id.
    pub(crate) identity: SpecificationDigest,
    /// Key of its setup, for which its workers have to give a proof.
    pub(crate) setup: SetupKey,
    /// Approximate memory of its specification, bytes.
    pub(crate) bytes: u64,
    pub(crate) stage: Stage,
    pub(crate) search: Search,
    /// Evaluations of points that its search will ask for when it comes to other groups and starts.
    pub(crate) ahead: Ahead,
    /// Speculative evaluations of points that its search may ask for next.
    pub(crate) speculation: Speculation,
    /// Results of evaluations that have not begun yet, from an earlier coordinator.
    pub(crate) saved: SavedParts,
    /// Number of its evaluations in the store. Those that the search has not received yet are read
    /// before it continues.
    pub(crate) stored: u64,
    /// All workers whose answers are in evaluations that the search has received.
    pub(crate) workers: BTreeSet<WorkerName>,
    /// Its search is restarted as soon as the record that is being stored is durable.
    pub(crate) restart_pending: bool,
    /// An evaluation was damaged in the store and has been computed again.
    pub(crate) recomputed: bool,
    /// The last evaluation that the search has received, if `recomputed`.
    pub(crate) received: Option<EvaluationRecord>,
    /// A client has cancelled it; it ends as soon as the record that is being stored is durable.
    pub(crate) cancelled: bool,
    /// Rate of the answers that its search needs, over the last seconds.
    pub(crate) rate: Rate,
    /// Time of one of its realizations on one slot.
    pub(crate) realization_time: RealizationTime,
    /// The rate of all workers at it, as last measured.
    pub(crate) fleet: Option<FleetRate>,
    /// Number of workers that have answered a batch of it, each stay counted.
    pub(crate) rated_workers: u64,
    /// The newest duplicate of one of its overdue batches.
    pub(crate) newest_overdue_duplicate: Option<BatchId>,
    /// Sequence number of its last published snapshot.
    pub(crate) sequence: u64,
    /// Time of its last progress: its entry here, its beginning, an answer that its search needs, the
    /// reading of a stored evaluation or the completion of one.
    pub(crate) last_progress: Duration,
    /// Requests that are answered when the current record is durable: submissions at first,
    /// cancellations at the end.
    pub(crate) pending_replies: Vec<ReplyId>,
    /// The doubts about its earlier result, if it is computed again because a host that contributed to it
    /// was banned.
    pub(crate) doubts: Doubts,
    /// The store's refusal of the current record.
    pub(crate) store_retry: Option<StoreRetry>,
}

impl Job {
    /// Returns a job without computed results in this process, with `stored` evaluations in the
    /// store.
    pub(crate) fn new(record: JobRecord, stage: Stage, stored: u64, now: Duration) -> Self {
        Self {
            identity: identity(&record.specification),
            setup: SetupKey::from_specification(&record.specification),
            bytes: bytes(&record.specification),
            search: Search::new(record.specification.clone()),
            ahead: Ahead::default(),
            speculation: Speculation::default(),
            saved: SavedParts::default(),
            record,
            stage,
            stored,
            workers: BTreeSet::new(),
            restart_pending: false,
            recomputed: false,
            received: None,
            cancelled: false,
            rate: Rate::default(),
            realization_time: RealizationTime::default(),
            fleet: None,
            rated_workers: 0,
            newest_overdue_duplicate: None,
            sequence: sequence(0, now),
            last_progress: now,
            pending_replies: Vec::new(),
            doubts: Doubts::default(),
            store_retry: None,
        }
    }

    /// Creates the evaluation of a point, with the results that an earlier coordinator saved.
    pub(crate) fn new_evaluation(
        &mut self,
        number: u64,
        attempt: u64,
        point: Point,
        config: &Config,
    ) -> PendingEvaluation {
        let realizations = self.record.specification.monte_carlo.realizations;
        let mut evaluation = PendingEvaluation::new(number, attempt, point, realizations);
        let audits = (&config.audit_key, config.audit_fraction);
        self.saved.restore(&mut evaluation, self.record.job, audits);
        evaluation
    }

    /// Returns the evaluation that the search asked for, while it is under way.
    pub(crate) fn evaluation(&self) -> Option<&PendingEvaluation> {
        match &self.stage {
            Stage::Computing(evaluation) => Some(evaluation),
            _ => None,
        }
    }

    /// Same as [`Job::evaluation`].
    pub(crate) fn evaluation_mut(&mut self) -> Option<&mut PendingEvaluation> {
        self.stage.evaluation_mut()
    }

    /// Returns all evaluations under way; the one that the search asked for comes first.
    pub(crate) fn evaluations(&self) -> impl Iterator<Item = &PendingEvaluation> {
        self.needed_evaluations().chain(&self.speculation.evaluations)
    }

    /// Returns the evaluation that the search asked for, and those that it will ask for.
    pub(crate) fn needed_evaluations(&self) -> impl Iterator<Item = &PendingEvaluation> {
        self.evaluation().into_iter().chain(self.ahead.evaluations())
    }

    /// Same as [`Job::needed_evaluations`].
    pub(crate) fn needed_evaluations_mut(
        &mut self,
    ) -> impl Iterator<Item = &mut PendingEvaluation> {
        self.stage.evaluation_mut().into_iter().chain(self.ahead.evaluations_mut())
    }

    /// Returns the one of [`Job::needed_evaluations`] with this attempt.
    pub(crate) fn certain_evaluation(&self, attempt: u64) -> Option<&PendingEvaluation> {
        self.needed_evaluations().find(|evaluation| evaluation.attempt == attempt)
    }

    /// Same as [`Job::certain_evaluation`].
    pub(crate) fn certain_evaluation_mut(
        &mut self,
        attempt: u64,
    ) -> Option<&mut PendingEvaluation> {
        self.needed_evaluations_mut().find(|evaluation| evaluation.attempt == attempt)
    }

    /// Same as [`Job::evaluations`].
    pub(crate) fn evaluations_mut(&mut self) -> impl Iterator<Item = &mut PendingEvaluation> {
        let certain = self.stage.evaluation_mut().into_iter().chain(self.ahead.evaluations_mut());
        certain.chain(&mut self.speculation.evaluations)
    }
}

/// The rate of all workers at one job.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FleetRate {
    /// Sum over the workers that are expected to answer, realizations per second.
    pub(crate) total: f64,
    /// Number of workers that are expected to answer.
    pub(crate) workers: usize,
    /// Mean of one slot, realizations per second.
    pub(crate) per_slot: f64,
    /// [`Job::rated_workers`] when it was measured.
    pub(crate) rated_workers: u64,
    /// [`State::fleet_changes`](crate::core::state::State::fleet_changes) when it was measured.
    pub(crate) changes: u64,
    /// Number of batches for which it has been used.
    pub(crate) uses: u64,
}

/// Progress of a job.
#[derive(Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "a job has one, and it is computing most of the time"
)]
pub(crate) enum Stage {
    /// Its submission is being stored; no client has had an answer.
    StoringSubmission,
    /// It waits for its turn.
    Waiting,
    /// A stored evaluation is being read for its search.
    Replaying {
        /// The store has received the request to read it.
        asked: bool,
    },
    /// Batches of its evaluation are sent to workers.
    Computing(PendingEvaluation),
    /// A settled evaluation is being completed beside the core.
    Completing(Settled),
    /// A complete evaluation is being stored.
    StoringEvaluation {
        record: EvaluationRecord,
        /// See [`Store::put_evaluation`](crate::store::Store::put_evaluation).
        deletes_later: bool,
    },
    /// Evaluations are being stored that were complete before the search asked for them, or are completed
    /// beside the core. Once they are durable, the search is replaced by the one that has taken them in.
    StoringPrepared {
        /// The evaluations, with consecutive numbers; not empty.
        records: Vec<EvaluationRecord>,
        /// See [`Store::put_evaluation`](crate::store::Store::put_evaluation), of the last of them.
        deletes_later: bool,
        /// The search after them.
        after: After,
    },
    /// Its end is being stored.
    StoringEnd(EndRecord),
}

impl Stage {
    /// Returns the evaluation whose batches are sent to workers.
    fn evaluation_mut(&mut self) -> Option<&mut PendingEvaluation> {
        match self {
            Self::Computing(evaluation) => Some(evaluation),
            _ => None,
        }
    }

    /// Returns whether a record of the job is not durable yet, or about to be made.
    pub(crate) fn is_storing(&self) -> bool {
        matches!(
            self,
            Self::StoringSubmission
                | Self::Completing(_)
                | Self::StoringEvaluation { .. }
                | Self::StoringPrepared { .. }
                | Self::StoringEnd(_)
        )
    }
}

/// The search after evaluations that are being stored.
#[derive(Debug)]
pub(crate) enum After {
    /// It has taken them in.
    Ready(Box<Search>),
    /// It is taking the evaluation in, beside the core.
    Awaited {
        /// Number of the attempt at the evaluation.
        attempt: u64,
        /// The evaluation is durable already.
        durable: bool,
    },
}

/// A settled evaluation, whose results are completed elsewhere.
#[derive(Debug)]
pub(crate) struct Settled {
    pub(crate) number: u64,
    pub(crate) attempt: u64,
    pub(crate) point: Point,
    /// All workers whose answers are among the results.
    pub(crate) workers: Vec<WorkerName>,
    /// What the store has of it.
    pub(crate) stored: StoredRecord,
}

/// Points that a search may ask for next. They are neither stored nor shown.
#[derive(Debug, Default)]
pub(crate) struct Speculation {
    /// Candidate points, most likely first.
    pub(crate) candidates: Vec<Point>,
    /// Evaluations of candidates that have begun, in the order of their beginning.
    pub(crate) evaluations: Vec<PendingEvaluation>,
}

/// Returns the approximate memory of a specification, bytes.
pub(crate) fn bytes(specification: &JobSpecification) -> u64 {
    let data_bytes = |data: &Data| {
        let names: usize =
            data.groups().iter().map(|group| size_of::<Group>() + group.name.len()).sum();
        let set_bytes = |set: VelocitySet<'_>| {
            size_of_val(set.velocities) + set.subjects.map_or(0, size_of_val)
        };
        let sets: usize = (0..data.sets()).filter_map(|set| data.set(set)).map(set_bytes).sum();
        names + sets
    };
    let data = specification.data.as_ref().map_or(0, data_bytes);
    (size_of::<JobSpecification>() + data) as u64
}

/// A refusal of the store.
#[derive(Debug)]
pub(crate) struct StoreRetry {
    pub(crate) since: Duration,
    pub(crate) retry_at: Duration,
    pub(crate) error: String,
    /// The record has been sent to the store again.
    pub(crate) in_flight: bool,
}

/// A job whose end is durable, as far as lists show it.
#[derive(Debug)]
pub(crate) struct EndedJob {
    pub(crate) request: Option<RequestName>,
    pub(crate) identity: SpecificationDigest,
    pub(crate) kind: JobKind,
    /// The client that submitted it.
    pub(crate) client: String,
    /// Display name; may be empty.
    pub(crate) name: String,
    /// Priority among the jobs of its client.
    pub(crate) priority: u32,
    pub(crate) max_evaluations: u64,
    /// Number of realizations of each evaluation.
    pub(crate) realizations: u64,
    /// Time of acceptance, since the Unix epoch.
    pub(crate) accepted: Duration,
    /// Sequence number of the snapshot that shows its end, or of a later one.
    pub(crate) sequence: u64,
    pub(crate) end: EndRecord,
    /// The doubts about its result: bans, since its end, of hosts that contributed to it.
    pub(crate) doubts: Doubts,
}

impl EndedJob {
    /// Returns what lists show of a job after its end. `last_sequence` is the number of its last snapshot
    /// before the end; that of the end is published next.
    pub(crate) fn new(record: &JobRecord, end: EndRecord, last_sequence: u64) -> Self {
        let specification = &record.specification;
        Self {
            request: RequestName::from_record(record),
            identity: identity(specification),
            kind: specification.kind,
            client: record.client.clone(),
            name: record.name.clone(),
            priority: record.priority,
            max_evaluations: specification.evaluations_max(),
            realizations: specification.monte_carlo.realizations,
            accepted: record.accepted,
            sequence: sequence(last_sequence, end.ended),
            end,
            doubts: Doubts::default(),
        }
    }
}

/// Name of the request that submitted a job: ids of different clients are independent.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct RequestName {
    client: String,
    id: String,
}

impl RequestName {
    /// Returns the name of request `id` of `client`; `None` without an id, since such a request is
    /// never repeated.
    pub(crate) fn new(client: &str, id: &str) -> Option<Self> {
        (!id.is_empty()).then(|| Self { client: client.to_owned(), id: id.to_owned() })
    }

    /// Returns the name of the request that submitted a job.
    pub(crate) fn from_record(record: &JobRecord) -> Option<Self> {
        Self::new(&record.client, &record.request_id)
    }
}

pub(crate) type SpecificationDigest = [u8; 32];

/// Returns the digest of a specification; different specifications have different digests.
pub(crate) fn identity(specification: &JobSpecification) -> SpecificationDigest {
    let encoded = specification::to_message(specification).encode_to_vec();
    *blake3::hash(&encoded).as_bytes()
}

/// Returns the sequence number of a snapshot at `now` after one with number `last`. It always
/// increases, and since it follows the clock it increases across restarts too.
pub(crate) fn sequence(last: u64, now: Duration) -> u64 {
    u64::try_from(now.as_millis()).unwrap_or(u64::MAX).max(last.saturating_add(1))
}
