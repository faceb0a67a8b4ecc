//! Encoding, separator and decimal mark of a CSV file, and its cells.

use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};
use osteon_common::limits;

use crate::velocities::{DecimalMark, Separator, csv_fields};

/// Maximum number of lines that are looked at: those of the largest file that a job can use, with its
/// header and a line above it.
const LINES_MAX: usize = limits::DATA_VELOCITIES_MAX + 2;
/// Number of lines by which the separator is chosen.
const SEPARATOR_LINES: usize = 200;

/// A file as a table of texts.
#[derive(Debug)]
pub(super) struct Layout {
    /// The encoding, if a job file must name it.
    pub(super) encoding: Option<&'static Encoding>,
    pub(super) separator: Separator,
    /// Whether the job file need not name the separator.
    pub(super) is_usual_separator: bool,
    pub(super) decimal: DecimalMark,
    /// Names of the columns.
    pub(super) names: Vec<String>,
    /// The rows, each with as many cells as there are names.
    pub(super) rows: Vec<Vec<String>>,
}

impl Layout {
    /// Returns the layout of a file with these bytes, or why there is none.
    pub(super) fn of(bytes: &[u8]) -> Result<Self, String> {
        let (used, named) = encoding(bytes);
        let (text, _, _) = used.decode(bytes);
        let is_text = |line: &&str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
        let mut lines: Vec<&str> = text.lines().filter(is_text).take(LINES_MAX).collect();
        let above = lines.first().and_then(|line| Separator::of_first_line(line));
        if above.is_some() {
            lines.remove(0);
        }
        let Some((header, rows)) = lines.split_first() else {
            return Err(
                "it is empty; it must have a line with the names of the columns, and a row for \
                        each velocity"
                    .to_owned(),
            );
        };
        let separator = above.unwrap_or_else(|| separator(&lines));
        let fields = |line: &str| csv_fields(line, separator.character());
        let names = fields(header).unwrap_or_default();
        let cells = |line: &&str| {
            let mut cells = fields(line).unwrap_or_default();
            cells.resize(names.len(), String::new());
            cells
        };
        let is_row = |cells: &Vec<String>| cells.iter().any(|cell| !cell.is_empty());
        let rows: Vec<Vec<String>> = rows.iter().map(cells).filter(is_row).collect();
        let decimal = decimal(&rows, separator);
        if names.iter().all(|name| decimal.number(name).is_some()) {
            return Err(
                "its first line has only numbers; write the names of the columns above it, such \
                        as `velocity`"
                    .to_owned(),
            );
        }
        let is_usual_separator = above.is_some() || separator == Separator::default();
        Ok(Self { encoding: named, separator, is_usual_separator, decimal, names, rows })
    }

    /// Returns the cells of a column.
    pub(super) fn column(&self, place: usize) -> impl Iterator<Item = &str> + Clone {
        self.rows.iter().map(move |row| row.get(place).map_or("", String::as_str))
    }

    /// Returns the encoding's name, as users write it.
    pub(super) fn encoding_name(&self) -> Option<String> {
        self.encoding.map(|encoding| encoding.name().to_lowercase())
    }

    /// Says what was found.
    pub(super) fn described(&self) -> Vec<String> {
        let separator = match self.separator {
            Separator::Comma => "commas",
            Separator::Semicolon => "semicolons",
            Separator::Tab => "tabs",
            Separator::Bar => "vertical bars",
        };
        let decimal = match self.decimal {
            DecimalMark::Point => "decimal points",
            DecimalMark::Comma => "decimal commas",
        };
        let between = match self.names.len() {
            1 => String::new(),
            _ => format!("fields separated by {separator}, "),
        };
        let encoding = self.encoding_name().map_or_else(String::new, |name| format!(", {name}"));
        let (rows, columns) = (self.rows.len(), self.names.len());
        let plural = |count: usize| if count == 1 { "" } else { "s" };
        vec![format!(
            "{rows} row{} of {columns} column{}: {between}{decimal}{encoding}",
            plural(rows),
            plural(columns)
        )]
    }
}

/// Returns the encoding of a file, and the one to name in a job file.
fn encoding(bytes: &[u8]) -> (&'static Encoding, Option<&'static Encoding>) {
    if let Some((encoding, _)) = Encoding::for_bom(bytes) {
        return (encoding, None);
    }
    // In UTF-16, every other byte of a number is 0.
    let zeros =
        |first: usize| bytes.iter().skip(first).step_by(2).filter(|&&byte| byte == 0).count();
    let (even, odd) = (zeros(0), zeros(1));
    if even.max(odd) > bytes.len() / 8 {
        let encoding = if odd > even { UTF_16LE } else { UTF_16BE };
        return (encoding, Some(encoding));
    }
    match str::from_utf8(bytes) {
        Ok(_) => (UTF_8, None),
        Err(_) => (WINDOWS_1252, Some(WINDOWS_1252)),
    }
}

/// Returns the separator with which the most lines have as many fields as the first; of several, the one
/// with the most fields.
fn separator(lines: &[&str]) -> Separator {
    let score = |separator: &Separator| {
        let count =
            |line: &&&str| csv_fields(line, separator.character()).ok().map(|fields| fields.len());
        let lines = &lines[..lines.len().min(SEPARATOR_LINES)];
        let header = lines.iter().next().and_then(|line| count(&line));
        let same = lines.iter().filter(|line| header.is_some() && count(line) == header).count();
        (same, header)
    };
    let best = Separator::ALL.iter().map(score).max();
    Separator::ALL.into_iter().find(|one| Some(score(one)) == best).unwrap_or_default()
}

/// Returns the decimal mark with which the most cells are numbers.
fn decimal(rows: &[Vec<String>], separator: Separator) -> DecimalMark {
    let numbers = |mark: DecimalMark| {
        rows.iter().flatten().filter(|cell| mark.number(cell).is_some()).count()
    };
    let point = numbers(DecimalMark::Point);
    let comma = numbers(DecimalMark::Comma);
    // Fields that are separated by commas have decimal commas only within quotes.
    let least = if separator == Separator::Comma { point + 1 } else { point };
    if comma > least.max(point) { DecimalMark::Comma } else { DecimalMark::Point }
}
