//! A store that lasts as long as its handles: for runs that keep nothing, and for tests.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{EndRecord, EvaluationRecord, JobRecord, Store, StoreError, StoredJob};
use crate::ids::JobId;

/// A store in memory. Clones share their content, as two openings of one file would.
#[derive(Debug, Clone, Default)]
pub struct MemoryStore(Arc<Mutex<Content>>);

#[derive(Debug, Default)]
struct Content {
    jobs: BTreeMap<JobId, StoredJob>,
    evaluations: BTreeMap<(JobId, u64), EvaluationRecord>,
}

impl MemoryStore {
    /// An empty store.
    pub fn new() -> Self {
        Self::default()
    }

    fn content(&self) -> MutexGuard<'_, Content> {
        // Every change is one insertion: there is no half-done state that a panic could leave.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Store for MemoryStore {
    fn jobs(&mut self) -> Result<Vec<StoredJob>, StoreError> {
        Ok(self.content().jobs.values().cloned().collect())
    }

    fn evaluations(&mut self, job: JobId) -> Result<Vec<EvaluationRecord>, StoreError> {
        let content = self.content();
        let all = content.evaluations.range((job, 0)..=(job, u64::MAX));
        Ok(all.map(|(_, record)| record.clone()).collect())
    }

    fn put_job(&mut self, record: &JobRecord) -> Result<(), StoreError> {
        let stored = StoredJob { record: record.clone(), end: None };
        self.content().jobs.entry(record.job).or_insert(stored);
        Ok(())
    }

    fn put_evaluation(&mut self, record: &EvaluationRecord) -> Result<(), StoreError> {
        self.content().evaluations.insert((record.job, record.number), record.clone());
        Ok(())
    }

    fn finish_job(&mut self, record: &EndRecord) -> Result<(), StoreError> {
        if let Some(job) = self.content().jobs.get_mut(&record.job) {
            job.end = Some(record.clone());
        }
        Ok(())
    }
}
