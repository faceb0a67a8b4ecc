//! Which texts and numbers of a column stand for values that are missing.

use std::cmp::Reverse;

use super::cells::{CellMark, Cells, Text};
use super::csv_format::{CsvFormat, DecimalMark};
use super::header::{Header, is_gap};
use super::problem::{LocatedProblem, Problem, shortened};

/// Maximum number of texts that a job file names as missing.
const MISSING_MAX: usize = 20;
/// Longest text that stands for a missing value, characters.
const MISSING_CHARACTERS_MAX: usize = 40;
/// Texts that stand for missing values although they have digits.
const MISSING: [&str; 3] = ["#DIV/0!", "#NUM!", "1.#QNAN"];
/// By how much a number that stands for none is larger than the largest velocity, or smaller than the smallest.
const APART: f64 = 1.5;

impl Cells {
    /// Returns the texts that stand for missing values.
    pub(super) fn missing(
        &self,
        mark: DecimalMark,
        format: &CsvFormat,
        header: &Header,
    ) -> Result<Vec<String>, LocatedProblem> {
        if let Some(missing) = &format.missing {
            return Ok(missing.clone());
        }
        let column = shortened(&header.names[self.place]);
        self.refuse_strange(&column, header.line)?;
        let mut missing: Vec<String> = self.texts.keys().cloned().collect();
        missing.extend(self.numbers_for_none(mark)?);
        missing.sort();
        match missing.len() > MISSING_MAX {
            true => {
                let (count, first) = (missing.len(), shortened(&missing[0]));
                Err((None, Problem::ManyTexts { column, count, first }))
            }
            false => Ok(missing),
        }
    }

    /// Refuses texts that may be more than a gap: a number written in another way, or a name.
    fn refuse_strange(&self, column: &str, header: usize) -> Result<(), LocatedProblem> {
        let has_digit = |text: &str| text.contains(|c: char| c.is_numeric());
        let is_strange = |(found, text): &(&String, &Text)| {
            has_digit(found) && !MISSING.contains(&found.as_str())
                || found.chars().count() > MISSING_CHARACTERS_MAX
                || text.is_name && !is_gap(found)
                || text.is_first && text.count == 1 && !is_gap(found)
        };
        let strange = self.texts.iter().filter(is_strange);
        let Some((found, text)) = strange.min_by_key(|(_, text)| text.line) else { return Ok(()) };
        let (column, found) = (column.to_owned(), shortened(found));
        Err((
            Some(text.line),
            match has_digit(&found) {
                false if text.is_name => Problem::TwoTables { first: header, second: text.line },
                false if text.is_first => Problem::NameBelow { column, found },
                _ => Problem::NotNumbers { column, found },
            },
        ))
    }

    /// Returns the numbers that stand for missing values.
    fn numbers_for_none(&self, mark: DecimalMark) -> Result<Vec<String>, LocatedProblem> {
        let at = usize::from(mark == DecimalMark::Comma);
        let is_mark = |value: &f64| self.marks.values().any(|mark| mark.values[at] == *value);
        let usual: Vec<f64> = self
            .values
            .iter()
            .map(|values| values[at])
            .filter(|value| !is_mark(value) && *value > 0.0)
            .collect();
        let largest = usual.iter().copied().fold(0.0, f64::max);
        let smallest = usual.iter().copied().fold(f64::INFINITY, f64::min);
        let mut for_none = Vec::new();
        let mut marks: Vec<(&String, &CellMark)> = self.marks.iter().collect();
        marks.sort_by_key(|(_, mark)| Reverse(mark.line));
        while let Some((text, mark)) = marks.pop() {
            let value = mark.values[at];
            let is_like_velocity = (smallest / APART..APART * largest).contains(&value.abs());
            let found = || shortened(text);
            let located = |problem| Err((Some(mark.line), problem));
            match mark.is_repeated && !usual.is_empty() {
                _ if value < 0.0 && is_like_velocity => {
                    return located(Problem::Negative { found: found() });
                }
                _ if value <= 0.0 => for_none.push(text.clone()),
                true if !is_like_velocity && text.contains('9') && value > largest => {
                    for_none.push(text.clone());
                }
                true if !is_like_velocity => {
                    return located(Problem::LikeCode { found: found() });
                }
                _ => {}
            }
        }
        Ok(for_none)
    }
}
