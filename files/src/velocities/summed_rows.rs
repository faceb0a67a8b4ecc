//! The rows of a table, with those apart that may sum up others.

use std::collections::BTreeSet;

use osteon_common::limits;

use super::column_choice::ColumnChoice;
use super::header::Header;
use super::lines::{TableLine, TableLines};
use super::number::CellNumber;
use super::problem::{LocatedProblem, Problem, shortened};
use super::running_moments::RunningMoments;
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
pub(super) const TELLING: f64 = 0.025;
/// Most different words for which it is asked what rows are that have them where others have numbers.
const WORDS_MAX: usize = 3;
/// Most rows behind a gap that may sum up those above it, and fewest of these.
const TAIL_MAX: usize = 4;
const TAIL_OF_MIN: usize = 3;
/// Statistics that rows behind a gap are compared with, where there are several.
const OF_TAIL: [Statistic; 5] = [
    Statistic::Mean,
    Statistic::Median,
    Statistic::Deviation,
    Statistic::Largest,
    Statistic::Smallest,
];
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
    /// The velocities, and those behind the last suspect.
    all: RunningMoments,
    recent: RunningMoments,
    /// Rows at the end of the table, so far, that have words where others have numbers.
    edge: Vec<Suspect>,
    /// The first of such rows that others follow, and the different words of all, as long as these are few.
    first_word: Option<Suspect>,
    different_words: BTreeSet<String>,
    /// The rows behind the last gap, and the number of velocities above it.
    tail: Vec<Suspect>,
    above_gap: usize,
}

/// A row that may sum up others.
#[derive(Clone)]
pub(super) struct Suspect {
    pub(super) line: usize,
    pub(super) label: Option<SummaryLabel>,
    pub(super) value: Option<CellNumber>,
    /// Number of velocities above it.
    pub(super) above: usize,
    /// Whether it stands apart from the rows above it.
    pub(super) is_apart: bool,
    pub(super) unlike: Unlike,
    /// Whether it has a word where most others have a number.
    pub(super) has_word: bool,
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
            rows.note_gap(&row);
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
        rows.ask_of_words()?;
        if !rows.suspect_tail(choice) {
            rows.suspect_last(last, choice);
        }
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
        let is_bare = are_bare_noticed && !is_named && !before.is_empty();
        let unlike = match (&label, &value) {
            (Some(_), _) if usual.is_odd(&fields, choice.place) => Unlike::Odd,
            (Some(_), _) => Unlike::Value,
            (None, _) if is_bare => Unlike::Bare,
            (None, Some(value)) => self.unlike(value, &fields, (choice, usual), is_apart),
            (None, None) => Unlike::Value,
        };
        let shown = name_for_messages(label.as_ref(), &fields, choice.place);
        let has_word = usual.has_word_for_number(&fields, choice.place);
        let above = self.velocities.len();
        Suspect { line, label, value, above, is_apart, unlike, has_word, shown }
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
        let velocity = value.velocity(choice.unit);
        let mut means =
            [self.all, self.recent].into_iter().filter(|of| have_mean(of, velocity, rounding));
        let is_labelled = fields.iter().any(is_label);
        let is_certain = is_labelled || usual.has_gap(fields, choice.place);
        let is_mean = means.any(|of| is_certain || rounding < TELLING * of.deviation());
        let is_apart = is_apart && fields.len() > 1;
        let is_fine = fields.len() == 1 && value.has_more_decimals(self.rounding, choice.unit);
        if is_mean && (is_apart || is_fine || is_odd() || is_labelled) {
            return Unlike::Odd;
        }
        match usual.has_word(fields, choice.place) || self.is_after_suspect() && is_odd() {
            true => Unlike::Edge,
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
        self.recent = RunningMoments::default();
        self.suspects.append(&mut self.edge);
        self.suspects.push(suspect);
    }

