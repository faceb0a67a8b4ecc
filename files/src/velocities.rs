//! Measured velocities from a file.
//!
//! There is one reader, for `osteon init` and for jobs, in steps: the bytes and what kind of file they are
//! ([`opening`]), their text ([`encodings`]), its lines ([`text_lines`]), where the table begins and what
//! separates its fields ([`header`]), which column has the velocities and how they are written ([`choice`]),
//! which rows are none ([`lines`], [`summaries`]), the rows themselves ([`columns`]), and what was taken
//! ([`account`]). What no key says is found out for `osteon init`; for a job it is as documented.

mod account;
mod cells;
mod choice;
mod collected;
mod column_choice;
mod column_roles;
mod columns;
mod content;
mod csv_format;
mod encodings;
mod fields;
mod hdf5;
mod header;
mod lines;
mod matlab;
mod missing;
mod name_words;
mod names;
mod number;
mod opening;
mod problem;
mod row_kinds;
mod row_names;
mod running_moments;
mod shapes;
mod statistics;
mod summaries;
mod summed_rows;
mod table;
mod text_lines;
mod units;
mod workbook;

use std::path::{Path, PathBuf};

use osteon_common::check::VELOCITIES_MIN;
use osteon_common::job::Group;
use osteon_common::visible;
use thiserror::Error;

use self::collected::CollectedVelocities;
use self::column_choice::POSSIBLE;
use self::columns::Columns;
use self::lines::{TableLine, TableLines};
use self::problem::{LocatedProblem, Problem, shortened};
use crate::picking_comment;

pub(crate) use self::collected::Measured;
pub(crate) use self::column_roles::{is_like_group, is_like_subject};
pub(crate) use self::columns::NamedColumns;
pub(crate) use self::csv_format::{CsvFormat, DecimalMark, Separator, VelocityUnit};
pub(crate) use self::table::VelocityTable;

/// Maximum number of bad lines that are reported individually.
const REPORTED_MAX: usize = 10;

/// Most lines below a table that are none of its rows.
const BELOW_MAX: usize = 1000;

/// One error in a file of velocities.
#[derive(Debug, Error)]
#[error("{}{}: {problem}{cure}", visible::path(path), .line.map(|line| format!(", line {line}")).unwrap_or_default())]
pub(crate) struct CsvError {
    path: PathBuf,
    line: Option<usize>,
    problem: Problem,
    /// Keys that read the file, at the end of a message; empty if there is no need for them, or none are known.
    cure: String,
}

impl CsvError {
    /// Returns whether it represents further errors that are not listed.
    pub(crate) fn stands_for_more(&self) -> bool {
        matches!(self.problem, Problem::More)
    }

    fn located(path: &Path, (line, problem): LocatedProblem) -> Self {
        Self { path: path.to_owned(), line, problem, cure: String::new() }
    }
}

/// Returns the table in the file at `path`, with what no key says found out.
///
/// # Errors
/// If it is none, or can be read in several ways.
pub(crate) fn understand(path: &Path) -> Result<VelocityTable, Vec<CsvError>> {
    let format = CsvFormat { is_found_out: true, ..CsvFormat::default() };
    VelocityTable::open(path, &format).map_err(|problem| vec![CsvError::located(path, problem)])
}

/// Returns the velocities that a job has which says of the file at `path` what was understood.
///
/// It is read again with the keys of that job, so that what is said of a file is what the job takes.
///
/// # Errors
/// Those of the job's reader, and a velocity that no job may have.
pub(crate) fn read_as_understood(
    path: &Path,
    table: VelocityTable,
    named: &NamedColumns<'_>,
) -> Result<Measured<Vec<Group>>, Vec<CsvError>> {
    let (format, is_unit_guessed) = (table.format(), table.is_unit_guessed());
    // The file is read once more, and should be in memory once.
    drop(table);
    let mut measured = read(path, named, &format)?;
    measured.account.is_unit_guessed = is_unit_guessed;
    let lines = measured.origin.lines.iter().flatten();
    let velocities = measured.data.iter().flat_map(|group| &group.velocities);
    match velocities.zip(lines).find(|(velocity, _)| !POSSIBLE.contains(velocity)) {
        Some((&found, &line)) => {
            let problem = (Some(line as usize), Problem::Impossible { found });
            Err(vec![CsvError::located(path, problem)])
        }
        None => Ok(measured),
    }
}

/// Returns the velocities of the file at `path`, m/s, in the file's order: in groups by the names
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
    let table = VelocityTable::open(path, format).map_err(|problem| {
        vec![CsvError { cure: cure(path, format, &problem.1), ..CsvError::located(path, problem) }]
    })?;
    let header = table.header_line();
    let read = of_table(path, &table, named);
    // The file is read once more for a cure, and should be in memory once.
    drop(table);
    read.map_err(|mut errors| {
        // Other columns that are missing are in no other reading, either.
        if let Some(first) = errors.first_mut().filter(|first| first.line > Some(header)) {
            first.cure = cure(path, format, &first.problem);
        }
        errors
    })
}

