//! The cells of one column: whether they are velocities, in which unit and with which decimal mark.

use std::collections::BTreeMap;

use osteon_common::limits;

use super::column_choice::{ColumnChoice, POSSIBLE, USUAL};
use super::csv_format::{CsvFormat, DecimalMark, Separator, VelocityUnit};
use super::header::Header;
use super::lines::{TableLine, TableLines};
use super::names::ColumnName;
use super::number::{CellNumber, is_number};
use super::problem::{LocatedProblem, Problem, shortened};
use super::units::{self, NamedUnit};

/// Medians of velocities of which nothing else says the unit.
const IN_METRES: std::ops::Range<f64> = 1000.0..10_000.0;
const IN_KILOMETRES: std::ops::Range<f64> = 1.0..10.0;
/// Names of columns of units, in lower case.
const UNIT_NAMES: [&str; 5] = ["unit", "units", "einheit", "unit\u{e9}", "unidad"];
/// Maximum number of different texts of a column that are kept.
pub(super) const TEXTS_MAX: usize = 1000;

/// Fewest rows of numbers that are counted.
const COUNTED_MIN: usize = 4;
/// With what programs begin comments, beside what is always one.
const COMMENTS: [&str; 3] = ["%", "//", "!"];

/// The cells of one column.
#[derive(Default)]
pub(super) struct Cells {
    pub(super) place: usize,
    /// Each number with either mark, not a number where it is none.
    pub(super) values: Vec<[f64; 2]>,
    /// The unit in the cells, if it is the same in all that have one.
    unit_in_cells: Option<VelocityUnit>,
    has_other_unit: bool,
    /// Line of the first number that is one with only this mark.
    only: [Option<usize>; 2],
    /// Numbers that may stand for none.
    pub(super) marks: BTreeMap<String, CellMark>,
    /// Cells that are not numbers, and where they stand.
    pub(super) texts: BTreeMap<String, Text>,
    /// The last text, if it may be one of the names of another table.
    name: Option<String>,
    /// Number of cells that have a text.
    filled: usize,
    /// The unit that stands below the header.
    unit_below: Option<NamedUnit>,
    /// The unit in a column of units, and the first that is another, with its line.
    unit_beside: Option<VelocityUnit>,
    other_beside: Option<(usize, String)>,
    /// Line and number of fields of the first row of another shape.
    other_shape: Option<(usize, usize)>,
    /// Line of the first row that begins as a comment of some program.
    comment: Option<(usize, String)>,
    /// Rows whose velocity may go on in the next column: the line and the cells of the first.
    split: Option<(usize, [String; 2])>,
    /// Number of rows with only digits in the next column, and whether it has no name of its own.
    digits_behind: usize,
    is_next_nameless: bool,
    /// Where a line is one field: what stands behind its comma, if that may be a number of its own.
    behind_commas: Vec<f64>,
}

/// A number that may stand for none.
pub(super) struct CellMark {
    pub(super) values: [f64; 2],
    pub(super) line: usize,
    /// Whether it has one digit again and again, and nothing else.
    pub(super) is_repeated: bool,
}

/// A text in place of a number.
pub(super) struct Text {
    pub(super) line: usize,
    pub(super) count: usize,
    /// Whether it stands directly below the header.
    pub(super) is_first: bool,
    /// Whether it seems to be one of the names of another table.
    pub(super) is_name: bool,
}

