//! Which column has the velocities, in which unit and with which decimal mark.
//!
//! The name of a column and the size of its numbers decide together. What may be read in two ways is
//! refused with the key that decides.

use std::collections::{BTreeMap, BTreeSet};

use osteon_common::limits;

use super::csv_format::{CsvFormat, DecimalMark, VelocityUnit};
use super::header::{Header, velocity_places};
use super::lines::{TableLine, TableLines};
use super::names::ColumnName;
use super::number::CellNumber;
use super::problem::{LocatedProblem, Problem, listed, shortened};

/// Velocities of sound in bone, m/s, as wide as the program accepts them.
pub(super) const POSSIBLE: std::ops::Range<f64> = 100.0..20_000.0;
/// Medians of velocities of which nothing else says the unit.
const IN_METRES: std::ops::Range<f64> = 1000.0..10_000.0;
const IN_KILOMETRES: std::ops::Range<f64> = 1.0..10.0;
/// Most columns that may be the velocities.
const COLUMNS_MAX: usize = 20;
/// Rows in which units are looked for.
const EXAMINED_ROWS: usize = 50;
/// Maximum number of texts that a job file names as missing.
const MISSING_MAX: usize = 20;
/// Maximum number of different texts of a column that are kept.
const TEXTS_MAX: usize = 1000;
/// Longest text that stands for a missing value, characters.
const MISSING_CHARACTERS_MAX: usize = 40;
/// Texts that stand for missing values although they have digits.
const MISSING: [&str; 3] = ["#DIV/0!", "#NUM!", "1.#QNAN"];
/// How much larger than the largest other value a mark of nines is.
const NINES_ABOVE: f64 = 1.5;

/// How the column of velocities is read.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ColumnChoice {
    pub(super) place: usize,
    pub(super) decimal: DecimalMark,
    pub(super) unit: VelocityUnit,
    /// Whether the unit follows from the size of the numbers alone.
    pub(super) is_unit_guessed: bool,
    /// Texts that stand for missing values.
    pub(super) missing: Vec<String>,
}

impl ColumnChoice {
    /// Returns the column that the keys name, read as they say.
    pub(super) fn given(format: &CsvFormat, place: usize) -> Self {
        Self {
            place,
            decimal: format.decimal.unwrap_or_default(),
            unit: format.unit.unwrap_or_default(),
            is_unit_guessed: false,
            missing: format.missing.clone().unwrap_or_default(),
        }
    }

    /// Finds the column, as far as no key says it.
    pub(super) fn found(
        text: &str,
        header: &Header,
        format: &CsvFormat,
    ) -> Result<Self, LocatedProblem> {
        let at_header = |problem| (Some(header.line), problem);
        let read = |place| Cells::collect(text, header, place)?.choice(header, format);
        if let Some(column) = &format.column {
            let mut places = header.names.iter().enumerate().filter(|(_, name)| *name == column);
            return match (places.next(), places.next()) {
                (Some((place, _)), None) => read(place),
                (Some(_), Some(_)) => {
                    Err(at_header(Problem::RepeatedColumn { column: shortened(column) }))
                }
                (None, _) => Err(at_header(Problem::NoColumn {
                    column: shortened(column),
                    columns: listed(&header.names),
                })),
            };
        }
        let named = velocity_places(&header.names);
        let places = if named.is_empty() { places_with_units(text, header) } else { named };
        let mut choices = Vec::new();
        let mut first_problem = None;
        for place in places.into_iter().take(COLUMNS_MAX) {
            match read(place) {
                Ok(choice) => choices.push(choice),
                Err(problem) => first_problem = first_problem.or(Some(problem)),
            }
        }
        match (choices.len(), first_problem) {
            (1, _) => Ok(choices.swap_remove(0)),
            (0, Some(problem)) => Err(problem),
            (0, None) => Err(at_header(Problem::no_velocities(&header.names))),
            _ => only_one(choices, header).map_err(at_header),
        }
    }
}

/// Returns the places of columns of which the cells themselves say that they are velocities.
fn places_with_units(text: &str, header: &Header) -> Vec<usize> {
    let mut places = BTreeSet::new();
    for line in TableLines::after_header(text, header, None).take(EXAMINED_ROWS) {
        let Ok((_, TableLine::Data(fields))) = line else { continue };
        for (place, field) in fields.iter().enumerate() {
            let read = DecimalMark::ALL.into_iter().find_map(|mark| CellNumber::read(field, mark));
            if read.is_some_and(|number| number.unit.is_some()) {
                places.insert(place);
            }
        }
    }
    places.into_iter().collect()
}

