//! A state from what the store holds: unfinished jobs are replayed and go on.

use std::ops::ControlFlow;
use std::time::Duration;

use osteon_common::version;
use thiserror::Error;

use super::{Effects, jobs};
use crate::config::Config;
use crate::effect::Effect;
use crate::failure::Failure;
use crate::ids::JobId;
use crate::search::{ReplayError, Search};
use crate::state::{Job, Stage, State};
use crate::store::{JobRecord, Store, StoreError, StoredJob};

/// A job out of the store, its search replayed if it has not ended.
#[derive(Debug)]
pub struct RestoredJob {
    stored: StoredJob,
    search: Result<Option<Search>, ReplayError>,
}

/// Why a state cannot be rebuilt.
#[derive(Debug, Error)]
pub enum RestoreError {
    /// The store cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// An evaluation is missing.
    #[error("the store has no evaluation {missing} of job {job} but later ones; restore a copy")]
    Gap {
        /// The job.
        job: JobId,
        /// Number of the missing evaluation.
        missing: u64,
    },
}

impl RestoredJob {
    /// All jobs of a store. Blocks.
    ///
    /// A job that has not ended and whose evaluations were computed with other numerics than this
    /// program's begins again: results of two numerics never mix.
    ///
    /// # Errors
    /// When the store cannot be read or does not take that, or an evaluation is missing in it.
    pub fn load(store: &mut dyn Store) -> Result<Vec<Self>, RestoreError> {
        let mut restored = Vec::new();
        for mut stored in store.jobs()? {
            let search = if stored.end.is_some() {
                Ok(None)
            } else {
                keep_numerics(store, &mut stored.record)?;
                replay(store, &stored.record)?.map(Some)
            };
            restored.push(Self { stored, search });
        }
        Ok(restored)
    }
}

/// Makes a job begin again if its numerics are not this program's.
fn keep_numerics(store: &mut dyn Store, record: &mut JobRecord) -> Result<(), StoreError> {
    let fingerprint = version::fingerprint();
    if record.fingerprint != fingerprint {
        tracing::warn!(
            job = %record.job,
            stored = %record.fingerprint,
            now = %fingerprint,
            "the job was begun with other numerics; its evaluations are computed again"
        );
        store.begin_again(record.job, &fingerprint)?;
        record.fingerprint = fingerprint;
    }
    Ok(())
}

/// The search of a stored job that its evaluations lead to. One of them is in memory at a time,
/// and the best.
///
/// # Errors
/// When the store cannot be read or an evaluation is missing; inside, when they belong to another
/// search.
fn replay(
    store: &mut dyn Store,
    record: &JobRecord,
) -> Result<Result<Search, ReplayError>, RestoreError> {
    let job = record.job;
    let mut search = Search::new(record.specification.clone());
    let mut told = Ok(());
    let mut gap = None;
    store.evaluations(job, 0, &mut |stored| {
        let missing = search.evaluations();
        if stored.number != missing {
            gap = Some(RestoreError::Gap { job, missing });
            return ControlFlow::Break(());
        }
        told = search.retell(stored.point, stored.outcomes, stored.estimated_error);
        if told.is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    })?;
    match gap {
        Some(gap) => Err(gap),
        None => Ok(told.map(|()| search)),
    }
}

impl State {
    /// A coordinator that goes on with `restored` jobs, as of `now`.
    pub fn restore(
        config: Config,
        restored: Vec<RestoredJob>,
        now: Duration,
    ) -> (Self, Vec<Effect>) {
        let mut state = Self::new(config, now);
        let mut effects = Effects::new();
        let mut failed = Vec::new();
        for RestoredJob { stored: StoredJob { record, end }, search } in restored {
            let id = record.job;
            state.next_job = state.next_job.max(id.0 + 1);
            if !record.request_id.is_empty() {
                state.requests.insert(record.request_id.clone(), id);
            }
            let search = search.unwrap_or_else(|error| {
                failed.push((id, Failure::from(error)));
                None
            });
            let stage = match end {
                Some(end) => {
                    state.ended += 1;
                    Stage::Ended(end)
                }
                None => {
                    state.waiting.push_back(id);
                    Stage::Waiting
                }
            };
            state.jobs.insert(id, Job::new(record, stage, search, now));
        }
        for (id, failure) in failed {
            jobs::fail(&mut state, id, &failure, now, &mut effects);
        }
        jobs::begin_waiting(&mut state, now, &mut effects);
        (state, effects)
    }
}
