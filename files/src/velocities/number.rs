//! A number as people and programs write it in a cell.
//!
//! Beside digits and a decimal mark that may be: marks of thousands, an exponent of Fortran (`D+03`), a
//! unit of velocity, an error after `±`, and the forms by which spreadsheets make a text of a number
//! (`="3908.5"`, `'3908.5`). What can be read in two ways under one decimal mark is no number.

use std::borrow::Cow;

use super::csv_format::{DecimalMark, VelocityUnit};
use super::units;

/// Longest text that is looked at, characters.
const CHARACTERS_MAX: usize = 80;
/// Digits between two marks of thousands.
const GROUP_DIGITS: usize = 3;
/// Fewest equal digits that are a mark.
const REPEATED_MIN: usize = 3;
/// What stands between a value and its error.
const BEFORE_ERROR: [&str; 3] = ["\u{b1}", "+/-", "+-"];

/// A number, and what stands with it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CellNumber {
    /// The cell.
    text: String,
    /// Sign, digits and decimal point.
    digits: String,
    exponent: i32,
    /// The unit in the cell.
    pub(super) unit: Option<VelocityUnit>,
    /// Whether an error follows it.
    pub(super) has_error: bool,
}

/// Returns whether a cell is a number, with either decimal mark.
pub(super) fn is_number(cell: &str) -> bool {
    DecimalMark::ALL.into_iter().any(|mark| CellNumber::read(cell, mark).is_some())
}

impl CellNumber {
    /// Reads a cell.
    pub(super) fn read(text: &str, decimal: DecimalMark) -> Option<Self> {
        if text.len() > 4 * CHARACTERS_MAX {
            return None;
        }
        let cell = text;
        let text = half_width(bare(text.trim()));
        // Most cells of text end here: the search for a unit takes much longer.
        if !text.contains(|c: char| c.is_ascii_digit()) {
            return None;
        }
        let (value, error) = match BEFORE_ERROR.iter().find_map(|mark| text.split_once(mark)) {
            Some((value, error)) => (value.trim(), Some(error.trim())),
            None => (text.trim(), None),
        };
        let (value, unit) = without_unit(value);
        let mut unit = unit;
        if let Some(error) = error {
            let (error, of_error) = without_unit(error);
            plain_digits(error, decimal)?;
            unit = unit.or(of_error);
        }
        let (mantissa, exponent) = split_exponent(value)?;
        let digits = plain_digits(mantissa, decimal)?;
        Some(Self { text: cell.to_owned(), digits, exponent, unit, has_error: error.is_some() })
    }

    /// Returns the text of its cell.
    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// Returns whether it is one digit again and again, by which programs mark that there is no value.
    pub(super) fn is_repeated(&self) -> bool {
        let mut digits = self.digits.trim_end_matches(".0").bytes().filter(u8::is_ascii_digit);
        let Some(first) = digits.next() else { return false };
        digits.clone().count() + 1 >= REPEATED_MIN && digits.all(|digit| digit == first)
    }

    /// Returns the number, in the unit of its cell.
    pub(super) fn value(&self) -> f64 {
        self.scaled(0)
    }

    /// Returns the velocity in m/s, given the unit of the column; that of the cell takes precedence.
    ///
    /// It is rounded once: 3.9105 km/s is 3910.5 m/s to the bit.
    pub(super) fn velocity(&self, unit: VelocityUnit) -> f64 {
        self.scaled(self.unit.unwrap_or(unit).power())
    }

    /// Returns half of the last decimal in m/s: by so much it may have been rounded.
    pub(super) fn rounding(&self, unit: VelocityUnit) -> f64 {
        let decimals = self.digits.split_once('.').map_or(0, |(_, decimals)| decimals.len());
        let decimals = i32::try_from(decimals).unwrap_or(i32::MAX);
        let power = self.unit.unwrap_or(unit).power();
        let power = self.exponent.saturating_add(power).saturating_sub(decimals);
        0.5 * format!("1e{power}").parse::<f64>().unwrap_or(f64::INFINITY)
    }

    /// Returns whether it is written more finely than numbers that are rounded so.
    pub(super) fn has_more_decimals(&self, rounding: f64, unit: VelocityUnit) -> bool {
        self.rounding(unit) < 0.9 * rounding
    }

