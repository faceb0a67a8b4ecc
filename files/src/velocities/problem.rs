//! Faults of a CSV file of velocities, and of its lines.

use std::io;

use osteon_common::check::VELOCITY;
use osteon_common::observables::Observable;
use osteon_common::{limits, visible};
use thiserror::Error;

use super::column_choice::POSSIBLE;
use super::csv_format::DecimalMark;

/// The column of the velocities, if no key names another.
pub(super) const COLUMN: &str = "velocity";
/// Maximum number of characters of a file's text that a message quotes.
const SHOWN_CHARACTERS_MAX: usize = 60;

/// A fault and its line, from 1.
pub(super) type LocatedProblem = (Option<usize>, Problem);

/// A fault. Its message completes a sentence that begins with the file or the line.
#[derive(Debug, Error)]
pub(crate) enum Problem {
    #[error("cannot be read: {0}")]
    Unreadable(io::Error),
    #[error("is longer than {} bytes", limits::FILE_BYTES_MAX)]
    TooLarge,
    #[error(
        "is longer than {} bytes; a line has the fields of one velocity",
        limits::LINE_BYTES_MAX
    )]
    LongLine,
    #[error("is {what}; {cure}")]
    OtherKind { what: &'static str, cure: &'static str },
    #[error("is {what} that cannot be read: {reason}; save the table as CSV")]
    Damaged { what: &'static str, reason: String },
    #[error("unpacks to more than {bytes} bytes; save the table as CSV")]
    UnpackedTooLarge { bytes: u64 },
    #[error("is {what} without a vector of numbers; save the velocities as one, or as CSV")]
    NoVectors { what: &'static str },
    #[error(
        "has the data set `{name}` with the attribute {attribute:?}, which is not read: write the velocities as they are, in \
         m/s and without it, or as CSV"
    )]
    Attribute { name: String, attribute: &'static str },
    #[error("has a character 0 inside of the line, which is no text; the file is damaged")]
    Nul,
    #[error(
        "is not UTF-8 text, and its encoding is not clear; give it: [data] encoding = \"windows-1252\" (Western \
         Europe), \"windows-1251\" (Cyrillic), \"shift_jis\", \"gbk\", …"
    )]
    UnknownEncoding,
    #[error(
        "is not UTF-8 text; give its encoding: [data] encoding = \"windows-1252\" (Western Europe, Latin-1), \
         \"utf-16le\", … or save it as UTF-8"
    )]
    NotUtf8,
    #[error("has no header; its first line must name the columns, one of them `{COLUMN}`")]
    Empty,
    #[error("is not a header; it must name the columns, one of them `{COLUMN}`")]
    NoHeader,
    #[error("no column `{column}`; the header has {columns}")]
    NoColumn { column: String, columns: String },
    #[error(
        "no column is clearly that of the velocities; the header has {columns}. If one is, name it: [data] column \
         = \"…\" (and its unit)"
    )]
    NoVelocities { columns: String },
    #[error(
        "no column is one of velocities, but `{distance}` and `{time}` are a distance and a time: write \
         their quotient into a column `velocity`"
    )]
    DistanceAndTime { distance: String, time: String },
    #[error(
        "several columns may be the velocities: {columns}; say which: [data] column = {first:?}, …"
    )]
    SeveralColumns { first: String, columns: String },
    #[error(
        "begins with numbers, and no line above names the columns: write the names above them, such as \
         `velocity`, or say which column it is: [data] header_line = 0, column = \"1\", …"
    )]
    OnlyNumbers,
    #[error(
        "has names of columns again, others than in line {first}: these are two tables; write them into \
         two files, or leave one of them out"
    )]
    TwoTables { first: usize, second: usize },
    #[error("{first} and {second} both have velocities; save the one as CSV")]
    SeveralTables { first: String, second: String },
    #[error(
        "the column `{column}` has another unit of velocity than m/s, km/s and mm/us; convert it to one of these"
    )]
    OtherUnit { column: String },
    #[error(
        "the unit of the column `{column}` is none of velocities that is known; if it has these, say it: [data] column = \
         {column:?}, unit = \"m/s\""
    )]
    UnknownUnit { column: String },
    #[error(
        "the column of units has {found:?}; write all velocities in one unit: m/s, km/s or mm/us ([data] unit)"
    )]
    UnitBeside { found: String },
    #[error(
        "begins with {found:?}: if it is a comment, begin it with # (such lines are not read), and otherwise delete \
         that mark"
    )]
    LikeComment { found: String },
    #[error(
        "the numbers of the column `{column}` are counted one by one, and no velocities; say which column has \
         these: [data] column = \"…\""
    )]
    Counted { column: String },
    #[error(
        "each line may be one number with a decimal comma, or two: [data] decimal = \",\", separator = \";\" if it is \
         one, and otherwise write a name for each column"
    )]
    OneOrTwoNumbers,
    #[error(
        "the velocity is {found:?}, and {next:?} behind it may be its decimals: quote such numbers, or separate the \
         fields by semicolons: [data] separator = \";\", decimal = \",\""
    )]
    SplitNumber { found: String, next: String },
    #[error(
        "the velocities are whole numbers (median {median}), and their decimals may stand in the next column: quote \
         such numbers, or separate the fields by semicolons: [data] separator = \";\""
    )]
    WholeNumbers { median: f64 },
    #[error(
        "has {found:?}, so that rows say what they are of: write the velocities of bone into a column of their own, and \
         name it: [data] column = \"…\""
    )]
    NamedInRows { found: String },
    #[error(
        "the column `{column}` has {found:?} directly below its name: write a header of one line; or if that stands for \
         a missing value: [data] missing = [{found:?}]"
    )]
    NameBelow { column: String, found: String },
    #[error(
        "velocity is {found:?}: if the sign is a direction, leave it out in the file; if it stands for a missing \
         value: [data] missing = [{found:?}]"
    )]
    Negative { found: String },
    #[error(
        "velocity is {found:?}, far from the others, as a code for a missing value is: if it is one, [data] missing = \
         [{found:?}]; otherwise write it with decimals"
    )]
    LikeCode { found: String },
    #[error(
        "the column `{column}` has the median {median} where its unit is {unit}: no velocity of bone; say which \
         is wrong: [data] unit = \"m/s\" or \"km/s\" (or column = \"…\")"
    )]
    OtherSize { column: String, median: f64, unit: &'static str },
    #[error(
        "the median of the column `{column}` is {median}; velocities of bone are 1000 to 8000 m/s, and no \
         unit is said: [data] unit = \"m/s\", \"km/s\" or \"mm/us\" (or column = \"…\")"
    )]
    NoUsualSize { column: String, median: f64 },
    #[error("the column `{column}` has {found:?}, which is no number; correct it in the file")]
    NotNumbers { column: String, found: String },
    #[error(
        "the column `{column}` has {count} different texts that are no velocity, such as {first:?}; correct these in \
         the file"
    )]
    ManyTexts { column: String, count: usize, first: String },
    #[error(
        "the velocity has another decimal mark than in line {first}; say which it is: [data] decimal = \".\" or \
         \",\", and correct the others in the file"
    )]
    TwoMarks { first: usize },
    #[error(
        "the unit below the header is {found}, and that of the job {given}: [data] unit = {found:?}"
    )]
    UnitBelow { found: &'static str, given: &'static str },
    #[error("velocity is {found:?}, and the unit is {given}; write all in one unit")]
    UnitOfCell { found: String, given: &'static str },
    #[error("{}", doubt_of_row(label, found, *.others))]
    DoubtfulSummary { label: String, found: String, others: f64 },
    #[error(
        "the velocity of {word:?} is {found:?}, and the other rows have a number in place of that word: if the \
         row is no measurement, delete it, and otherwise give it a number"
    )]
    OtherRow { word: String, found: String },
    #[error(
        "in each group of the column `{column}` the {which} row has the mean of the others: delete these rows, or, \
         if they are measurements, the column"
    )]
    GroupMeans { column: String, which: &'static str },
    #[error(
        "the velocities where `{column}` is {first:?} have a mean of {first_mean:.1} m/s, and where it is \
         {second:?} of {second_mean:.1} m/s: keep rows of one kind, or identify each by itself: [data] group = \
         {column:?}"
    )]
    DifferentThings {
        column: String,
        first: String,
        first_mean: f64,
        second: String,
        second_mean: f64,
    },
    #[error(
        "column {place} has no name, and numbers like those of `{column}` beside it: give it a name, or say which \
         column it is: [data] column = {column:?}"
    )]
    Nameless { place: usize, column: String },
    #[error(
        "a comment names {found:?} with missing values: if it stands for none, [data] missing = [{found:?}], and \
         otherwise delete the comment"
    )]
    NamedMissing { found: String },
    #[error("has too many rows that seem to sum up others; leave them out of the file")]
    ManySummaries,
    #[error(
        "has no row below the header; each must have a velocity, and none begins with #, as comments do"
    )]
    NoRowsBelow,
    #[error("the header has the column `{column}` twice")]
    RepeatedColumn { column: String },
    #[error("{column} is empty; it must name the {named} of the velocity")]
    NoName { column: String, named: &'static str },
    #[error("{column} is empty; it must be a number (SI units), the same in all rows of a group")]
    NoKnownValue { column: String },
    #[error(
        "{column} is {found:?}; it must be the {} measured with the velocity, {} (a row without one cannot \
         be used with [data] {}: leave it out of the file)",
        .observable.row().title,
        .observable.row().accepted,
        .observable.name()
    )]
    NotObserved { column: String, found: String, observable: Observable },
    #[error(
        "{column} is {found:?}; it must be the standard error of the velocity, at least 0 and in its unit (to leave out \
         rows without one: [data] missing = [\"\"])"
    )]
    NotAnError { column: String, found: String },
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
    #[error(
        "the number of fields is {found}; the header has {expected} (a field that contains the separator, or a \
         decimal comma, must stand in quotes; what is no row must begin with #)"
    )]
    FieldCount { found: usize, expected: usize },
    #[error("a quote is not closed, or stands inside a field")]
    Quote,
    #[error(
        "velocity is empty; it must be a number above 0 (to leave out rows without one: [data] missing = \
         [\"\"])"
    )]
    NoNumber,
    #[error("velocity is {found:?}; it must be a number above 0{}", cure_of_text(found, *.decimal, *.is_missing))]
    NotANumber { found: String, decimal: Option<DecimalMark>, is_missing: bool },
    #[error("velocity {}", VELOCITY.refusal(*.found))]
    Refused { found: f64 },
    #[error(
        "velocity is {found:?} m/s; no velocity of sound in bone is outside {} to {} (m/s): correct it in the file, or \
         if that stands for a missing value: [data] missing = [\"…\"]",
        POSSIBLE.start,
        POSSIBLE.end
    )]
    Impossible { found: f64 },
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

