//! Where a table begins in a text: the line with the names of its columns, and what separates them.

use super::content::Content;
use super::csv_format::{CsvFormat, Separator};
use super::fields::{COMMENT_MARKS, csv_fields, trimmed};
use super::names::ColumnName;
use super::number::is_number;
use super::problem::{COLUMN, LocatedProblem, Problem};
use super::row_names;
use super::text_lines::{TextRecord, TextRecords};
use super::units::{self, NamedUnit};

/// Number of records in which the header is looked for.
const RECORDS_MAX: usize = 1000;
/// Maximum number of columns of a table whose header is to be found.
const COLUMNS_MAX: usize = 1000;
/// Words for a value that is missing, in lower case. Besides these, a cell without two letters or digits in a
/// row (`-`, `?`, `n.a.`) has no value.
const GAPS: [&str; 12] = [
    "na", "nan", "null", "none", "nil", "missing", "nd", "inf", "div/0", "value", "false", "failed",
];
/// Maximum number of distinct headers that are looked at.
const HEADERS_MAX: usize = 20;
/// Maximum number of lines between the header and the first row: units, and rules.
const BETWEEN_MAX: usize = 3;
/// Number of rows below a header that are examined: whether they fit it, and whether their first fields are
/// names of rows for which it has no column.
const ROWS_EXAMINED: usize = 50;

/// Names of the columns, and where their rows begin.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    /// Line of the names, from 1; 0 if there is none.
    pub(super) line: usize,
    /// Number of lines above the first row.
    pub(super) lines_above: usize,
    pub(super) separator: Separator,
    pub(super) names: Vec<String>,
    /// Whether a job file need not say what the separator is.
    pub(super) is_separator_usual: bool,
}

impl Header {
    /// Finds the header as the keys say, or as the text shows.
    pub(super) fn find(content: &Content, format: &CsvFormat) -> Result<Self, LocatedProblem> {
        let is_given = format.header_line.is_some() || !format.is_found_out;
        if is_given { given(content, format) } else { found(content, format) }
    }

    /// Returns the records below the header.
    pub(super) fn rows<'a>(&self, text: &'a str) -> TextRecords<'a> {
        TextRecords::split(text, self.separator).skip_lines(self.lines_above)
    }
}

/// Returns the fields of a line; one that has an open quote is one field.
pub(super) fn fields_of(record: &TextRecord<'_>, separator: Separator) -> Vec<String> {
    csv_fields(record.text, separator).unwrap_or_else(|_| vec![record.text.trim().to_owned()])
}

/// Returns whether fields are the units of columns rather than values of a row, given the places of
/// velocities.
pub(super) fn are_units(fields: &[String], places: &[usize]) -> bool {
    let is_none = |field: &str| field.trim_matches(['-', ' ', '[', ']', '(', ')']).is_empty();
    let of_place = |&place: &usize| units::of_velocity(fields.get(place)?);
    let has_unit = fields.iter().any(|field| units::of_text(field).is_some());
    places.iter().find_map(of_place).is_some()
        || has_unit && fields.iter().all(|field| is_none(field) || units::of_text(field).is_some())
}

/// Returns whether fields are a line that is drawn, as below a header.
pub(super) fn is_rule(fields: &[String]) -> bool {
    let is_drawn = |field: &String| {
        field.chars().all(|c| matches!(c, '-' | '=' | '_' | '+' | '|' | ' ' | ':'))
    };
    fields.iter().any(|field| field.len() >= 5) && fields.iter().all(is_drawn)
}

/// Returns the names in a header, which may stand in a comment.
fn names_in(text: &str, separator: Separator) -> Result<Vec<String>, Problem> {
    let text = text.trim_start();
    let uncommented = text.trim_start_matches(COMMENT_MARKS);
    let names =
        csv_fields(if uncommented.trim().is_empty() { text } else { uncommented }, separator)?;
    // A name over several lines has one blank between them.
    let one_line = |name: String| name.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut names: Vec<String> = names.into_iter().map(one_line).collect();
    // A comment mark alone in its field (`#,velocity`) is the name of a column of running numbers.
    if uncommented.len() < text.len() && names.len() > 1 && names[0].is_empty() {
        text[..text.len() - uncommented.len()].clone_into(&mut names[0]);
    }
    Ok(names)
}