/// Returns the one of several columns whose name is that of the documentation.
fn only_one(choices: Vec<ColumnChoice>, header: &Header) -> Result<ColumnChoice, Problem> {
    let names: Vec<String> =
        choices.iter().map(|choice| header.names[choice.place].clone()).collect();
    let mut exact = choices.into_iter().filter(|one| header.names[one.place] == "velocity");
    match (exact.next(), exact.next()) {
        (Some(choice), None) => Ok(choice),
        (Some(_), Some(_)) => Err(Problem::RepeatedColumn { column: "velocity".to_owned() }),
        _ => {
            let first = names.first().map_or("", String::as_str);
            Err(Problem::SeveralColumns { first: shortened(first), columns: listed(&names) })
        }
    }
}

/// The cells of one column.
#[derive(Default)]
struct Cells {
    place: usize,
    /// Each number with either mark, not a number where it is none.
    values: Vec<[f64; 2]>,
    /// The unit in the cells, if it is the same in all that have one.
    unit_in_cells: Option<VelocityUnit>,
    has_other_unit: bool,
    /// Line of the first number that is one with only this mark.
    only: [Option<usize>; 2],
    /// Numbers that may stand for none, each with the values of its text.
    marks: BTreeMap<String, [f64; 2]>,
    /// What is no number, with the line of the first.
    texts: BTreeMap<String, usize>,
    /// Number of cells that have a text.
    filled: usize,
    /// The unit that stands below the header.
    unit_below: Option<VelocityUnit>,
    /// Line and number of fields of the first row of another shape.
    other_shape: Option<(usize, usize)>,
}

impl Cells {
    fn collect(text: &str, header: &Header, place: usize) -> Result<Self, LocatedProblem> {
        let mut cells = Self { place, ..Self::default() };
        for line in TableLines::after_header(text, header, Some(place)) {
            match line? {
                (_, TableLine::Units(units)) => {
                    cells.unit_below = units.get(place).copied().flatten()
                }
                (line, TableLine::Data(mut fields)) if place < fields.len() => {
                    cells.add(line, fields.swap_remove(place));
                }
                (line, TableLine::OtherShape(fields)) => {
                    cells.other_shape.get_or_insert((line, fields.len()));
                }
                _ => {}
            }
            if cells.values.len() > limits::DATA_VELOCITIES_MAX {
                return Err((None, Problem::TooMany));
            }
        }
        Ok(cells)
    }

    fn add(&mut self, line: usize, cell: String) {
        self.filled += usize::from(!cell.is_empty());
        let read = DecimalMark::ALL.map(|mark| CellNumber::read(&cell, mark));
        let Some(number) = read.iter().flatten().next() else {
            if self.texts.len() <= TEXTS_MAX {
                self.texts.entry(cell).or_insert(line);
            }
            return;
        };
        if let Some(unit) = number.unit {
            self.has_other_unit |= *self.unit_in_cells.get_or_insert(unit) != unit;
        }
        for at in 0..2 {
            if read[at].is_some() && read[1 - at].is_none() {
                self.only[at].get_or_insert(line);
            }
        }
        let is_mark = number.value() <= 0.0 || number.is_nines();
        let values = read.each_ref().map(|one| one.as_ref().map_or(f64::NAN, CellNumber::value));
        if is_mark && self.marks.len() <= TEXTS_MAX {
            self.marks.insert(cell, values);
        }
        self.values.push(values);
    }

    fn choice(&self, header: &Header, format: &CsvFormat) -> Result<ColumnChoice, LocatedProblem> {
        let name = &header.names[self.place];
        let says = ColumnName::parse(name);
        let column = || shortened(name);
        let at_header = |problem| (Some(header.line), problem);
        if says.has_other_velocity_unit() && format.unit.is_none() {
            return Err(at_header(Problem::OtherUnit { column: column() }));
        }
        if self.values.is_empty() || 2 * self.values.len() < self.filled {
            return Err(self.no_numbers(column(), header));
        }
        let unit = format.unit.or(says.velocity_unit()).or(self.unit_below);
        let unit = unit.or(self.unit_in_cells.filter(|_| !self.has_other_unit));
        let marks = self.possible_marks(format)?;
        let mut medians = Vec::new();
        for mark in marks {
            let median = self.median(mark);
            medians.push(median);
            let found = match unit {
                Some(unit) => self.fits(mark, unit).then_some((unit, false)),
                None => unit_of_size(median, says.is_symbol()).map(|unit| (unit, true)),
            };
            if let Some((unit, is_unit_guessed)) = found {
                let missing = self.missing(mark, format, &column())?;
                let place = self.place;
                return Ok(ColumnChoice { place, decimal: mark, unit, is_unit_guessed, missing });
            }
        }
        let median = medians.first().copied().unwrap_or(f64::NAN);
        Err(at_header(match unit {
            Some(unit) => Problem::OtherSize { column: column(), median, unit: unit.name() },
            None => Problem::NoUsualSize { column: column(), median },
        }))
    }

