//! The rows of a table, with those apart that may sum up others.

use osteon_common::limits;

use super::column_choice::ColumnChoice;
use super::header::Header;
use super::lines::{TableLine, TableLines};
use super::number::CellNumber;
use super::problem::{LocatedProblem, Problem, shortened};
use super::shapes::UsualShape;
use super::statistics::{Statistic, Statistics, SummaryLabel};

/// Most rows that may seem to sum up others.
const ROWS_MAX: usize = 2000;
/// Most rows with only a velocity that are noticed.
const BARE_MAX: usize = 10;
/// Most lines of another shape than the rows.
const OTHER_SHAPES_MAX: usize = 1000;
/// Fewest rows among which one of another kind is noticed.
const ROWS_MIN: usize = 4;
/// Fewest velocities of which one that equals their mean is noticed.
const MEAN_OF_MIN: usize = 2;
/// Up to what share of the deviation a value may be rounded, if it tells something that it equals the mean.
const TELLING: f64 = 0.025;
/// Share of rows that have a cell before the velocity, where a row without them is noticed.
const FILLED: f64 = 0.8;

/// What was seen of a table.
#[derive(Default)]
pub(super) struct SummedRows {
    /// Velocities of rows that sum up nothing.
    pub(super) velocities: Vec<f64>,
    /// By how much these may have been rounded.
    pub(super) rounding: f64,
    pub(super) suspects: Vec<Suspect>,
    /// Number of all rows, also of those without a velocity.
    pub(super) count: usize,
    /// Number of rows with a cell before the velocity.
    filled: usize,
    /// Sum of the velocities, and of those behind the last suspect, with their number.
    sum: f64,
    last_sum: f64,
    last_count: usize,
    /// Rows at the end of the table, so far, that have words where others have numbers.
    edge: Vec<Suspect>,
}
/// A row that may sum up others.
pub(super) struct Suspect {
    pub(super) line: usize,
    pub(super) label: Option<SummaryLabel>,
    pub(super) value: Option<CellNumber>,
    /// Number of velocities above it.
    pub(super) above: usize,
    /// Whether it stands apart from the rows above it.
    pub(super) is_apart: bool,
    pub(super) unlike: Unlike,
    /// Its label, first name or velocity, for messages.
    pub(super) shown: String,
}

/// In what a row is unlike the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unlike {
    /// It has no name.
    Bare,
    /// Its cells have another shape, or one of them is a label.
    Odd,
    /// It has a word where others have numbers, at the begin or end of the table.
    Edge,
    /// In nothing but its value.
    Value,
}
/// A row of the table as it was read, and the label of a summary that stands in it or above it.
struct ReadRow {
    line: usize,
    label: Option<SummaryLabel>,
    fields: Vec<String>,
    is_apart: bool,
}

impl SummedRows {
    /// Reads the rows below a header.
    pub(super) fn collect(
        text: &str,
        header: &Header,
        choice: &ColumnChoice,
    ) -> Result<Self, LocatedProblem> {
        let rows = Self::read(text, header, choice, true)?;
        let is_bare = |one: &&Suspect| one.label.is_none() && one.unlike == Unlike::Bare;
        let bare = rows.suspects.iter().filter(is_bare).count();
        // Where many rows have only a velocity, that says nothing.
        if bare > BARE_MAX || rows.suspects.len() > ROWS_MAX {
            return Self::read(text, header, choice, false);
        }
        Ok(rows)
    }

