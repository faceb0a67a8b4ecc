//! What the name of a column says about its values: by its words, and by a unit in it.

use super::csv_format::VelocityUnit;
use super::units::{self, NamedUnit, folded};

/// Words of velocities, in lower case; a name contains one.
const VELOCITY: [&str; 26] = [
    "velocit",
    "speed",
    "schallgeschw",
    "geschwindigk",
    "vitesse",
    "c\u{e9}l\u{e9}rit\u{e9}",
    "celerite",
    "velocidad",
    "rapidez",
    "snelheid",
    "hastighet",
    "pr\u{119}dko\u{15b}",
    "predkosc",
    "rychlost",
    "r\u{fd}chlos\u{165}",
    "h\u{131}z",
    "nopeus",
    "sebess\u{e9}g",
    "\u{441}\u{43a}\u{43e}\u{440}\u{43e}\u{441}\u{442}",
    "\u{3c4}\u{3b1}\u{3c7}\u{3cd}\u{3c4}\u{3b7}\u{3c4}\u{3b1}",
    "\u{901f}\u{5ea6}",
    "\u{97f3}\u{901f}",
    "\u{58f0}\u{901f}",
    "\u{8072}\u{901f}",
    "\u{6ce2}\u{901f}",
    "\u{c18d}\u{b3c4}",
];
/// Abbreviations of velocities that mean nothing else in this field.
const ABBREVIATIONS: [&str; 6] = ["sos", "fas", "vfas", "upv", "vel", "vsos"];
/// Symbols of velocities, which may mean something else.
const SYMBOLS: [&str; 13] =
    ["v", "c", "sv", "vp", "vl", "cl", "cp", "pv", "v0", "c0", "va", "vlam", "cfas"];
/// Words of columns that say how much another scatters, or something about it.
const SCATTER: [&str; 33] = [
    "sd",
    "std",
    "stdev",
    "stddev",
    "error",
    "err",
    "uncertainty",
    "stderr",
    "sem",
    "se",
    "variance",
    "var",
    "cv",
    "cov",
    "sigma",
    "rmse",
    "ratio",
    "index",
    "quality",
    "flag",
    "status",
    "count",
    "repeatability",
    "standardabweichung",
    "streuung",
    "fehler",
    "unsicherheit",
    "erreur",
    "incertitude",
    "errore",
    "deviation",
    "desviaci\u{f3}n",
    "\u{e9}cart",
];
/// Parts of names of other quantities.
const OTHER_PARTS: [&str; 47] = [
    "time",
    "tof",
    "zeit",
    "temps",
    "tiempo",
    "tempo",
    "\u{432}\u{440}\u{435}\u{43c}\u{44f}",
    "\u{65f6}\u{95f4}",
    "\u{6642}\u{9593}",
    "thick",
    "dicke",
    "paisseur",
    "espesor",
    "spessore",
    "\u{539a}",
    "distan",
    "length",
    "l\u{e4}nge",
    "depth",
    "tiefe",
    "profond",
    "height",
    "width",
    "diam",
    "position",
    "modul",
    "young",
    "stiffness",
    "elasti",
    "densi",
    "dichte",
    "temp",
    "freq",
    "attenuation",
    "d\u{e4}mpf",
    "bua",
    "decay",
    "pressure",
    "druck",
    "salin",
    "conductiv",
    "poros",
    "amplitude",
    "phase",
    "volt",
    "slowness",
    "impedance",
];
/// Whole words of other quantities.
const OTHER_WORDS: [&str; 21] = [
    "e", "rho", "t", "f", "h", "d", "l", "age", "weight", "mass", "bmi", "bmd", "id", "no", "nr",
    "date", "alter", "gain", "angle", "n", "lon",
];
/// Longest qualifier of a symbol, characters.
const QUALIFIER_MAX: usize = 4;
/// Longest name that is looked at, bytes.
const NAME_BYTES_MAX: usize = 400;

/// Meaning of the words in the name of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Velocity,
    /// A letter that often stands for a velocity.
    Symbol,
    Scatter,
    Other,
    None,
}

/// How the name of a column is understood.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ColumnName {
    word: Word,
    unit: Option<NamedUnit>,
}