impl Cells {
    pub(super) fn collect(
        text: &str,
        header: &Header,
        place: usize,
    ) -> Result<Self, LocatedProblem> {
        let mut cells = Self { place, ..Self::default() };
        cells.is_next_nameless = header.names.get(place + 1).is_some_and(String::is_empty);
        let is_unit = |name: &String| UNIT_NAMES.contains(&name.to_lowercase().as_str());
        let units_at = header.names.iter().position(is_unit);
        let mut lines = TableLines::after_header(text, header, Some(place));
        let mut is_first = true;
        while let Some(line) = lines.next() {
            match line? {
                (_, TableLine::Units(units)) => {
                    cells.unit_below = units.get(place).copied().flatten();
                }
                (line, TableLine::Data(fields)) if place < fields.len() => {
                    cells.is_next_nameless |=
                        lines.is_longer && header.separator == Separator::Comma;
                    cells.look_around(line, &fields, units_at);
                    let is_name = lines.is_after_gap
                        && fields.iter().all(|field| !field.is_empty() && !is_number(field));
                    cells.add(line, &fields, (is_first, is_name));
                    is_first = false;
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

    /// Looks at what stands beside the velocity in a row.
    fn look_around(&mut self, line: usize, fields: &[String], units_at: Option<usize>) {
        let begin = fields.iter().find(|field| !field.is_empty()).map_or("", String::as_str);
        if COMMENTS.iter().any(|mark| begin.starts_with(mark)) {
            self.comment.get_or_insert_with(|| (line, begin.to_owned()));
        }
        if let Some(unit) = units_at.and_then(|at| fields.get(at)).filter(|unit| !unit.is_empty()) {
            match units::of_velocity(unit) {
                Some(found) if *self.unit_beside.get_or_insert(found) == found => {}
                _ => {
                    self.other_beside.get_or_insert_with(|| (line, unit.clone()));
                }
            }
        }
        let is_digits = |text: &str| !text.is_empty() && text.bytes().all(|c| c.is_ascii_digit());
        let (cell, next) = (&fields[self.place], fields.get(self.place + 1));
        let Some(next) = next.filter(|next| is_digits(next)) else { return };
        self.digits_behind += 1;
        if is_digits(cell) && cell.len() < 3 {
            self.split.get_or_insert_with(|| (line, [cell.clone(), next.clone()]));
        }
    }

    /// Adds a cell, given whether it stands directly below the header, and whether it may be a name.
    fn add(&mut self, line: usize, fields: &[String], (is_first, is_name): (bool, bool)) {
        let cell = &fields[self.place];
        self.filled += usize::from(!cell.is_empty());
        let read = DecimalMark::ALL.map(|mark| CellNumber::read(cell, mark));
        let Some(number) = read.iter().flatten().next() else {
            if self.texts.len() <= TEXTS_MAX {
                let text = Text { line, count: 0, is_first, is_name: false };
                self.texts.entry(cell.clone()).or_insert(text).count += 1;
                self.name = is_name.then(|| cell.clone());
            }
            return;
        };
        // Only above numbers it is a name, and otherwise a remark.
        if let Some(text) = self.name.take().and_then(|name| self.texts.get_mut(&name)) {
            text.is_name = true;
        }
        if let Some(unit) = number.unit {
            self.has_other_unit |= *self.unit_in_cells.get_or_insert(unit) != unit;
        }
        for at in 0..2 {
            if read[at].is_some() && read[1 - at].is_none() {
                self.only[at].get_or_insert(line);
            }
        }
        let values = read.each_ref().map(|one| one.as_ref().map_or(f64::NAN, CellNumber::value));
        let is_mark = number.value() <= 0.0 || number.is_repeated();
        if is_mark && self.marks.len() <= TEXTS_MAX {
            let is_repeated = number.is_repeated();
            self.marks.insert(cell.clone(), CellMark { values, line, is_repeated });
        }
        if fields.len() == 1
            && let Some((whole, behind)) = cell.split_once(',')
            && !behind.starts_with('0')
            && whole.bytes().all(|byte| byte.is_ascii_digit())
        {
            self.behind_commas.extend(behind.parse::<f64>());
        }
        self.values.push(values);
    }

    pub(super) fn choice(
        &self,
        header: &Header,
        format: &CsvFormat,
    ) -> Result<ColumnChoice, LocatedProblem> {
        let name = &header.names[self.place];
        let says = ColumnName::parse(name);
        let column = || shortened(name);
        let at_header = |problem| (Some(header.line), problem);
        if self.filled == 0 && self.other_shape.is_none() {
            return Err((None, Problem::NoRowsBelow));
        }
        let unit = self.unit(says, format, header)?;
        if self.values.is_empty() || 2 * self.values.len() < self.filled {
            return Err(self.no_numbers(column(), header));
        }
        self.refuse_doubtful(header)?;
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
                let missing = self.missing(mark, format, header)?;
                self.refuse_split(mark, unit, format)?;
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

    /// Returns the unit that a key, the name, the line below it, a column of units, or the cells say.
    fn unit(
        &self,
        says: ColumnName,
        format: &CsvFormat,
        header: &Header,
    ) -> Result<Option<VelocityUnit>, LocatedProblem> {
        if format.unit.is_some() {
            return Ok(format.unit);
        }
        let below = match self.unit_below {
            None => None,
            Some(NamedUnit::Velocity(unit)) => Some(unit),
            Some(_) => None,
        };
        let column = || shortened(&header.names[self.place]);
        let other = self.unit_below.or(says.unit());
        let problem = match other {
            Some(NamedUnit::OtherVelocity) => Problem::OtherUnit { column: column() },
            Some(NamedUnit::Other | NamedUnit::Unknown) => {
                Problem::UnknownUnit { column: column() }
            }
            Some(NamedUnit::Velocity(_)) | None => return self.velocity_unit(says, below),
        };
        Err((Some(header.line), problem))
    }

    fn velocity_unit(
        &self,
        says: ColumnName,
        below: Option<VelocityUnit>,
    ) -> Result<Option<VelocityUnit>, LocatedProblem> {
        if let Some((line, found)) = &self.other_beside {
            return Err((Some(*line), Problem::UnitBeside { found: shortened(found) }));
        }
        let unit = says.velocity_unit().or(below).or(self.unit_beside);
        Ok(unit.or(self.unit_in_cells.filter(|_| !self.has_other_unit)))
    }

    /// Refuses rows of which something says that they may be no measurements.
    fn refuse_doubtful(&self, header: &Header) -> Result<(), LocatedProblem> {
        if let Some((line, found)) = &self.comment {
            return Err((Some(*line), Problem::LikeComment { found: shortened(found) }));
        }
        let is_next = |pair: &[[f64; 2]]| pair[1][0] == pair[0][0] + 1.0;
        if self.values.len() >= COUNTED_MIN && self.values.windows(2).all(is_next) {
            let column = shortened(&header.names[self.place]);
            return Err((Some(header.line), Problem::Counted { column }));
        }
        Ok(())
    }

    /// Refuses numbers of which a part may stand in the next column, and lines that may be two numbers.
    fn refuse_split(
        &self,
        mark: DecimalMark,
        unit: VelocityUnit,
        format: &CsvFormat,
    ) -> Result<(), LocatedProblem> {
        if mark == DecimalMark::Comma
            && format.decimal.is_none()
            && self.behind_commas.len() == self.values.len()
            && USUAL.contains(&median(self.behind_commas.clone()))
        {
            return Err((None, Problem::OneOrTwoNumbers));
        }
        let at = usize::from(mark == DecimalMark::Comma);
        let is_whole = self.values.iter().all(|values| values[at].fract() == 0.0);
        let is_small = unit.power() > 0;
        if let Some((line, [found, next])) = self.split.clone().filter(|_| is_small) {
            return Err((Some(line), Problem::SplitNumber { found, next }));
        }
        let is_split = self.digits_behind == self.values.len() && self.is_next_nameless;
        if is_whole && (is_small || is_split) {
            return Err((None, Problem::WholeNumbers { median: self.median(mark) }));
        }
        Ok(())
    }

    /// Quotes the first cell that is no number.
    fn no_numbers(&self, column: String, header: &Header) -> LocatedProblem {
        let mut texts: Vec<_> = self.texts.iter().filter(|(text, _)| !text.is_empty()).collect();
        texts.sort_by_key(|(_, text)| text.line);
        match (texts.first(), self.other_shape) {
            (Some((found, text)), _) => {
                (Some(text.line), Problem::NotNumbers { column, found: shortened(found) })
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
}

/// Returns the unit in which numbers of this median are velocities of bone. A letter that may mean something
/// else names velocities only in the size that nothing else has.
fn unit_of_size(median: f64, is_symbol: bool) -> Option<VelocityUnit> {
    if IN_METRES.contains(&median) {
        return Some(VelocityUnit::MetrePerSecond);
    }
    (IN_KILOMETRES.contains(&median) && !is_symbol).then_some(VelocityUnit::KilometrePerSecond)
}

pub(super) fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(f64::NAN)
}