/// Returns the header where the keys say that it is; without such a key, in the first line that is neither
/// empty nor a comment.
fn given(content: &Content, format: &CsvFormat) -> Result<Header, LocatedProblem> {
    // What the first line says holds for every header, however it is found.
    let first_line_separator = above_of(&content.text);
    let given_separator = content.separator().or(format.separator).or(first_line_separator);
    let skipped = match format.header_line {
        Some(line) => line.saturating_sub(1),
        None => format.skip_lines.unwrap_or(0),
    };
    let records =
        TextRecords::split(&content.text, given_separator.unwrap_or_default()).skip_lines(skipped);
    for record in records {
        let record = record?;
        let is_header_line = format.header_line == Some(record.line);
        let says_separator =
            first_line_separator.is_some() && Separator::of_first_line(record.text).is_some();
        if !is_header_line && (record.is_blank() || record.is_comment() || says_separator) {
            continue;
        }
        let separator = given_separator.unwrap_or_default();
        let located = |problem| (Some(record.line), problem);
        if format.header_line == Some(0) {
            let count = csv_fields(record.text, separator).map_err(located)?.len();
            let names = (1..=count).map(|place| place.to_string()).collect();
            return Ok(Header {
                line: 0,
                lines_above: format.skip_lines.unwrap_or(0),
                separator,
                names,
                is_separator_usual: given_separator.is_none(),
            });
        }
        let mut header = Header {
            line: record.line,
            lines_above: record.line + record.text.matches('\n').count(),
            separator,
            names: names_in(record.text, separator).map_err(located)?,
            is_separator_usual: format.separator.is_none(),
        };
        let rows: Vec<_> = header
            .rows(&content.text)
            .map_while(Result::ok)
            .filter(|record| !record.is_blank() && !record.is_comment())
            .take(ROWS_EXAMINED)
            .map(|record| (record, fields_of(&record, separator)))
            .collect();
        let column = format.column.as_deref().unwrap_or(COLUMN);
        let place = header.names.iter().position(|name| name == column);
        row_names::adapt(&mut header.names, &record, separator, &rows, place.as_slice());
        return Ok(header);
    }
    Err((None, Problem::Empty))
}

/// Finds the header by what it says, with every separator that may be.
fn found(content: &Content, format: &CsvFormat) -> Result<Header, LocatedProblem> {
    let skipped = format.skip_lines.unwrap_or(0);
    let first_line_separator = above_of(&content.text);
    let given_separator = content.separator().or(format.separator).or(first_line_separator);
    let separators = given_separator.map_or_else(|| Separator::ALL.to_vec(), |one| vec![one]);
    let mut best = None;
    let mut fallback = None;
    let mut first_problem = None;
    for separator in separators {
        let beginning = Beginning::read(&content.text, separator, skipped)?;
        match beginning.header() {
            Ok(Some((score, header))) => keep_better(&mut best, score, header),
            Err(problem) => first_problem = first_problem.or(Some(problem)),
            _ => {}
        }
        if let Some((score, header)) = beginning.above_numbers() {
            keep_better(&mut fallback, score, header);
        }
    }
    // Any text can be read as one column, which is no reason to forget the problem of another separator.
    let has_columns =
        best.as_ref().is_some_and(|(_, header): &(Fit, Header)| header.names.len() > 1);
    if let (false, Some(problem)) = (has_columns, first_problem) {
        return Err(problem);
    }
    let (_, mut header) = best.or(fallback).ok_or((None, Problem::Empty))?;
    let is_usual = header.separator == Separator::default() && format.separator.is_none();
    header.is_separator_usual =
        is_usual || content.separator().is_some() || first_line_separator.is_some();
    if header.line == 0 {
        return Err((Some(header.lines_above + 1), Problem::OnlyNumbers));
    }
    Ok(header)
}

/// How well a separator makes a table of a text. Compared in this order: the number of rows; whether a
/// character separates several columns (2), blanks do (1), or there is one column or a torn unit (0); the number
/// of columns.
type Fit = (usize, u8, usize);

