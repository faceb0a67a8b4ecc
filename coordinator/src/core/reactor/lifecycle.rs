//! Life cycles of jobs, their records and workers.

pub(super) mod jobs;
pub(super) mod prune;
pub(super) mod recheck;
pub(super) mod records;
pub(super) mod replay;
pub(super) mod requests;
pub(super) mod restore;
pub(super) mod ticks;
pub(super) mod workers;
