//! Units as people write them in headers and cells.

use unicode_normalization::UnicodeNormalization as _;

use super::csv_format::VelocityUnit;

/// What a text names as a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NamedUnit {
    /// A unit that a job file can name.
    Velocity(VelocityUnit),
    /// Another unit of velocity.
    OtherVelocity,
    /// A unit of something else.
    Other,
    /// A text at the place of a unit that is no unit known here.
    Unknown,
}

const LENGTHS: [&str; 9] = ["km", "mm", "cm", "dm", "um", "kft", "ft", "in", "m"];
/// How people write a factor of thousand before a unit, without blanks and powers.
const THOUSAND: [&str; 7] = ["103", "x103", "\u{d7}103", "1000", "x1000", "\u{d7}1000", "1e3"];
const TIMES: [&str; 6] = ["us", "ms", "ns", "min", "s", "h"];
/// Units of other quantities.
const OTHERS: [&str; 67] = [
    "rpm",
    "1/min",
    "us",
    "ms",
    "ns",
    "ps",
    "s",
    "min",
    "h",
    "d",
    "m",
    "mm",
    "cm",
    "dm",
    "um",
    "nm",
    "km",
    "in",
    "ft",
    "pa",
    "kpa",
    "mpa",
    "gpa",
    "psi",
    "bar",
    "mbar",
    "dbar",
    "n/mm2",
    "kg/m3",
    "g/cm3",
    "g/ml",
    "g/cc",
    "kg/l",
    "g/l",
    "mg/cm3",
    "g/cm2",
    "g",
    "kg",
    "c",
    "\u{b0}c",
    "degc",
    "celsius",
    "k",
    "kelvin",
    "\u{b0}f",
    "degf",
    "f",
    "hz",
    "khz",
    "mhz",
    "ghz",
    "db",
    "db/cm",
    "db/mhz",
    "db/cm/mhz",
    "v",
    "mv",
    "uv",
    "%",
    "psu",
    "ppt",
    "deg",
    "\u{b0}",
    "rad",
    "years",
    "yr",
    "ms/cm",
];
/// Spelled words, and the unit in short.
const SPELLED: [(&str, &str); 22] = [
    ("millimeters", "mm"),
    ("millimetres", "mm"),
    ("kilometers", "km"),
    ("kilometres", "km"),
    ("kilometer", "km"),
    ("kilometre", "km"),
    ("millimeter", "mm"),
    ("millimetre", "mm"),
    ("meters", "m"),
    ("metres", "m"),
    ("meter", "m"),
    ("metre", "m"),
    ("microseconds", "us"),
    ("microsecond", "us"),
    ("seconds", "s"),
    ("second", "s"),
    ("usec", "us"),
    ("msec", "ms"),
    ("sec", "s"),
    ("feet", "ft"),
    ("per", "/"),
    ("\u{7c73}/\u{79d2}", "m/s"),
];

/// Returns a text in lower case, with one form of each letter and without what only decorates.
pub(super) fn folded(text: &str) -> String {
    let one = |c: char| match c {
        '\u{3bc}' => 'u',
        '\u{2212}' | '\u{2013}' => '-',
        '\u{22c5}' | '\u{2219}' | '\u{30fb}' => '\u{b7}',
        '\u{2215}' | '\u{2044}' => '/',
        other => other,
    };
    // NFKC makes the micro sign the Greek letter, and a superscript its digit.
    text.nfkc().flat_map(char::to_lowercase).map(one).collect()
}

/// Returns the unit of velocity that a text is, if a job file can name it.
pub(super) fn of_velocity(text: &str) -> Option<VelocityUnit> {
    match of_text(text) {
        Some(NamedUnit::Velocity(unit)) => Some(unit),
        _ => None,
    }
}

