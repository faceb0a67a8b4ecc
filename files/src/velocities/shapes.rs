//! The shape of a row: what kinds of characters its cells have, and which shape most rows have.
//!
//! A row that sums up others has a name unlike theirs, in whatever language: "Mean" below "P1", "P2", …

use std::collections::{BTreeMap, BTreeSet};

use super::header::Header;
use super::lines::{TableLine, TableLines};
use super::number::is_number;

/// Rows that are looked at: which shape is usual shows in the first of them.
const ROWS_MAX: usize = 10_000;
/// Most different shapes that are counted.
const SHAPES_MAX: usize = 200;
/// Share of the rows that have the usual shape.
const USUAL: f64 = 0.6;
/// Fewest rows of the usual shape.
const ROWS_MIN: usize = 3;
/// Fewest letters of a word.
const WORD_MIN: usize = 3;

/// The shape that most rows have, without their velocity; empty if there is none.
pub(super) struct UsualShape {
    shape: Vec<String>,
    /// The shape of the first row, which a row that begins a block may share: others leave its name away.
    first: Vec<String>,
    /// Columns with decimals, which are no names.
    decimals: BTreeSet<usize>,
}

impl UsualShape {
    pub(super) fn of_rows(text: &str, header: &Header, place: usize) -> Self {
        let mut counts: BTreeMap<Vec<String>, usize> = BTreeMap::new();
        let (mut rows, mut decimals) = (0_usize, BTreeSet::new());
        let mut first = Vec::new();
        for line in TableLines::after_header(text, header, Some(place)) {
            let Ok((_, TableLine::Data(fields))) = line else { continue };
            if rows == ROWS_MAX {
                break;
            }
            rows += 1;
            let are_decimals = |field: &String| field.contains(['.', ',']) && is_number(field);
            decimals.extend((0..fields.len()).filter(|&at| are_decimals(&fields[at])));
            let shape = of_fields(&fields, place);
            if rows == 1 {
                first.clone_from(&shape);
            }
            if counts.len() < SHAPES_MAX || counts.contains_key(&shape) {
                *counts.entry(shape).or_default() += 1;
            }
        }
        let usual = counts.into_iter().max_by_key(|(_, count)| *count);
        let is_usual = |count: usize| count >= ROWS_MIN && count as f64 >= USUAL * rows as f64;
        let shape = usual.filter(|(_, count)| is_usual(*count)).map(|(shape, _)| shape);
        Self { shape: shape.unwrap_or_default(), first, decimals }
    }

    /// Returns whether a row has another shape than most, and than the first.
    pub(super) fn is_odd(&self, fields: &[String], place: usize) -> bool {
        if self.shape.is_empty() {
            return false;
        }
        let shape = of_fields(fields, place);
        shape != self.shape && shape != self.first
    }

    /// Returns whether a row has nothing in a column in which most have something.
    pub(super) fn has_gap(&self, fields: &[String], place: usize) -> bool {
        let is_gap = |(at, field): (usize, &String)| {
            at != place
                && field.is_empty()
                && self.shape.get(at).is_some_and(|usual| !usual.is_empty())
        };
        fields.iter().enumerate().any(is_gap)
    }

    /// Returns whether a row has a word where most have a number, or a name with one.
    pub(super) fn has_word(&self, fields: &[String], place: usize) -> bool {
        self.has_word_for(fields, place, |usual| usual.contains('9'))
    }

    /// Returns whether a row has a word where most have a number.
    pub(super) fn has_word_for_number(&self, fields: &[String], place: usize) -> bool {
        self.has_word_for(fields, place, |usual| usual == "9")
    }

    fn has_word_for(&self, fields: &[String], place: usize, is_replaced: fn(&str) -> bool) -> bool {
        let is_word = |(at, field): (usize, &String)| {
            at != place
                && !self.decimals.contains(&at)
                && self.shape.get(at).is_some_and(|usual| is_replaced(usual))
                && field.chars().filter(|c| c.is_alphabetic()).count() >= WORD_MIN
                && !field.contains(|c: char| c.is_numeric())
        };
        fields.iter().enumerate().any(is_word)
    }
}

/// Returns the shape of each cell but one: letters as `a`, digits and numbers as `9`.
fn of_fields(fields: &[String], place: usize) -> Vec<String> {
    let shape = |(at, field): (usize, &String)| {
        if at == place {
            return String::new();
        }
        // Most cells are plain numbers or have no digit; is_number takes much longer.
        let has_digit = field.contains(|c: char| c.is_numeric());
        if has_digit && (field.parse::<f64>().is_ok() || is_number(field)) {
            return "9".to_owned();
        }
        let kind = |c: char| match c {
            _ if c.is_alphabetic() => 'a',
            _ if c.is_numeric() => '9',
            _ => c,
        };
        let mut kinds: Vec<char> = field.chars().map(kind).collect();
        kinds.dedup();
        kinds.into_iter().collect()
    };
    fields.iter().enumerate().map(shape).collect()
}
