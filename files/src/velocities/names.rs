//! What the name of a column says about its values: by its words, and by a unit in it.

use super::csv_format::VelocityUnit;
use super::name_words::{
    ABBREVIATIONS, OTHER_BEHIND, OTHER_PARTS, OTHER_THINGS, OTHER_WORDS, REMARKS, SCATTER, SYMBOLS,
    VELOCITY,
};
use super::units::{self, NamedUnit, folded};

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
        // Ultrasound, and no microseconds.
        let name = name.strip_suffix("_US").or(name.strip_suffix(" US")).unwrap_or(name);
        let quantity = name.split(['(', '[', '{']).next().unwrap_or_default();
        let is_squared = quantity.contains('\u{b2}') || quantity.contains("^2");
        let (without, unit) = split_unit(&without_conditions(&folded(name)));
        Self { word: if is_squared { Word::Other } else { word_of(&without) }, unit }
    }

    /// Returns whether values below this name are velocities, if they have the size of some.
    pub(super) fn is_of_velocities(self) -> bool {
        match (self.unit, self.word) {
            (_, Word::Scatter | Word::Other) | (Some(NamedUnit::Other), _) => false,
            (_, Word::Velocity) | (None, Word::Symbol) => true,
            (Some(NamedUnit::Velocity(_)), _) => true,
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

    pub(super) fn unit(self) -> Option<NamedUnit> {
        self.unit
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
    if has(&OTHER_THINGS) {
        return Word::Other;
    }
    let name = &name.replace(" of sound", "");
    let is_velocity = VELOCITY.iter().any(|part| name.contains(part)) || has(&ABBREVIATIONS);
    let is_other = OTHER_PARTS.iter().any(|part| name.contains(part)) || has(&OTHER_WORDS);
    match (is_velocity, is_other) {
        // A "velocity time" is a time, a "TOF speed" a speed.
        (true, _) if ends_with_other(name) => Word::Other,
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
    let is_behind = |part: &str| {
        let Some(at) = name.rfind(part).filter(|&at| at > velocity && at < of) else {
            return false;
        };
        // A numbered position is the place of the measurement.
        let next = name[at + part.len()..].trim_start_matches([' ', '_']);
        !(part == "position" && next.starts_with(|c: char| c.is_ascii_digit()))
    };
    let behind = name.get(velocity..of).unwrap_or_default();
    let mut words = behind.split(|c: char| !c.is_alphanumeric()).skip(1);
    OTHER_PARTS.iter().any(|part| is_behind(part)) || words.any(|word| OTHER_BEHIND.contains(&word))
}

/// Returns whether the words are a symbol with qualifiers, as in "c_L" or "v axial".
fn is_symbol(words: &[&str]) -> bool {
    let Some((first, others)) = words.split_first() else { return false };
    SYMBOLS.contains(first) && others.iter().all(|word| is_remark_word(word))
}

/// Returns whether a word says of what or how a velocity was measured.
fn is_remark_word(word: &str) -> bool {
    REMARKS.contains(&word)
        || ABBREVIATIONS.contains(&word)
        || SYMBOLS.contains(&word)
        || VELOCITY.iter().any(|part| word.contains(part))
        || word.chars().all(char::is_numeric)
}

/// Returns a name without the frequency or temperature of the measurement: "SOS 1 MHz", "velocity at 37 °C".
fn without_conditions(name: &str) -> String {
    let name = ['-', ' ', '_'].iter().fold(name.replace("temperature", "temp"), |name, between| {
        name.replace(&format!("temp{between}corr"), "corr")
    });
    let is_number = |part: &str| part.trim_start_matches(['(', '[']).parse::<f64>().is_ok();
    let is_other = |part: &str| units::of_text(part) == Some(NamedUnit::Other);
    let mut kept: Vec<&str> = Vec::new();
    for part in name.split(['_', ' ']) {
        if is_other(part) && kept.last().is_some_and(|last| is_number(last)) {
            kept.pop();
        } else {
            kept.push(part);
        }
    }
    kept.join(" ")
}

/// Returns whether a text in brackets is no unit: it says how the velocity was measured.
fn is_remark(text: &str) -> bool {
    let number = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let is_condition = number > 0 && units::of_text(&text[number..]) == Some(NamedUnit::Other);
    let mut words = text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    is_condition || words.all(is_remark_word) && !text.contains('/')
}

/// Returns a name without its unit, and the unit.
fn split_unit(name: &str) -> (String, Option<NamedUnit>) {
    let name = name.trim();
    // In brackets any unit counts, and what is no remark is one.
    let (mut rest, mut before, mut is_unknown) = (name, 0, false);
    while let Some(open) = rest.find(['(', '[', '{', '<']) {
        let inner = &rest[open + 1..];
        let end = match rest.as_bytes()[open] {
            b'(' => ')',
            b'[' => ']',
            b'{' => '}',
            _ => '>',
        };
        let close = inner.find(end).unwrap_or(inner.len());
        if let Some(unit) = units::of_text(&inner[..close]) {
            let end = (before + open + 1 + close + 1).min(name.len());
            let end = name.ceil_char_boundary(end);
            return (format!("{} {}", &name[..before + open], &name[end..]), Some(unit));
        }
        is_unknown |= !is_remark(&inner[..close]);
        before += open + 1 + close;
        rest = name.get(before..).unwrap_or("");
    }
    if is_unknown {
        let quantity = name.split(['(', '[', '{', '<']).next().unwrap_or_default();
        return (quantity.to_owned(), Some(NamedUnit::Unknown));
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
            ("SOS 1 MHz", None),
            ("velocity_200_kHz", None),
            ("velocity at 37 \u{b0}C", None),
            ("FAS (1 MHz)", None),
            ("velocity temp-corrected (m/s)", Some(m)),
            ("speed_US", None),
            ("SOS_position1", None),
            ("velocity (10^3 m/s)", Some(km)),
            ("velocity (x1000 m/s)", Some(km)),
            ("c_{FAS} \\(m s^{-1}\\)", Some(m)),
            ("SOS (left)", None),
        ] {
            let says = ColumnName::parse(name);
            assert!(says.is_of_velocities(), "{name}: {says:?}");
            assert_eq!(says.velocity_unit(), unit, "{name}");
        }
    }

    /// Names of other columns, between bars.
    const OTHERS: [&str; 10] = [
        "tof_us|time (us)|t / \u{b5}s|E (MPa)|E|thickness_mm|Distance (mm)|density|freq_kHz",
        "Temperature (Celsius)|Frequency|velocity SD (m/s)|speed error|id|n|c (\u{b0}C)",
        "v (V)|velocity (%)|velocity time|Elastic modulus|porosity|2500|comments|site",
        "patient||x|value|SV-C.Xchange (No Sensor)|UPV ratio|V (mm3)|FAS SNR (3.4)",
        "motor speed (rpm)|SOS_ID|C (pF)|cp [J/(kg K)]|c (N/m)|V_pp|V_rms|Speed [1/min]",
        "speed_rpm|sampling speed (kS/s)|FAS sample|FAS pick (samples)|FAS arrival|FAS ToA",
        "velocity delay|SOS No.|velocity file no|velocity year|c_w|c_ref|c_ref (m/s)",
        "water (m/s)|speed of sound in water|velocity gain|velocity n|velocity dispersion",
        "velocity\u{b2}|velocity^2 (km2/s2)|velocity_z|speed class|speed of sound rank",
        "SOS T-score",
    ];

    #[test]
    fn names_of_other_quantities_are_not() {
        for name in OTHERS.iter().flat_map(|line| line.split('|')) {
            assert!(
                !ColumnName::parse(name).is_of_velocities(),
                "{name}: {:?}",
                ColumnName::parse(name)
            );
        }
        assert!(ColumnName::parse("velocity (ft/s)").unit() == Some(NamedUnit::OtherVelocity));
        assert!(ColumnName::parse("velocity (ft/s)").is_of_velocities());
        // What is in brackets and not known is asked about.
        for name in ["velocity (counts)", "velocity (px/s)", "velocity [a.u.]", "SOS [m/s * 10]"] {
            let says = ColumnName::parse(name);
            assert!(
                says.is_of_velocities() && says.unit() == Some(NamedUnit::Unknown),
                "{name}: {says:?}"
            );
        }
    }
}