impl ColumnName {
    /// Returns how the name of a column is understood.
    pub(super) fn parse(name: &str) -> Self {
        if name.len() > NAME_BYTES_MAX {
            return Self { word: Word::None, unit: None };
        }
        let name = folded(name);
        let (without, unit) = split_unit(&name);
        Self { word: word_of(&without), unit }
    }

    /// Returns whether values below this name are velocities, if they have the size of some.
    pub(super) fn is_of_velocities(self) -> bool {
        match (self.unit, self.word) {
            (_, Word::Scatter) | (Some(NamedUnit::Other), _) => false,
            (_, Word::Velocity) | (None, Word::Symbol) => true,
            (Some(NamedUnit::Velocity(_)), word) => word != Word::Other,
            _ => false,
        }
    }

    /// Returns whether it has a word of velocities, and not only their unit or a letter.
    pub(super) fn has_word(self) -> bool {
        self.word == Word::Velocity
    }

    /// Returns whether it is a letter that may mean something else.
    pub(super) fn is_symbol(self) -> bool {
        self.word == Word::Symbol && self.unit.is_none()
    }

    /// Returns the unit of velocity in it.
    pub(super) fn velocity_unit(self) -> Option<VelocityUnit> {
        match self.unit {
            Some(NamedUnit::Velocity(unit)) => Some(unit),
            _ => None,
        }
    }

    /// Returns whether it has a unit of velocity that no job file can name.
    pub(super) fn has_other_velocity_unit(self) -> bool {
        self.unit == Some(NamedUnit::OtherVelocity)
    }
}

/// Returns what the words say of a name without its unit.
fn word_of(name: &str) -> Word {
    let words: Vec<&str> =
        name.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let has = |list: &[&str]| words.iter().any(|word| list.contains(word));
    if has(&SCATTER) {
        return Word::Scatter;
    }
    let is_velocity = VELOCITY.iter().any(|part| name.contains(part)) || has(&ABBREVIATIONS);
    let is_other = OTHER_PARTS.iter().any(|part| name.contains(part)) || has(&OTHER_WORDS);
    match (is_velocity, is_other) {
        // A "velocity time" is a time, a "TOF speed" a speed.
        (true, true) if ends_with_other(name) => Word::Other,
        (true, _) => Word::Velocity,
        (false, _) if is_symbol(&words) => Word::Symbol,
        (false, true) => Word::Other,
        (false, false) => Word::None,
    }
}

/// Returns whether the name of another quantity stands behind that of a velocity, but not as what the
/// velocity is of, or measured at.
fn ends_with_other(name: &str) -> bool {
    let last_of = |list: &[&str]| list.iter().filter_map(|part| name.rfind(part)).max();
    let velocity = last_of(&VELOCITY).or(last_of(&ABBREVIATIONS)).unwrap_or(0);
    let of = name.find(" of ").or(name.find(" at ")).or(name.find('(')).unwrap_or(name.len());
    last_of(&OTHER_PARTS).is_some_and(|other| other > velocity && other < of)
}

/// Returns whether the words are a symbol with qualifiers, as in "c_L" or "v axial".
fn is_symbol(words: &[&str]) -> bool {
    let Some((first, others)) = words.split_first() else { return false };
    let is_qualifier = |word: &&str| {
        word.chars().count() <= QUALIFIER_MAX
            || ["proximal", "distal", "axial", "radial", "mean", "right", "corrected", "calc"]
                .contains(word)
    };
    SYMBOLS.contains(first) && others.iter().all(is_qualifier)
}

/// Returns a name without its unit, and the unit.
fn split_unit(name: &str) -> (String, Option<NamedUnit>) {
    let name = name.trim();
    // In brackets any unit counts.
    let mut rest = name;
    let mut before = 0;
    while let Some(open) = rest.find(['(', '[', '{', '<']) {
        let inner = &rest[open + 1..];
        let close = inner.find([')', ']', '}', '>']).unwrap_or(inner.len());
        if let Some(unit) = units::of_text(&inner[..close]) {
            let end = (before + open + 1 + close + 1).min(name.len());
            let end = name.ceil_char_boundary(end);
            return (format!("{} {}", &name[..before + open], &name[end..]), Some(unit));
        }
        before += open + 1 + close;
        rest = name.get(before..).unwrap_or("");
    }
    // Behind a mark, too: "t / us", "velocity, m/s", "SOUND VELOCITY;M/SEC", "v in km/s".
    for mark in [" / ", ",", ";", " in ", ":"] {
        if let Some((before, text)) = name.split_once(mark)
            && let Some(unit) = units::of_text(text)
        {
            return (before.to_owned(), Some(unit));
        }
    }
    last_words(name)
}