    /// Quotes the first cell that is no number.
    fn no_numbers(&self, column: String, header: &Header) -> LocatedProblem {
        let mut texts: Vec<_> = self.texts.iter().filter(|(text, _)| !text.is_empty()).collect();
        texts.sort_by_key(|(_, line)| **line);
        match (texts.first(), self.other_shape) {
            (Some((found, line)), _) => {
                (Some(**line), Problem::NotNumbers { column, found: shortened(found) })
            }
            (None, Some((line, found))) => {
                (Some(line), Problem::FieldCount { found, expected: header.names.len() })
            }
            (None, None) => (None, Problem::NoRowsBelow),
        }
    }

    /// Returns the decimal marks with which the numbers can be read, the likelier first.
    fn possible_marks(&self, format: &CsvFormat) -> Result<Vec<DecimalMark>, LocatedProblem> {
        if let Some(mark) = format.decimal {
            return Ok(vec![mark]);
        }
        let [point, comma] = DecimalMark::ALL;
        match self.only {
            [Some(_), None] => Ok(vec![point]),
            [None, Some(_)] => Ok(vec![comma]),
            [None, None] => Ok(vec![point, comma]),
            [Some(first), Some(second)] => {
                let (first, second) = (first.min(second), first.max(second));
                Err((Some(second), Problem::TwoMarks { first }))
            }
        }
    }

    /// Returns the median of the numbers above 0, in the unit of the column or of the cells.
    fn median(&self, mark: DecimalMark) -> f64 {
        let at = usize::from(mark == DecimalMark::Comma);
        median(self.values.iter().map(|values| values[at]).filter(|&value| value > 0.0).collect())
    }

    /// Returns whether the numbers have the size of velocities in a unit.
    fn fits(&self, mark: DecimalMark, unit: VelocityUnit) -> bool {
        POSSIBLE.contains(&(self.median(mark) * unit.factor()))
    }

    /// Returns the texts that stand for missing values.
    fn missing(
        &self,
        mark: DecimalMark,
        format: &CsvFormat,
        column: &str,
    ) -> Result<Vec<String>, LocatedProblem> {
        if let Some(missing) = &format.missing {
            return Ok(missing.clone());
        }
        let has_digit = |text: &str| text.contains(|c: char| c.is_numeric());
        let is_strange = |(text, _): &(&String, &usize)| {
            has_digit(text) && !MISSING.contains(&text.as_str())
                || text.chars().count() > MISSING_CHARACTERS_MAX
        };
        let mut strange: Vec<_> = self.texts.iter().filter(is_strange).collect();
        strange.sort_by_key(|(_, line)| **line);
        if let Some((found, line)) = strange.first() {
            let (column, found) = (column.to_owned(), shortened(found));
            return Err((Some(**line), Problem::NotNumbers { column, found }));
        }
        let mut missing: Vec<String> = self.texts.keys().cloned().collect();
        let at = usize::from(mark == DecimalMark::Comma);
        let is_mark = |value: &f64| self.marks.values().any(|values| values[at] == *value);
        let usual = self.values.iter().map(|values| values[at]).filter(|value| !is_mark(value));
        let largest = usual.fold(0.0, f64::max);
        let is_none = |(_, values): &(&String, &[f64; 2])| {
            values[at] <= 0.0 || values[at] > NINES_ABOVE * largest
        };
        missing.extend(self.marks.iter().filter(is_none).map(|(text, _)| text.clone()));
        missing.sort();
        match missing.len() > MISSING_MAX {
            true => {
                let (count, first) = (missing.len(), shortened(&missing[0]));
                Err((None, Problem::ManyTexts { column: column.to_owned(), count, first }))
            }
            false => Ok(missing),
        }
    }
}

/// Returns the unit in which numbers of this median are velocities of bone. A letter that may mean something
/// else names velocities only in the size that nothing else has.
fn unit_of_size(median: f64, is_symbol: bool) -> Option<VelocityUnit> {
    if IN_METRES.contains(&median) {
        return Some(VelocityUnit::MetrePerSecond);
    }
    (IN_KILOMETRES.contains(&median) && !is_symbol).then_some(VelocityUnit::KilometrePerSecond)
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(f64::NAN)
}
