//! First fields that are no column of the header: the names of rows, as R writes them.

use super::column_choice::USUAL;
use super::csv_format::{DecimalMark, Separator};
use super::fields::{COMMENT_MARKS, trimmed};
use super::number::{CellNumber, is_number};
use super::text_lines::TextRecord;

/// Adapts the names of a header to the rows below: R gives no name to those of rows, and the mark of a comment
/// is a name only above a column.
pub(super) fn adapt(
    names: &mut Vec<String>,
    header: &TextRecord<'_>,
    separator: Separator,
    rows: &[(TextRecord<'_>, Vec<String>)],
    places: &[usize],
) {
    let is_mark = !names[0].is_empty() && names[0].chars().all(|c| COMMENT_MARKS.contains(&c));
    if is_mark && rows.iter().all(|(_, row)| row.len() + 1 == names.len()) {
        names.remove(0);
        return;
    }
    let is_quoted = header.text.contains('"');
    // An unquoted comma within numbers makes one field more, too.
    let is_certain = is_quoted || separator != Separator::Comma;
    let fields: Vec<_> =
        rows.iter().map(|(_, row)| trimmed(row.clone(), names.len() + 1)).collect();
    if !is_certain || !have_names(names.len(), &fields) {
        return;
    }
    // Where a column of velocities has such as it stands, it may as well be the last name that is missing.
    let is_velocity = |row: &&Vec<String>| places.iter().any(|&at| is_like_velocity(&row[at]));
    let as_they_stand = fields.iter().filter(is_velocity).count();
    if is_quoted && rows.iter().all(is_of_r) || 2 * as_they_stand < rows.len() {
        names.insert(0, String::new());
    }
}

/// Returns whether rows have one field more than the header, and their first fields are names: all different, and
/// rising numbers or none.
fn have_names(count: usize, rows: &[Vec<String>]) -> bool {
    let is_longer = |row: &Vec<String>| {
        row.len() == count + 1 && row.last().is_some_and(|last| !last.is_empty())
    };
    if rows.is_empty() || !rows.iter().all(is_longer) {
        return false;
    }
    let first: Vec<&str> = rows.iter().map(|row| row[0].as_str()).collect();
    let numbers: Vec<i64> = first.iter().filter_map(|name| name.parse().ok()).collect();
    let is_rising =
        numbers.len() == first.len() && numbers.windows(2).all(|pair| pair[1] > pair[0]);
    let mut different = first.clone();
    different.sort_unstable();
    different.dedup();
    is_rising || first.iter().all(|name| !is_number(name)) && different.len() == first.len()
}

/// Returns whether a row has its number in quotes, and another number without, as R writes them.
fn is_of_r((record, fields): &(TextRecord<'_>, Vec<String>)) -> bool {
    let quotes = record.text.bytes().filter(|&byte| byte == b'"').count();
    record.text.starts_with('"') && is_number(&fields[0]) && quotes < 2 * fields.len()
}

/// Returns whether a cell is a number of the size of velocities, in some unit.
pub(super) fn is_like_velocity(cell: &str) -> bool {
    DecimalMark::ALL.into_iter().any(|mark| {
        CellNumber::read(cell, mark).is_some_and(|number| {
            let value = number.value();
            USUAL.contains(&value) || USUAL.contains(&(1000.0 * value)) && value.fract() != 0.0
        })
    })
}
