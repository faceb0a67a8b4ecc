//! Why a phase velocity is not known.

use serde::Serialize;

/// A kind of failure. Names in files are those of serde.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum WaveFailure {
    /// No wave has a phase velocity in the range.
    NoWave,
    /// Several waves have one.
    SeveralWaves,
    /// No wave is above the noise, or the noise moves its wavenumber too far.
    TooNoisy,
    /// The record ends before the slowest wave of the range has passed all receivers.
    TooShort,
    /// Waves of the range have more than a period between neighbouring receivers, and are not told from others.
    TooCoarse,
    /// A signal is clipped.
    Saturated,
    /// Too many signals are constant.
    DeadReceiver,
}

impl WaveFailure {
    /// All kinds, in the order of the documentation.
    pub const ALL: [Self; 7] = [
        Self::NoWave,
        Self::SeveralWaves,
        Self::TooNoisy,
        Self::TooShort,
        Self::TooCoarse,
        Self::Saturated,
        Self::DeadReceiver,
    ];

    /// Returns the name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoWave => "no_wave",
            Self::SeveralWaves => "several_waves",
            Self::TooNoisy => "too_noisy",
            Self::TooShort => "too_short",
            Self::TooCoarse => "too_coarse",
            Self::Saturated => "saturated",
            Self::DeadReceiver => "dead_receiver",
        }
    }

    /// Returns the meaning, as a sentence without its end.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::NoWave => "no wave has a phase velocity in the range",
            Self::SeveralWaves => {
                "several waves have phase velocities in the range; make it narrower"
            }
            Self::TooNoisy => {
                "no wave is above the noise, or the noise moves its wavenumber too far"
            }
            Self::TooShort => {
                "the record ends before the slowest wave of the range has passed all receivers"
            }
            Self::TooCoarse => {
                "the receivers are too far apart for the wavelengths of the range, whose waves look like others"
            }
            Self::Saturated => "a signal is clipped",
            Self::DeadReceiver => "more than a quarter of the receivers recorded nothing",
        }
    }
}
