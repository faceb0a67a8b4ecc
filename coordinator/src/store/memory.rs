//! A store that lasts as long as its handles: for runs that save nothing, and for tests.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use osteon_search::{Summary, same_point};

use super::{
    BanRecord, Changes, DoubtRecord, EndRecord, EvaluationRecord, JobRecord, PartRecord, Store,
    StoreError, StoredJob,
};
use crate::core::ids::JobId;
use crate::core::worker_name::WorkerName;

/// A store in memory. Clones share their contents, as if one file were opened twice.
#[derive(Debug, Clone, Default)]
pub struct MemoryStore(Arc<Mutex<StoreContent>>);

#[derive(Debug, Default)]
struct StoreContent {
    jobs: BTreeMap<JobId, StoredJob>,
    last_deleted_job: Option<JobId>,
    evaluations: BTreeMap<(JobId, u64), EvaluationRecord>,
    parts: Vec<PartRecord>,
    summaries: BTreeMap<JobId, Summary>,
    bans: BTreeMap<u64, BanRecord>,
    doubts: BTreeMap<(JobId, u64), DoubtRecord>,
}

impl MemoryStore {
    /// Returns an empty store.
    pub fn new() -> Self {
        Self::default()
    }

    fn content(&self) -> MutexGuard<'_, StoreContent> {
        // No change can panic half-way.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Store for MemoryStore {
    fn together(&mut self, changes: &mut Changes<'_>) -> Result<(), StoreError> {
        changes(self)
    }

    fn visit_jobs(&mut self, visit: &mut dyn FnMut(StoredJob)) -> Result<(), StoreError> {
        let content = self.content();
        for (&id, job) in &content.jobs {
            let evaluations = content.evaluations.range((id, 0)..=(id, u64::MAX)).count() as u64;
            visit(StoredJob { evaluations, ..job.clone() });
        }
        Ok(())
    }

    fn job(&mut self, job: JobId) -> Result<Option<JobRecord>, StoreError> {
        Ok(self.content().jobs.get(&job).map(|job| job.record.clone()))
    }

    fn evaluation(
        &mut self,
        job: JobId,
        number: u64,
    ) -> Result<Option<EvaluationRecord>, StoreError> {
        Ok(self.content().evaluations.get(&(job, number)).cloned())
    }

    fn reset_job(&mut self, job: JobId, fingerprint: &str) -> Result<(), StoreError> {
        let mut content = self.content();
        content.evaluations.retain(|(of, _), _| *of != job);
        content.parts.retain(|part| part.job != job);
        if let Some(stored) = content.jobs.get_mut(&job) {
            fingerprint.clone_into(&mut stored.record.fingerprint);
        }
        Ok(())
    }

    fn put_job(&mut self, record: &JobRecord) -> Result<(), StoreError> {
        let stored = StoredJob { record: record.clone(), end: None, evaluations: 0 };
        self.content().jobs.entry(record.job).or_insert(stored);
        Ok(())
    }

    fn put_evaluation(
        &mut self,
        record: &EvaluationRecord,
        deletes_later: bool,
    ) -> Result<(), StoreError> {
        let mut content = self.content();
        let EvaluationRecord { job, number: last, .. } = *record;
        content.evaluations.insert((job, last), record.clone());
        content.parts.retain(|part| part.job != job || !same_point(&part.point, &record.point));
        if deletes_later {
            content.evaluations.retain(|(of, number), _| *of != job || *number <= last);
        }
        Ok(())
    }

    fn put_part(&mut self, record: &PartRecord) -> Result<(), StoreError> {
        self.content().parts.push(record.clone());
        Ok(())
    }

    fn parts(&mut self, job: JobId) -> Result<Vec<PartRecord>, StoreError> {
        Ok(self.content().parts.iter().filter(|part| part.job == job).cloned().collect())
    }

    fn finish_job(&mut self, end: &EndRecord, summary: &Summary) -> Result<(), StoreError> {
        let mut content = self.content();
        content.summaries.insert(end.job, summary.clone());
        content.parts.retain(|part| part.job != end.job);
        if let Some(job) = content.jobs.get_mut(&end.job) {
            job.end = Some(end.clone());
        }
        Ok(())
    }

    fn summary(&mut self, job: JobId) -> Result<Option<Summary>, StoreError> {
        Ok(self.content().summaries.get(&job).cloned())
    }

    fn delete_jobs(&mut self, jobs: &[JobId]) -> Result<(), StoreError> {
        let mut content = self.content();
        content.last_deleted_job = content.last_deleted_job.max(jobs.iter().max().copied());
        content.jobs.retain(|job, _| !jobs.contains(job));
        content.summaries.retain(|job, _| !jobs.contains(job));
        content.evaluations.retain(|(job, _), _| !jobs.contains(job));
        content.parts.retain(|part| !jobs.contains(&part.job));
        content.doubts.retain(|(job, _), _| !jobs.contains(job));
        Ok(())
    }

    fn last_deleted_job(&mut self) -> Result<Option<JobId>, StoreError> {
        Ok(self.content().last_deleted_job)
    }

    fn put_ban(&mut self, record: &BanRecord) -> Result<(), StoreError> {
        let mut content = self.content();
        if content.bans.insert(record.number, record.clone()).is_none() {
            let host = record.worker.host();
            let of_host =
                content.evaluations.values().filter(|it| WorkerName::any_of(&it.workers, host));
            let jobs: BTreeSet<JobId> = of_host.map(|evaluation| evaluation.job).collect();
            for job in jobs {
                if content.jobs.get(&job).is_some_and(|job| job.end.is_some()) {
                    let doubt = DoubtRecord { job, ban: record.number, digest: None };
                    content.doubts.insert((job, record.number), doubt);
                }
            }
        }
        Ok(())
    }

    fn bans(&mut self) -> Result<Vec<BanRecord>, StoreError> {
        Ok(self.content().bans.values().cloned().collect())
    }

    fn doubts(&mut self) -> Result<Vec<DoubtRecord>, StoreError> {
        Ok(self.content().doubts.values().cloned().collect())
    }

    fn reopen_job(&mut self, job: JobId) -> Result<Option<StoredJob>, StoreError> {
        let mut content = self.content();
        let digest = content.summaries.remove(&job).map(|summary| summary.digest);
        let open = content.doubts.values_mut().filter(|doubt| doubt.job == job);
        open.filter(|doubt| doubt.digest.is_none()).for_each(|doubt| {
            doubt.digest = Some(digest.clone().unwrap_or_default());
        });
        let evaluations = content.evaluations.range((job, 0)..=(job, u64::MAX)).count() as u64;
        let reopened = content.jobs.get_mut(&job).map(|stored| {
            stored.end = None;
            StoredJob { evaluations, ..stored.clone() }
        });
        Ok(reopened)
    }
}
