//! Which rows of a table sum up others and are no measurements.
//!
//! A label alone does not decide: somebody may be called Max. The value has to be that statistic of the
//! other rows, of those before it, or of those behind it; or the row stands beside one of which that
//! is so. A label without such a value is asked about.

use std::collections::BTreeMap;

use osteon_common::limits;

use super::choice::{ColumnChoice, POSSIBLE};
use super::header::Header;
use super::lines::{TableLine, TableLines};
use super::number::CellNumber;
use super::problem::{LocatedProblem, Problem, shortened};
use super::statistics::{Statistic, Statistics, SummaryLabel};

/// Most rows that may seem to sum up others.
const ROWS_MAX: usize = 2000;
/// Most rows with only a velocity that are noticed.
const BARE_MAX: usize = 10;
/// Most lines of another shape than the rows.
const OTHER_SHAPES_MAX: usize = 1000;
/// Most values that are looked at for those rows, all in all.
const WORK_MAX: usize = 50_000_000;
/// Fewest rows among which one of another kind is noticed.
const ROWS_MIN: usize = 5;
/// Share of rows that have a cell before the velocity, where a row without them is noticed.
const FILLED: f64 = 0.8;
/// Statistics that a value without a label is compared with.
const UNLABELLED: [Statistic; 4] =
    [Statistic::Mean, Statistic::Deviation, Statistic::Median, Statistic::Sum];

/// The rows that are left out, by their lines, with what they are.
pub(super) type Summaries = BTreeMap<usize, String>;

/// A row that may sum up others.
struct Suspect {
    line: usize,
    label: Option<SummaryLabel>,
    value: Option<CellNumber>,
    /// Number of velocities above it.
    above: usize,
    /// Whether it stands apart from the rows above it.
    is_apart: bool,
}

/// Finds these rows.
pub(super) fn of_table(
    text: &str,
    header: &Header,
    choice: &ColumnChoice,
) -> Result<Summaries, LocatedProblem> {
    let mut rows = SummedRows::collect(text, header, choice, true)?;
    if rows.suspects.iter().filter(|one| one.label.is_none()).count() > BARE_MAX {
        // Where many rows have only a velocity, that says nothing.
        rows = SummedRows::collect(text, header, choice, false)?;
    }
    rows.verdicts(choice)
}

/// What was seen of a table.
#[derive(Default)]
struct SummedRows {
    /// Velocities of rows that sum up nothing.
    velocities: Vec<f64>,
    /// By how much these may have been rounded.
    rounding: f64,
    suspects: Vec<Suspect>,
    /// Number of all rows, also of those without a velocity.
    count: usize,
    /// Number of rows with a cell before the velocity.
    filled: usize,
}

