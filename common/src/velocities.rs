//! Measured velocities from a CSV file.
//!
//! The first line that is neither empty nor a comment (`#`) names the columns; `velocity` (m/s)
//! is one of them, others are not looked at. Fields may be quoted, but hold no line break.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::check::{VELOCITIES_MIN, VELOCITY};
use crate::file_error::{read_bytes, without_byte_order_mark};
use crate::limits;

/// The column that is read.
const COLUMN: &str = "velocity";
/// Most bad lines that are reported one by one.
const REPORTED_MAX: usize = 10;

/// One thing wrong with a CSV file of velocities.
#[derive(Debug, Error)]
#[error("{}{}: {problem}", .path.display(), .line.map(|line| format!(", line {line}")).unwrap_or_default())]
pub(crate) struct CsvError {
    path: PathBuf,
    line: Option<usize>,
    problem: Problem,
}

#[derive(Debug, Error)]
enum Problem {
    #[error("cannot be read: {0} (its path is relative to the job file)")]
    Unreadable(std::io::Error),
    #[error("is longer than {} bytes", limits::FILE_BYTES_MAX)]
    TooLarge,
    #[error("is not UTF-8 text")]
    NotUtf8,
    #[error("has no header; its first line must name the columns, one of them `{COLUMN}`")]
    Empty,
    #[error("is no header; it must name the columns, one of them `{COLUMN}`")]
    NoHeader,
    #[error("no column `{COLUMN}`; the header has {columns}")]
    NoColumn { columns: String },
    #[error("the header has the column `{COLUMN}` twice")]
    RepeatedColumn,
    #[error("the number of fields is {found}; the header has {expected}")]
    FieldCount { found: usize, expected: usize },
    #[error("a quote is not closed, or stands inside a field")]
    Quote,
    #[error("velocity is empty; it must be a number above 0 (m/s)")]
    NoNumber,
    #[error("velocity is {found:?}; it must be a number above 0 (m/s)")]
    NotANumber { found: String },
    #[error("velocity {}", VELOCITY.refusal(*.found))]
    Refused { found: f64 },
    #[error("has no rows; a coefficient of variation needs at least two velocities")]
    NoRows,
    #[error("has one velocity; a coefficient of variation needs at least two")]
    OneRow,
    #[error("has more than {} velocities", limits::DATA_VELOCITIES_MAX)]
    TooMany,
    #[error("more lines are wrong, not listed here")]
    More,
}

/// The velocities of the CSV file at `path`, m/s, in its order.
///
/// # Errors
/// Everything that is wrong with it, up to [`REPORTED_MAX`] lines.
pub(crate) fn read(path: &Path) -> Result<Vec<f64>, Vec<CsvError>> {
    let located = |(line, problem)| CsvError { path: path.to_owned(), line, problem };
    text_of(path)
        .map_err(|located| vec![located])
        .and_then(|text| parse(&text))
        .map_err(|problems| problems.into_iter().map(located).collect())
}

fn text_of(path: &Path) -> Result<String, Located> {
    let bytes = read_bytes(path).map_err(|error| (None, Problem::Unreadable(error)))?;
    let bytes = bytes.ok_or((None, Problem::TooLarge))?;
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
        (Some(line), Problem::NotUtf8)
    })
}

type Located = (Option<usize>, Problem);

fn parse(text: &str) -> Result<Vec<f64>, Vec<Located>> {
    let mut lines = without_byte_order_mark(text)
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line))
        .filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
    let Some((number, header)) = lines.next() else {
        return Err(vec![(None, Problem::Empty)]);
    };
    let columns = Columns::of(header).map_err(|problem| vec![(Some(number), problem)])?;
    let mut velocities = Vec::new();
    let mut problems = Vec::new();
    for (number, line) in lines {
        match columns.velocity(line) {
            Ok(velocity) => velocities.push(velocity),
            Err(problem) => problems.push((Some(number), problem)),
        }
        if problems.len() > REPORTED_MAX {
            problems.pop();
            problems.push((None, Problem::More));
            return Err(problems);
        }
        if velocities.len() > limits::DATA_VELOCITIES_MAX {
            return Err(vec![(None, Problem::TooMany)]);
        }
    }
    if problems.is_empty() && velocities.len() < VELOCITIES_MIN {
        problems
            .push((None, if velocities.is_empty() { Problem::NoRows } else { Problem::OneRow }));
    }
    if problems.is_empty() { Ok(velocities) } else { Err(problems) }
}

/// Where the velocity stands in each row.
struct Columns {
    count: usize,
    velocity: usize,
}

impl Columns {
    fn of(header: &str) -> Result<Self, Problem> {
        let names = fields(header)?;
        let mut found = names.iter().enumerate().filter(|(_, name)| name.as_str() == COLUMN);
        match (found.next(), found.next()) {
            (Some((velocity, _)), None) => Ok(Self { count: names.len(), velocity }),
            (Some(_), Some(_)) => Err(Problem::RepeatedColumn),
            (None, _) if names.iter().all(|name| name.parse::<f64>().is_ok()) => {
                Err(Problem::NoHeader)
            }
            (None, _) => Err(Problem::NoColumn { columns: listed(&names) }),
        }
    }

    fn velocity(&self, line: &str) -> Result<f64, Problem> {
        let fields = fields(line)?;
        if fields.len() != self.count {
            return Err(Problem::FieldCount { found: fields.len(), expected: self.count });
        }
        let field = &fields[self.velocity];
        match field.parse::<f64>() {
            Ok(velocity) if VELOCITY.contains(velocity) => Ok(velocity),
            Ok(found) => Err(Problem::Refused { found }),
            Err(_) if field.is_empty() => Err(Problem::NoNumber),
            Err(_) => Err(Problem::NotANumber { found: shortened(field) }),
        }
    }
}

/// The fields of one line, without surrounding space and quotes.
fn fields(line: &str) -> Result<Vec<String>, Problem> {
    let mut fields = Vec::new();
    let mut rest = line;
    loop {
        let (field, after) = match rest.trim_start().strip_prefix('"') {
            Some(quoted) => quoted_field(quoted)?,
            None => {
                let end = rest.find(',').unwrap_or(rest.len());
                if rest[..end].contains('"') {
                    return Err(Problem::Quote);
                }
                (rest[..end].trim().to_owned(), &rest[end..])
            }
        };
        fields.push(field);
        match after.strip_prefix(',') {
            Some(next) => rest = next,
            None => return Ok(fields),
        }
    }
}

/// A field whose opening quote is behind us, and what follows its closing one: nothing or a comma.
fn quoted_field(mut rest: &str) -> Result<(String, &str), Problem> {
    let mut field = String::new();
    loop {
        let (before, after) = rest.split_once('"').ok_or(Problem::Quote)?;
        field.push_str(before);
        // A doubled quote stands for one.
        if let Some(after) = after.strip_prefix('"') {
            field.push('"');
            rest = after;
            continue;
        }
        let after = after.trim_start();
        if after.is_empty() || after.starts_with(',') {
            return Ok((field.trim().to_owned(), after));
        }
        return Err(Problem::Quote);
    }
}

/// Most characters of a file's text that a message repeats.
const SHOWN_CHARACTERS_MAX: usize = 60;

fn shortened(text: &str) -> String {
    text.chars().take(SHOWN_CHARACTERS_MAX).collect()
}

fn listed(names: &[String]) -> String {
    let names: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
    shortened(&names.join(", "))
}
