//! Which column has the velocities, in which unit and with which decimal mark.
//!
//! The name of a column and the size of its numbers decide together. What may be read in two ways is
//! refused with the key that decides.

use std::collections::BTreeSet;

use super::cells::Cells;
use super::column_choice::ColumnChoice;
use super::csv_format::{CsvFormat, DecimalMark};
use super::header::{Header, velocity_places};
use super::lines::{TableLine, TableLines};
use super::names::ColumnName;
use super::number::CellNumber;
use super::problem::{LocatedProblem, Problem, listed, shortened};

/// Most columns that may be the velocities.
const COLUMNS_MAX: usize = 20;
/// Rows in which units are looked for.
const EXAMINED_ROWS: usize = 50;

/// Finds the column, as far as no key says it.
pub(super) fn find_column(
    text: &str,
    header: &Header,
    format: &CsvFormat,
) -> Result<ColumnChoice, LocatedProblem> {
    let at_header = |problem| (Some(header.line), problem);
    let read = |place| Cells::collect(text, header, place)?.choice(header, format);
    if let Some(column) = &format.column {
        let mut places = header.names.iter().enumerate().filter(|(_, name)| *name == column);
        return match (places.next(), places.next()) {
            (Some((place, _)), None) => read(place),
            (Some(_), Some(_)) => {
                Err(at_header(Problem::RepeatedColumn { column: shortened(column) }))
            }
            (None, _) => Err(at_header(Problem::NoColumn {
                column: shortened(column),
                columns: listed(&header.names),
            })),
        };
    }
    let named = velocity_places(&header.names);
    let places = if named.is_empty() { places_with_units(text, header)? } else { named };
    let mut choices = Vec::new();
    let mut first_problem = None;
    for place in places.iter().copied().take(COLUMNS_MAX) {
        match read(place) {
            Ok(choice) => choices.push(choice),
            // A column without any cell, as in a form, is none.
            Err((_, Problem::NoRowsBelow)) if places.len() > 1 => {}
            Err(problem) => first_problem = first_problem.or(Some(problem)),
        }
    }
    match (choices.pop(), choices.is_empty(), first_problem) {
        (Some(choice), true, None) => Ok(choice),
        (None, _, Some(problem)) => Err(problem),
        (None, _, None) if places.is_empty() => {
            Err(at_header(Problem::no_velocities(&header.names)))
        }
        (None, _, None) => Err((None, Problem::NoRowsBelow)),
        // Which of several it is, nobody but the user knows; that one of them cannot be read says nothing.
        _ => Err(at_header(several(&places, header))),
    }
}

/// Returns the places of columns of which the cells themselves say that they are velocities.
fn places_with_units(text: &str, header: &Header) -> Result<Vec<usize>, LocatedProblem> {
    let mut places = BTreeSet::new();
    let mut named = None;
    for line in TableLines::after_header(text, header, None).take(EXAMINED_ROWS) {
        let Ok((line, TableLine::Data(fields))) = line else { continue };
        for (place, field) in fields.iter().enumerate() {
            let read = DecimalMark::ALL.into_iter().find_map(|mark| CellNumber::read(field, mark));
            if read.is_some_and(|number| number.unit.is_some()) {
                places.insert(place);
            } else if ColumnName::parse(field).has_word() {
                named.get_or_insert((line, field.clone()));
            }
        }
    }
    match named.filter(|_| !places.is_empty()) {
        // Each row says what is in it, and not all are velocities of bone.
        Some((line, found)) => Err((Some(line), Problem::NamedInRows { found: shortened(&found) })),
        None => Ok(places.into_iter().collect()),
    }
}

/// Asks which of several columns has the velocities.
fn several(places: &[usize], header: &Header) -> Problem {
    let names: Vec<String> = places.iter().map(|&place| header.names[place].clone()).collect();
    let is_twice = |name: &&String| names.iter().filter(|other| other == name).count() > 1;
    if let Some(name) = names.iter().find(is_twice) {
        return Problem::RepeatedColumn { column: shortened(name) };
    }
    let first = names.first().map_or("", String::as_str);
    Problem::SeveralColumns { first: shortened(first), columns: listed(&names) }
}
