//! What the core is told about its surroundings, and remembers until it is told something else.

use std::collections::BTreeSet;
use std::time::Duration;

use crate::core::event::Event;

/// Something that has a hard bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Bounded {
    /// Jobs that wait or run.
    Jobs,
    /// The specifications of these jobs, bytes.
    JobBytes,
    /// Attached workers.
    Workers,
    /// Connections of clients and workers.
    Connections,
}

/// What an operator may be warned of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum ConcernKind {
    NearBound(Bounded),
    StoreRefuses,
    LogStuck,
}

/// The store's last refusal, if it has stored nothing since.
#[derive(Debug, Clone)]
pub(crate) struct StoreRefusal {
    /// Time of the first refusal in a row.
    pub(crate) since: Duration,
    /// Error text for people.
    pub(crate) error: String,
}

/// The log of the store's database, as long as it cannot be copied into the database.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StuckLog {
    pub(crate) since: Duration,
    pub(crate) bytes: u64,
}

/// What the core was told.
#[derive(Debug, Default)]
pub(crate) struct ServiceCondition {
    /// Open connections, and their maximum number.
    pub(crate) connections: (u64, u64),
    pub(crate) refusal: Option<StoreRefusal>,
    pub(crate) stuck_log: Option<StuckLog>,
    /// The concerns that were written to the program's log and are not over yet.
    pub(crate) told: BTreeSet<ConcernKind>,
    /// Time when new concerns were last looked for.
    pub(crate) looked: Duration,
}

impl ServiceCondition {
    /// Remembers what an event says.
    pub(crate) fn note(&mut self, event: &Event, now: Duration) {
        match event {
            Event::Connections { open, most } => self.connections = (*open, *most),
            Event::Stored { .. } => self.refusal = None,
            Event::StoreFailed { error, .. } => {
                let since = self.refusal.as_ref().map_or(now, |refusal| refusal.since);
                self.refusal = Some(StoreRefusal { since, error: error.clone() });
            }
            Event::LogCopied => self.stuck_log = None,
            Event::LogStuck { bytes } => {
                let since = self.stuck_log.map_or(now, |stuck| stuck.since);
                self.stuck_log = Some(StuckLog { since, bytes: *bytes });
            }
            _ => {}
        }
    }
}
