//! How a CSV file of velocities is written: the keys of `[data]` that say so.

use encoding_rs::Encoding;
use osteon_common::fields::Choice;

/// How a file is written. The default is that of files that need no further word: UTF-8, commas,
/// decimal points, the column `velocity` in m/s.
#[derive(Debug, Clone, Default)]
pub(crate) struct CsvFormat {
    /// The separator of fields; `None` for that of a first line `sep=…`, or else a comma.
    pub(crate) separator: Option<Separator>,
    pub(crate) decimal: DecimalMark,
    /// Name of the column of velocities, if it is not `velocity`.
    pub(crate) column: Option<String>,
    pub(crate) unit: VelocityUnit,
    /// Texts that stand for a value that is missing; a row with one of them is left out.
    pub(crate) missing: Vec<String>,
    /// The encoding; `None` for UTF-8. A byte order mark takes precedence.
    pub(crate) encoding: Option<&'static Encoding>,
}

/// The character between the fields of a line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Separator {
    #[default]
    Comma,
    Semicolon,
    Tab,
    Bar,
}

/// The character before the decimals.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum DecimalMark {
    #[default]
    Point,
    Comma,
}

/// Unit of the velocities of a file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum VelocityUnit {
    #[default]
    MetrePerSecond,
    KilometrePerSecond,
    MillimetrePerMicrosecond,
}

impl Separator {
    pub(crate) const ALL: [Self; 4] = [Self::Comma, Self::Semicolon, Self::Tab, Self::Bar];

    /// Returns the name in a job file.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Comma => ",",
            Self::Semicolon => ";",
            Self::Tab => "tab",
            Self::Bar => "|",
        }
    }

    /// Returns the character.
    pub(crate) fn character(self) -> char {
        match self {
            Self::Comma => ',',
            Self::Semicolon => ';',
            Self::Tab => '\t',
            Self::Bar => '|',
        }
    }

    /// Returns the separator that a line `sep=…` names, which spreadsheets write above the header.
    pub(crate) fn of_first_line(line: &str) -> Option<Self> {
        let mut named = line.trim_matches([' ', '"', '\r']).strip_prefix("sep=")?.chars();
        let (character, None) = (named.next()?, named.next()) else { return None };
        Self::ALL.into_iter().find(|separator| separator.character() == character)
    }
}

impl DecimalMark {
    pub(crate) const ALL: [Self; 2] = [Self::Point, Self::Comma];

    /// Returns the name in a job file.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Point => ".",
            Self::Comma => ",",
        }
    }

    /// Reads a number.
    pub(crate) fn number(self, text: &str) -> Option<f64> {
        self.scaled(text, 0)
    }

    /// Reads a number times a power of ten, rounded once: 3.9105 km/s is 3910.5 m/s to the bit.
    fn scaled(self, text: &str, power: i32) -> Option<f64> {
        let mut text = text.to_owned();
        if self == Self::Comma {
            if text.contains('.') {
                return None;
            }
            text = text.replacen(',', ".", 1);
        }
        let at = text.find(['e', 'E']).unwrap_or(text.len());
        let (digits, exponent) = text.split_at(at);
        if power == 0 || !digits.ends_with(|last: char| last.is_ascii_digit() || last == '.') {
            return text.parse().ok();
        }
        let exponent: i32 = match exponent.get(1..) {
            Some(exponent) => exponent.parse().ok()?,
            None => 0,
        };
        format!("{digits}e{}", exponent.checked_add(power)?).parse().ok()
    }
}

impl VelocityUnit {
    pub(crate) const ALL: [Self; 3] =
        [Self::MetrePerSecond, Self::KilometrePerSecond, Self::MillimetrePerMicrosecond];

