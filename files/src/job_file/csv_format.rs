//! The keys of `[data]` that say how a CSV file of velocities is written.

use encoding_rs::Encoding;
use osteon_common::fields::{Choice, WholeRange};
use osteon_common::limits;

use crate::document::Value;
use crate::reader::{Reader, Table};
use crate::velocities::CsvFormat;

/// Maximum number of texts that stand for a missing value.
pub(super) const MISSING_MAX: usize = 20;
/// Numbers of lines, and of a line: a file has no more lines than bytes.
pub(super) const LINES: WholeRange = WholeRange { min: 0, max: limits::FILE_BYTES_MAX };

/// Returns the format; `None` after recording what is wrong.
pub(super) fn read(reader: &mut Reader, table: &Table<'_>) -> Option<CsvFormat> {
    let mut format = CsvFormat {
        separator: chosen(reader, table, "separator"),
        decimal: chosen(reader, table, "decimal"),
        unit: chosen(reader, table, "unit"),
        skip_lines: lines(reader, table, "skip_lines"),
        header_line: lines(reader, table, "header_line"),
        ..CsvFormat::default()
    };
    if format.skip_lines.is_some() && format.header_line.is_some_and(|line| line > 0) {
        let message = "says where the header is, and so does `header_line`; leave one of them out";
        reader.violations.add(table.path("skip_lines"), message);
    }
    let column = reader.text(table, "column", "the name of the column of velocities");
    format.column = column.map(str::to_owned);
    format.missing = missing(reader, table)?;
    if let Some(name) = reader.text(table, "encoding", "the name of an encoding") {
        format.encoding = Encoding::for_label(name.as_bytes());
        if format.encoding.is_none() {
            let message = format!(
                "is {name:?}; it must be an encoding's name on the web, such as \"utf-8\", \"utf-16le\" or \
                 \"windows-1252\" (Western Europe, Latin-1)"
            );
            reader.violations.add(table.path("encoding"), message);
        }
    }
    Some(format)
}

/// Returns what a key chooses, if it is there.
fn chosen<T: Choice + Default>(reader: &mut Reader, table: &Table<'_>, key: &str) -> Option<T> {
    let mut choice = T::default();
    table.has(key).then(|| {
        reader.choice(table, key, &mut choice);
        choice
    })
}

/// Returns a number of lines, if the key is there.
fn lines(reader: &mut Reader, table: &Table<'_>, key: &str) -> Option<usize> {
    let lines = reader.whole(table, key, LINES)?;
    usize::try_from(lines).ok()
}

fn missing(reader: &mut Reader, table: &Table<'_>) -> Option<Option<Vec<String>>> {
    let path = table.path("missing");
    let expected = "a list of at most 20 texts, such as [\"\", \"NA\"]";
    match table.get("missing").map(|node| &node.value) {
        None => Some(None),
        Some(Value::List(elements)) if elements.len() <= MISSING_MAX => {
            Some(Some(reader.texts(&path, elements)?.into_iter().map(str::to_owned).collect()))
        }
        Some(other) => {
            reader.wrong_type(path, expected, other);
            None
        }
    }
}
