//! Measured velocities from a CSV file.
//!
//! The first line that is neither empty nor a comment (`#`) names the columns; `velocity` (m/s) is
//! one of them, unless the job file says otherwise; others may name the group and the subject of each
//! velocity; all further columns are ignored. Fields may be quoted, but contain no line break.

mod columns;
mod csv_format;
mod fields;
mod problem;
mod text_lines;

use std::collections::BTreeMap;
use std::io::BufRead;
use std::path::{Path, PathBuf};

use osteon_common::check::VELOCITIES_MIN;
use osteon_common::job::Group;
use osteon_common::known_quantities::KnownQuantities;
use osteon_common::origin::Origin;
use osteon_common::parameters::Parameter;
use osteon_common::{limits, visible};
use thiserror::Error;

use self::columns::{Columns, CsvLine, Row};
use self::problem::{Problem, shortened};
use self::text_lines::LineReader;

pub(crate) use self::columns::{NamedColumns, is_like_subject, is_like_velocity};
pub(crate) use self::csv_format::{CsvFormat, DecimalMark, Separator, VelocityUnit};
pub(crate) use self::fields::csv_fields;

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
    named: &NamedColumns<'_>,
    format: &CsvFormat,
) -> Result<Measured<Vec<Group>>, Vec<CsvError>> {
    let located = |(line, problem)| CsvError { path: path.to_owned(), line, problem };
    let (gathered, columns) = text_lines::open(path, format.encoding)
        .map_err(|problem| vec![(None, problem)])
        .and_then(|file| parse(file, named, format))
        .map_err(|problems| problems.into_iter().map(located).collect::<Vec<_>>())?;
    let measured = gathered.finish(path, &columns);
    if let Some(column) = named.group.first()
        && measured.data.iter().all(|group| group.no_variation().is_some())
    {
        let problem = Problem::NoVariation { column: shortened(column) };
        return Err(vec![located((None, problem))]);
    }
    Ok(measured)
}

type LocatedProblem = (Option<usize>, Problem);

fn parse(
    file: impl BufRead,
    named: &NamedColumns<'_>,
    format: &CsvFormat,
) -> Result<(CollectedVelocities, Columns), Vec<LocatedProblem>> {
    let mut lines = LineReader::new(file);
    let columns = columns(&mut lines, named, format).map_err(|problem| vec![problem])?;
    let mut gathered =
        CollectedVelocities { has_subjects: named.subject.is_some(), ..Default::default() };
    let mut problems = Vec::new();
    loop {
        match lines.next() {
            Ok(None) => break,
            Ok(Some((number, line))) => match columns.row(line) {
                Ok(CsvLine::Blank) => {}
                Ok(CsvLine::Missing) => gathered.left_out += 1,
                Ok(CsvLine::Row(row)) => match gathered.contradiction(&row, &columns) {
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

/// Reads the header, and a line above it that names the separator.
fn columns(
    lines: &mut LineReader<impl BufRead>,
    named: &NamedColumns<'_>,
    format: &CsvFormat,
) -> Result<Columns, LocatedProblem> {
    let mut above = None;
    // At most one line is above the header.
    for _ in 0..2 {
        let (number, line) = lines.next()?.ok_or((None, Problem::Empty))?;
        if above.is_none() {
            above = Separator::of_first_line(line);
            if above.is_some() {
                continue;
            }
        }
        return Columns::from_header(line, above, named, format)
            .map_err(|problem| (Some(number), problem));
    }
    Err((None, Problem::Empty))
}

/// The velocities read so far.
#[derive(Default)]
struct CollectedVelocities {
    groups: Vec<CollectedGroup>,
    /// Position of each group, by its name.
    places: BTreeMap<String, usize>,
    count: usize,
    /// Number of rows with a value that is missing.
    left_out: u32,
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
            left_out: self.left_out,
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
