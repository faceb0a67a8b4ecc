//! Restores a state from the store. The evaluations of jobs are not read here, however many there
//! are: a job that has not ended reads its own when its turn comes.

use std::collections::BTreeMap;
use std::time::Duration;

use osteon_common::version;

use super::jobs;
use crate::config::Config;
use crate::core::doubts::Doubts;
use crate::core::effect::Effect;
use crate::core::ids::JobId;
use crate::core::job::{EndedJob, Job, RequestName, Stage, sequence};
use crate::core::reactor::turn::Turn;
use crate::core::saved::SavedParts;
use crate::core::state::{Banned, State};
use crate::core::worker_name::WorkerName;
use crate::store::{BanRecord, DoubtRecord, JobRecord, PartRecord, Store, StoreError};

/// Contents of a store, without evaluations.
#[derive(Debug, Default)]
pub struct Restored {
    ended: Vec<(JobId, EndedJob)>,
    /// Each with the number of its stored evaluations.
    unfinished: Vec<(JobRecord, u64)>,
    /// Saved results of the incomplete evaluations of unfinished jobs.
    parts: BTreeMap<JobId, Vec<PartRecord>>,
    banned: Vec<BanRecord>,
    doubts: Vec<DoubtRecord>,
    /// Digests of the ended jobs that have doubts.
    digests: BTreeMap<JobId, String>,
    last_deleted_job: Option<JobId>,
}

impl Restored {
    /// Reads a store. Blocks.
    ///
    /// An unfinished job whose evaluations were computed with other numerics than this program's
    /// begins again: results of different numerics are never mixed. Hosts stay banned until an operator lifts
    /// the ban.
    ///
    /// # Errors
    /// When the store cannot be read or written, or the numbers of a job's evaluations have a gap.
    pub fn load(store: &mut dyn Store) -> Result<Self, StoreError> {
        let mut restored = Self::default();
        store.visit_jobs(&mut |stored| match stored.end {
            Some(end) => {
                restored.ended.push((stored.record.job, EndedJob::new(&stored.record, end, 0)));
            }
            None => restored.unfinished.push((stored.record, stored.evaluations)),
        })?;
        for (record, evaluations) in &mut restored.unfinished {
            reset_if_numerics_differ(store, record, evaluations)?;
        }
        restored.banned = store.bans()?;
        restored.doubts = store.doubts()?;
        for doubt in &restored.doubts {
            // A damaged summary is reported where the result is fetched.
            if let Ok(Some(summary)) = store.summary(doubt.job) {
                restored.digests.insert(doubt.job, summary.digest);
            }
        }
        restored.last_deleted_job = store.last_deleted_job()?;
        for (JobRecord { job, .. }, _) in &restored.unfinished {
            let parts = store.parts(*job)?;
            if !parts.is_empty() {
                restored.parts.insert(*job, parts);
            }
        }
        Ok(restored)
    }
}

/// Restarts a job from the beginning if its evaluations were computed with other numerics.
fn reset_if_numerics_differ(
    store: &mut dyn Store,
    record: &mut JobRecord,
    evaluations: &mut u64,
) -> Result<(), StoreError> {
    let fingerprint = version::fingerprint();
    if record.fingerprint != fingerprint {
        tracing::warn!(
            job = %record.job,
            stored = %record.fingerprint,
            now = %fingerprint,
            "the job was begun with other numerics; its evaluations are computed again"
        );
        store.reset_job(record.job, &fingerprint)?;
        record.fingerprint = fingerprint;
        *evaluations = 0;
    }
    Ok(())
}

impl Restored {
    /// Returns the number of jobs that have not ended.
    pub fn unfinished_jobs(&self) -> usize {
        self.unfinished.len()
    }

    /// Returns the number of jobs that have ended.
    pub fn ended_jobs(&self) -> usize {
        self.ended.len()
    }

    /// Returns the number of bans that hold.
    pub fn banned_workers(&self) -> usize {
        self.banned.iter().filter(|ban| ban.lifted.is_none()).count()
    }
}

impl State {
    /// Returns a coordinator that continues with `restored`, as of `now`, and its first effects.
    pub fn restore(config: Config, restored: Restored, now: Duration) -> (Self, Vec<Effect>) {
        let mut state = Self::new(config, now);
        let Restored {
            ended,
            unfinished,
            mut parts,
            banned,
            doubts,
            mut digests,
            last_deleted_job,
        } = restored;
        let mut doubts_of: BTreeMap<JobId, Doubts> = BTreeMap::new();
        for doubt in doubts {
            let of = doubts_of.entry(doubt.job).or_default();
            if let Some(digest) = digests.remove(&doubt.job) {
                of.set_digest(digest);
            }
            of.add(doubt);
        }
        state.next_job = last_deleted_job.map_or(1, |job| job.0 + 1);
        let durable = |record| Banned { record, store_at: None, refused: false };
        state.banned = banned.into_iter().map(durable).collect();
        for (id, mut job) in ended {
            // It must be above those of the snapshots that were published before the restart.
            job.sequence = sequence(job.sequence, now);
            job.doubts = doubts_of.remove(&id).unwrap_or_default();
            state.know(id, job.request.clone());
            state.ended.insert(id, job);
        }
        for (record, evaluations) in unfinished {
            let id = record.job;
            state.know(id, RequestName::from_record(&record));
            state.waiting.push_back(id);
            let mut job = Job::new(record, Stage::Waiting, evaluations, now);
            job.doubts = doubts_of.remove(&id).unwrap_or_default();
            let parts = parts.remove(&id).unwrap_or_default();
            let is_doubtful = |worker: &WorkerName| state.is_doubtful(worker, &job.record);
            let saved = SavedParts::new(parts, is_doubtful);
            job.saved = saved;
            state.jobs.insert(id, job);
        }
        let mut turn = Turn::new(&mut state, now);
        jobs::begin_waiting(&mut turn);
        let effects = turn.effects;
        (state, effects)
    }

    fn know(&mut self, id: JobId, request: Option<RequestName>) {
        self.next_job = self.next_job.max(id.0 + 1);
        self.requests.extend(request.map(|request| (request, id)));
    }
}
