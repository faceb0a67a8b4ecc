//! The meter of the core task: counts events and effects, and measures how long reactions take. It
//! exists only if metrics are exported; otherwise nothing is counted.

use std::time::{Duration, Instant};

use crate::core::distribution::TimeDistribution;
use crate::core::effect::Effect;
use crate::core::event::Event;
use crate::core::measurements::StateMeasurements;
use crate::core::state::State;
use crate::core::tally::{Before, EventCounts, EventTally};

/// Counts and times so far.
#[derive(Debug, Default)]
pub(crate) struct Meter {
    tally: EventTally,
    event_times: TimeDistribution,
}

/// The beginning of a reaction.
#[derive(Debug)]
pub(crate) struct Reading {
    begun: Instant,
    before: Before,
}

/// What the core task tells of itself.
#[derive(Debug)]
pub(crate) struct CoreReport {
    pub(crate) counts: EventCounts,
    pub(crate) event_times: TimeDistribution,
    pub(crate) state: StateMeasurements,
    /// Commands that wait for the store's thread.
    pub(crate) store_queue: usize,
}

impl Meter {
    /// Counts an event to which the state is about to react.
    pub(crate) fn begin(&mut self, state: &State, event: &Event, now: Duration) -> Reading {
        Reading { begun: Instant::now(), before: self.tally.count_event(state, event, now) }
    }

    /// Counts the effects of the reaction.
    pub(crate) fn count_reaction(
        &mut self,
        reading: &Reading,
        state: &State,
        effects: &[Effect],
        now: Duration,
    ) {
        self.tally.count_reaction(&reading.before, state, effects, now);
    }

    /// Measures a reaction whose effects are carried out.
    pub(crate) fn end(&mut self, reading: &Reading) {
        self.event_times.add(reading.begun.elapsed());
    }

    /// Counts the effects of the coordinator's start.
    pub(crate) fn count_start(&mut self, state: &State, effects: &[Effect], now: Duration) {
        self.tally.count_effects(state, effects, now);
    }

    /// Returns counts and measurements as of `now`.
    pub(crate) fn report(&self, state: &State, store_queue: usize, now: Duration) -> CoreReport {
        CoreReport {
            counts: self.tally.counts().clone(),
            event_times: self.event_times.clone(),
            state: StateMeasurements::new(state, now),
            store_queue,
        }
    }
}
