//! The axial-transmission probe: one line source, a row of receivers, one pulse.

use crate::accepted::{Interval, WholeRange};
use crate::fields::{Fields, Key, Number, Section};
use crate::limits::{RECEIVERS_MAX, RECEIVERS_MIN};
use crate::plausible::{ELEMENT_WIDTH, FREQUENCY, HEIGHT, PITCH};
use crate::pulse::PulseForm;

/// Largest accepted tilt, rad: 11°, far more than any operator's hand.
const TILT_MAX: f64 = 0.2;
/// Meaning of the key `amplitude`.
const AMPLITUDE: &str = "amplitude F1 of the pulse (the paper gives it in N; \
                         [physics.md](physics.md#the-medium) explains the dimension)";

const RECEIVERS: WholeRange = WholeRange::new(RECEIVERS_MIN as u64, RECEIVERS_MAX as u64);

/// A line source, invariant along x2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Source {
    /// Position along the bone, m.
    pub x1: f64,
    /// Height above the bone's upper face, m.
    pub x3: f64,
}

/// A row of equidistant receivers at one height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receivers {
    /// Position of the first receiver along the bone, m.
    pub first_x1: f64,
    /// Distance between neighbours, m, above 0.
    pub pitch: f64,
    /// Number of receivers, 3 to 64.
    pub count: u32,
    /// Height above the bone's upper face, m.
    pub x3: f64,
}

impl Receivers {
    /// Returns the position of receiver `j` (from 0) along the bone, m.
    ///
    /// Product and sum are rounded separately (no fused multiply-add), so that the position has the
    /// same bits wherever it is computed.
    pub fn x1(&self, j: u32) -> f64 {
        self.first_x1 + f64::from(j) * self.pitch
    }

    /// Returns the positions of all receivers along the bone, m.
    pub fn positions(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.count).map(|j| self.x1(j))
    }
}

/// The probe and its pulse, by default F(t) = amplitude · sin(2π fc t) · exp(-4 (fc t - 1)²), t ≥ 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// Centre frequency fc of the pulse, Hz.
    pub center_frequency: f64,
    /// Amplitude F1 of the pulse. The paper gives its unit as N; dimensionally it is m²/s², and
    /// then pressures are in Pa.
    pub amplitude: f64,
    /// Form of the pulse.
    pub pulse: PulseForm,
    /// Frequency, Hz, at which guided waves are measured; `None`: the centre frequency. It changes nothing
    /// else.
    pub guided_wave_frequency: Option<f64>,
    /// Whether A0 is that of the bone between coupling and marrow as half-spaces, and not in a vacuum. It changes
    /// nothing else.
    pub a0_in_fluids: bool,
    /// Width along the probe, m, of the source's and of each receiver's element: the source emits evenly
    /// over it, and a receiver averages over it. 0: lines. Below the pitch and the nearest distance.
    pub element_width: f64,
    /// The line source.
    pub source: Source,
    /// The receivers.
    pub receivers: Receivers,
    /// Angle, rad, by which the probe is turned about the source: if it is positive, receivers are
    /// the higher, the farther they are from the source.
    pub tilt: f64,
    /// Whether a second source emits, too, as far beyond the last receiver as the first is before the
    /// first one.
    pub bidirectional: bool,
}

/// Position of a receiver as seen from the source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Distance from the source along the bone, m.
    pub x: f64,
    /// Height above the bone's upper face, m.
    pub x3: f64,
}

impl Probe {
    /// Returns the distances of the receivers from the source along the probe, m.
    pub fn distances(&self) -> impl Iterator<Item = f64> + '_ {
        self.receivers.positions().map(|x1| (x1 - self.source.x1).abs())
    }

    /// Returns the places of the receivers. The probe is rigid, also where source and receivers have
    /// different heights.
    pub fn places(&self) -> impl Iterator<Item = Place> + '_ {
        let (sin, cos) = libm::sincos(self.tilt);
        let across = self.receivers.x3 - self.source.x3;
        self.distances().map(move |distance| Place {
            x: distance * cos - across * sin,
            x3: self.receivers.x3 + distance * sin - across * (1.0 - cos),
        })
    }

    /// Returns how far an element extends along the bone and upwards, m; the latter is negative if
    /// receivers are the lower, the farther they are.
    pub fn element_extent(&self) -> (f64, f64) {
        let (sin, cos) = libm::sincos(self.tilt);
        (self.element_width * cos, self.element_width * sin)
    }

    /// Returns the frequency, Hz, in which bands are measured: the centre frequency, or more if the pulse
    /// needs a wider band than the paper's.
    pub fn band_unit(&self) -> f64 {
        self.center_frequency * self.pulse.bandwidth(self.center_frequency)
    }

    /// Returns the frequency, Hz, at which A0 and S0 are computed.
    pub fn frequency_of_guided_waves(&self) -> f64 {
        self.guided_wave_frequency.unwrap_or(self.center_frequency)
    }

    /// Returns the height of the lowest receiver, m.
    pub fn lowest_receiver(&self) -> f64 {
        self.places().map(|place| place.x3).fold(f64::INFINITY, f64::min)
    }

    /// Returns the probe as its second source sees it, in the mirrored bone, whose velocities are the
    /// same: the receivers have the same distances, in the opposite order.
    pub fn from_other_side(&self) -> Self {
        let (first, last) = (self.receivers.x1(0), self.receivers.x1(self.receivers.count - 1));
        let apart = (first - self.source.x1).abs() + (last - self.source.x1).abs();
        let rise = apart * libm::sin(self.tilt);
        let source = Source { x3: self.source.x3 + rise, ..self.source };
        let receivers = Receivers { x3: self.receivers.x3 + rise, ..self.receivers };
        Self { source, receivers, tilt: -self.tilt, ..self.clone() }
    }
}