/// Keeps a header if it fits better.
fn keep_better(best: &mut Option<(Fit, Header)>, rows: usize, header: Header) {
    let width = header.names.len();
    // A unit is no column of its own.
    let is_torn = header.names.iter().any(|name| is_velocity_unit(name));
    let rank = match header.separator.character() {
        _ if width == 1 || is_torn => 0,
        None => 1,
        Some(_) => 2,
    };
    let fit = (rows, rank, width);
    if best.as_ref().is_none_or(|(other, _)| fit > *other) {
        *best = Some((fit, header));
    }
}

/// Returns the separator that the first line names.
fn above_of(text: &str) -> Option<Separator> {
    Separator::of_first_line(text.lines().find(|line| !line.trim().is_empty())?)
}

/// The first records of a text, in which its header is looked for.
struct Beginning<'a> {
    separator: Separator,
    records: Vec<(TextRecord<'a>, Vec<String>)>,
    /// Which of these have a number.
    have_number: Vec<bool>,
}

impl<'a> Beginning<'a> {
    fn read(text: &'a str, separator: Separator, skipped: usize) -> Result<Self, LocatedProblem> {
        let mut records = Vec::new();
        for record in TextRecords::split(text, separator).skip_lines(skipped) {
            let record = record?;
            if record.is_blank() || Separator::of_first_line(record.text).is_some() {
                continue;
            }
            records.push((record, fields_of(&record, separator)));
            if records.len() == RECORDS_MAX {
                break;
            }
        }
        let has_number = |(_, fields): &(TextRecord<'_>, Vec<String>)| {
            fields.iter().any(|field| is_number(field))
        };
        let have_number = records.iter().map(has_number).collect();
        Ok(Self { separator, records, have_number })
    }

    /// Returns the header that names velocities with numbers below, and the number of its rows.
    fn header(&self) -> Result<Option<(usize, Header)>, LocatedProblem> {
        let mut found: Vec<(usize, usize, Header, bool)> = Vec::new();
        for at in 0..self.records.len() {
            if found.len() == HEADERS_MAX {
                break;
            }
            let Some((header, places)) = self.candidate(at) else { continue };
            let is_new = found.iter().all(|(_, _, other, _)| other.names != header.names);
            if !is_new {
                continue;
            }
            let has_word =
                places.iter().any(|&place| ColumnName::parse(&header.names[place]).has_word());
            let score = self.rows_below(at, &header, &places, self.records.len());
            if let Some((before, _, other, _)) = found.last() {
                let places = velocity_places(&other.names);
                if self.rows_below(*before, other, &places, at) > 0 {
                    let (first, second) = (other.line, header.line);
                    return Err((Some(second), Problem::TwoTables { first, second }));
                }
            }
            found.push((at, score, header, has_word));
        }
        let any_word = found.iter().any(|(_, _, _, has_word)| *has_word);
        found.retain(|(_, _, _, has_word)| *has_word || !any_word);
        Ok(found.pop().map(|(_, score, header, _)| (score, header)))
    }

    /// Returns the record as a header, with the places of its columns of velocities, if the next row, or at
    /// least a third of the next ones, fits it and has velocities.
    fn candidate(&self, at: usize) -> Option<(Header, Vec<usize>)> {
        let (record, _) = &self.records[at];
        let below = &self.have_number[at + 1..self.records.len().min(at + ROWS_EXAMINED)];
        if self.have_number[at] || !below.contains(&true) {
            return None;
        }
        let names = names_in(record.text, self.separator).ok()?;
        let is_wide = names.len() > COLUMNS_MAX;
        if is_wide || names.iter().any(|name| is_number(name)) || velocity_places(&names).is_empty()
        {
            return None;
        }
        let rows: Vec<_> = self.below(at, &names).take(ROWS_EXAMINED).collect();
        let mut header = self.header_at(at, names);
        let places = velocity_places(&header.names);
        row_names::adapt(&mut header.names, record, self.separator, &rows, &places);
        let places = velocity_places(&header.names);
        let is_row = |(_, row): &&(TextRecord<'_>, Vec<String>)| {
            row.len() == header.names.len()
                && places.iter().any(|&place| is_number(&row[place]) || is_gap(&row[place]))
        };
        let matching = rows.iter().filter(is_row).count();
        // A table of one row may stand above another.
        let is_next = rows.first().is_some_and(|row| {
            is_row(&row) && places.iter().any(|&place| row_names::is_like_velocity(&row.1[place]))
        });
        // Blanks within names make columns of their units.
        let is_torn = self.separator.character().is_none()
            && header.names.iter().any(|name| is_velocity_unit(name));
        let is_table = matching > 0 && 3 * matching >= rows.len() || is_next;
        (is_table && !is_torn).then_some((header, places))
    }

