//! Plausible values of the numbers in a file: the range in which a physical value lies, and the
//! units that people write instead of the required one.
//!
//! A physically impossible number is refused if one of these units explains it; one that is only
//! unusual is accepted with a [warning](crate::warnings::Warning).

use crate::accepted::Interval;

/// A unit that people use instead of the required one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct OtherUnit {
    /// The unit as printed after a number.
    name: &'static str,
    /// Its value as a power of 10 of the required unit.
    exponent: i32,
}

/// Prior knowledge about one kind of number. All of it refers to values above 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlausibleRange {
    /// The required unit; empty for pure numbers.
    pub(crate) unit: &'static str,
    /// Typical value: if several units explain a number, the one that brings it nearest to this is
    /// chosen.
    typical: f64,
    /// Values outside this range (from, to) cause a warning.
    usual: (f64, f64),
    /// A value below the first, or not below the second, is refused if another unit explains it.
    /// The range extends at least ten times beyond every meaningful value.
    possible: (f64, f64),
    /// Units that explain numbers outside the range.
    units: &'static [OtherUnit],
}

/// Factor by which a number in another unit may lie beyond the usual range to count as explained by
/// it.
const EXPLAINED: f64 = 10.0;

const fn other(name: &'static str, exponent: i32) -> OtherUnit {
    OtherUnit { name, exponent }
}

const LENGTHS: &[OtherUnit] = &[other("mm", -3), other("µm", -6)];
const SPEEDS: &[OtherUnit] = &[other("km/s", 3), other("mm/s", -3)];
const PER_CENT: &[OtherUnit] = &[other("%", -2)];
const DENSITIES: &[OtherUnit] = &[other("g/cm³", 3)];

/// A measured velocity of the first arriving signal.
pub(crate) const VELOCITY: PlausibleRange = PlausibleRange {
    unit: "m/s",
    typical: 4000.0,
    usual: (1000.0, 8000.0),
    possible: (100.0, 20_000.0),
    units: SPEEDS,
};
/// The coefficient of variation of measured velocities.
pub(crate) const VARIATION: PlausibleRange = PlausibleRange {
    unit: "",
    typical: 0.03,
    usual: (1e-4, 0.5),
    possible: (0.0, 1.0),
    units: PER_CENT,
};
/// Thickness of the bone.
pub(crate) const BONE_THICKNESS: PlausibleRange = PlausibleRange {
    unit: "m",
    typical: 4e-3,
    usual: (0.2e-3, 30e-3),
    possible: (0.0, 1.0),
    units: LENGTHS,
};
/// Thickness of a fluid. A layer that is far too thick has no echo and does no harm.
pub(crate) const FLUID_THICKNESS: PlausibleRange = PlausibleRange {
    unit: "m",
    typical: 10e-3,
    usual: (0.0, 0.3),
    possible: (0.0, f64::INFINITY),
    units: LENGTHS,
};
/// Density of a fluid; a very small one represents a vacuum.
pub(crate) const FLUID_DENSITY: PlausibleRange = PlausibleRange {
    unit: "kg/m³",
    typical: 1000.0,
    usual: (100.0, 15_000.0),
    possible: (0.0, f64::INFINITY),
    units: DENSITIES,
};
/// Speed of sound in a fluid.
pub(crate) const SOUND_SPEED: PlausibleRange = PlausibleRange {
    unit: "m/s",
    typical: 1500.0,
    usual: (300.0, 3500.0),
    possible: (10.0, 1e5),
    units: SPEEDS,
};
/// Centre frequency of the pulse.
pub(crate) const FREQUENCY: PlausibleRange = PlausibleRange {
    unit: "Hz",
    typical: 1e6,
    usual: (20e3, 20e6),
    possible: (2e3, f64::INFINITY),
    units: &[other("MHz", 6), other("kHz", 3)],
};
/// Quality factor of bone, soft tissue, gel or water.
pub(crate) const QUALITY_FACTOR: PlausibleRange = PlausibleRange {
    unit: "",
    typical: 20.0,
    usual: (4.0, 1e5),
    possible: (0.0, f64::INFINITY),
    units: &[],
};
/// Height of source or receivers above the bone.
pub(crate) const HEIGHT: PlausibleRange = PlausibleRange {
    unit: "m",
    typical: 2e-3,
    usual: (0.0, 50e-3),
    possible: (0.0, 1.0),
    units: &[other("mm", -3)],
};
/// Distance of the first receiver from the source, along the bone.
pub(crate) const DISTANCE: PlausibleRange = PlausibleRange {
    unit: "m",
    typical: 15e-3,
    usual: (1e-3, 0.5),
    possible: (0.0, 3.0),
    units: LENGTHS,
};
/// Distance of neighbouring receivers.
pub(crate) const PITCH: PlausibleRange = PlausibleRange {
    unit: "m",
    typical: 1e-3,
    usual: (50e-6, 20e-3),
    possible: (0.0, 0.1),
    units: LENGTHS,
};
/// Width of a probe's elements; lines have none.
pub(crate) const ELEMENT_WIDTH: PlausibleRange = PlausibleRange {
    unit: "m",
    typical: 0.6e-3,
    usual: (0.0, 10e-3),
    possible: (0.0, 0.1),
    units: LENGTHS,
};
/// Size of the hybrid method's elements.
pub(crate) const ELEMENT_SIZE: PlausibleRange = PlausibleRange {
    unit: "m",
    typical: 0.5e-3,
    usual: (0.0, 10e-3),
    possible: (0.0, 0.1),
    units: LENGTHS,
};
/// Time step of the hybrid method. A step that is far too long fails at once.
pub(crate) const TIME_STEP: PlausibleRange = PlausibleRange {
    unit: "s",
    typical: 1e-8,
    usual: (1e-12, 1e-6),
    possible: (0.0, f64::INFINITY),
    units: &[other("ns", -9), other("µs", -6)],
};
/// Density of the bone.
pub(crate) const DENSITY: PlausibleRange = PlausibleRange {
    unit: "kg/m³",
    typical: 1800.0,
    usual: (300.0, 6000.0),
    possible: (10.0, f64::INFINITY),
    units: DENSITIES,
};
/// Young and shear moduli.
pub(crate) const MODULUS: PlausibleRange = PlausibleRange {
    unit: "Pa",
    typical: 10e9,
    usual: (100e6, 1e12),
    possible: (1e6, f64::INFINITY),
    units: &[other("GPa", 9), other("MPa", 6)],
};
/// Poisson ratios.
pub(crate) const POISSON_RATIO: PlausibleRange = PlausibleRange {
    unit: "",
    typical: 0.35,
    usual: (-0.5, 1.0),
    possible: (0.0, 5.0),
    units: PER_CENT,
};
/// Porosity of cortical bone. Where it is spongy, it has more.
pub(crate) const POROSITY: PlausibleRange = PlausibleRange {
    unit: "",
    typical: 0.1,
    usual: (0.0, 0.3),
    possible: (0.0, 1.0),
    units: PER_CENT,
};
/// Dispersion of the random elasticity.
pub(crate) const DISPERSION: PlausibleRange = PlausibleRange {
    unit: "",
    typical: 0.1,
    usual: (2e-3, 0.7),
    possible: (0.0, 1.0),
    units: PER_CENT,
};

