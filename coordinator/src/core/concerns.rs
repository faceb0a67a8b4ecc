//! Warnings for the operator: a bound is half used up, the store refuses records, or its log only grows. The
//! coordinator's log says each once; the list of jobs and the live page show it as long as it lasts.

use std::fmt;
use std::time::Duration;

use osteon_common::limits::{JOBS_MAX, WORKERS_MAX};

use crate::core::service_condition::{Bounded, ConcernKind};
use crate::core::state::State;

/// A log that could not be copied for less than this is no concern: a disk may be full for a moment.
const LOG_PATIENCE: Duration = Duration::from_secs(60);
const MIB: u64 = 1 << 20;

/// A state of the service that the operator is warned of.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Concern {
    /// At least half of what is allowed is used.
    NearBound { what: Bounded, used: u64, most: u64 },
    /// The store has refused a record, and stored none since.
    StoreRefuses { time: Duration, error: String },
    /// The store's log could not be copied into the database.
    LogStuck { time: Duration, bytes: u64 },
}

impl Bounded {
    pub(crate) const ALL: [Self; 4] =
        [Self::Jobs, Self::JobBytes, Self::Workers, Self::Connections];

    /// Returns the name in metrics.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Jobs => "jobs",
            Self::JobBytes => "job_bytes",
            Self::Workers => "workers",
            Self::Connections => "connections",
        }
    }

    /// Returns how much is used, and the bound.
    pub(crate) fn usage(self, state: &State) -> (u64, u64) {
        match self {
            Self::Jobs => (state.unfinished_jobs() as u64, JOBS_MAX as u64),
            Self::JobBytes => {
                (state.jobs.values().map(|job| job.bytes).sum(), state.config.jobs_bytes_max)
            }
            Self::Workers => (state.workers.len() as u64, WORKERS_MAX as u64),
            Self::Connections => state.condition.connections,
        }
    }
}

impl Concern {
    fn kind(&self) -> ConcernKind {
        match self {
            Self::NearBound { what, .. } => ConcernKind::NearBound(*what),
            Self::StoreRefuses { .. } => ConcernKind::StoreRefuses,
            Self::LogStuck { .. } => ConcernKind::LogStuck,
        }
    }
}

/// Returns everything that is a concern at `now`.
pub(crate) fn concerns(state: &State, now: Duration) -> Vec<Concern> {
    let mut found = Vec::new();
    if let Some(refusal) = &state.condition.refusal {
        let (time, error) = (now.saturating_sub(refusal.since), refusal.error.clone());
        found.push(Concern::StoreRefuses { time, error });
    }
    if let Some(stuck) = state.condition.stuck_log {
        let time = now.saturating_sub(stuck.since);
        if time >= LOG_PATIENCE {
            found.push(Concern::LogStuck { time, bytes: stuck.bytes });
        }
    }
    for what in Bounded::ALL {
        let (used, most) = what.usage(state);
        if used > 0 && used >= most / 2 {
            found.push(Concern::NearBound { what, used, most });
        }
    }
    found
}

/// Returns the concerns that the coordinator's log does not say yet.
pub(crate) fn new_ones(state: &mut State, now: Duration) -> Vec<Concern> {
    let mut all = concerns(state, now);
    let kinds: Vec<ConcernKind> = all.iter().map(Concern::kind).collect();
    // A number that goes up and down around the half is told once.
    let stays = |kind: &ConcernKind| match kind {
        ConcernKind::NearBound(what) => {
            let (used, most) = what.usage(state);
            used >= most / 8 * 3
        }
        _ => kinds.contains(kind),
    };
    let mut told = state.condition.told.clone();
    told.retain(stays);
    all.retain(|concern| told.insert(concern.kind()));
    state.condition.told = told;
    all
}

impl fmt::Display for Concern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NearBound { what: Bounded::Jobs, used, most } => write!(
                f,
                "{used} of at most {most} jobs wait or run; beyond them, submissions are refused"
            ),
            Self::NearBound { what: Bounded::JobBytes, used, most } => write!(
                f,
                "the jobs that wait or run take {} MiB of at most {} MiB for their specifications; beyond \
                 them, submissions are refused",
                used / MIB,
                most / MIB
            ),
            Self::NearBound { what: Bounded::Workers, used, most } => {
                write!(f, "{used} of at most {most} workers are attached; more are refused")
            }
            Self::NearBound { what: Bounded::Connections, used, most } => {
                write!(f, "{used} of at most {most} connections are open; more have to wait")
            }
            Self::StoreRefuses { time, error } => write!(
                f,
                "the store has refused records for {} s, and stored none since: {error}",
                time.as_secs()
            ),
            Self::LogStuck { time, bytes } => write!(
                f,
                "the store's log could not be copied into its database for {} s and has {} MiB: see \
                 whether its disk is full or fails; nothing is lost, but it only grows",
                time.as_secs(),
                bytes / MIB
            ),
        }
    }
}
