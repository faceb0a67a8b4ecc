//! Which rows of a table sum up others and are no measurements.
//!
//! A label alone does not decide: somebody may be called Max. The value has to be that statistic of the
//! other rows, of those before it, or of those behind it; or the row stands beside one of which that
//! is so. A label without such a value is asked about.

use std::collections::BTreeMap;
use std::ops::Range;

use super::column_choice::{ColumnChoice, POSSIBLE};
use super::header::Header;
use super::number::CellNumber;
use super::problem::{LocatedProblem, Problem, shortened};
use super::statistics::{Statistic, Statistics};
use super::summed_rows::{SummedRows, Suspect, TELLING, Unlike};

/// Most values that are looked at for those rows, all in all.
const WORK_MAX: usize = 50_000_000;
/// Statistics that a value without a label is compared with.
const UNLABELLED: [Statistic; 4] =
    [Statistic::Mean, Statistic::Deviation, Statistic::Median, Statistic::Sum];

/// The rows that are left out, by their lines, with what they are.
pub(super) type Summaries = BTreeMap<usize, String>;

/// Finds these rows.
pub(super) fn of_table(
    text: &str,
    header: &Header,
    choice: &ColumnChoice,
) -> Result<Summaries, LocatedProblem> {
    let rows = SummedRows::collect(text, header, choice)?;
    Judge { rows: &rows, choice }.verdicts()
}

/// Decides which of the suspects sum up others.
struct Judge<'a> {
    rows: &'a SummedRows,
    choice: &'a ColumnChoice,
}

impl Judge<'_> {
    /// Decides of each block of suspects with no other row between them.
    fn verdicts(&self) -> Result<Summaries, LocatedProblem> {
        let mut left_out = Summaries::new();
        let velocities = &self.rows.velocities;
        let all = Statistics::from_velocities(velocities);
        let blocks: Vec<&[Suspect]> =
            self.rows.suspects.chunk_by(|one, next| one.above == next.above).collect();
        let begins: Vec<usize> = blocks.iter().map(|block| block[0].above).collect();
        let mut work = 0;
        for (at, block) in blocks.into_iter().enumerate() {
            let above = begins[at];
            let last = at.checked_sub(1).map_or(0, |before| begins[before]);
            let next = begins.get(at + 1).copied().unwrap_or(velocities.len());
            work += next - last;
            let of_rows = |range: Range<usize>| {
                velocities
                    .get(range)
                    .filter(|_| work < WORK_MAX)
                    .and_then(Statistics::from_velocities)
            };
            let sets = [all, of_rows(last..above), of_rows(above..next)];
            let found: Vec<bool> = block.iter().map(|one| self.is_found(one, &sets)).collect();
            let is_summary =
                block.iter().zip(&found).any(|(one, &is_found)| is_found && self.is_telling(one));
            for (one, is_found) in block.iter().zip(found) {
                if self.is_left_out(one, is_summary, is_found) {
                    left_out.insert(one.line, one.shown.clone());
                } else if self.is_doubtful(one, is_found) {
                    return Err(doubt(one, all));
                }
            }
        }
        Ok(left_out)
    }

    /// Returns whether a row whose value is found is a summary for certain, and its block with it.
    fn is_telling(&self, one: &Suspect) -> bool {
        match &one.label {
            Some(label) => !label.is_like_name || self.is_at_end(one) && one.unlike == Unlike::Odd,
            None => {
                matches!(one.unlike, Unlike::Odd | Unlike::Edge) || self.rows.is_bareness_noticed()
            }
        }
    }

    fn is_left_out(&self, one: &Suspect, is_summary: bool, is_found: bool) -> bool {
        match (&one.label, one.unlike) {
            (Some(_), _) => is_summary || !self.is_possible(one),
            (None, Unlike::Bare) => {
                is_summary && is_found && (one.is_apart || self.rows.is_bareness_noticed())
            }
            (None, Unlike::Odd | Unlike::Edge) => is_summary,
            (None, Unlike::Value) => false,
        }
    }

    /// Returns whether it has to be asked what a row is that is not left out.
    fn is_doubtful(&self, one: &Suspect, is_found: bool) -> bool {
        match (&one.label, one.unlike) {
            (Some(label), _) => !label.is_like_name || self.is_at_end(one) || is_found,
            (None, Unlike::Bare) => self.is_at_end(one) && self.rows.is_bareness_noticed(),
            // The first name may be unlike the others.
            (None, Unlike::Edge) => one.above > 0 || one.has_word,
            (None, _) => true,
        }
    }

    fn is_at_end(&self, one: &Suspect) -> bool {
        one.above == self.rows.velocities.len()
    }

    /// Returns whether the value is what the label says, of some of the rows.
    fn is_found(&self, one: &Suspect, sets: &[Option<Statistics>]) -> bool {
        let Some(value) = &one.value else { return false };
        // Where numbers are coarse, any may have such a value.
        let is_telling = |set: &&Statistics, rounding: f64| {
            one.label.is_some()
                || one.unlike != Unlike::Edge
                || rounding < TELLING * set.value(Statistic::Deviation)
        };
        let rounding = value.rounding(self.choice.unit) + self.rows.rounding;
        let in_cell = value.value();
        let velocity = value.velocity(self.choice.unit);
        let is = |statistic: Statistic| {
            let is_count = statistic == Statistic::Count;
            let value = if is_count { in_cell } else { velocity };
            let mut telling = sets.iter().flatten().filter(|set| is_telling(set, rounding));
            telling.any(|set| set.is(statistic, value, rounding))
                || is_count && in_cell == self.rows.count as f64
        };
        match &one.label {
            Some(label) => is(label.statistic),
            None => UNLABELLED.into_iter().any(is),
        }
    }

    /// Returns whether a row has a number that may be a velocity.
    fn is_possible(&self, one: &Suspect) -> bool {
        one.value.as_ref().is_some_and(|value| POSSIBLE.contains(&value.velocity(self.choice.unit)))
    }
}

/// Returns the question whether a row is a measurement.
fn doubt(one: &Suspect, all: Option<Statistics>) -> LocatedProblem {
    let statistic = one.label.as_ref().map_or(Statistic::Mean, |label| label.statistic);
    let problem = Problem::DoubtfulSummary {
        label: match one.unlike {
            Unlike::Bare => String::new(),
            _ => one.shown.trim_matches('"').to_owned(),
        },
        found: shortened(one.value.as_ref().map_or("", CellNumber::text)),
        others: all.map_or(f64::NAN, |all| all.value(statistic)),
    };
    (Some(one.line), problem)
}
