//! A store that lasts as long as its handles: for runs that keep nothing, and for tests.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{EndRecord, EvaluationRecord, JobRecord, Store, StoreError, StoredJob};
use crate::ids::JobId;
use crate::search::Summary;

/// A store in memory. Clones share their content, as two openings of one file would.
#[derive(Debug, Clone, Default)]
pub struct MemoryStore(Arc<Mutex<Content>>);

#[derive(Debug, Default)]
struct Content {
    jobs: BTreeMap<JobId, StoredJob>,
    evaluations: BTreeMap<(JobId, u64), EvaluationRecord>,
    summaries: BTreeMap<JobId, Summary>,
}

impl MemoryStore {
    /// An empty store.
    pub fn new() -> Self {
        Self::default()
    }

    fn content(&self) -> MutexGuard<'_, Content> {
        // No change panics half-way.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Store for MemoryStore {
    fn jobs(&mut self) -> Result<Vec<StoredJob>, StoreError> {
        Ok(self.content().jobs.values().cloned().collect())
    }

    fn evaluations(
        &mut self,
        job: JobId,
        first: u64,
        visit: &mut dyn FnMut(EvaluationRecord) -> ControlFlow<()>,
    ) -> Result<(), StoreError> {
        let content = self.content();
        for (_, record) in content.evaluations.range((job, first)..=(job, u64::MAX)) {
            if visit(record.clone()).is_break() {
                break;
            }
        }
        Ok(())
    }

    fn begin_again(&mut self, job: JobId, fingerprint: &str) -> Result<(), StoreError> {
        let mut content = self.content();
        content.evaluations.retain(|(of, _), _| *of != job);
        if let Some(stored) = content.jobs.get_mut(&job) {
            fingerprint.clone_into(&mut stored.record.fingerprint);
        }
        Ok(())
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

    fn finish_job(&mut self, end: &EndRecord, summary: &Summary) -> Result<(), StoreError> {
        let mut content = self.content();
        content.summaries.insert(end.job, summary.clone());
        if let Some(job) = content.jobs.get_mut(&end.job) {
            job.end = Some(end.clone());
        }
        Ok(())
    }

    fn summary(&mut self, job: JobId) -> Result<Option<Summary>, StoreError> {
        Ok(self.content().summaries.get(&job).cloned())
    }
}
