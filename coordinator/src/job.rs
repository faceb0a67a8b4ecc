//! A job as the coordinator knows it: how far it is, and what is left of one that has ended.

use std::collections::BTreeSet;
use std::time::Duration;

use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::parameters::Point;
use osteon_proto::specification;
use prost::Message as _;

use crate::evaluation::Evaluation;
use crate::ids::{BatchId, Token};
use crate::pace::Pace;
use crate::rate::Rate;
use crate::store::{EndRecord, EvaluationRecord, JobRecord};
use crate::worker_name::WorkerName;
use osteon_search::Search;

/// A job that has not ended.
#[derive(Debug)]
pub(crate) struct Job {
    pub(crate) record: JobRecord,
    /// Digest of its specification: of two submissions of one request.
    pub(crate) identity: Identity,
    pub(crate) stage: Stage,
    pub(crate) search: Search,
    /// Speculative evaluations of points that its search may ask for next.
    pub(crate) speculation: Speculation,
    /// How many evaluations the store has of it; those that the search was not told are read
    /// before it goes on.
    pub(crate) stored: u64,
    /// Everybody whose answers are in evaluations that the search was told.
    pub(crate) workers: BTreeSet<WorkerName>,
    /// Its search is to be restarted, when what is being stored is stored.
    pub(crate) restart_pending: bool,
    /// An evaluation was damaged in the store, and computed again.
    pub(crate) recomputed: bool,
    /// A client wants it ended as soon as what is being stored is stored.
    pub(crate) cancelled: bool,
    pub(crate) rate: Rate,
    /// How long its realizations take.
    pub(crate) pace: Pace,
    /// The newest duplicate of an overdue batch of it.
    pub(crate) scout: Option<BatchId>,
    /// Sequence number of its last snapshot that was published.
    pub(crate) sequence: u64,
    /// When it last got an answer, or began, or was accepted.
    pub(crate) progressed: Duration,
    /// Requests that are answered when the present record is durable: submissions at first,
    /// cancellations at the end.
    pub(crate) tokens: Vec<Token>,
    /// The store's refusal of the present record.
    pub(crate) trouble: Option<Trouble>,
}

impl Job {
    /// A job of which nothing is computed here yet, with so many stored evaluations.
    pub(crate) fn new(record: JobRecord, stage: Stage, stored: u64, now: Duration) -> Self {
        Self {
            identity: identity(&record.specification),
            search: Search::new(record.specification.clone()),
            speculation: Speculation::default(),
            record,
            stage,
            stored,
            workers: BTreeSet::new(),
            restart_pending: false,
            recomputed: false,
            cancelled: false,
            rate: Rate::default(),
            pace: Pace::default(),
            scout: None,
            sequence: sequence(0, now),
            progressed: now,
            tokens: Vec::new(),
            trouble: None,
        }
    }

    /// The evaluation that the search asked for, while it is under way.
    pub(crate) fn evaluation(&self) -> Option<&Evaluation> {
        match &self.stage {
            Stage::Computing(evaluation) => Some(evaluation),
            _ => None,
        }
    }

    /// All evaluations under way, that which the search asked for first.
    pub(crate) fn evaluations(&self) -> impl Iterator<Item = &Evaluation> {
        self.evaluation().into_iter().chain(&self.speculation.evaluations)
    }

    /// As [`Job::evaluations`].
    pub(crate) fn evaluations_mut(&mut self) -> impl Iterator<Item = &mut Evaluation> {
        let asked_for = match &mut self.stage {
            Stage::Computing(evaluation) => Some(evaluation),
            _ => None,
        };
        asked_for.into_iter().chain(&mut self.speculation.evaluations)
    }
}