    /// Takes rows with words for measurements, as others follow.
    fn flush_edge(&mut self, choice: &ColumnChoice) {
        for suspect in std::mem::take(&mut self.edge) {
            if let Some(value) = &suspect.value {
                self.add(value, choice);
            }
            if suspect.has_word && self.different_words.len() <= WORDS_MAX {
                self.different_words.insert(suspect.shown.clone());
                self.first_word.get_or_insert(suspect);
            }
        }
    }

    /// Asks what rows are that have the same few words where all others have numbers.
    fn ask_of_words(&self) -> Result<(), LocatedProblem> {
        match &self.first_word {
            Some(first) if self.different_words.len() <= WORDS_MAX => {
                let word = first.shown.trim_matches('"').to_owned();
                let found = first.value.as_ref().map_or("", CellNumber::text);
                let found = shortened(found);
                Err((Some(first.line), Problem::OtherRow { word, found }))
            }
            _ => Ok(()),
        }
    }

    /// Keeps the rows behind the last gap, as long as these are few.
    fn note_gap(&mut self, row: &Suspect) {
        if row.is_apart {
            self.tail.clear();
            self.above_gap = self.velocities.len();
        }
        if row.is_apart || (1..=TAIL_MAX).contains(&self.tail.len()) {
            self.tail.push(row.clone());
        }
    }

    /// Notices rows behind a gap at the end of a table of one column, if all are statistics of those above it.
    fn suspect_tail(&mut self, choice: &ColumnChoice) -> bool {
        let of_tail = self.velocities.get(self.above_gap..).unwrap_or_default();
        let is_one = |row: &Suspect| row.unlike == Unlike::Value && row.label.is_none();
        if of_tail.len() != self.tail.len()
            || self.tail.len() > TAIL_MAX
            || !self.tail.iter().all(is_one)
        {
            return false;
        }
        let all = Statistics::from_velocities(&self.velocities[..self.above_gap]);
        let Some(all) = all.filter(|_| self.above_gap >= TAIL_OF_MIN) else { return false };
        let is_statistic = |row: &Suspect| {
            row.value.as_ref().is_some_and(|value| {
                let rounding = value.rounding(choice.unit) + self.rounding;
                let is = |statistic| all.is(statistic, value.velocity(choice.unit), rounding);
                (is(Statistic::Mean) || is(Statistic::Median))
                    && rounding < TELLING * all.value(Statistic::Deviation)
                    || self.tail.len() > 1 && OF_TAIL.into_iter().any(is)
            })
        };
        if self.tail.is_empty() || !self.tail.iter().all(is_statistic) {
            return false;
        }
        self.velocities.truncate(self.above_gap);
        for mut row in std::mem::take(&mut self.tail) {
            (row.above, row.unlike) = (self.above_gap, Unlike::Odd);
            self.suspects.push(row);
        }
        true
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
        self.all.add(velocity);
        self.recent.add(velocity);
        // Zeros at the end may have been left away.
        self.rounding = self.rounding.min(value.rounding(choice.unit));
    }

    /// Returns whether it is noticed that a row has nothing beside its velocity.
    pub(super) fn is_bareness_noticed(&self) -> bool {
        let rows = self.velocities.len();
        rows >= ROWS_MIN && self.filled as f64 >= FILLED * rows as f64
    }
}

/// Returns whether a value is the mean of some velocities.
fn have_mean(velocities: &RunningMoments, value: f64, rounding: f64) -> bool {
    velocities.count() >= MEAN_OF_MIN && (value - velocities.mean()).abs() <= rounding * 1.000_001
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
fn name_for_messages(label: Option<&SummaryLabel>, fields: &[String], place: usize) -> String {
    let beside =
        || fields.iter().enumerate().filter(|(at, _)| *at != place).map(|(_, field)| field);
    let of_row = beside().find(|field| SummaryLabel::recognize(field).is_some());
    let named = of_row.or_else(|| beside().find(|field| !field.is_empty())).or(fields.get(place));
    let text = label.map(|label| label.text.as_str()).or(named.map(String::as_str));
    format!("{:?}", shortened(text.unwrap_or_default()))
}
