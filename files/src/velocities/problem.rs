//! Faults of a CSV file of velocities, and of its lines.

use std::{fmt, io};

use osteon_common::check::VELOCITY;
use osteon_common::{limits, visible};
use thiserror::Error;

use super::csv_format::{DecimalMark, Separator};

/// The column of the velocities.
pub(super) const COLUMN: &str = "velocity";
/// Maximum number of characters of a file's text that a message quotes.
const SHOWN_CHARACTERS_MAX: usize = 60;

/// How to read a file that is not written as expected, at the end of a message.
#[derive(Debug)]
pub(crate) enum CsvHint {
    None,
    Separator(Separator),
    Column(String),
    Decimal(DecimalMark),
    Missing(String),
    QuotedDecimal,
}

impl fmt::Display for CsvHint {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => Ok(()),
            Self::Separator(separator) => {
                write!(formatter, "; if its fields are separated so: [data] separator = {:?}", separator.name())
            }
            Self::Column(name) => {
                write!(formatter, "; if those are the velocities: [data] column = {name:?}")
            }
            Self::Decimal(mark) => {
                write!(formatter, " (if that is a decimal mark: [data] decimal = {:?})", mark.name())
            }
            Self::Missing(text) => write!(
                formatter,
                " (if that stands for a missing value: [data] missing = [{text:?}])"
            ),
            Self::QuotedDecimal => formatter.write_str(
                " (if numbers have decimal commas: quote them, or separate fields by semicolons, and give \
                 [data] decimal = \",\")",
            ),
        }
    }
}

/// A fault. Its message completes a sentence that begins with the file or the line.
#[derive(Debug, Error)]
pub(crate) enum Problem {
    #[error("cannot be read: {0} (its path is relative to the job file)")]
    Unreadable(io::Error),
    #[error("is longer than {} bytes", limits::FILE_BYTES_MAX)]
    TooLarge,
    #[error(
        "is longer than {} bytes; a line has the fields of one velocity",
        limits::LINE_BYTES_MAX
    )]
    LongLine,
    #[error(
        "is not UTF-8 text; give its encoding: [data] encoding = \"windows-1252\" (Western Europe, Latin-1), \
         \"utf-16le\", … or save it as UTF-8"
    )]
    NotUtf8,
    #[error("has no header; its first line must name the columns, one of them `{COLUMN}`")]
    Empty,
    #[error("is not a header; it must name the columns, one of them `{COLUMN}`")]
    NoHeader,
    #[error("no column `{column}`; the header has {columns}{hint}")]
    NoColumn { column: String, columns: String, hint: CsvHint },
    #[error("the header has the column `{column}` twice")]
    RepeatedColumn { column: String },
    #[error("{column} is empty; it must name the {named} of the velocity")]
    NoName { column: String, named: &'static str },
    #[error("{column} is empty; it must be a number (SI units), the same in all rows of a group")]
    NoKnownValue { column: String },
    #[error(
        "{column} is {found:?}; it must be the decay of the velocity in dB/cm, a number from -100 to 100 (a \
         row without a decay cannot be used with [data] decay: leave it out of the file)"
    )]
    NoDecay { column: String, found: String },
    #[error(
        "{column} is {found:?}; it must be a number (SI units), the same in all rows of a group"
    )]
    NotAKnownValue { column: String, found: String },
    #[error(
        "{column} is {found:?}, and {first:?} in line {line}; all rows of the group {group:?} must have the \
         same value"
    )]
    OtherKnownValue { column: String, found: f64, first: f64, line: u32, group: String },
    #[error(
        "no group of the column `{column}` has two velocities that differ; a coefficient of variation \
         needs at least two different ones"
    )]
    NoVariation { column: String },
    #[error("has more than {} groups", limits::GROUPS_MAX)]
    TooManyGroups,
    #[error("the number of fields is {found}; the header has {expected}{hint}")]
    FieldCount { found: usize, expected: usize, hint: CsvHint },
    #[error("a quote is not closed, or stands inside a field")]
    Quote,
    #[error(
        "velocity is empty; it must be a number above 0 (to leave out rows without one: [data] missing = \
         [\"\"])"
    )]
    NoNumber,
    #[error("velocity is {found:?}; it must be a number above 0{hint}")]
    NotANumber { found: String, hint: CsvHint },
    #[error("velocity {}", VELOCITY.refusal(*.found))]
    Refused { found: f64 },
    #[error("has no rows; a coefficient of variation needs at least two velocities")]
    NoRows,
    #[error("has one velocity; a coefficient of variation needs at least two")]
    OneRow,
    #[error("has more than {} velocities", limits::DATA_VELOCITIES_MAX)]
    TooMany,
    #[error(
        "has more than {} velocities, the most that can have subjects",
        limits::DATA_SUBJECTS_MAX
    )]
    TooManySubjects,
    #[error("more lines with errors are not listed")]
    More,
}

/// Returns the beginning of a text, on one line.
pub(super) fn shortened(text: &str) -> String {
    visible::line(&text.chars().take(SHOWN_CHARACTERS_MAX).collect::<String>()).into_owned()
}

/// Returns a list of names, shortened.
pub(super) fn listed(names: &[String]) -> String {
    let names: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
    shortened(&names.join(", "))
}
