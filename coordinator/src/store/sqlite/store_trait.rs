//! The trait `Store` of a `SqliteStore`. Each method calls the one of the same name that takes a
//! shared reference, because a copy of the store uses it while other commands run in between.

use std::fs::File;

use osteon_search::Summary;

use super::SqliteStore;
use crate::core::ids::JobId;
use crate::store::{
    BanRecord, BetweenPieces, Changes, DoubtRecord, EndRecord, EvaluationRecord, JobRecord,
    PartRecord, PieceRecord, Store, StoreError, StoredJob,
};

impl Store for SqliteStore {
    fn together(&mut self, changes: &mut Changes<'_>) -> Result<(), StoreError> {
        (&*self).together(changes)
    }

    fn settle(&mut self) -> bool {
        (&*self).settle()
    }

    fn stuck_log(&self) -> Option<u64> {
        (&self).stuck_log()
    }

    fn visit_jobs(&mut self, visit: &mut dyn FnMut(StoredJob)) -> Result<(), StoreError> {
        (&*self).visit_jobs(visit)
    }

    fn job(&mut self, job: JobId) -> Result<Option<JobRecord>, StoreError> {
        (&*self).job(job)
    }

    fn evaluation(
        &mut self,
        job: JobId,
        number: u64,
    ) -> Result<Option<EvaluationRecord>, StoreError> {
        (&*self).evaluation(job, number)
    }

    fn reset_job(&mut self, job: JobId, fingerprint: &str) -> Result<(), StoreError> {
        (&*self).reset_job(job, fingerprint)
    }

    fn put_job(&mut self, record: &JobRecord) -> Result<(), StoreError> {
        (&*self).put_job(record)
    }

    fn put_evaluation(
        &mut self,
        record: &EvaluationRecord,
        deletes_later: bool,
    ) -> Result<(), StoreError> {
        (&*self).put_evaluation(record, deletes_later)
    }

    fn put_evaluations(&mut self, records: &[EvaluationRecord]) -> Result<(), StoreError> {
        (&*self).put_evaluations(records)
    }

    fn put_part(&mut self, record: &PartRecord) -> Result<(), StoreError> {
        (&*self).put_part(record)
    }

    fn put_piece(&mut self, record: &PieceRecord) -> Result<(), StoreError> {
        (&*self).put_piece(record)
    }

    fn parts(&mut self, job: JobId) -> Result<Vec<PartRecord>, StoreError> {
        (&*self).parts(job)
    }

    fn finish_job(&mut self, end: &EndRecord, summary: &Summary) -> Result<(), StoreError> {
        (&*self).finish_job(end, summary)
    }

    fn summary(&mut self, job: JobId) -> Result<Option<Summary>, StoreError> {
        (&*self).summary(job)
    }

    fn delete_jobs(&mut self, jobs: &[JobId]) -> Result<(), StoreError> {
        (&*self).delete_jobs(jobs)
    }

    fn last_deleted_job(&mut self) -> Result<Option<JobId>, StoreError> {
        (&*self).last_deleted_job()
    }

    fn put_ban(&mut self, record: &BanRecord) -> Result<(), StoreError> {
        (&*self).put_ban(record)
    }

    fn bans(&mut self) -> Result<Vec<BanRecord>, StoreError> {
        (&*self).bans()
    }

    fn doubts(&mut self) -> Result<Vec<DoubtRecord>, StoreError> {
        (&*self).doubts()
    }

    fn reopen_job(&mut self, job: JobId) -> Result<Option<StoredJob>, StoreError> {
        (&*self).reopen_job(job)
    }

    fn copy(&mut self, between: &mut BetweenPieces<'_>) -> Result<Option<File>, StoreError> {
        (&*self).copy(between)
    }
}