/// Returns the velocities of a table in the file at `path`; for the rest see [`read`].
///
/// # Errors
/// Those of the rows.
fn of_table(
    path: &Path,
    table: &VelocityTable,
    named: &NamedColumns<'_>,
) -> Result<Measured<Vec<Group>>, Vec<CsvError>> {
    let located = |problem| CsvError::located(path, problem);
    let header = Some(table.header_line()).filter(|&line| line > 0);
    let columns =
        Columns::of_table(table, named).map_err(|problem| vec![located((header, problem))])?;
    let gathered = gather(table, &columns, named)
        .map_err(|problems| problems.into_iter().map(located).collect::<Vec<_>>())?;
    let mut measured = gathered.finish(path, &columns);
    measured.origin.picking = picking_comment::read(&table.content.text);
    if let Some(column) = named.group.first()
        && measured.data.iter().all(|group| group.no_variation().is_some())
    {
        let problem = Problem::NoVariation { column: shortened(column) };
        return Err(vec![located((None, problem))]);
    }
    Ok(measured)
}

/// Gathers the velocities of the rows.
fn gather(
    table: &VelocityTable,
    columns: &Columns<'_>,
    named: &NamedColumns<'_>,
) -> Result<CollectedVelocities, Vec<LocatedProblem>> {
    let gathered = CollectedVelocities::new(named.subject.is_some(), table);
    let mut reading =
        RowReading { table, columns, gathered, problems: Vec::new(), below: Vec::new() };
    let mut lines =
        TableLines::after_header(&table.content.text, &table.header, Some(table.place()));
    for line in lines.by_ref() {
        let read =
            line.map_err(|(line, problem)| (line, problem, true)).and_then(|(number, line)| {
                reading.line(number, line).map_err(|problem| {
                    let is_final = problem.is_final();
                    (Some(number).filter(|_| !is_final), problem, is_final)
                })
            });
        if let Err((line, problem, is_final)) = read {
            reading.problems.push((line, problem));
            // After this error, the rest of the file cannot be interpreted, or no later row can mend it.
            if is_final {
                return Err(reading.problems);
            }
        }
        if reading.problems.len() > REPORTED_MAX {
            reading.problems.truncate(REPORTED_MAX);
            reading.problems.push((None, Problem::More));
            return Err(reading.problems);
        }
    }
    reading.gathered.account.comments = lines.comments;
    reading.finish()
}

/// The rows of a table while they are read.
struct RowReading<'a> {
    table: &'a VelocityTable,
    columns: &'a Columns<'a>,
    gathered: CollectedVelocities,
    problems: Vec<LocatedProblem>,
    /// Lines that seem to stand below the table; if a velocity follows, they are wrong rows.
    below: Vec<(usize, Vec<String>)>,
}

impl RowReading<'_> {
    fn line(&mut self, number: usize, line: TableLine) -> Result<(), Problem> {
        let account = &mut self.gathered.account;
        let fields = match line {
            TableLine::Rule => return Ok(()),
            TableLine::OpenQuote => return Err(Problem::Quote),
            TableLine::Units(_) => {
                account.leave_out(number, "(units)");
                return Ok(());
            }
            TableLine::RepeatedHeader => {
                account.leave_out(number, "(the header again)");
                return Ok(());
            }
            TableLine::OtherShape(fields)
            | TableLine::Labelled { fields, .. }
            | TableLine::Data(fields) => fields,
        };
        if let Some(shown) = self.table.summaries.get(&number) {
            account.leave_out(number, shown);
            return Ok(());
        }
        if fields.len() == self.table.names().len() {
            if self.gathered.row(number, fields, self.columns)? {
                let below = self.below.drain(..);
                self.problems.extend(
                    below.map(|(line, fields)| (Some(line), wrong_shape(self.table, &fields))),
                );
            }
            return Ok(());
        }
        match self.table.is_below(&fields) && self.below.len() < BELOW_MAX {
            true => self.below.push((number, fields)),
            false => return Err(wrong_shape(self.table, &fields)),
        }
        Ok(())
    }

    fn finish(mut self) -> Result<CollectedVelocities, Vec<LocatedProblem>> {
        for (line, fields) in self.below {
            let text = fields.iter().find(|field| !field.is_empty()).map_or("", String::as_str);
            self.gathered.account.leave_out(line, &format!("{:?}", shortened(text)));
        }
        let count = self.gathered.count;
        if self.problems.is_empty() && count < VELOCITIES_MIN {
            self.problems.push((None, if count == 0 { Problem::NoRows } else { Problem::OneRow }));
        }
        if self.problems.is_empty() { Ok(self.gathered) } else { Err(self.problems) }
    }
}

fn wrong_shape(table: &VelocityTable, fields: &[String]) -> Problem {
    Problem::FieldCount { found: fields.len(), expected: table.names().len() }
}

/// Returns what may be the reason, or the keys that read a file which a job does not, at the end of a message.
fn cure(path: &Path, format: &CsvFormat, problem: &Problem) -> String {
    if matches!(problem, Problem::Unreadable(_)) {
        return " (its path is relative to the job file)".to_owned();
    }
    if format.is_found_out || !problem.may_be_of_format() {
        return String::new();
    }
    let open = CsvFormat { is_found_out: true, ..format.clone() };
    let Ok(table) = VelocityTable::open(path, &open) else { return String::new() };
    let keys: Vec<String> = table
        .keys()
        .into_iter()
        .filter(|(key, _)| !format.has(key))
        .map(|(key, value)| format!("{key} = {value}"))
        .collect();
    match keys.is_empty() {
        true => String::new(),
        false => format!("; this reads it: [data] {}", keys.join(", ")),
    }
}