    /// Returns the name in a job file.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::MetrePerSecond => "m/s",
            Self::KilometrePerSecond => "km/s",
            Self::MillimetrePerMicrosecond => "mm/us",
        }
    }

    /// Returns the unit that a user wrote, with any of the characters for micro.
    pub(crate) fn of_text(text: &str) -> Option<Self> {
        let text = text.trim().replace(['\u{b5}', '\u{3bc}'], "u");
        Self::ALL.into_iter().find(|unit| unit.name() == text)
    }

    /// Returns the power of ten that makes a value one in m/s.
    fn power(self) -> i32 {
        match self {
            Self::MetrePerSecond => 0,
            Self::KilometrePerSecond | Self::MillimetrePerMicrosecond => 3,
        }
    }

    /// Reads a velocity, and returns it in m/s.
    pub(crate) fn velocity(self, text: &str, decimal: DecimalMark) -> Option<f64> {
        decimal.scaled(text, self.power())
    }
}

/// Implements [`Choice`] for types with a constant `ALL`, a method `name` and a way to read it.
macro_rules! choices {
    ($($type:ty: $read:expr),+) => {$(
        impl Choice for $type {
            fn names(&self) -> Vec<&'static str> {
                Self::ALL.map(Self::name).to_vec()
            }

            fn name(&self) -> &'static str {
                Self::name(*self)
            }

            fn choose(&mut self, name: &str) -> bool {
                let read: fn(&str) -> Option<Self> = $read;
                read(name).inspect(|&value| *self = value).is_some()
            }
        }
    )+};
}

choices! {
    Separator: |text| {
        Self::ALL.into_iter().find(|one| one.name() == text || text == one.character().to_string())
    },
    DecimalMark: |text| Self::ALL.into_iter().find(|one| one.name() == text),
    VelocityUnit: Self::of_text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_velocity_is_the_same_to_the_bit_in_every_unit_and_with_every_mark() {
        let check = |unit: VelocityUnit, decimal, text: &str, expected: Option<f64>| {
            assert_eq!(unit.velocity(text, decimal), expected, "{unit:?} {text}");
        };
        let (point, comma) = (DecimalMark::Point, DecimalMark::Comma);
        for unit in [VelocityUnit::KilometrePerSecond, VelocityUnit::MillimetrePerMicrosecond] {
            check(unit, point, "3.9105", Some(3910.5));
            check(unit, comma, "3,9105", Some(3910.5));
            check(unit, point, "4", Some(4000.0));
            check(unit, point, "4.", Some(4000.0));
            check(unit, point, "39105e-4", Some(3910.5));
            check(unit, point, "39.1E-1", Some(3910.0));
            check(unit, point, "1e2147483647", None);
            check(unit, point, "3,9105", None);
            check(unit, comma, "3.910,5", None);
            check(unit, point, "", None);
            check(unit, point, "-3.9", Some(-3900.0));
        }
        check(VelocityUnit::MetrePerSecond, comma, "3910,5", Some(3910.5));
        check(VelocityUnit::MetrePerSecond, comma, "3,910,5", None);
        check(VelocityUnit::KilometrePerSecond, point, "inf", Some(f64::INFINITY));
        for k in 1000..3000 {
            let text = format!("{:.4}", f64::from(k) / 700.0);
            let expected = format!("{text}e3").parse().ok();
            check(VelocityUnit::KilometrePerSecond, point, &text, expected);
        }
    }

    #[test]
    fn names_are_read_as_people_write_them() {
        for text in ["mm/us", "mm/\u{b5}s", "mm/\u{3bc}s"] {
            assert_eq!(VelocityUnit::of_text(text), Some(VelocityUnit::MillimetrePerMicrosecond));
        }
        assert_eq!(VelocityUnit::of_text("cm/s"), None);
        let mut separator = Separator::Comma;
        for (name, expected) in [
            ("\t", Separator::Tab),
            ("tab", Separator::Tab),
            (";", Separator::Semicolon),
            ("|", Separator::Bar),
        ] {
            assert!(separator.choose(name));
            assert_eq!(separator, expected);
        }
        assert!(!separator.choose("semicolon"));
        for (line, expected) in [
            ("sep=;", Some(Separator::Semicolon)),
            ("\"sep=;\"", Some(Separator::Semicolon)),
            ("sep=\t", Some(Separator::Tab)),
            ("sep=", None),
            ("sep=;;", None),
            ("velocity", None),
        ] {
            assert_eq!(Separator::of_first_line(line), expected, "{line}");
        }
    }
}
