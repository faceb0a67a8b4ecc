//! The sheets of an Excel workbook (`.xlsx`).
//!
//! Cells are taken one after the other: a sheet of two cells may claim to be a million rows high. How much
//! the archive unpacks to is measured before, by unpacking it and keeping nothing.

use std::io::{self, Cursor, Read as _};

use calamine::{DataRef, Reader as _, Xlsx};
use osteon_common::limits;
use zip::ZipArchive;

use super::content::{Content, field};
use super::encodings;
use super::problem::Problem;

/// Most bytes that a workbook may unpack to.
const UNPACKED_BYTES_MAX: u64 = 2 * limits::FILE_BYTES_MAX;
/// Most sheets of a workbook that are looked at.
const SHEETS_MAX: usize = 100;
/// Most columns of a sheet, as of Excel.
const COLUMNS_MAX: u32 = 16_384;
const WHAT: &str = "an Excel workbook";

/// Returns the sheets that have any cells.
pub(super) fn tables(bytes: Vec<u8>) -> Result<Vec<Content>, Problem> {
    if !bytes.windows(3).any(|part| part == b"xl/") {
        return Err(Problem::OtherKind {
            what: "a ZIP archive, and no Excel workbook",
            cure: "unpack it first, or save the table as CSV",
        });
    }
    if unpacked_length(&bytes)? > UNPACKED_BYTES_MAX {
        return Err(Problem::UnpackedTooLarge { bytes: UNPACKED_BYTES_MAX });
    }
    let damaged =
        |error: calamine::XlsxError| Problem::Damaged { what: WHAT, reason: error.to_string() };
    let mut workbook = Xlsx::new(Cursor::new(bytes)).map_err(damaged)?;
    let mut tables = Vec::new();
    let names: Vec<String> =
        workbook.sheets_metadata().iter().map(|sheet| sheet.name.clone()).collect();
    for name in names.into_iter().take(SHEETS_MAX) {
        // Sheets of pictures and charts have no cells.
        let Ok(text) = sheet(&mut workbook, &name) else { continue };
        if !text.trim().is_empty() {
            let origin = format!("sheet {name:?} of {WHAT}");
            tables.push(Content::of_table(encodings::normalised(text), origin));
        }
    }
    if tables.is_empty() {
        let reason = "it has no cells".to_owned();
        return Err(Problem::Damaged { what: WHAT, reason });
    }
    Ok(tables)
}

/// Returns the cells of a sheet: a line for each row, so that their numbers are the same.
fn sheet(workbook: &mut Xlsx<Cursor<Vec<u8>>>, name: &str) -> Result<String, calamine::XlsxError> {
    let mut cells = workbook.worksheet_cells_reader(name)?;
    let mut text = String::new();
    let (mut row, mut column) = (0, 0);
    while let Some(cell) = cells.next_cell()? {
        let (cell_row, cell_column) = cell.get_position();
        let content = shown(cell.get_value());
        // What comes in another order, or has no text, adds nothing.
        let is_next = cell_row > row || cell_row == row && cell_column >= column;
        if content.is_empty() || !is_next || cell_column >= COLUMNS_MAX {
            continue;
        }
        while row < cell_row && text.len() < limits::FILE_BYTES_MAX as usize {
            text.push('\n');
            (row, column) = (row + 1, 0);
        }
        while column < cell_column {
            text.push('\t');
            column += 1;
        }
        text.push_str(&field(&content));
        if text.len() >= limits::FILE_BYTES_MAX as usize {
            break;
        }
    }
    Ok(padded(text + "\n"))
}

/// Returns rows with as many fields as the longest has: empty cells at the end are not in the file.
fn padded(text: String) -> String {
    let tabs = |line: &str| line.bytes().filter(|&byte| byte == b'\t').count();
    let longest = text.lines().map(tabs).max().unwrap_or(0);
    if longest.saturating_mul(text.lines().count()) > limits::FILE_BYTES_MAX as usize {
        return text;
    }
    let pad = |line: &str| match line.is_empty() {
        true => "\n".to_owned(),
        false => format!("{line}{}\n", "\t".repeat(longest - tabs(line))),
    };
    text.lines().map(pad).collect()
}

/// Returns the text of a cell; numbers with a decimal point, and dates as none.
fn shown(value: &DataRef<'_>) -> String {
    match value {
        DataRef::Int(number) => number.to_string(),
        DataRef::Float(number) => format!("{number}"),
        DataRef::String(text) => text.clone(),
        DataRef::SharedString(text) => (*text).to_owned(),
        DataRef::Bool(value) => value.to_string(),
        DataRef::DateTime(date) => format!("date {}", date.as_f64()),
        DataRef::DateTimeIso(text) | DataRef::DurationIso(text) => text.clone(),
        DataRef::Error(error) => error.to_string(),
        DataRef::Empty => String::new(),
    }
}

/// Returns to how many bytes the files of an archive unpack; more than [`UNPACKED_BYTES_MAX`] are not counted.
///
/// What an archive says of itself may be wrong; a file in it that is not stored as usual makes it none.
fn unpacked_length(archive: &[u8]) -> Result<u64, Problem> {
    let damaged = || Problem::Damaged { what: WHAT, reason: "its directory is damaged".to_owned() };
    let mut archive = ZipArchive::new(Cursor::new(archive)).map_err(|_| damaged())?;
    let mut total = 0;
    for index in 0..archive.len() {
        let file = archive.by_index(index).map_err(|_| damaged())?;
        let room = UNPACKED_BYTES_MAX - total + 1;
        total += io::copy(&mut file.take(room), &mut io::sink()).map_err(|_| damaged())?;
        if total > UNPACKED_BYTES_MAX {
            break;
        }
    }
    Ok(total)
}