    fn scaled(&self, power: i32) -> f64 {
        let exponent = self.exponent.saturating_add(power);
        // The digits were checked when they were read.
        format!("{}e{exponent}", self.digits).parse().unwrap_or(f64::NAN)
    }
}

/// Returns a cell without what makes a text of it in a spreadsheet.
fn bare(text: &str) -> &str {
    let inner = text.strip_prefix("=\"").and_then(|rest| rest.strip_suffix('"'));
    if let Some(inner) = inner {
        return inner;
    }
    match text.strip_prefix('\'') {
        Some(rest) if rest.starts_with(|c: char| c.is_ascii_digit()) => rest,
        _ => text,
    }
}

/// Returns a text with digits and signs as in ASCII.
fn half_width(text: &str) -> Cow<'_, str> {
    if text.is_ascii() {
        return Cow::Borrowed(text);
    }
    let narrow = |c: char| match c {
        '\u{ff10}'..='\u{ff19}' | '\u{ff0b}'..='\u{ff0e}' => {
            // Full-width forms stand in the order of ASCII.
            char::from_u32(u32::from(c) - 0xfee0).unwrap_or(c)
        }
        '\u{2212}' => '-',
        other => other,
    };
    Cow::Owned(text.chars().map(narrow).collect())
}

/// Returns a text without the unit of velocity at its end.
fn without_unit(text: &str) -> (&str, Option<VelocityUnit>) {
    if text.ends_with(|c: char| c.is_ascii_digit()) && !text.ends_with('1') {
        return (text, None);
    }
    let letters = text.char_indices().filter(|(_, c)| c.is_alphabetic());
    for (at, _) in letters.take(CHARACTERS_MAX) {
        if let Some(unit) = units::of_velocity(&text[at..]) {
            return (text[..at].trim_end(), Some(unit));
        }
    }
    (text, None)
}

/// Splits an exponent off, which Fortran may begin with a D.
fn split_exponent(text: &str) -> Option<(&str, i32)> {
    match text.find(['e', 'E', 'd', 'D']) {
        None => Some((text, 0)),
        Some(at) => {
            let exponent = &text[at + 1..];
            let begins = exponent.starts_with(|c: char| c.is_ascii_digit() || c == '+' || c == '-');
            if !begins {
                return None;
            }
            Some((&text[..at], exponent.parse().ok()?))
        }
    }
}

/// Returns sign, digits and decimal point of a number, without its marks of thousands.
fn plain_digits(text: &str, decimal: DecimalMark) -> Option<String> {
    let (sign, unsigned) = match text.strip_prefix(['-', '+']) {
        Some(rest) => (if text.starts_with('-') { "-" } else { "" }, rest),
        None => ("", text),
    };
    let (whole, decimals) = match unsigned.split_once(decimal.character()) {
        Some((whole, decimals)) => (whole, Some(decimals)),
        None => (unsigned, None),
    };
    let is_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if !decimals.is_none_or(is_digits) || whole.is_empty() && decimals.is_none_or(str::is_empty) {
        return None;
    }
    let whole = if is_digits(whole) { whole.to_owned() } else { ungrouped(whole, decimal)? };
    let whole = if whole.is_empty() { "0" } else { &whole };
    Some(match decimals {
        Some(decimals) if !decimals.is_empty() => format!("{sign}{whole}.{decimals}"),
        _ => format!("{sign}{whole}"),
    })
}

/// Returns the digits of a whole number with marks of thousands: all the same, and three digits behind
/// each.
fn ungrouped(text: &str, decimal: DecimalMark) -> Option<String> {
    let mark = text.chars().find(|c| !c.is_ascii_digit())?;
    let is_mark = match mark {
        '.' | ',' => mark != decimal.character(),
        '\'' | '\u{2019}' | '\u{2bc}' => true,
        blank => blank == ' ' || is_narrow_blank(blank),
    };
    let mut groups = text.split(mark);
    let first = groups.next()?;
    let is_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let is_first = (1..=GROUP_DIGITS).contains(&first.len()) && !first.starts_with('0');
    let is_whole = is_first && is_digits(first);
    let others = groups.all(|group| group.len() == GROUP_DIGITS && is_digits(group));
    (is_mark && is_whole && others).then(|| text.replace(mark, ""))
}

