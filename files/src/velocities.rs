//! Measured velocities from a CSV file.
//!
//! The first line that is neither empty nor a comment (`#`) names the columns; `velocity` (m/s) is
//! one of them, another one may name the group of each velocity; other columns are ignored. Fields
//! may be quoted, but contain no line break.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use osteon_common::check::{VELOCITIES_MIN, VELOCITY};
use osteon_common::job::Group;
use osteon_common::origin::Origin;
use osteon_common::{limits, visible};
use thiserror::Error;

use crate::file_error::without_byte_order_mark;
use crate::user_file;

/// The column of the velocities.
const COLUMN: &str = "velocity";
/// Maximum number of bad lines that are reported individually.
const REPORTED_MAX: usize = 10;

/// Measured velocities of a file, one set or a set for each group.
#[derive(Debug)]
pub(crate) struct Measured<T> {
    /// The velocities, m/s.
    pub(crate) data: T,
    /// Their positions in the file.
    pub(crate) origin: Origin,
}

/// One error in a CSV file of velocities.
#[derive(Debug, Error)]
#[error("{}{}: {problem}", visible::path(path), .line.map(|line| format!(", line {line}")).unwrap_or_default())]
pub(crate) struct CsvError {
    path: PathBuf,
    line: Option<usize>,
    problem: Problem,
}

#[derive(Debug, Error)]
enum Problem {
    #[error("cannot be read: {0} (its path is relative to the job file)")]
    Unreadable(io::Error),
    #[error("is longer than {} bytes", limits::FILE_BYTES_MAX)]
    TooLarge,
    #[error(
        "is longer than {} bytes; a line has the fields of one velocity",
        limits::LINE_BYTES_MAX
    )]
    LongLine,
    #[error("is not UTF-8 text")]
    NotUtf8,
    #[error("has no header; its first line must name the columns, one of them `{COLUMN}`")]
    Empty,
    #[error("is not a header; it must name the columns, one of them `{COLUMN}`")]
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
    #[error("more lines with errors are not listed")]
    More,
}

impl CsvError {
    /// Returns whether it represents further errors that are not listed.
    pub(crate) fn stands_for_more(&self) -> bool {
        matches!(self.problem, Problem::More)
    }
}

/// Returns the velocities of the CSV file at `path`, m/s, in the file's order.
///
/// # Errors
/// All errors in the file, up to [`REPORTED_MAX`] lines.
pub(crate) fn read(path: &Path) -> Result<Measured<Vec<f64>>, Vec<CsvError>> {
    let Measured { data, origin } = measured(path, None)?;
    // Without a column of groups all velocities are in one group.
    Ok(Measured { data: data.into_iter().flat_map(|group| group.velocities).collect(), origin })
}

/// Returns the velocities of the CSV file at `path`, m/s, grouped by the names in its column
/// `column`: groups in the order of their first occurrence, velocities in the order of the file.
///
/// # Errors
/// Same as [`read`].
pub(crate) fn read_groups(
    path: &Path,
    column: &str,
) -> Result<Measured<Vec<Group>>, Vec<CsvError>> {
    let measured = measured(path, Some(column))?;
    if measured.data.iter().all(|group| group.no_variation().is_some()) {
        let problem = Problem::NoVariation { column: shortened(column) };
        return Err(vec![CsvError { path: path.to_owned(), line: None, problem }]);
    }
    Ok(measured)
}

/// Returns the velocities by the names in `column`; if there is no column, all in one group without
/// a name.
fn measured(path: &Path, column: Option<&str>) -> Result<Measured<Vec<Group>>, Vec<CsvError>> {
    let located = |(line, problem)| CsvError { path: path.to_owned(), line, problem };
    let gathered = open(path)
        .map_err(|problem| vec![(None, problem)])
        .and_then(|file| parse(file, column))
        .map_err(|problems| problems.into_iter().map(located).collect::<Vec<_>>())?;
    let CollectedVelocities { groups, lines, .. } = gathered;
    Ok(Measured { data: groups, origin: Origin { path: path.to_owned(), lines } })
}

fn open(path: &Path) -> Result<impl BufRead, Problem> {
    let open = || -> io::Result<(File, u64)> {
        let file = user_file::open(path)?;
        let length = file.metadata()?.len();
        Ok((file, length))
    };
    match open().map_err(Problem::Unreadable)? {
        (_, length) if length > limits::FILE_BYTES_MAX => Err(Problem::TooLarge),
        // Data appended while the file is read are ignored.
        (file, length) => Ok(BufReader::new(file.take(length))),
    }
}

type LocatedProblem = (Option<usize>, Problem);

