//! Measured velocities from a CSV file.
//!
//! The first line that is neither empty nor a comment (`#`) names the columns; `velocity` (m/s)
//! is one of them, another one may name the group of each; others are not looked at. Fields may be
//! quoted, but hold no line break.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::check::{VELOCITIES_MIN, VELOCITY};
use crate::file_error::{read_bytes, without_byte_order_mark};
use crate::job::Group;
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
    #[error("no column `{column}`; the header has {columns}")]
    NoColumn { column: String, columns: String },
    #[error("the header has the column `{column}` twice")]
    RepeatedColumn { column: String },
    #[error("{column} is empty; it must name the group of the velocity")]
    NoGroup { column: String },
    #[error(
        "no group of the column `{column}` has two velocities that differ; a coefficient of variation \
         needs at least two different ones"
    )]
    NoVariation { column: String },
    #[error("has more than {} groups", limits::GROUPS_MAX)]
    TooManyGroups,
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
    let rows = rows_of(path, None)?;
    Ok(rows.into_iter().map(|(_, velocity)| velocity).collect())
}

/// The velocities of the CSV file at `path`, m/s, by the names in its column `column`: groups in the
/// order in which they begin, velocities in that of the file.
///
/// # Errors
/// As [`read`].
pub(crate) fn read_groups(path: &Path, column: &str) -> Result<Vec<Group>, Vec<CsvError>> {
    let mut groups: Vec<Group> = Vec::new();
    let mut places: BTreeMap<String, usize> = BTreeMap::new();
    let whole = |problem| vec![CsvError { path: path.to_owned(), line: None, problem }];
    for (name, velocity) in rows_of(path, Some(column))? {
        let place = places.get(&name).copied().unwrap_or_else(|| {
            groups.push(Group { name: name.clone(), velocities: Vec::new() });
            places.insert(name, groups.len() - 1);
            groups.len() - 1
        });
        groups[place].velocities.push(velocity);
        if groups.len() > limits::GROUPS_MAX {
            return Err(whole(Problem::TooManyGroups));
        }
    }
    if groups.iter().all(|group| group.no_variation().is_some()) {
        return Err(whole(Problem::NoVariation { column: shortened(column) }));
    }
    Ok(groups)
}

/// Name of the group (empty without a `column` of them) and velocity of each row.
fn rows_of(path: &Path, column: Option<&str>) -> Result<Vec<(String, f64)>, Vec<CsvError>> {
    let located = |(line, problem)| CsvError { path: path.to_owned(), line, problem };
    text_of(path)
        .map_err(|located| vec![located])
        .and_then(|text| parse(&text, column))
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

fn parse(text: &str, group: Option<&str>) -> Result<Vec<(String, f64)>, Vec<Located>> {
    let mut lines = without_byte_order_mark(text)
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line))
        .filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
    let Some((number, header)) = lines.next() else {
        return Err(vec![(None, Problem::Empty)]);
    };
    let columns = Columns::of(header, group).map_err(|problem| vec![(Some(number), problem)])?;
    let mut velocities = Vec::new();
    let mut problems = Vec::new();
    for (number, line) in lines {
        match columns.row(line) {
            Ok(row) => velocities.push(row),
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

/// Where velocity and group stand in each row.
struct Columns {
    count: usize,
    velocity: usize,
    /// With its name.
    group: Option<(usize, String)>,
}

impl Columns {
    fn of(header: &str, group: Option<&str>) -> Result<Self, Problem> {
        let names = fields(header)?;
        if !names.iter().any(|name| name == COLUMN)
            && names.iter().all(|name| name.parse::<f64>().is_ok())
        {
            return Err(Problem::NoHeader);
        }
        let group = match group {
            Some(column) => Some((place_of(column, &names)?, column.to_owned())),
            None => None,
        };
        Ok(Self { count: names.len(), velocity: place_of(COLUMN, &names)?, group })
    }

    /// Name of the group, and the velocity.
    fn row(&self, line: &str) -> Result<(String, f64), Problem> {
        let mut fields = fields(line)?;
        if fields.len() != self.count {
            return Err(Problem::FieldCount { found: fields.len(), expected: self.count });
        }
        let velocity = velocity(&fields[self.velocity])?;
        let Some((place, column)) = &self.group else {
            return Ok((String::new(), velocity));
        };
        match std::mem::take(&mut fields[*place]) {
            name if name.is_empty() => Err(Problem::NoGroup { column: shortened(column) }),
            name => Ok((name, velocity)),
        }
    }
}

fn place_of(column: &str, names: &[String]) -> Result<usize, Problem> {
    let mut found = names.iter().enumerate().filter(|(_, name)| name.as_str() == column);
    let column = || shortened(column);
    match (found.next(), found.next()) {
        (Some((place, _)), None) => Ok(place),
        (Some(_), Some(_)) => Err(Problem::RepeatedColumn { column: column() }),
        (None, _) => Err(Problem::NoColumn { column: column(), columns: listed(names) }),
    }
}

fn velocity(field: &str) -> Result<f64, Problem> {
    match field.parse::<f64>() {
        Ok(velocity) if VELOCITY.contains(velocity) => Ok(velocity),
        Ok(found) => Err(Problem::Refused { found }),
        Err(_) if field.is_empty() => Err(Problem::NoNumber),
        Err(_) => Err(Problem::NotANumber { found: shortened(field) }),
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
