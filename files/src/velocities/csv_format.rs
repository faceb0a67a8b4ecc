//! How a CSV file of velocities is written: the keys of `[data]` that say so.

use encoding_rs::Encoding;
use osteon_common::fields::Choice;

/// How a file is written, as far as keys say it.
#[derive(Debug, Clone, Default)]
pub(crate) struct CsvFormat {
    pub(crate) separator: Option<Separator>,
    pub(crate) decimal: Option<DecimalMark>,
    /// Name of the column of velocities.
    pub(crate) column: Option<String>,
    pub(crate) unit: Option<VelocityUnit>,
    /// Texts that stand for a value that is missing; a row with one of them is left out.
    pub(crate) missing: Option<Vec<String>>,
    /// The encoding. A byte order mark takes precedence.
    pub(crate) encoding: Option<&'static Encoding>,
    /// Number of lines above the header that are not looked at.
    pub(crate) skip_lines: Option<usize>,
    /// Line of the header, from 1; 0 if there is none.
    pub(crate) header_line: Option<usize>,
    /// Whether what no key says is found out. Otherwise it is as documented: a header in the first
    /// line, commas, decimal points, the column `velocity` in m/s, UTF-8.
    pub(crate) is_found_out: bool,
}

impl CsvFormat {
    /// Returns whether a key was given.
    pub(super) fn has(&self, key: &str) -> bool {
        match key {
            "separator" => self.separator.is_some(),
            "decimal" => self.decimal.is_some(),
            "column" => self.column.is_some(),
            "unit" => self.unit.is_some(),
            "missing" => self.missing.is_some(),
            "encoding" => self.encoding.is_some(),
            "header_line" => self.header_line.is_some() || self.skip_lines.is_some(),
            _ => false,
        }
    }
}

/// The character between the fields of a line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Separator {
    #[default]
    Comma,
    Semicolon,
    Tab,
    Bar,
    /// One or more blanks.
    Space,
    /// Two or more blanks: names and texts may have one between their words.
    Spaces,
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
    pub(crate) const ALL: [Self; 6] =
        [Self::Comma, Self::Semicolon, Self::Tab, Self::Bar, Self::Space, Self::Spaces];

    /// Returns the name in a job file.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Comma => ",",
            Self::Semicolon => ";",
            Self::Tab => "tab",
            Self::Bar => "|",
            Self::Space => "space",
            Self::Spaces => "spaces",
        }
    }

    /// Returns what separates the fields, in words.
    pub(crate) fn described(self) -> &'static str {
        match self {
            Self::Comma => "commas",
            Self::Semicolon => "semicolons",
            Self::Tab => "tabs",
            Self::Bar => "vertical bars",
            Self::Space => "blanks",
            Self::Spaces => "two or more blanks",
        }
    }

    /// Returns the character between two fields; `None` for blanks, of which there may be any number.
    pub(super) fn character(self) -> Option<char> {
        match self {
            Self::Comma => Some(','),
            Self::Semicolon => Some(';'),
            Self::Tab => Some('\t'),
            Self::Bar => Some('|'),
            Self::Space | Self::Spaces => None,
        }
    }

    /// Returns the separator that a line `sep=…` names, which spreadsheets write above the header.
    pub(crate) fn of_first_line(line: &str) -> Option<Self> {
        let mut named = line.trim_matches([' ', '"', '\r']).strip_prefix("sep=")?.chars();
        let (character, None) = (named.next()?, named.next()) else { return None };
        Self::ALL.into_iter().find(|separator| separator.character() == Some(character))
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

    /// Returns the other mark.
    pub(super) fn other(self) -> Self {
        match self {
            Self::Point => Self::Comma,
            Self::Comma => Self::Point,
        }
    }

    /// Returns the character.
    pub(super) fn character(self) -> char {
        match self {
            Self::Point => '.',
            Self::Comma => ',',
        }
    }

    /// Reads a plain number, without marks of thousands or a unit.
    pub(super) fn number(self, text: &str) -> Option<f64> {
        match self {
            Self::Point => text.parse().ok(),
            Self::Comma if text.contains('.') => None,
            Self::Comma => text.replacen(',', ".", 1).parse().ok(),
        }
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

    /// Returns the velocity of one such unit, m/s.
    pub(super) fn factor(self) -> f64 {
        match self {
            Self::MetrePerSecond => 1.0,
            Self::KilometrePerSecond | Self::MillimetrePerMicrosecond => 1000.0,
        }
    }

    /// Returns the power of ten that makes a value one in m/s.
    pub(super) fn power(self) -> i32 {
        match self {
            Self::MetrePerSecond => 0,
            Self::KilometrePerSecond | Self::MillimetrePerMicrosecond => 3,
        }
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
        Self::ALL.into_iter().find(|one| one.name() == text || one.character().is_some_and(|character| text == character.to_string()))
    },
    DecimalMark: |text| Self::ALL.into_iter().find(|one| one.name() == text),
    VelocityUnit: Self::of_text
}

#[cfg(test)]
mod tests {
    use super::*;

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
