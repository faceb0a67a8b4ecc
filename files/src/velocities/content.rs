//! What is in a file: its text, or tables that were made text of, with tabs between their fields.

use encoding_rs::Encoding;

use super::csv_format::Separator;
use super::encodings;

/// The text of a file.
#[derive(Debug)]
pub(super) struct Content {
    pub(super) text: String,
    /// The encoding, if it was found out and a job file must name it.
    pub(super) encoding: Option<&'static Encoding>,
    /// Whether characters without width were dropped.
    pub(super) had_invisible: bool,
    /// Where the table comes from, if it was no text.
    pub(super) origin: Option<String>,
}

impl Content {
    /// Returns a table that was no text.
    pub(super) fn of_table(text: String, origin: String) -> Self {
        Self { text, encoding: None, had_invisible: false, origin: Some(origin) }
    }

    /// Returns what separates the fields, if the file itself does not say it.
    pub(super) fn separator(&self) -> Option<Separator> {
        self.origin.is_some().then_some(Separator::Tab)
    }
}

/// Returns a field of a table as text between tabs, on one line.
pub(super) fn field(text: &str) -> String {
    let text = text.replace(['\n', '\r', '\t', '\0'], " ");
    match text.contains('"') {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text,
    }
}

/// A column of numbers with a name.
#[derive(Debug)]
pub(super) struct NumberColumn {
    pub(super) name: String,
    pub(super) numbers: Vec<f64>,
}

/// Returns whether an array with these lengths is a vector.
pub(super) fn is_vector(shape: &[usize]) -> bool {
    shape.iter().filter(|&&length| length != 1).count() == 1
}

/// Returns tables of columns: those of one length are beside each other, in the order in which they come.
pub(super) fn tables_of(columns: &[NumberColumn], origin: &str) -> Vec<Content> {
    let mut lengths: Vec<usize> = Vec::new();
    for column in columns {
        if !lengths.contains(&column.numbers.len()) {
            lengths.push(column.numbers.len());
        }
    }
    lengths
        .into_iter()
        .map(|length| {
            let of_length: Vec<_> =
                columns.iter().filter(|column| column.numbers.len() == length).collect();
            let line = |cells: Vec<String>| cells.join("\t") + "\n";
            let mut text = line(of_length.iter().map(|column| field(&column.name)).collect());
            for row in 0..length {
                text += &line(of_length.iter().map(|column| cell(column.numbers[row])).collect());
            }
            Content::of_table(encodings::normalised(text), origin.to_owned())
        })
        .collect()
}

/// Returns a number as text; not a number is a gap.
fn cell(number: f64) -> String {
    if number.is_nan() { String::new() } else { format!("{number:?}") }
}
