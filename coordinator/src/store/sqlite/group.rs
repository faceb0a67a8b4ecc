//! Several records in one transaction, and so with one sync.

use rusqlite::Connection;

use super::{OpenGroup, SqliteStore};
use crate::core::ids::JobId;
use crate::store::{Changes, StoreError};

impl SqliteStore {
    /// Makes all changes in one transaction; see [`crate::store::Store::together`].
    pub(super) fn change_together(&self, changes: &mut Changes<'_>) -> Result<(), StoreError> {
        let refused = |source| self.refused(source);
        let transaction = self.connection.unchecked_transaction().map_err(refused)?;
        self.group.set(Some(OpenGroup::default()));
        let mut store = self;
        let changed = changes(&mut store);
        let accepted = self.group.take().and_then(|group| group.highest_job);
        // An error rolls the transaction back, if SQLite has not done so already.
        changed?;
        transaction.commit().map_err(refused)?;
        // If this fails, the caller puts each record again by itself, and a job that then fails again is
        // removed by `accept`.
        accepted.map_or(Ok(()), |job| self.mark.borrow_mut().acknowledge(job))
    }

    /// Makes a change in the transaction of the open group, or else in one of its own.
    pub(super) fn change(
        &self,
        change: impl FnOnce(&Connection) -> rusqlite::Result<()>,
    ) -> Result<(), StoreError> {
        let changed = if self.group.get().is_some() {
            change(&self.connection)
        } else {
            self.connection.unchecked_transaction().and_then(|transaction| {
                change(&transaction)?;
                transaction.commit()
            })
        };
        changed.map_err(|source| self.refused(source))
    }

    /// Handles a job whose row is written: it counts as acknowledged once the row is durable.
    pub(super) fn accept(&self, job: JobId) -> Result<(), StoreError> {
        if let Some(OpenGroup { highest_job }) = self.group.get() {
            // `None` is less than any job.
            self.group.set(Some(OpenGroup { highest_job: highest_job.max(Some(job)) }));
            return Ok(());
        }
        self.mark.borrow_mut().acknowledge(job).inspect_err(|_| {
            // The job is refused, but the mark may name it all the same. So the database records it
            // as deleted; if that fails too, it stays as a job that nobody asks for.
            if let Err(error) = self.remove_jobs(&[job]) {
                tracing::error!(%job, %error, "a refused job stays in the store");
            }
        })
    }
}