impl Probe {
    /// Returns the probe with its source moved by `offset`, m, away from the receivers, which stay where they are.
    pub fn with_source_farther(&self, offset: f64) -> Self {
        // A tilt turns the probe about its source, so that heights are those at another source.
        let drop = offset * libm::sin(self.tilt);
        let away = if self.receivers.first_x1 < self.source.x1 { offset } else { -offset };
        let source = Source { x1: self.source.x1 + away, x3: self.source.x3 - drop };
        let receivers = Receivers { x3: self.receivers.x3 - drop, ..self.receivers };
        Self { source, receivers, ..self.clone() }
    }
}

impl Default for Probe {
    /// A 1 MHz probe with 14 receivers 0.8 mm apart, 11 to 21.4 mm from the source, all 2 mm
    /// above the bone.
    fn default() -> Self {
        Self {
            center_frequency: 1e6,
            amplitude: 100.0,
            pulse: PulseForm::default(),
            guided_wave_frequency: None,
            a0_in_fluids: false,
            element_width: 0.0,
            source: Source { x1: 0.0, x3: 2e-3 },
            receivers: Receivers { first_x1: 11e-3, pitch: 0.8e-3, count: 14, x3: 2e-3 },
            tilt: 0.0,
            bidirectional: false,
        }
    }
}

impl Section for Probe {
    fn declare(&mut self, fields: &mut dyn Fields) {
        fields.number(
            Key { name: "center_frequency", meaning: "centre frequency fc of the pulse" },
            &mut self.center_frequency,
            Number::above_zero(&FREQUENCY),
        );
        fields.number(
            Key { name: "amplitude", meaning: AMPLITUDE },
            &mut self.amplitude,
            Number::within(Interval::above(0.0, "N")),
        );
        fields.custom_table(PulseForm::KEY);
        let guided = "frequency at which the guided waves A0 and S0 are computed; by default \
                      `center_frequency`";
        fields.optional_number(
            Key { name: "guided_wave_frequency", meaning: guided },
            &mut self.guided_wave_frequency,
            Number::above_zero(&FREQUENCY),
        );
        let in_fluids = "whether A0 is that of the bone between coupling and marrow, which reach far, \
                         instead of a vacuum; only where it is slower than sound in both";
        fields.boolean(Key { name: "a0_in_fluids", meaning: in_fluids }, &mut self.a0_in_fluids);
        let width = "width of the source and of each receiver along the probe, over which they emit and \
                     average; below the pitch and the nearest distance. 0: lines";
        fields.number(
            Key { name: "element_width", meaning: width },
            &mut self.element_width,
            Number::at_least(0.0, &ELEMENT_WIDTH),
        );
        let source = "the line source; inside the coupling fluid";
        fields.table(Key { name: "source", meaning: source }, &mut |fields| {
            self.source.declare(fields);
        });
        let receivers = "the receivers; all on one side of the source, inside the coupling fluid";
        fields.table(Key { name: "receivers", meaning: receivers }, &mut |fields| {
            self.receivers.declare(fields);
        });
        let tilt = "angle by which the probe is turned about the source; positive if receivers farther \
                    from it are higher";
        fields.number(
            Key { name: "tilt", meaning: tilt },
            &mut self.tilt,
            Number::within(Interval::from_to(-TILT_MAX, TILT_MAX, "rad")),
        );
        let bidirectional = "whether a second source at the other end emits, too: the velocity is then \
                             the harmonic mean of both directions";
        fields.boolean(
            Key { name: "bidirectional", meaning: bidirectional },
            &mut self.bidirectional,
        );
    }
}

/// Accepted positions along the bone: any finite number, since only differences matter.
const POSITION: Number = Number::within(Interval::finite("m"));

impl Section for Source {
    fn declare(&mut self, fields: &mut dyn Fields) {
        fields.number(
            Key { name: "x1", meaning: "position along the bone" },
            &mut self.x1,
            POSITION,
        );
        fields.number(
            Key { name: "x3", meaning: "height above the bone" },
            &mut self.x3,
            Number::above_zero(&HEIGHT),
        );
    }
}

impl Section for Receivers {
    fn declare(&mut self, fields: &mut dyn Fields) {
        fields.number(
            Key { name: "first_x1", meaning: "position of the first receiver along the bone" },
            &mut self.first_x1,
            POSITION,
        );
        fields.number(
            Key { name: "pitch", meaning: "distance between neighbours" },
            &mut self.pitch,
            Number::above_zero(&PITCH),
        );
        fields.whole(
            Key { name: "count", meaning: "number of receivers" },
            &mut self.count,
            RECEIVERS,
        );
        fields.number(
            Key { name: "x3", meaning: "height above the bone" },
            &mut self.x3,
            Number::above_zero(&HEIGHT),
        );
    }
}
