//! The lines below a header: rows of the table, and what else stands there.

use super::csv_format::Separator;
use super::fields::{csv_fields, trimmed};
use super::header::{Header, are_units, is_rule};
use super::number::is_number;
use super::problem::LocatedProblem;
use super::statistics::SummaryLabel;
use super::text_lines::TextRecords;
use super::units::{self, NamedUnit};

/// A line that is neither empty nor a comment.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum TableLine {
    /// The units of the columns, directly below the header.
    Units(Vec<Option<NamedUnit>>),
    /// The header again.
    RepeatedHeader,
    /// A line that is drawn, or has only separators.
    Rule,
    /// A row that says of itself that it sums up others.
    Labelled { label: SummaryLabel, fields: Vec<String> },
    /// A row, with as many fields as there are names.
    Data(Vec<String>),
    /// A row with another number of fields.
    OtherShape(Vec<String>),
    /// A line with a quote that is not closed.
    OpenQuote,
}

/// The lines below a header.
pub(super) struct TableLines<'a> {
    records: TextRecords<'a>,
    header: &'a Header,
    /// Place of the velocities, if it is known.
    place: Option<usize>,
    /// Whether no row has come yet.
    is_first: bool,
    /// Whether the last line was empty.
    pub(super) is_after_gap: bool,
    /// Whether the last row had empty fields beyond those of the header.
    pub(super) is_longer: bool,
    /// Number of comments so far.
    pub(super) comments: usize,
    /// Number of fields of the first row.
    length: Option<usize>,
}

impl<'a> TableLines<'a> {
    pub(super) fn after_header(text: &'a str, header: &'a Header, place: Option<usize>) -> Self {
        let records = header.rows(text);
        Self {
            records,
            header,
            place,
            is_first: true,
            is_after_gap: false,
            is_longer: false,
            length: None,
            comments: 0,
        }
    }

    fn line(&mut self, fields: Vec<String>) -> TableLine {
        let length = fields.len();
        self.is_longer = length > self.header.names.len();
        // A comma within a number fills what ends the other rows, and is not seen at the number of fields.
        let is_other = self.length.is_some_and(|first| first != length);
        if self.is_longer && is_other && self.is_filled_behind(&fields) {
            return TableLine::OtherShape(fields);
        }
        let fields = trimmed(fields, self.header.names.len());
        if fields.iter().all(String::is_empty) && fields.len() > 1 || is_rule(&fields) {
            return TableLine::Rule;
        }
        if self.is_first && are_units(&fields, self.place.as_slice()) && self.header.line > 0 {
            self.is_first = false;
            return TableLine::Units(fields.iter().map(|field| units::of_text(field)).collect());
        }
        if self.header.line > 0 && is_header(&fields, &self.header.names) {
            return TableLine::RepeatedHeader;
        }
        self.is_first = false;
        if let Some(label) = self.label(&fields) {
            return TableLine::Labelled { label, fields };
        }
        self.length.get_or_insert(length);
        match fields.len() == self.header.names.len() {
            true => TableLine::Data(fields),
            false => TableLine::OtherShape(fields),
        }
    }

    /// Returns whether a quoted field goes on over lines which are rows themselves: its quote was left open.
    fn has_rows(&self, record: &str) -> bool {
        let count = self.header.names.len();
        let is_row = |line: &str| {
            let fields: Vec<&str> = match self.header.separator.character() {
                Some(separator) => line.split(separator).collect(),
                None => return false,
            };
            let cell = self.place.and_then(|place| fields.get(place));
            fields.len() >= count && count > 1 && cell.is_some_and(|cell| is_number(cell))
        };
        record.lines().skip(1).any(is_row)
    }

    /// Returns whether, in a table with commas, the last column is not that of the velocities but behind it, and
    /// is not empty in this row.
    fn is_filled_behind(&self, fields: &[String]) -> bool {
        let last = self.header.names.len().saturating_sub(1);
        self.header.separator == Separator::Comma
            && self.place.is_some_and(|place| place < last)
            && fields.get(last).is_some_and(|field| !field.is_empty())
    }

    /// Returns the label by which a row sums up others: in its first cell that is not empty, in the cell before
    /// the velocity, or in that of the velocity.
    fn label(&self, fields: &[String]) -> Option<SummaryLabel> {
        let place = self.place?;
        let first = fields.iter().find(|field| !field.is_empty())?;
        let before = place.checked_sub(1).and_then(|place| fields.get(place));
        let cells = [Some(first), before, fields.get(place)];
        cells.into_iter().flatten().find_map(|cell| SummaryLabel::recognize(cell))
    }
}

/// Returns whether fields are the names of the columns; an empty first one, above names of rows, may be missing.
fn is_header(fields: &[String], names: &[String]) -> bool {
    let names = if names.first().is_some_and(String::is_empty) && fields.len() < names.len() {
        &names[1..]
    } else {
        names
    };
    fields == names
}

impl Iterator for TableLines<'_> {
    type Item = Result<(usize, TableLine), LocatedProblem>;

    fn next(&mut self) -> Option<Self::Item> {
        self.is_after_gap = false;
        loop {
            let record = match self.records.next()? {
                Ok(record) => record,
                Err(problem) => return Some(Err(problem)),
            };
            if record.is_blank() {
                self.is_after_gap = true;
                continue;
            }
            if record.is_comment() {
                self.comments += 1;
                continue;
            }
            let fields = csv_fields(record.text, self.header.separator);
            let fields = fields.ok().filter(|_| !self.has_rows(record.text));
            let line = fields.map_or(TableLine::OpenQuote, |fields| self.line(fields));
            return Some(Ok((record.line, line)));
        }
    }
}