/// Returns the unit that a text is, with or without brackets around it.
pub(super) fn of_text(text: &str) -> Option<NamedUnit> {
    if text.len() > 80 {
        return None;
    }
    let text = folded(text);
    let text = text.trim().trim_matches(['(', ')', '[', ']', '{', '}', '<', '>', ' ']);
    let short = shortened(text);
    match short.as_str() {
        "m/s" | "mps" => Some(NamedUnit::Velocity(VelocityUnit::MetrePerSecond)),
        "km/s" => Some(NamedUnit::Velocity(VelocityUnit::KilometrePerSecond)),
        "mm/us" => Some(NamedUnit::Velocity(VelocityUnit::MillimetrePerMicrosecond)),
        "mph" | "fps" | "kmh" | "kph" => Some(NamedUnit::OtherVelocity),
        other => {
            let is_thousand = |factor: &str| other.strip_prefix(factor) == Some("m/s");
            if THOUSAND.iter().any(|factor| is_thousand(factor)) {
                return Some(NamedUnit::Velocity(VelocityUnit::KilometrePerSecond));
            }
            let parts = other.split_once('/');
            let is_velocity = parts
                .is_some_and(|(length, time)| LENGTHS.contains(&length) && TIMES.contains(&time));
            if is_velocity {
                return Some(NamedUnit::OtherVelocity);
            }
            OTHERS.contains(&other).then_some(NamedUnit::Other)
        }
    }
}

/// Returns a unit without blanks and spelled words, with a stroke in place of a power.
fn shortened(text: &str) -> String {
    let mut text = text.to_owned();
    for (spelled, short) in SPELLED {
        text = text.replace(spelled, short);
    }
    // Cyrillic letters of metre, second, kilo and micro.
    for (letter, short) in
        [("\u{43c}\u{43a}\u{441}", "us"), ("\u{43c}", "m"), ("\u{441}", "s"), ("\u{43a}", "k")]
    {
        text = text.replace(letter, short);
    }
    let text: String = text
        .chars()
        .filter(|c| {
            !c.is_whitespace() && !['^', '*', '\u{b7}', '.', '{', '}', '\\', '$'].contains(c)
        })
        .collect();
    if let Some(powers) = text.strip_suffix("-1") {
        for length in LENGTHS {
            let time = powers.strip_prefix(length).map(|rest| rest.trim_start_matches('/'));
            if let Some(time) = time.filter(|time| TIMES.contains(time)) {
                return format!("{length}/{time}");
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_read_as_people_write_it() {
        let check =
            |text: &str, expected: Option<NamedUnit>| assert_eq!(of_text(text), expected, "{text}");
        let velocity = |unit| Some(NamedUnit::Velocity(unit));
        for text in [
            "m/s",
            "M/SEC",
            "[m/s]",
            "(m s-1)",
            "m\u{b7}s\u{207b}\u{b9}",
            "ms^-1",
            "m.s-1",
            "m s^-1",
            "m / s",
            "Meters per Second",
            "metres/second",
            "\u{43c}/\u{441}",
            "\u{7c73}/\u{79d2}",
            "mps",
            "m/sec.",
        ] {
            check(text, velocity(VelocityUnit::MetrePerSecond));
        }
        for text in ["km/s", "km s-1", "kms-1", "\u{43a}\u{43c}/\u{441}", "Km/s"] {
            check(text, velocity(VelocityUnit::KilometrePerSecond));
        }
        for text in [
            "mm/us",
            "mm/\u{b5}s",
            "mm/\u{3bc}s",
            "mm us-1",
            "\u{43c}\u{43c}/\u{43c}\u{43a}\u{441}",
        ] {
            check(text, velocity(VelocityUnit::MillimetrePerMicrosecond));
        }
        for text in ["ft/s", "cm/us", "mm/s", "km/h"] {
            check(text, Some(NamedUnit::OtherVelocity));
        }
        for text in ["MPa", "[us]", "\u{b5}s", "\u{b0}C", "kHz", "kg/m\u{b3}", "dB/cm", "%"] {
            check(text, Some(NamedUnit::Other));
        }
        for text in ["", "velocity", "no sensor", "m/", "a/s"] {
            check(text, None);
        }
    }
}