/// Returns the unit that the last words of a name are, with what stands before them: "pulse_speed_m_s",
/// "tof_us", "SV m/s".
fn last_words(name: &str) -> (String, Option<NamedUnit>) {
    let parts: Vec<&str> = name.split(['_', ' ']).filter(|part| !part.is_empty()).collect();
    for count in (1..=4.min(parts.len().saturating_sub(1))).rev() {
        let (before, last) = parts.split_at(parts.len() - count);
        let joined = last.join("/").replace("/per/", "/");
        let spaced = last.join(" ");
        // "m_s" is m/s, and no millisecond.
        let unit = units::of_text(&joined).or_else(|| units::of_text(&spaced));
        match unit {
            // One letter is more often a part of a symbol.
            Some(NamedUnit::Other) if spaced.chars().count() == 1 => {}
            Some(unit) => return (before.join(" "), Some(unit)),
            None => {}
        }
    }
    (name.to_owned(), None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_velocities_are_told_from_others() {
        let (m, km) = (VelocityUnit::MetrePerSecond, VelocityUnit::KilometrePerSecond);
        let us = VelocityUnit::MillimetrePerMicrosecond;
        for (name, unit) in [
            ("velocity", None),
            ("Velocity", None),
            ("FAS_velocity", None),
            ("FAS (km/s)", Some(km)),
            ("v [mm/\u{b5}s]", Some(us)),
            ("SV (m/s)", Some(m)),
            ("speed of sound", None),
            ("Speed of sound at 20 \u{b0}C (m/s)", Some(m)),
            ("SOS", None),
            ("c", None),
            ("c [m/s]", Some(m)),
            ("c_L (m/s)", Some(m)),
            ("v_proximal", None),
            ("SOUND VELOCITY;M/SEC", Some(m)),
            ("Sound velocity (Meters per Second)", Some(m)),
            ("Sound Velocity (calc)", None),
            ("pulse_speed_m_s", Some(m)),
            ("speed_m_per_s", Some(m)),
            ("TOF speed (m s-1)", Some(m)),
            ("result (m\u{b7}s\u{207b}\u{b9})", Some(m)),
            ("velocity in km/s", Some(km)),
            ("Schallgeschwindigkeit / m/s", Some(m)),
            ("vitesse (m/s)", Some(m)),
            ("velocit\u{e0} [m/s]", Some(m)),
            ("\u{441}\u{43a}\u{43e}\u{440}\u{43e}\u{441}\u{442}\u{44c} (\u{43c}/\u{441})", Some(m)),
            ("\u{58f0}\u{901f}(m/s)", Some(m)),
            ("\u{97f3}\u{901f}\u{ff08}m/s\u{ff09}", Some(m)),
            ("longitudinal velocity", None),
        ] {
            let says = ColumnName::parse(name);
            assert!(says.is_of_velocities(), "{name}: {says:?}");
            assert_eq!(says.velocity_unit(), unit, "{name}");
        }
    }

    #[test]
    fn names_of_other_quantities_are_not() {
        for name in [
            "tof_us",
            "time (us)",
            "t / \u{b5}s",
            "E (MPa)",
            "E",
            "thickness_mm",
            "Distance (mm)",
            "density",
            "freq_kHz",
            "Temperature (Celsius)",
            "Frequency",
            "velocity SD (m/s)",
            "speed error",
            "id",
            "n",
            "c (\u{b0}C)",
            "v (V)",
            "velocity (%)",
            "velocity time",
            "Elastic modulus",
            "porosity",
            "2500",
            "comments",
            "site",
            "patient",
            "",
            "x",
            "value",
            "SV-C.Xchange (No Sensor)",
            "UPV ratio",
        ] {
            assert!(
                !ColumnName::parse(name).is_of_velocities(),
                "{name}: {:?}",
                ColumnName::parse(name)
            );
        }
        assert!(ColumnName::parse("velocity (ft/s)").has_other_velocity_unit());
        assert!(ColumnName::parse("velocity (ft/s)").is_of_velocities());
    }
}
