//! One event under way.

use std::time::Duration;

use crate::effect::Effect;
use crate::state::State;

/// The state that an event changes, when it happened, and what is to be done about it so far.
pub(super) struct Turn<'a> {
    pub(super) state: &'a mut State,
    pub(super) now: Duration,
    /// In the order in which they are to be done.
    pub(super) effects: Vec<Effect>,
}

impl<'a> Turn<'a> {
    /// An event that happened at `now`, about which nothing is done yet.
    pub(super) fn new(state: &'a mut State, now: Duration) -> Self {
        Self { state, now, effects: Vec::new() }
    }
}