impl Problem {
    /// Returns whether no later row can mend it.
    pub(super) fn is_final(&self) -> bool {
        matches!(self, Self::TooMany | Self::TooManySubjects | Self::TooManyGroups)
    }

    /// Returns whether other keys on how the file is written may read it.
    pub(super) fn may_be_of_format(&self) -> bool {
        matches!(
            self,
            Self::NoHeader
                | Self::NoColumn { .. }
                | Self::FieldCount { .. }
                | Self::NotANumber { decimal: None, is_missing: false, .. }
                | Self::NotUtf8
        )
    }

    /// Returns whether it says that there are no velocities, rather than that they are not understood.
    pub(super) fn is_no_table(&self) -> bool {
        matches!(
            self,
            Self::NoVelocities { .. }
                | Self::DistanceAndTime { .. }
                | Self::Empty
                | Self::OnlyNumbers
                | Self::NoRowsBelow
        )
    }

    /// Returns why none of these columns is that of the velocities.
    pub(super) fn no_velocities(names: &[String]) -> Self {
        let of = |parts: &[&str]| {
            let has = |name: &&String| parts.iter().any(|part| name.to_lowercase().contains(part));
            names.iter().find(has).map(|name| shortened(name))
        };
        match (of(&["dist", "length", "abstand"]), of(&["time", "tof", "zeit"])) {
            (Some(distance), Some(time)) => Self::DistanceAndTime { distance, time },
            _ => Self::NoVelocities { columns: listed(names) },
        }
    }
}

/// Asks whether a row is a measurement.
fn doubt_of_row(label: &str, found: &str, others: f64) -> String {
    let (row, cure) = match label {
        label if label == found => (String::new(), "write it with a decimal more".to_owned()),
        "" => (String::new(), "fill its other cells".to_owned()),
        label => (format!(" of {label:?}"), "give it another name".to_owned()),
    };
    format!(
        "the velocity{row} is {found:?}, and the other rows give {others:.1}: if the row sums up others, delete \
         it from the file, and otherwise {cure}"
    )
}

/// Returns what to do with a velocity that is no number.
fn cure_of_text(found: &str, decimal: Option<DecimalMark>, is_missing: bool) -> String {
    match decimal {
        Some(mark) => {
            format!(" (if that is a decimal mark: [data] decimal = {:?})", mark.name())
        }
        None if is_missing => {
            format!(" (if that stands for a missing value: [data] missing = [{found:?}])")
        }
        None => String::new(),
    }
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