    fn read(
        text: &str,
        header: &Header,
        choice: &ColumnChoice,
        are_bare_noticed: bool,
    ) -> Result<Self, LocatedProblem> {
        let mut rows = Self { rounding: f64::INFINITY, ..Self::default() };
        let usual = UsualShape::of_rows(text, header, choice.place);
        let mut lines = TableLines::after_header(text, header, Some(choice.place));
        // A label may stand on a line of its own, above its value.
        let mut waiting: Option<SummaryLabel> = None;
        let mut other_shapes = 0;
        let mut last = None;
        while let Some(line) = lines.next() {
            let is_apart = lines.is_after_gap;
            let row = match line? {
                (line, TableLine::Data(fields)) => {
                    rows.count += 1;
                    ReadRow { line, label: waiting.take(), fields, is_apart }
                }
                (line, TableLine::Labelled { label, fields }) => {
                    ReadRow { line, label: Some(label), fields, is_apart }
                }
                (_, TableLine::OtherShape(_)) => {
                    other_shapes += 1;
                    // The rows will be refused, or are all above.
                    if other_shapes > OTHER_SHAPES_MAX {
                        break;
                    }
                    continue;
                }
                _ => continue,
            };
            waiting = row.label_above(choice).or(waiting);
            if rows.velocities.len() > limits::DATA_VELOCITIES_MAX {
                return Err((None, Problem::TooMany));
            }
            let row = rows.describe(row, choice, &usual, are_bare_noticed);
            last = rows.take(row, choice);
            if rows.suspects.len() > ROWS_MAX {
                let are_labelled = rows.suspects.last().is_some_and(|one| one.label.is_some());
                if are_labelled || !are_bare_noticed {
                    return Err((rows.suspects.last().map(|one| one.line), Problem::ManySummaries));
                }
                break;
            }
        }
        rows.suspects.append(&mut rows.edge);
        rows.suspect_last(last, choice);
        Ok(rows)
    }

    /// Returns a row with what may make it a summary.
    fn describe(
        &mut self,
        row: ReadRow,
        choice: &ColumnChoice,
        usual: &UsualShape,
        are_bare_noticed: bool,
    ) -> Suspect {
        let value = row.value(choice);
        let ReadRow { line, label, fields, is_apart } = row;
        // What a row is of stands before its velocity.
        let before = fields.get(..choice.place).unwrap_or_default();
        let is_named = before.iter().any(|field| !field.is_empty());
        self.filled += usize::from(is_named);
        let is_bare = are_bare_noticed && !is_named && (!before.is_empty() || is_apart);
        let unlike = match (&label, &value) {
            (Some(_), _) if usual.is_odd(&fields, choice.place) => Unlike::Odd,
            (Some(_), _) => Unlike::Value,
            (None, _) if is_bare => Unlike::Bare,
            (None, Some(value)) => self.unlike(value, &fields, (choice, usual), is_apart),
            (None, None) => Unlike::Value,
        };
        let shown = shown(label.as_ref(), &fields, choice.place);
        Suspect { line, label, value, above: self.velocities.len(), is_apart, unlike, shown }
    }

    /// Takes a row as a measurement, and returns it then, or as one that may sum up others.
    fn take(&mut self, row: Suspect, choice: &ColumnChoice) -> Option<Suspect> {
        match (&row.label, &row.value) {
            (None, None) => None,
            (None, Some(value)) if row.unlike == Unlike::Value => {
                self.flush_edge(choice);
                self.add(value, choice);
                Some(row)
            }
            _ => {
                self.suspect(row);
                if self.edge.len() > ROWS_MAX {
                    // So many rows sum up nothing.
                    self.flush_edge(choice);
                }
                None
            }
        }
    }

    /// Returns in what a row with a velocity is unlike those above it.
    fn unlike(
        &self,
        value: &CellNumber,
        fields: &[String],
        (choice, usual): (&ColumnChoice, &UsualShape),
        is_apart: bool,
    ) -> Unlike {
        let is_odd = || usual.is_odd(fields, choice.place);
        let is_label = |field: &String| SummaryLabel::recognize(field).is_some();
        let rounding = value.rounding(choice.unit) + self.rounding;
        let value = value.velocity(choice.unit);
        let is_mean = |sum: f64, count: usize| {
            count >= MEAN_OF_MIN && (value - sum / count as f64).abs() <= rounding * 1.000_001
        };
        let is_mean =
            is_mean(self.sum, self.velocities.len()) || is_mean(self.last_sum, self.last_count);
        match is_mean && (is_apart || is_odd() || fields.iter().any(is_label)) {
            true => Unlike::Odd,
            false
                if (self.is_after_suspect() || usual.has_word(fields, choice.place))
                    && is_odd() =>
            {
                Unlike::Edge
            }
            false => Unlike::Value,
        }
    }

