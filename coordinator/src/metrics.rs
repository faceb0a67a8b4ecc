//! Metrics for monitoring: what a coordinator exports, and in which form. They contain numbers and
//! fixed words only, no names of users, jobs and hosts.

pub(crate) mod exposition;
pub(crate) mod families;
pub(crate) mod process;
pub(crate) mod write_times;
