//! The lines below a header: rows of the table, and what else stands there.

use super::csv_format::VelocityUnit;
use super::fields::csv_fields;
use super::header::{Header, are_units, is_rule, trimmed};
use super::problem::LocatedProblem;
use super::statistics::SummaryLabel;
use super::text_lines::TextRecords;
use super::units;

/// A line that is neither empty nor a comment.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum TableLine {
    /// The units of the columns, directly below the header.
    Units(Vec<Option<VelocityUnit>>),
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
}

impl<'a> TableLines<'a> {
    pub(super) fn after_header(text: &'a str, header: &'a Header, place: Option<usize>) -> Self {
        let records = header.rows(text);
        Self { records, header, place, is_first: true, is_after_gap: false }
    }

    fn line(&mut self, fields: Vec<String>) -> TableLine {
        let fields = trimmed(fields, self.header.names.len());
        if fields.iter().all(String::is_empty) && fields.len() > 1 || is_rule(&fields) {
            return TableLine::Rule;
        }
        if self.is_first && are_units(&fields, self.place.as_slice()) && self.header.line > 0 {
            self.is_first = false;
            return TableLine::Units(
                fields.iter().map(|field| units::of_velocity(field)).collect(),
            );
        }
        if self.header.line > 0 && is_header(&fields, &self.header.names) {
            return TableLine::RepeatedHeader;
        }
        self.is_first = false;
        if let Some(label) = self.label(&fields) {
            return TableLine::Labelled { label, fields };
        }
        match fields.len() == self.header.names.len() {
            true => TableLine::Data(fields),
            false => TableLine::OtherShape(fields),
        }
    }

    /// Returns the label by which a row sums up others: in its first cell that is not empty, in the cell before
    /// the velocity, or in that of the velocity.
    fn label(&self, fields: &[String]) -> Option<SummaryLabel> {
        let place = self.place?;
        let first = fields.iter().find(|field| !field.is_empty())?;
        let before = place.checked_sub(1).and_then(|place| fields.get(place));
        let of_place = fields.get(place).filter(|field| *field != first);
        SummaryLabel::recognize(first)
            .or_else(|| {
                before
                    .filter(|field| *field != first)
                    .and_then(|field| SummaryLabel::recognize(field))
            })
            .or_else(|| of_place.and_then(|field| SummaryLabel::recognize(field)))
    }
}

/// Returns whether fields are the names of the columns; what follows in the header may be missing at the end.
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
            }
            if record.is_blank() || record.is_comment() {
                continue;
            }
            let fields = csv_fields(record.text, self.header.separator);
            let line = fields.map_or(TableLine::OpenQuote, |fields| self.line(fields));
            return Some(Ok((record.line, line)));
        }
    }
}
