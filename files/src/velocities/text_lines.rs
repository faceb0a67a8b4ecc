//! The lines of a text, and the fields of the records that they make.

use osteon_common::limits;

use super::csv_format::Separator;
use super::fields::csv_fields;
use super::problem::{LocatedProblem, Problem};

/// Most lines over which a quoted field may go on.
const QUOTED_LINES_MAX: usize = 20;
/// Most open quotes of a text whose end is looked for below their line.
const SEARCHES_MAX: usize = 100;

/// A line, or several with a quoted field that goes on over their ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TextRecord<'a> {
    /// Number of the first line, from 1.
    pub(super) line: usize,
    pub(super) text: &'a str,
}

impl TextRecord<'_> {
    /// Returns whether it has nothing to read: neither a value nor a name.
    pub(super) fn is_blank(&self) -> bool {
        self.text.trim().is_empty()
    }

    /// Returns whether it is a comment.
    pub(super) fn is_comment(&self) -> bool {
        self.text.trim_start().starts_with('#')
    }
}

/// The records of a text.
#[derive(Debug, Clone)]
pub(super) struct TextRecords<'a> {
    rest: &'a str,
    /// Number of the next line, from 1.
    line: usize,
    separator: Separator,
    /// How often an open quote may still be looked for the end of.
    searches: usize,
}

impl<'a> TextRecords<'a> {
    /// Returns the records of a text whose fields are separated so.
    pub(super) fn split(text: &'a str, separator: Separator) -> Self {
        Self { rest: text, line: 1, separator, searches: SEARCHES_MAX }
    }

    /// Skips lines, whatever is in them.
    pub(super) fn skip_lines(mut self, count: usize) -> Self {
        for _ in 0..count {
            let (_, rest) = split_line(self.rest);
            self.rest = rest;
            self.line += 1;
        }
        self
    }

    /// Returns the length of the record that begins here, and how many lines it has: one, unless a quoted
    /// field is not closed in the first.
    fn extent(&mut self, first: &str) -> (usize, usize) {
        let quotes = |text: &str| text.bytes().filter(|&byte| byte == b'"').count();
        let mut count = quotes(first);
        let is_open = count % 2 == 1 && csv_fields(first, self.separator).is_err();
        if !is_open || self.searches == 0 {
            return (first.len(), 1);
        }
        self.searches -= 1;
        let mut rest = split_line(self.rest).1;
        for lines in 2..=QUOTED_LINES_MAX {
            let (next, after) = split_line(rest);
            let length = self.rest.len() - rest.len() + next.len();
            let is_end = rest.is_empty() || length > limits::LINE_BYTES_MAX;
            if is_end {
                break;
            }
            // Only a line with a quote can close the field.
            let more = quotes(next);
            count += more;
            let is_closed = more > 0 && count % 2 == 0;
            if is_closed && csv_fields(&self.rest[..length], self.separator).is_ok() {
                return (length, lines);
            }
            rest = after;
        }
        (first.len(), 1)
    }
}

impl<'a> Iterator for TextRecords<'a> {
    type Item = Result<TextRecord<'a>, LocatedProblem>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let (first, _) = split_line(self.rest);
        let line = self.line;
        let refused = |problem| Some(Err((Some(line), problem)));
        if first.len() > limits::LINE_BYTES_MAX {
            self.rest = "";
            return refused(Problem::LongLine);
        }
        let (length, lines) = self.extent(first);
        let text = &self.rest[..length];
        if text.contains('\0') {
            self.rest = "";
            return refused(Problem::Nul);
        }
        for _ in 0..lines {
            self.rest = split_line(self.rest).1;
        }
        self.line += lines;
        Some(Ok(TextRecord { line, text }))
    }
}

/// Returns the first line of a text without its end, and what follows it.
fn split_line(text: &str) -> (&str, &str) {
    let (line, rest) = text.split_once('\n').unwrap_or((text, ""));
    (line.trim_end_matches('\r'), rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn records(text: &str) -> Vec<(usize, &str)> {
        TextRecords::split(text, Separator::Comma)
            .map(|record| record.map_or((0, ""), |record| (record.line, record.text)))
            .collect()
    }

    #[test]
    fn a_quoted_field_goes_on_over_lines() {
        let check =
            |text, expected: &[(usize, &str)]| assert_eq!(records(text), expected, "{text}");
        check("a,b\r\n1,2\n\n3,4", &[(1, "a,b"), (2, "1,2"), (3, ""), (4, "3,4")]);
        check("\"a\n(m/s)\",b\n1,2\n", &[(1, "\"a\n(m/s)\",b"), (3, "1,2")]);
        check("5\" probe,1\n2,3\n", &[(1, "5\" probe,1"), (2, "2,3")]);
        check("\"open,1\n2,3\n", &[(1, "\"open,1"), (2, "2,3")]);
    }

    #[test]
    fn a_line_that_is_too_long_or_no_text_ends_the_records() {
        let long = "x".repeat(limits::LINE_BYTES_MAX + 1);
        assert_eq!(records(&format!("a\n{long}\nb\n")), [(1, "a"), (0, "")]);
        assert_eq!(records("a\n1\u{0}2\nb\n"), [(1, "a"), (0, "")]);
    }

    #[test]
    fn lines_are_skipped_whatever_is_in_them() {
        let rest = TextRecords::split("\"open\nx\nvelocity\n", Separator::Comma).skip_lines(2);
        let found: Vec<_> = rest.map(|record| record.map(|record| record.line)).collect();
        assert!(matches!(found[..], [Ok(3)]));
    }
}
