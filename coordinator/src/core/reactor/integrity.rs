//! Decides which answers and which workers count.

pub(super) mod answers;
pub(super) mod bans;
pub(super) mod checks;
