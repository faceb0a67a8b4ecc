//! A state from what the store holds: unfinished jobs are replayed and go on.

use std::time::Duration;

use thiserror::Error;

use super::{Effects, jobs};
use crate::config::Config;
use crate::effect::Effect;
use crate::failure::Failure;
use crate::ids::JobId;
use crate::search::{ReplayError, Search};
use crate::state::{Job, Stage, State};
use crate::store::{EvaluationRecord, Store, StoreError, StoredJob};

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
    /// # Errors
    /// When the store cannot be read, or an evaluation is missing in it.
    pub fn load(store: &mut dyn Store) -> Result<Vec<Self>, RestoreError> {
        let mut restored = Vec::new();
        for stored in store.jobs()? {
            let search = if stored.end.is_some() {
                Ok(None)
            } else {
                let evaluations = store.evaluations(stored.record.job)?;
                replay(&stored, evaluations)?.map(Some)
            };
            restored.push(Self { stored, search });
        }
        Ok(restored)
    }
}

/// The search of a stored job that its `evaluations` lead to.
///
/// # Errors
/// When an evaluation is missing; inside, when they belong to another search.
pub(crate) fn replay(
    stored: &StoredJob,
    evaluations: Vec<EvaluationRecord>,
) -> Result<Result<Search, ReplayError>, RestoreError> {
    let job = stored.record.job;
    for (missing, record) in (0..).zip(&evaluations) {
        if record.number != missing {
            return Err(RestoreError::Gap { job, missing });
        }
    }
    let told = evaluations.into_iter().map(|record| (record.point, record.outcomes));
    Ok(Search::replay(stored.record.specification.clone(), told))
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
