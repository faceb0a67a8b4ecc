//! The keys of `[data]` that say how a CSV file of velocities is written.

use encoding_rs::Encoding;

use crate::document::Value;
use crate::reader::{Reader, Table};
use crate::velocities::{CsvFormat, Separator};

/// Maximum number of texts that stand for a missing value.
pub(super) const MISSING_MAX: usize = 20;

/// Returns the format; `None` after recording what is wrong.
pub(super) fn read(reader: &mut Reader, table: &Table<'_>) -> Option<CsvFormat> {
    let mut format = CsvFormat::default();
    if table.has("separator") {
        let mut separator = Separator::default();
        reader.choice(table, "separator", &mut separator);
        format.separator = Some(separator);
    }
    reader.choice(table, "decimal", &mut format.decimal);
    reader.choice(table, "unit", &mut format.unit);
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

fn missing(reader: &mut Reader, table: &Table<'_>) -> Option<Vec<String>> {
    let path = table.path("missing");
    let expected = "a list of at most 20 texts, such as [\"\", \"NA\"]";
    match table.get("missing").map(|node| &node.value) {
        None => Some(Vec::new()),
        Some(Value::List(elements)) if elements.len() <= MISSING_MAX => {
            Some(reader.texts(&path, elements)?.into_iter().map(str::to_owned).collect())
        }
        Some(other) => {
            reader.wrong_type(path, expected, other);
            None
        }
    }
}