impl SummedRows {
    fn collect(
        text: &str,
        header: &Header,
        choice: &ColumnChoice,
        are_bare_noticed: bool,
    ) -> Result<Self, LocatedProblem> {
        let mut rows = Self { rounding: f64::INFINITY, ..Self::default() };
        let mut lines = TableLines::after_header(text, header, Some(choice.place));
        // A label may stand on a line of its own, above its value.
        let mut waiting: Option<SummaryLabel> = None;
        let mut other_shapes = 0;
        while let Some(line) = lines.next() {
            let is_apart = lines.is_after_gap;
            let (line, label, fields) = match line? {
                (line, TableLine::Data(fields)) => {
                    rows.count += 1;
                    (line, waiting.take(), fields)
                }
                (line, TableLine::Labelled { label, fields }) => (line, Some(label), fields),
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
            let cell = fields.get(choice.place).map_or("", String::as_str);
            let value = CellNumber::read(cell, choice.decimal)
                .filter(|_| !choice.missing.iter().any(|missing| missing == cell));
            if value.is_none() && label.as_ref().is_some_and(|label| label.text == cell) {
                waiting = label.clone();
            }
            // What a row is of stands before its velocity.
            let before = fields.get(..choice.place).unwrap_or_default();
            let is_named = before.iter().any(|field| !field.is_empty());
            rows.filled += usize::from(is_named);
            let is_bare = are_bare_noticed && !is_named && (!before.is_empty() || is_apart);
            match (label, value) {
                (None, Some(value)) if !is_bare => rows.add(&value, choice),
                (None, None) => {}
                (label, value) => {
                    let above = rows.velocities.len();
                    rows.suspects.push(Suspect { line, label, value, above, is_apart });
                }
            }
            if rows.velocities.len() > limits::DATA_VELOCITIES_MAX {
                return Err((None, Problem::TooMany));
            }
            let are_labelled = rows.suspects.last().is_some_and(|one| one.label.is_some());
            if rows.suspects.len() > ROWS_MAX {
                if are_labelled {
                    return Err((Some(line), Problem::ManySummaries));
                }
                return Self::collect(text, header, choice, false);
            }
        }
        Ok(rows)
    }

    fn add(&mut self, value: &CellNumber, choice: &ColumnChoice) {
        self.velocities.push(value.velocity(choice.unit));
        // Zeros at the end may have been left away.
        self.rounding = self.rounding.min(value.rounding(choice.unit));
    }

    /// Decides of each block of such rows with no other between them.
    fn verdicts(&self, choice: &ColumnChoice) -> Result<Summaries, LocatedProblem> {
        let mut left_out = Summaries::new();
        let rows = self.velocities.len();
        let all = Statistics::from_velocities(&self.velocities);
        let mut work = 0;
        let mut last = 0;
        for block in self.suspects.chunk_by(|one, next| one.above == next.above) {
            let above = block[0].above;
            let before = &self.velocities[last..above];
            work += before.len();
            let before = Statistics::from_velocities(before).filter(|_| work < WORK_MAX);
            let behind =
                self.velocities.get(above..above + self.length_behind(above)).unwrap_or_default();
            work += behind.len();
            let behind = Statistics::from_velocities(behind).filter(|_| work < WORK_MAX);
            let sets = [all, before, behind];
            let matches: Vec<bool> =
                block.iter().map(|one| self.is_found(one, choice, &sets)).collect();
            let is_at_end = above == rows;
            let is_certain = |(one, is_found): (&Suspect, &bool)| {
                let is_name = one.label.as_ref().is_none_or(|label| label.is_like_name);
                *is_found && (is_at_end || !is_name)
            };
            let is_summary = block.iter().zip(&matches).any(is_certain);
            for (one, is_found) in block.iter().zip(matches) {
                let is_left_out = match one.label {
                    Some(_) => is_summary || !self.is_possible(one, choice),
                    None => is_summary && is_found && (one.is_apart || self.is_noticed()),
                };
                let is_asked = match &one.label {
                    Some(label) => !label.is_like_name || is_at_end || is_found,
                    None => is_at_end && self.is_noticed(),
                };
                if is_left_out {
                    left_out.insert(one.line, one.shown());
                } else if is_asked {
                    return Err(one.doubt(all));
                }
            }
            last = above;
        }
        Ok(left_out)
    }

    /// Returns the number of velocities from one on to the next block.
    fn length_behind(&self, above: usize) -> usize {
        let next = self.suspects.iter().map(|one| one.above).find(|&next| next > above);
        next.unwrap_or(self.velocities.len()) - above
    }

    /// Returns whether the value is what the label says, of some of the rows.
    fn is_found(&self, one: &Suspect, choice: &ColumnChoice, sets: &[Option<Statistics>]) -> bool {
        let Some(value) = &one.value else { return false };
        let rounding = value.rounding(choice.unit) + self.rounding;
        let in_cell = value.value();
        let value = value.velocity(choice.unit);
        let is = |statistic: Statistic| {
            let value = if statistic == Statistic::Count { in_cell } else { value };
            let is_of_set = |set: &Statistics| set.is(statistic, value, rounding);
            sets.iter().flatten().any(is_of_set)
                || statistic == Statistic::Count && in_cell == self.count as f64
        };
        match &one.label {
            Some(label) => is(label.statistic),
            None => UNLABELLED.into_iter().any(is),
        }
    }

    /// Returns whether a row has a number that may be a velocity.
    fn is_possible(&self, one: &Suspect, choice: &ColumnChoice) -> bool {
        one.value.as_ref().is_some_and(|value| POSSIBLE.contains(&value.velocity(choice.unit)))
    }

    /// Returns whether it is noticed that a row has nothing beside its velocity.
    fn is_noticed(&self) -> bool {
        let rows = self.velocities.len();
        rows >= ROWS_MIN && self.filled as f64 >= FILLED * rows as f64
    }
}

impl Suspect {
    /// Returns what stands for it in a message.
    fn shown(&self) -> String {
        let value = self.value.as_ref().map_or("", CellNumber::text);
        let text = self.label.as_ref().map_or(value, |label| label.text.as_str());
        format!("{:?}", shortened(text))
    }

    /// Returns the question whether it is a measurement.
    fn doubt(&self, all: Option<Statistics>) -> LocatedProblem {
        let statistic = self.label.as_ref().map_or(Statistic::Mean, |label| label.statistic);
        let problem = Problem::DoubtfulSummary {
            label: self.label.as_ref().map_or_else(String::new, |label| shortened(&label.text)),
            found: shortened(self.value.as_ref().map_or("", CellNumber::text)),
            others: all.map_or(f64::NAN, |all| all.value(statistic)),
        };
        (Some(self.line), problem)
    }
}