impl PlausibleRange {
    /// Returns whether such a value is physically impossible.
    pub(crate) fn is_impossible(&self, value: f64) -> bool {
        let (from, to) = self.possible;
        !(from..to).contains(&value)
    }

    /// Returns the required unit in words.
    pub(crate) fn asked_for(&self) -> String {
        match self.unit {
            "" => "values are pure numbers".to_owned(),
            unit => format!("values are in {unit}"),
        }
    }

    /// Returns the limits between which every value is possible.
    pub(crate) fn possible(&self) -> (f64, f64) {
        self.possible
    }

    /// Returns the question whether impossible `values` of one field are in another unit; `None` if
    /// one of them is possible, or if no unit explains all of them.
    ///
    /// `accepted` are the values that the field accepts in addition.
    pub(crate) fn question(&self, values: &[f64], accepted: Interval) -> Option<String> {
        let impossible = |&value: &f64| value > 0.0 && self.is_impossible(value);
        let (from, to) = self.usual;
        let meant = |si: f64| {
            (from / EXPLAINED..=to * EXPLAINED).contains(&si)
                && !self.is_impossible(si)
                && accepted.contains(si)
        };
        if !values.iter().all(impossible) {
            return None;
        }
        self.asked(values, meant)
    }

    /// Returns a warning about an unusual but possible value.
    pub(crate) fn doubt(&self, value: f64) -> Option<String> {
        let (from, to) = self.usual;
        if (from..=to).contains(&value) || value.is_nan() {
            return None;
        }
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        let usual = if from > 0.0 || value < from {
            format!("{} to {}{unit}", short(from), short(to))
        } else {
            format!("up to {}{unit}", short(to))
        };
        let meant = |si: f64| (from..=to).contains(&si);
        let asked = Some(value).filter(|&value| value > 0.0);
        let asked = asked.and_then(|value| self.asked(&[value], meant));
        let question = asked.map(|question| format!("; {question}")).unwrap_or_default();
        Some(format!("is {}{unit}; usual is {usual}{question}", short(value)))
    }

    /// Returns the question whether `values` are in the unit that brings all of them into the range
    /// `meant`.
    fn asked(&self, values: &[f64], meant: impl Fn(f64) -> bool) -> Option<String> {
        let explains = |unit: &&OtherUnit| values.iter().all(|&value| meant(unit.si(value)));
        let distance = |unit: &OtherUnit| {
            let first = values.first().map_or(f64::NAN, |&value| unit.si(value));
            libm::log(first / self.typical).abs()
        };
        let unit = self
            .units
            .iter()
            .filter(explains)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        let listed = |written: &dyn Fn(f64) -> String| {
            values.iter().map(|&value| written(value)).collect::<Vec<_>>().join(" and ")
        };
        let here = listed(&|value| value.to_string());
        let si = listed(&|value| unit.written(value));
        Some(format!("did you mean {here} {} ({si})?", unit.name))
    }
}

impl OtherUnit {
    /// Converts `value` of this unit to the required unit, correctly rounded.
    fn si(self, value: f64) -> f64 {
        // A number with an exponent always parses.
        format!("{value}e{}", self.exponent).parse().unwrap_or(f64::NAN)
    }

    /// Returns the converted value as it may be typed.
    fn written(self, value: f64) -> String {
        if self.exponent == -2 {
            short(self.si(value))
        } else {
            format!("{value}e{}", self.exponent)
        }
    }
}

/// Formats a number for a sentence, with four digits.
pub(crate) fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    let magnitude = rounded.abs();
    if magnitude != 0.0 && magnitude.is_finite() && !(1e-4..1e7).contains(&magnitude) {
        return format!("{rounded:e}");
    }
    rounded.to_string()
}

#[cfg(test)]
mod tests;