/// How far a job is.
#[derive(Debug)]
pub(crate) enum Stage {
    /// Its record is being stored; no client has heard of it.
    Accepting,
    /// It waits for its turn.
    Waiting,
    /// A stored evaluation is being read for its search.
    Replaying {
        /// The store was asked for it.
        asked: bool,
    },
    /// Its evaluation is handed out.
    Computing(Evaluation),
    /// A complete evaluation is being stored.
    Storing {
        /// The evaluation.
        record: EvaluationRecord,
        /// Those after it in the store belong to another path.
        is_last: bool,
    },
    /// Its end is being stored.
    Finishing(EndRecord),
}

impl Stage {
    /// Whether a record of the job is not durable yet.
    pub(crate) fn is_storing(&self) -> bool {
        matches!(self, Self::Accepting | Self::Storing { .. } | Self::Finishing(_))
    }
}

/// Points that a search may ask for next. Nothing of them is stored or shown.
#[derive(Debug, Default)]
pub(crate) struct Speculation {
    /// The points, the likeliest first.
    pub(crate) candidates: Vec<Point>,
    /// The evaluations that are begun of them, in the order of their beginning.
    pub(crate) evaluations: Vec<Evaluation>,
}

/// A refusal of the store.
#[derive(Debug)]
pub(crate) struct Trouble {
    pub(crate) since: Duration,
    pub(crate) retry_at: Duration,
    pub(crate) error: String,
    /// It is on its way again.
    pub(crate) on_its_way: bool,
}

/// A job whose end is durable: what a list shows of it.
#[derive(Debug)]
pub(crate) struct EndedJob {
    pub(crate) request: Option<RequestName>,
    pub(crate) identity: Identity,
    pub(crate) kind: JobKind,
    /// Who submitted it.
    pub(crate) client: String,
    /// What people call it; may be empty.
    pub(crate) name: String,
    /// Its rank among the jobs of its client.
    pub(crate) priority: u32,
    pub(crate) max_evaluations: u64,
    /// Realizations of each evaluation.
    pub(crate) realizations: u64,
    /// When it was accepted, since the Unix epoch.
    pub(crate) accepted: Duration,
    /// Sequence number of its last snapshot.
    pub(crate) sequence: u64,
    pub(crate) end: EndRecord,
}

impl EndedJob {
    /// What is kept of a job that ended, after a snapshot with number `sequence`.
    pub(crate) fn new(record: &JobRecord, end: EndRecord, sequence: u64) -> Self {
        let specification = &record.specification;
        Self {
            request: RequestName::of(record),
            identity: identity(specification),
            kind: specification.kind,
            client: record.client.clone(),
            name: record.name.clone(),
            priority: record.priority,
            max_evaluations: specification.evaluations_max(),
            realizations: specification.monte_carlo.realizations,
            accepted: record.accepted,
            sequence: self::sequence(sequence, end.ended),
            end,
        }
    }
}

/// Names the request that submitted a job: ids of different clients have nothing in common.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct RequestName {
    client: String,
    id: String,
}

impl RequestName {
    /// The request `id` of `client`; `None` without an id: then it is never repeated.
    pub(crate) fn new(client: &str, id: &str) -> Option<Self> {
        (!id.is_empty()).then(|| Self { client: client.to_owned(), id: id.to_owned() })
    }

    /// That which submitted a job.
    pub(crate) fn of(record: &JobRecord) -> Option<Self> {
        Self::new(&record.client, &record.request_id)
    }
}

/// Digest of a specification.
pub(crate) type Identity = [u8; 32];

/// Digest of a specification: equal for equal ones only.
pub(crate) fn identity(specification: &JobSpecification) -> Identity {
    let encoded = specification::to_message(specification).encode_to_vec();
    *blake3::hash(&encoded).as_bytes()
}

/// Number of a snapshot at `now` after one with number `last`: it grows, and since it follows the
/// clock it grows over restarts too.
pub(crate) fn sequence(last: u64, now: Duration) -> u64 {
    u64::try_from(now.as_millis()).unwrap_or(u64::MAX).max(last.saturating_add(1))
}
