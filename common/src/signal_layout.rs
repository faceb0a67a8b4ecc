//! How the signals of a probe are recorded: the section `[signals]` of a probe file.

use crate::accepted::Interval;
use crate::fields::{self, Fields, Key, Number, Section};
use crate::limits::TRANSMITTERS_MAX;
use crate::plausible::TIME_STEP;

fields::choices!(SignalAxis, TimeUnit, Transmitter, SignalUnit);

/// An axis of an array of signals: whether its indices number series, sources, receivers or samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignalAxis {
    /// Measurements, each of which has a velocity.
    Series,
    /// Sources that emitted one after the other.
    Transmitter,
    /// Receivers, from the first to the last.
    Receiver,
    /// Samples.
    Time,
}

impl SignalAxis {
    /// All axes, in the order in which messages list them.
    pub const ALL: [Self; 4] = [Self::Series, Self::Transmitter, Self::Receiver, Self::Time];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Series => "series",
            Self::Transmitter => "transmitter",
            Self::Receiver => "receiver",
            Self::Time => "time",
        }
    }
}

/// The unit of a file's column of times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TimeUnit {
    /// Seconds.
    #[default]
    Seconds,
    /// Milliseconds.
    Milliseconds,
    /// Microseconds.
    Microseconds,
    /// Nanoseconds.
    Nanoseconds,
}

impl TimeUnit {
    /// All units, in the order in which messages list them.
    pub const ALL: [Self; 4] =
        [Self::Seconds, Self::Milliseconds, Self::Microseconds, Self::Nanoseconds];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Seconds => "s",
            Self::Milliseconds => "ms",
            Self::Microseconds => "us",
            Self::Nanoseconds => "ns",
        }
    }

    /// Returns how many of this unit are a second, by which a time is divided.
    pub fn per_second(self) -> f64 {
        match self {
            Self::Seconds => 1.0,
            Self::Milliseconds => 1e3,
            Self::Microseconds => 1e6,
            Self::Nanoseconds => 1e9,
        }
    }
}

/// The unit of the signals. A velocity does not depend on it; `full_scale` is in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SignalUnit {
    /// Pascal.
    #[default]
    Pascal,
    /// Volt.
    Volt,
    /// Millivolt.
    Millivolt,
    /// Steps of an analogue-to-digital converter.
    Counts,
}

impl SignalUnit {
    /// All units, in the order in which messages list them.
    pub const ALL: [Self; 4] = [Self::Pascal, Self::Volt, Self::Millivolt, Self::Counts];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pascal => "Pa",
            Self::Volt => "V",
            Self::Millivolt => "mV",
            Self::Counts => "counts",
        }
    }
}

/// Which of a probe's two sources emitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transmitter {
    /// The source of `[probe.source]`, before the first receiver.
    First,
    /// The one as far beyond the last receiver.
    Second,
}

impl Transmitter {
    /// Both, in the order in which messages list them.
    pub const ALL: [Self; 2] = [Self::First, Self::Second];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::First => "first",
            Self::Second => "second",
        }
    }
}

/// How signals are recorded, and how they are filtered.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalLayout {
    /// The axes of an array, in the order in which the program that wrote the file has them; empty: the usual
    /// ones for the number of axes.
    pub axes: Vec<SignalAxis>,
    /// Name of the array in a file of several.
    pub variable: Option<String>,
    /// Time between samples, s, above 0; `None`: the file's column of times says it.
    pub sampling_interval: Option<f64>,
    /// Time of an array's first sample after the pulse begins, s; added to the times of a table.
    pub start: f64,
    /// Unit of a file's column of times.
    pub time_unit: TimeUnit,
    /// Unit of the signals.
    pub unit: SignalUnit,
    /// Largest modulus that can be recorded, above 0; a sample of that size is saturated.
    pub full_scale: Option<f64>,
    /// Edges of the filter's band, Hz: none, or the lower one (0: none) and the upper one.
    pub band: Vec<f64>,
    /// The source of each element of the axis of transmitters, and of signals without that axis.
    pub transmitters: Vec<Transmitter>,
    /// How much farther from the receivers than that source each of them is, m; empty: none is.
    pub transmitter_offsets: Vec<f64>,
}

impl SignalLayout {
    /// The list of axes, which has code of its own.
    pub const AXES: Key = Key {
        name: "axes",
        meaning: "what each axis of an array counts, in the order of NumPy's `shape` or MATLAB's `size`: \
                  `\"series\"`, `\"transmitter\"`, `\"receiver\"`, `\"time\"`",
    };
    /// The name of an array, which has code of its own.
    pub const VARIABLE: Key = Key {
        name: "variable",
        meaning: "name of the array, if the file has several: `\"x\"`, a field of a structure of MATLAB \
                  `\"a.b\"`, a data set of HDF5 `\"/a/b\"`",
    };
    /// The list of sources, which has code of its own.
    pub const TRANSMITTERS: Key = Key {
        name: "transmitters",
        meaning: "the source of each element of the axis of transmitters: `\"first\"` is that of \
                  `[probe.source]`, `\"second\"` the one beyond the last receiver",
    };

    /// Returns the sources of the axis of transmitters, each with how much farther it is from the receivers, m.
    pub fn sources(&self) -> impl Iterator<Item = (Transmitter, f64)> + '_ {
        let offsets = self.transmitter_offsets.iter().copied().chain(std::iter::repeat(0.0));
        self.transmitters.iter().copied().zip(offsets)
    }
}

impl Default for SignalLayout {
    fn default() -> Self {
        Self {
            axes: Vec::new(),
            variable: None,
            sampling_interval: None,
            start: 0.0,
            time_unit: TimeUnit::default(),
            unit: SignalUnit::default(),
            full_scale: None,
            band: Vec::new(),
            transmitters: vec![Transmitter::First],
            transmitter_offsets: Vec::new(),
        }
    }
}

impl Section for SignalLayout {
    fn declare(&mut self, fields: &mut dyn Fields) {
        fields.custom_table(Self::AXES);
        fields.custom_table(Self::VARIABLE);
        let interval = "time between samples; may be left out for a file with a column of times";
        fields.optional_number(
            Key { name: "sampling_interval", meaning: interval },
            &mut self.sampling_interval,
            Number::above_zero(&TIME_STEP),
        );
        let start =
            "time of an array's first sample after the pulse begins; added to the times of a table";
        fields.number(
            Key { name: "start", meaning: start },
            &mut self.start,
            Number::within(Interval::finite("s")),
        );
        let time_unit = Key { name: "time_unit", meaning: "unit of a file's column of times" };
        fields.choice(time_unit, &mut self.time_unit);
        fields.choice(Key { name: "unit", meaning: "unit of the signals" }, &mut self.unit);
        let full_scale = "largest modulus that can be recorded; samples of that size are saturated";
        fields.optional_number(
            Key { name: "full_scale", meaning: full_scale },
            &mut self.full_scale,
            Number::within(Interval::above(0.0, "")),
        );
        let band = "edges of the band to which signals are filtered; the lower one is 0 if there is none. \
                    Without it signals are not filtered";
        let accepted = Interval::from(0.0, "Hz");
        fields.numbers(Key { name: "band", meaning: band }, &mut self.band, accepted, 2);
        fields.custom_table(Self::TRANSMITTERS);
        let offsets = "how much farther from the receivers than the source that it names each element of \
                       `transmitters` is; by default 0";
        let accepted = Interval::from(0.0, "m");
        let offsets = Key { name: "transmitter_offsets", meaning: offsets };
        fields.numbers(offsets, &mut self.transmitter_offsets, accepted, TRANSMITTERS_MAX);
    }
}
