//! Measured velocities from a CSV file.
//!
//! The first line that is neither empty nor a comment (`#`) names the columns; `velocity` (m/s) is
//! one of them, others may name the group and the subject of each velocity; all further columns are
//! ignored. Fields may be quoted, but contain no line break.

mod columns;
mod problem;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use osteon_common::check::VELOCITIES_MIN;
use osteon_common::job::Group;
use osteon_common::known_quantities::KnownQuantities;
use osteon_common::origin::Origin;
use osteon_common::parameters::Parameter;
use osteon_common::{limits, visible};
use thiserror::Error;

use crate::file_error::without_byte_order_mark;
use crate::user_file;

use self::columns::{Columns, Row};
use self::problem::{Problem, shortened};

pub(crate) use self::columns::NamedColumns;

/// Maximum number of bad lines that are reported individually.
const REPORTED_MAX: usize = 10;
/// A column that seems to name subjects is an index of the rows if it has more names than this.
const UNUSED_NAMES_MAX: usize = 10_000;

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

impl CsvError {
    /// Returns whether it represents further errors that are not listed.
    pub(crate) fn stands_for_more(&self) -> bool {
        matches!(self.problem, Problem::More)
    }
}

/// Returns the velocities of the CSV file at `path`, m/s, in the file's order: in groups by the names
/// in the column of groups, in the order of their first occurrence; without such a column, all in one
/// group without a name.
///
/// # Errors
/// All errors in the file, up to [`REPORTED_MAX`] lines.
pub(crate) fn read(
    path: &Path,
    named: NamedColumns<'_>,
) -> Result<Measured<Vec<Group>>, Vec<CsvError>> {
    let located = |(line, problem)| CsvError { path: path.to_owned(), line, problem };
    let (gathered, columns) = open(path)
        .map_err(|problem| vec![(None, problem)])
        .and_then(|file| parse(file, named))
        .map_err(|problems| problems.into_iter().map(located).collect::<Vec<_>>())?;
    let measured = gathered.finish(path, &columns);
    if let Some(column) = named.group
        && measured.data.iter().all(|group| group.no_variation().is_some())
    {
        let problem = Problem::NoVariation { column: shortened(column) };
        return Err(vec![located((None, problem))]);
    }
    Ok(measured)
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
    named: NamedColumns<'_>,
) -> Result<(CollectedVelocities, Columns), Vec<LocatedProblem>> {
    let mut lines = LineReader { file, number: 0, bytes: Vec::new() };
    let header = lines.next().map_err(|problem| vec![problem])?;
    let (number, header) = header.ok_or_else(|| vec![(None, Problem::Empty)])?;
    let columns =
        Columns::from_header(header, named).map_err(|problem| vec![(Some(number), problem)])?;
    let mut gathered =
        CollectedVelocities { has_subjects: named.subject.is_some(), ..Default::default() };
    let mut problems = Vec::new();
    loop {
        match lines.next() {
            Ok(None) => break,
            Ok(Some((number, line))) => match columns.row(line) {
                Ok(row) => match gathered.contradiction(&row, &columns) {
                    Some(problem) => problems.push((Some(number), problem)),
                    None => gathered.add(number, row).map_err(|problem| vec![(None, problem)])?,
                },
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
    if problems.is_empty() { Ok((gathered, columns)) } else { Err(problems) }
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
    groups: Vec<CollectedGroup>,
    /// Position of each group, by its name.
    places: BTreeMap<String, usize>,
    count: usize,
    /// Whether a column of subjects is named.
    has_subjects: bool,
    /// Number of subjects in all groups.
    subjects: usize,
    /// Whether the column that seems to name subjects has too many names for that.
    is_index: bool,
}

/// The velocities of one group.
struct CollectedGroup {
    name: String,
    velocities: Vec<f64>,
    /// Line of each velocity, from 1.
    lines: Vec<u32>,
    /// Number of the subject of each velocity; empty if there is no such column.
    subjects: Vec<u32>,
    /// Numbers of the subjects, by their names.
    numbers: BTreeMap<String, u32>,
    /// Decay of each velocity; empty if there is no such column.
    decays: Vec<f64>,
    /// Quantities that are known of the group.
    known: [Option<f64>; Parameter::OF_SETUP.len()],
}

impl CollectedVelocities {
    /// Returns how a row contradicts what is known of its group from the first of its rows.
    fn contradiction(&self, row: &Row, columns: &Columns) -> Option<Problem> {
        let group = &self.groups[*self.places.get(&row.group)?];
        let pairs = group.known.iter().zip(row.known).enumerate();
        let mut different = pairs.filter_map(|(quantity, (first, found))| {
            let (first, found) = ((*first)?, found?);
            (first.to_bits() != found.to_bits()).then_some((quantity, first, found))
        });
        let (quantity, first, found) = different.next()?;
        Some(Problem::OtherKnownValue {
            column: shortened(columns.known(quantity)),
            found,
            first,
            line: group.lines.first().copied().unwrap_or_default(),
            group: shortened(&row.group),
        })
    }

    fn add(&mut self, line: usize, row: Row) -> Result<(), Problem> {
        self.count += 1;
        if self.count > limits::DATA_VELOCITIES_MAX {
            return Err(Problem::TooMany);
        }
        if self.has_subjects && self.count > limits::DATA_SUBJECTS_MAX {
            return Err(Problem::TooManySubjects);
        }
        let place = match self.places.get(&row.group) {
            Some(&place) => place,
            None if self.groups.len() == limits::GROUPS_MAX => return Err(Problem::TooManyGroups),
            None => {
                self.groups.push(CollectedGroup::new(row.group.clone(), row.known));
                self.places.insert(row.group, self.groups.len() - 1);
                self.groups.len() - 1
            }
        };
        let group = &mut self.groups[place];
        group.velocities.push(row.velocity);
        group.decays.extend(row.decay);
        // The limit on a file's bytes keeps the number of lines far below this.
        group.lines.push(u32::try_from(line).unwrap_or(u32::MAX));
        if let Some(subject) = row.subject.filter(|_| !self.is_index) {
            self.subjects += usize::from(group.add_subject(subject));
            self.is_index = !self.has_subjects && self.subjects > UNUSED_NAMES_MAX;
        }
        Ok(())
    }

    /// Returns the groups and what is known of their rows.
    fn finish(self, path: &Path, columns: &Columns) -> Measured<Vec<Group>> {
        let repeats = !self.is_index && self.groups.iter().any(CollectedGroup::repeats);
        let unused = columns.like_subjects().filter(|_| repeats);
        let origin = Origin {
            path: path.to_owned(),
            unused_subjects: unused.map(shortened),
            lines: Vec::with_capacity(self.groups.len()),
        };
        let mut measured = Measured { data: Vec::with_capacity(self.groups.len()), origin };
        for CollectedGroup { name, velocities, lines, subjects, decays, known, .. } in self.groups {
            let subjects = self.has_subjects.then_some(subjects);
            let known = KnownQuantities::new(known);
            // Rows have a decay each, or none has.
            let decays = (!decays.is_empty()).then_some(decays);
            measured.data.push(Group { name, velocities, subjects, decays, known });
            measured.origin.lines.push(lines);
        }
        measured
    }
}

impl CollectedGroup {
    fn new(name: String, known: [Option<f64>; Parameter::OF_SETUP.len()]) -> Self {
        let (velocities, lines, subjects) = (Vec::new(), Vec::new(), Vec::new());
        let (decays, numbers) = (Vec::new(), BTreeMap::new());
        Self { name, velocities, lines, subjects, decays, numbers, known }
    }

    /// Adds the subject of a velocity; returns whether it is a new one.
    fn add_subject(&mut self, name: String) -> bool {
        // At most as many as there are velocities.
        let next = u32::try_from(self.numbers.len()).unwrap_or(u32::MAX);
        let number = *self.numbers.entry(name).or_insert(next);
        self.subjects.push(number);
        number == next
    }

    /// Returns whether there are several subjects, of which some have several velocities.
    fn repeats(&self) -> bool {
        (2..self.subjects.len()).contains(&self.numbers.len())
    }
}