    /// Returns whether the row above is a suspect.
    fn is_after_suspect(&self) -> bool {
        let last = self.edge.last().or(self.suspects.last());
        last.is_some_and(|last| last.above == self.velocities.len())
    }

    /// Notices a row; one with a word counts only at the begin or the end, or behind a gap.
    fn suspect(&mut self, suspect: Suspect) {
        if suspect.label.is_none()
            && suspect.unlike == Unlike::Edge
            && !suspect.is_apart
            && suspect.above > 0
        {
            self.edge.push(suspect);
            return;
        }
        (self.last_sum, self.last_count) = (0.0, 0);
        self.suspects.append(&mut self.edge);
        self.suspects.push(suspect);
    }

    /// Takes rows with words for measurements, as others follow; but none that is the mean of those above.
    fn flush_edge(&mut self, choice: &ColumnChoice) {
        for suspect in std::mem::take(&mut self.edge) {
            if let Some(value) = &suspect.value {
                self.add(value, choice);
            }
        }
    }

    /// Notices the last row, if it has the value of the mean or median of all above.
    fn suspect_last(&mut self, last: Option<Suspect>, choice: &ColumnChoice) {
        let Some(suspect) = last else { return };
        let Some(velocity) = self.velocities.pop() else { return };
        let all = Statistics::from_velocities(&self.velocities);
        let is_summary = all.zip(suspect.value.as_ref()).is_some_and(|(all, value)| {
            let rounding = value.rounding(choice.unit) + self.rounding;
            let is = |statistic| all.is(statistic, velocity, rounding);
            // Where numbers are coarse, any may have that value.
            rounding < TELLING * all.value(Statistic::Deviation)
                && self.velocities.len() >= MEAN_OF_MIN
                && (is(Statistic::Mean)
                    || is(Statistic::Median) && value.has_more_decimals(self.rounding, choice.unit))
        });
        match is_summary {
            true => self.suspects.push(suspect),
            false => self.velocities.push(velocity),
        }
    }

    fn add(&mut self, value: &CellNumber, choice: &ColumnChoice) {
        let velocity = value.velocity(choice.unit);
        self.velocities.push(velocity);
        self.sum += velocity;
        (self.last_sum, self.last_count) = (self.last_sum + velocity, self.last_count + 1);
        // Zeros at the end may have been left away.
        self.rounding = self.rounding.min(value.rounding(choice.unit));
    }

    /// Returns whether it is noticed that a row has nothing beside its velocity.
    pub(super) fn is_bareness_noticed(&self) -> bool {
        let rows = self.velocities.len();
        rows >= ROWS_MIN && self.filled as f64 >= FILLED * rows as f64
    }
}

impl ReadRow {
    /// Returns the number in the column of velocities, if it does not stand for a missing one.
    fn value(&self, choice: &ColumnChoice) -> Option<CellNumber> {
        let cell = self.cell(choice);
        CellNumber::read(cell, choice.decimal)
            .filter(|_| !choice.missing.iter().any(|missing| missing == cell))
    }

    /// Returns the label of the value in the next row, which stands in the column of that value.
    fn label_above(&self, choice: &ColumnChoice) -> Option<SummaryLabel> {
        let label = self.label.as_ref()?;
        (label.text == self.cell(choice) && self.value(choice).is_none()).then(|| label.clone())
    }

    fn cell(&self, choice: &ColumnChoice) -> &str {
        self.fields.get(choice.place).map_or("", String::as_str)
    }
}

/// Returns what stands for a row in a message: its label, or its first name, or its velocity.
fn shown(label: Option<&SummaryLabel>, fields: &[String], place: usize) -> String {
    let beside =
        || fields.iter().enumerate().filter(|(at, _)| *at != place).map(|(_, field)| field);
    let of_row = beside().find(|field| SummaryLabel::recognize(field).is_some());
    let named = of_row.or_else(|| beside().find(|field| !field.is_empty())).or(fields.get(place));
    let text = label.map(|label| label.text.as_str()).or(named.map(String::as_str));
    format!("{:?}", shortened(text.unwrap_or_default()))
}