fn parse(
    file: impl BufRead,
    group: Option<&str>,
) -> Result<CollectedVelocities, Vec<LocatedProblem>> {
    let mut lines = LineReader { file, number: 0, bytes: Vec::new() };
    let header = lines.next().map_err(|problem| vec![problem])?;
    let (number, header) = header.ok_or_else(|| vec![(None, Problem::Empty)])?;
    let columns =
        Columns::from_header(header, group).map_err(|problem| vec![(Some(number), problem)])?;
    let mut gathered = CollectedVelocities::default();
    let mut problems = Vec::new();
    loop {
        match lines.next() {
            Ok(None) => break,
            Ok(Some((number, line))) => match columns.row(line) {
                Ok((name, velocity)) => {
                    gathered
                        .add(number, name, velocity)
                        .map_err(|problem| vec![(None, problem)])?;
                }
                Err(problem) => problems.push((Some(number), problem)),
            },
            // After this error, the rest of the file cannot be interpreted.
            Err(problem) => {
                problems.push(problem);
                return Err(problems);
            }
        }
        if problems.len() > REPORTED_MAX {
            problems.pop();
            problems.push((None, Problem::More));
            return Err(problems);
        }
    }
    if problems.is_empty() && gathered.count < VELOCITIES_MIN {
        problems.push((None, if gathered.count == 0 { Problem::NoRows } else { Problem::OneRow }));
    }
    if problems.is_empty() { Ok(gathered) } else { Err(problems) }
}

/// The lines of a file, of which one is in memory at a time.
struct LineReader<R> {
    file: R,
    /// Number of the last line, from 1.
    number: usize,
    bytes: Vec<u8>,
}

impl<R: BufRead> LineReader<R> {
    /// Returns the next line that is neither empty nor a comment, without its end, and its number.
    fn next(&mut self) -> Result<Option<(usize, &str)>, LocatedProblem> {
        loop {
            self.bytes.clear();
            // The line end takes at most two bytes.
            let most = limits::LINE_BYTES_MAX as u64 + 2;
            let mut line = self.file.by_ref().take(most);
            let read = line.read_until(b'\n', &mut self.bytes);
            if read.map_err(|error| (None, Problem::Unreadable(error)))? == 0 {
                return Ok(None);
            }
            self.number += 1;
            if self.bytes.last() == Some(&b'\n') {
                self.bytes.pop();
            }
            if self.bytes.last() == Some(&b'\r') {
                self.bytes.pop();
            }
            if self.bytes.len() > limits::LINE_BYTES_MAX {
                return Err((Some(self.number), Problem::LongLine));
            }
            // Checked here and borrowed after the loop: a borrow that is returned would last for
            // all iterations.
            let text = str::from_utf8(&self.bytes);
            let text = text.map_err(|_| (Some(self.number), Problem::NotUtf8))?;
            let begin = without_byte_order_mark(text).trim_start();
            if !begin.is_empty() && !begin.starts_with('#') {
                break;
            }
        }
        // Was already checked to be UTF-8.
        let text = str::from_utf8(&self.bytes).unwrap_or_default();
        let text = if self.number == 1 { without_byte_order_mark(text) } else { text };
        Ok(Some((self.number, text)))
    }
}

/// The velocities read so far.
#[derive(Default)]
struct CollectedVelocities {
    groups: Vec<Group>,
    /// Line of each velocity of each group, from 1.
    lines: Vec<Vec<u32>>,
    /// Position of each group, by its name.
    places: BTreeMap<String, usize>,
    count: usize,
}

impl CollectedVelocities {
    fn add(&mut self, line: usize, name: String, velocity: f64) -> Result<(), Problem> {
        self.count += 1;
        if self.count > limits::DATA_VELOCITIES_MAX {
            return Err(Problem::TooMany);
        }
        let place = match self.places.get(&name) {
            Some(&place) => place,
            None if self.groups.len() == limits::GROUPS_MAX => return Err(Problem::TooManyGroups),
            None => {
                self.groups.push(Group { name: name.clone(), velocities: Vec::new() });
                self.lines.push(Vec::new());
                self.places.insert(name, self.groups.len() - 1);
                self.groups.len() - 1
            }
        };
        self.groups[place].velocities.push(velocity);
        // The limit on a file's bytes keeps the number of lines far below this.
        self.lines[place].push(u32::try_from(line).unwrap_or(u32::MAX));
        Ok(())
    }
}

/// Positions of velocity and group in each row.
struct Columns {
    count: usize,
    velocity: usize,
    /// Position and name of the group's column.
    group: Option<(usize, String)>,
}

impl Columns {
    fn from_header(header: &str, group: Option<&str>) -> Result<Self, Problem> {
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

    /// Returns the name of the group, and the velocity.
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

/// Returns the fields of one line, without surrounding space and quotes.
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

/// Reads a field after its opening quote; returns it and the text after its closing quote, which is
/// empty or begins with a comma.
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

/// Maximum number of characters of a file's text that a message quotes.
const SHOWN_CHARACTERS_MAX: usize = 60;

fn shortened(text: &str) -> String {
    visible::line(&text.chars().take(SHOWN_CHARACTERS_MAX).collect::<String>()).into_owned()
}

fn listed(names: &[String]) -> String {
    let names: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
    shortened(&names.join(", "))
}
