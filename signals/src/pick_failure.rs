//! Why a receiver or a series has no time or velocity.

use serde::Serialize;

/// A kind of failure. Names in files are those of serde.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PickFailure {
    /// No extremum of the wave through the bone before the direct wave.
    NoArrival,
    /// The times do not lie on one line that leads away from the source.
    Inconsistent,
    /// A time is a whole number of periods off the line.
    CycleSlip,
    /// The signal is clipped before or at the extremum.
    Saturated,
    /// The signal is constant, or a thousand times smaller than the others.
    DeadReceiver,
    /// The signal has the opposite sign of the others.
    WrongPolarity,
    /// The noise hides the extremum, or which extremum is the first.
    TooNoisy,
}

impl PickFailure {
    /// All kinds, in the order of the documentation.
    pub const ALL: [Self; 7] = [
        Self::NoArrival,
        Self::Inconsistent,
        Self::CycleSlip,
        Self::Saturated,
        Self::DeadReceiver,
        Self::WrongPolarity,
        Self::TooNoisy,
    ];

    /// Returns the name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoArrival => "no_arrival",
            Self::Inconsistent => "inconsistent",
            Self::CycleSlip => "cycle_slip",
            Self::Saturated => "saturated",
            Self::DeadReceiver => "dead_receiver",
            Self::WrongPolarity => "wrong_polarity",
            Self::TooNoisy => "too_noisy",
        }
    }

    /// Returns the meaning, as the end of a sentence about a signal.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::NoArrival => "has no wave through the bone before the direct wave",
            Self::Inconsistent => "has its extremum off the line of the others",
            Self::CycleSlip => "is whole periods off the line of the others",
            Self::Saturated => "is clipped before or at the extremum",
            Self::DeadReceiver => "is constant, or a thousand times smaller than the others",
            Self::WrongPolarity => "has the opposite sign of the others",
            Self::TooNoisy => "has an extremum that the noise hides",
        }
    }
}