    /// Returns the records below a header that may be rows, with their fields: not comments, rules, or units.
    fn below(
        &self,
        at: usize,
        names: &[String],
    ) -> impl Iterator<Item = (TextRecord<'a>, Vec<String>)> {
        let (count, places) = (names.len(), velocity_places(names));
        let below = self.records[at + 1..].iter().enumerate();
        below
            .filter(move |(behind, (record, fields))| {
                let is_between =
                    *behind < BETWEEN_MAX && (is_rule(fields) || are_units(fields, &places));
                !is_between && !record.is_comment()
            })
            .map(move |(_, (record, fields))| (*record, trimmed(fields.clone(), count)))
    }

    /// Returns how many records between a header and another place have numbers in one of its columns of
    /// velocities.
    fn rows_below(&self, at: usize, header: &Header, places: &[usize], end: usize) -> usize {
        let is_row = |(_, fields): &&(TextRecord<'_>, Vec<String>)| {
            let fields = trimmed(fields.to_vec(), header.names.len());
            fields.len() == header.names.len()
                && places.iter().any(|&place| is_number(&fields[place]))
        };
        self.records[at + 1..end].iter().filter(is_row).count()
    }

    fn header_at(&self, at: usize, names: Vec<String>) -> Header {
        let record = &self.records[at].0;
        Header {
            line: record.line,
            lines_above: record.line + record.text.matches('\n').count(),
            separator: self.separator,
            names,
            is_separator_usual: false,
        }
    }

    /// Returns the header above the first row of numbers, whatever it says, and how many rows there are. If no
    /// line is above, it is one without names in line 0.
    fn above_numbers(&self) -> Option<(usize, Header)> {
        let first = self.have_number.iter().position(|&has_number| has_number);
        let Some(first) = first else {
            // Nothing but texts: the first line has the names.
            let (record, _) = self.records.first()?;
            return Some((0, self.header_at(0, names_in(record.text, self.separator).ok()?)));
        };
        let width = self.records[first].1.len();
        let rows = self.records[first..].iter().filter(|(_, fields)| fields.len() == width).count();
        let names_of =
            |record: &TextRecord<'_>| names_in(record.text, self.separator).unwrap_or_default();
        let above = self.records[..first]
            .iter()
            .rposition(|(record, _)| names_of(record).len() == width)
            // The rows may all have another number of fields.
            .or_else(|| {
                let last = first.checked_sub(1)?;
                let names = names_of(&self.records[last].0);
                (!velocity_places(&names).is_empty()).then_some(last)
            });
        let Some(above) = above else {
            let mut none = self.header_at(first, Vec::new());
            (none.lines_above, none.line) = (none.line - 1, 0);
            none.names = vec![String::new(); width];
            return Some((rows, none));
        };
        let names = names_in(self.records[above].0.text, self.separator).ok()?;
        Some((rows, self.header_at(above, names)))
    }
}

/// Returns whether a cell has no value, as people and programs say it.
pub(super) fn is_gap(cell: &str) -> bool {
    let cell = cell.to_lowercase();
    let mut words = cell.split(|c: char| !c.is_alphanumeric());
    GAPS.contains(&cell.trim_matches(|c: char| !c.is_alphanumeric()))
        || words.all(|word| word.chars().count() < 2)
}

/// Returns the places of names that are of velocities, and not only a unit.
pub(super) fn velocity_places(names: &[String]) -> Vec<usize> {
    let is_one =
        |name: &&String| !is_velocity_unit(name) && ColumnName::parse(name).is_of_velocities();
    let places = names.iter().enumerate().filter(|(_, name)| is_one(name));
    places.map(|(place, _)| place).collect()
}

fn is_velocity_unit(name: &str) -> bool {
    matches!(units::of_text(name), Some(NamedUnit::Velocity(_) | NamedUnit::OtherVelocity))
}
