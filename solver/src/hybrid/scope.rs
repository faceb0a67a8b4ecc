//! The windows of time that are evaluated at the receivers.

use osteon_common::case::Setup;
use osteon_common::probe::Place;
use osteon_common::sampling::{direct_arrival, earliest_arrival};

/// The windows of all receivers, for a bone whose waves along x1 have at most this speed.
#[derive(Debug, Clone)]
pub(super) struct Scope {
    /// No wave along the bone is faster, m/s.
    pub(super) speed: f64,
    /// One window per receiver.
    pub(super) windows: Vec<Span>,
    /// Width of source and receivers, m.
    element_width: f64,
}

/// The window of one receiver.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    /// Distance from the source along x1, m.
    pub(super) distance: f64,
    /// Earliest possible arrival of a wave through the bone, s.
    pub(super) from: f64,
    /// End of the window, s; at most the arrival of the direct wave.
    pub(super) to: f64,
}

impl Scope {
    /// Returns the windows up to the direct wave.
    pub(super) fn until_direct_wave(setup: &Setup, speed: f64) -> Self {
        let span = |place: Place| Span {
            distance: place.x,
            from: earliest_arrival(setup, place, speed),
            to: direct_arrival(setup, place),
        };
        let windows = setup.probe.places().map(span).collect();
        Self { speed, windows, element_width: setup.probe.element_width }
    }

    /// Returns windows that end at most `after` (s) after each of `times` (s), one per receiver.
    pub(super) fn end_after(&self, times: &[f64], after: f64) -> Self {
        let windows = self.windows.iter().zip(times);
        let windows =
            windows.map(|(span, time)| Span { to: span.to.min(time + after), ..*span }).collect();
        Self { windows, ..*self }
    }

    /// Returns the end of the last window, s.
    pub(super) fn end(&self) -> f64 {
        self.windows.iter().fold(0.0, |end: f64, span| end.max(span.to))
    }

    /// Returns the longest time, s, for which a window stays open after a wave without detours.
    pub(super) fn longest(&self) -> f64 {
        self.windows.iter().fold(0.0, |time: f64, span| time.max(span.to - span.from))
    }

    /// Returns the longest time, s, that a wave can spend across layers and still arrive in a
    /// window.
    pub(super) fn longest_time_across(&self) -> f64 {
        let time_across = |span: &Span| span.to - (span.distance - self.element_width) / self.speed;
        self.windows.iter().map(time_across).fold(0.0, f64::max)
    }
}
