//! Which answers count, and which workers.

pub(super) mod answers;
pub(super) mod bans;
pub(super) mod checks;