/// Returns whether a character is a blank that does not break a line.
fn is_narrow_blank(c: char) -> bool {
    matches!(c, '\u{a0}' | '\u{2007}' | '\u{2009}' | '\u{202f}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_read_as_people_write_it() {
        let check = |text: &str, decimal, expected: Option<f64>| {
            let read = CellNumber::read(text, decimal).map(|number| number.value());
            assert_eq!(read, expected, "{text:?} with {decimal:?}");
        };
        let (point, comma) = (DecimalMark::Point, DecimalMark::Comma);
        for (text, expected) in [
            ("3908.5", Some(3908.5)),
            ("4.", Some(4.0)),
            (".5", Some(0.5)),
            ("+3908", Some(3908.0)),
            ("-999", Some(-999.0)),
            ("\u{2212}999", Some(-999.0)),
            ("3,908.5", Some(3908.5)),
            ("3'908.5", Some(3908.5)),
            ("3\u{2019}908.5", Some(3908.5)),
            ("3 908.5", Some(3908.5)),
            ("3\u{202f}908", Some(3908.0)),
            ("1,234,567.25", Some(1_234_567.25)),
            ("3.908524D+03", Some(3908.524)),
            ("3.9085d3", Some(3908.5)),
            ("39.1E-1", Some(3.91)),
            ("=\"3908.5\"", Some(3908.5)),
            ("'3908.5", Some(3908.5)),
            ("\u{ff13}\u{ff19}\u{ff10}\u{ff18}\u{ff0e}\u{ff15}", Some(3908.5)),
            ("3908.5 \u{b1} 12", Some(3908.5)),
            ("3908.5+/-12.5 m/s", Some(3908.5)),
            ("3,9105", None),
            ("0,908.5", None),
            ("3,90.5", None),
            ("39,08,500", None),
            ("3,908'500", None),
            ("3.908.5", None),
            ("3908.5 \u{b1}", None),
            ("3908.5 (12)", None),
            ("3908.5 mm", None),
            ("3. Sep", None),
            ("nan", None),
            ("inf", None),
            ("1e", None),
            ("e3", None),
            ("1e99999999999", None),
            ("", None),
            (".", None),
            ("-", None),
            ("P1", None),
        ] {
            check(text, point, expected);
        }
        for (text, expected) in [
            ("3908,5", Some(3908.5)),
            ("3.908,5", Some(3908.5)),
            ("3.908", Some(3908.0)),
            ("3\u{a0}908,5", Some(3908.5)),
            ("3,9105", Some(3.9105)),
            ("3908.5", None),
            ("3,910,5", None),
            ("3.910.5", None),
        ] {
            check(text, comma, expected);
        }
    }

    #[test]
    fn a_velocity_is_the_same_to_the_bit_in_every_unit_and_with_every_mark() {
        let velocity =
            |text: &str, decimal, unit| Some(CellNumber::read(text, decimal)?.velocity(unit));
        let (point, comma) = (DecimalMark::Point, DecimalMark::Comma);
        for unit in [VelocityUnit::KilometrePerSecond, VelocityUnit::MillimetrePerMicrosecond] {
            for (text, decimal, expected) in [
                ("3.9105", point, Some(3910.5)),
                ("3,9105", comma, Some(3910.5)),
                ("4", point, Some(4000.0)),
                ("39105e-4", point, Some(3910.5)),
                ("39.1E-1", point, Some(3910.0)),
                ("3910.5 m/s", point, Some(3910.5)),
                ("3.9105 km/s", point, Some(3910.5)),
                ("3,9105", point, None),
                ("-3.9", point, Some(-3900.0)),
            ] {
                assert_eq!(velocity(text, decimal, unit), expected, "{unit:?} {text}");
            }
        }
        for k in 1000..3000 {
            let text = format!("{:.4}", f64::from(k) / 700.0);
            let expected = format!("{text}e3").parse().ok();
            assert_eq!(velocity(&text, point, VelocityUnit::KilometrePerSecond), expected);
        }
    }

    #[test]
    fn a_number_says_by_how_much_it_may_have_been_rounded() {
        for (text, expected) in
            [("3908", 0.5), ("3908.5", 0.05), ("3.90 km/s", 5.0), ("4e3", 500.0)]
        {
            let number = CellNumber::read(text, DecimalMark::Point).unwrap();
            let rounding = number.rounding(VelocityUnit::MetrePerSecond);
            assert!((rounding / expected - 1.0).abs() < 1e-12, "{text}: {rounding}");
        }
    }
}
