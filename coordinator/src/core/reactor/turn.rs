//! The context of one reaction.

use std::time::Duration;

use crate::core::effect::Effect;
use crate::core::state::State;

/// The state that an event changes, the time of the event, and the effects so far.
pub(super) struct Turn<'a> {
    pub(super) state: &'a mut State,
    pub(super) now: Duration,
    /// In the order in which they are to be carried out.
    pub(super) effects: Vec<Effect>,
}

impl<'a> Turn<'a> {
    /// Starts the reaction to an event at `now`, with no effects yet.
    pub(super) fn new(state: &'a mut State, now: Duration) -> Self {
        Self { state, now, effects: Vec::new() }
    }
}
