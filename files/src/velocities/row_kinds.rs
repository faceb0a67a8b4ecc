//! What the other columns of a table say of its rows: that some of a group sum up the others, that they are of
//! different things, or that the velocities go on in a column without a name.

use std::collections::BTreeMap;

use super::column_choice::{ColumnChoice, POSSIBLE};
use super::column_roles::{is_like_group, is_like_subject};
use super::fields::COMMENT_MARKS;
use super::header::Header;
use super::lines::{TableLine, TableLines};
use super::number::CellNumber;
use super::problem::{LocatedProblem, Problem, shortened};
use super::running_moments::RunningMoments;
use super::summaries::Summaries;

/// Most columns that are looked at, and most different cells of one.
const COLUMNS_MAX: usize = 20;
const CELLS_MAX: usize = 1000;
/// Fewest rows of a group of which one may sum up the others, and fewest such groups.
const GROUP_MIN: usize = 3;
const GROUPS_MIN: usize = 2;
/// Below which probability it is no chance that so many rows are means, and the inverse of the density of a normal
/// law at its mean, in standard deviations.
const CHANCE: f64 = 0.002;
const SCATTER: f64 = 2.5;
/// Most kinds of things that a column tells apart, and by how much the means of two of them differ.
const KINDS_MAX: usize = 4;
const APART: f64 = 1.25;
/// Share of rows with a number that make a column without a name one of velocities.
const NAMELESS: f64 = 0.5;
/// Names of columns that say whether a row counts, in lower case.
const STATES: [&str; 16] = [
    "status",
    "valid",
    "validity",
    "exclude",
    "excluded",
    "exclusion",
    "rejected",
    "accepted",
    "use",
    "used",
    "include",
    "included",
    "flag",
    "ok",
    "discard",
    "g\u{fc}ltig",
];
/// Cells that say that a row is of something else than bone, in lower case.
const OTHERS: [&str; 9] = [
    "cal",
    "calibration",
    "kalibrierung",
    "ref",
    "reference",
    "phantom",
    "water",
    "wasser",
    "blank",
];
/// How far a number that is there several times lies above all others, if it is the end of a range.
const OVERFLOW: f64 = 1.5;
/// Parts of what comments say of missing values, in lower case.
const MISSING: [&str; 8] =
    ["missing", "no data", "nodata", "not measured", "invalid", "fehl", "manquant", "faltante"];

/// Checks what the other columns say of the rows; returns a note for the user.
pub(super) fn check(
    text: &str,
    header: &Header,
    choice: &ColumnChoice,
    summaries: &Summaries,
    is_found_out: bool,
) -> Result<Option<String>, LocatedProblem> {
    let seen = SeenColumns::read(text, header, choice, summaries);
    seen.refuse_named_missing(text, header)?;
    if is_found_out {
        seen.refuse_overflow()?;
        seen.refuse_nameless(header, choice.place)?;
    }
    for (place, cells) in seen.cells.iter().enumerate() {
        let name = header.names.get(place).map_or("", String::as_str);
        if place == choice.place {
            continue;
        }
        refuse_means(name, cells, seen.rounding)?;
        if is_found_out && !is_role(name) {
            refuse_different_things(name, cells)?;
        }
    }
    Ok(seen.state_note(header))
}

/// Returns whether a column is that of groups or subjects, which the job may identify each by itself.
fn is_role(name: &str) -> bool {
    let name = name.to_lowercase();
    is_like_group(&name) || is_like_subject(&name)
}

/// The rows with one cell in a column.
#[derive(Debug, Clone, Copy)]
struct CellRows {
    moments: RunningMoments,
    first: (usize, f64),
    last: (usize, f64),
}

/// What was seen of the columns.
struct SeenColumns {
    /// For each column the rows with each of its cells; empty if there are too many of them.
    cells: Vec<BTreeMap<String, CellRows>>,
    is_full: Vec<bool>,
    is_nameless: Vec<bool>,
    /// For each column without a name the number of rows in which it has a number like the velocity.
    like_velocities: Vec<usize>,
    rows: usize,
    /// By how much velocities are rounded, m/s.
    rounding: f64,
    /// Numbers in the column of velocities as they stand: first line, velocity, and how often they are there.
    numbers: BTreeMap<String, (usize, f64, usize)>,
}

impl SeenColumns {
    fn read(text: &str, header: &Header, choice: &ColumnChoice, summaries: &Summaries) -> Self {
        let count = header.names.len().min(COLUMNS_MAX);
        let mut columns = Self {
            cells: vec![BTreeMap::new(); count],
            is_full: vec![false; count],
            is_nameless: header.names.iter().take(count).map(String::is_empty).collect(),
            like_velocities: vec![0; count],
            rows: 0,
            rounding: f64::INFINITY,
            numbers: BTreeMap::new(),
        };
        for line in TableLines::after_header(text, header, Some(choice.place)) {
            let Ok((line, TableLine::Data(fields))) = line else { continue };
            let Some(cell) = fields.get(choice.place) else { continue };
            if summaries.contains_key(&line) || choice.missing.contains(cell) {
                continue;
            }
            if let Some(value) = CellNumber::read(cell, choice.decimal) {
                columns.add(line, &fields, &value, choice);
            }
        }
        columns
    }

    fn add(&mut self, line: usize, fields: &[String], value: &CellNumber, choice: &ColumnChoice) {
        let velocity = value.velocity(choice.unit);
        self.rows += 1;
        self.rounding = self.rounding.min(value.rounding(choice.unit));
        if self.numbers.len() < CELLS_MAX {
            let cell = fields[choice.place].clone();
            self.numbers.entry(cell).or_insert((line, velocity, 0)).2 += 1;
        }
        for (place, field) in fields.iter().enumerate().take(self.cells.len()) {
            // Reading a number takes long, and is needed for columns without a name only.
            if self.is_nameless[place] && place != choice.place {
                let other = CellNumber::read(field, choice.decimal);
                let is_like = other.is_some_and(|other| {
                    (velocity / APART..velocity * APART).contains(&other.velocity(choice.unit))
                });
                self.like_velocities[place] += usize::from(is_like);
            }
            let cells = &mut self.cells[place];
            if field.is_empty() || self.is_full[place] || place == choice.place {
                continue;
            }
            if !cells.contains_key(field) {
                cells.insert(field.clone(), CellRows::begin(line, velocity));
            }
            let Some(rows) = cells.get_mut(field) else { continue };
            rows.moments.add(velocity);
            rows.last = (line, velocity);
            if cells.len() > CELLS_MAX {
                cells.clear();
                self.is_full[place] = true;
            }
        }
    }

    /// Asks of a column without a name that has numbers like the velocities.
    fn refuse_nameless(&self, header: &Header, place: usize) -> Result<(), LocatedProblem> {
        let is_like = |at: &usize| {
            self.is_nameless[*at] && self.like_velocities[*at] as f64 >= NAMELESS * self.rows as f64
        };
        match (0..self.cells.len()).find(is_like).filter(|_| self.rows > 1) {
            Some(at) => {
                let column = header.names.get(place).map_or("", String::as_str);
                let problem = Problem::Nameless { place: at + 1, column: shortened(column) };
                Err((Some(header.line), problem))
            }
            None => Ok(()),
        }
    }

    /// Asks of numbers that a comment names beside missing values.
    fn refuse_named_missing(&self, text: &str, header: &Header) -> Result<(), LocatedProblem> {
        for (at, line) in text.lines().enumerate() {
            if at + 1 >= header.line && !line.trim_start().starts_with(COMMENT_MARKS) {
                continue;
            }
            let folded = line.to_lowercase();
            if !MISSING.iter().any(|part| folded.contains(part)) {
                continue;
            }
            let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | ',' | '-');
            let numbers = folded.split(|c| !is_number(c)).map(|word| word.trim_matches([',', '.']));
            let named = |number: &&str| self.numbers.contains_key(*number);
            if let Some(found) = numbers.filter(|number| !number.is_empty()).find(named) {
                let line = self.numbers.get(found).map(|(line, ..)| *line);
                return Err((line, Problem::NamedMissing { found: found.to_owned() }));
            }
        }
        Ok(())
    }

    /// Asks of a number far above all others that is there several times: the end of a device's range.
    fn refuse_overflow(&self) -> Result<(), LocatedProblem> {
        let velocity = |one: &(&String, &(usize, f64, usize))| one.1.1;
        let is_possible =
            |(_, (_, velocity, _)): &(&String, &(usize, f64, usize))| POSSIBLE.contains(velocity);
        let mut by_size: Vec<_> = self.numbers.iter().filter(is_possible).collect();
        by_size.sort_by(|one, other| velocity(other).total_cmp(&velocity(one)));
        match by_size.as_slice() {
            [largest, next, ..]
                if largest.1.2 > 1 && velocity(largest) > OVERFLOW * velocity(next) =>
            {
                Err((Some(largest.1.0), Problem::LikeCode { found: shortened(largest.0) }))
            }
            _ => Ok(()),
        }
    }

    /// Says that a column which tells whether rows count is not read.
    fn state_note(&self, header: &Header) -> Option<String> {
        let is_state = |(place, name): (usize, &String)| {
            let cells = self.cells.get(place)?;
            let filled: usize = cells.values().map(|rows| rows.moments.count()).sum();
            let differ = cells.len() > 1 || !cells.is_empty() && filled < self.rows;
            let is_named = STATES.contains(&name.to_lowercase().as_str());
            let has_other = cells.keys().any(|cell| OTHERS.contains(&cell.to_lowercase().as_str()));
            (differ && (is_named || has_other && !is_role(name))).then_some((place, cells))
        };
        let (place, cells) = header.names.iter().enumerate().find_map(is_state)?;
        let found: Vec<_> = cells.keys().take(KINDS_MAX).map(|cell| shortened(cell)).collect();
        let name = shortened(&header.names[place]);
        Some(format!(
            "the column {name:?} ({}) is not read: rows count whatever it says; delete those that should not",
            found.join(", ")
        ))
    }
}

/// Asks whether the first or last row of each group sums up the others.
fn refuse_means(
    name: &str,
    cells: &BTreeMap<String, CellRows>,
    rounding: f64,
) -> Result<(), LocatedProblem> {
    let groups = || cells.values().filter(|rows| rows.moments.count() >= GROUP_MIN);
    if groups().count() < GROUPS_MIN {
        return Ok(());
    }
    type Place = fn(&CellRows) -> (usize, f64);
    let places: [(&'static str, Place); 2] =
        [("last", |rows| rows.last), ("first", |rows| rows.first)];
    for (which, of) in places {
        let by_chance: f64 =
            groups().map(|rows| rows.chance_of_mean(of(rows).1, rounding)).product();
        if by_chance < CHANCE {
            let line = groups().map(|rows| of(rows).0).min();
            return Err((line, Problem::GroupMeans { column: shortened(name), which }));
        }
    }
    Ok(())
}

impl CellRows {
    fn begin(line: usize, velocity: f64) -> Self {
        let place = (line, velocity);
        Self { moments: RunningMoments::default(), first: place, last: place }
    }

    /// Returns how probable it is that one of the velocities is the mean of the others by chance; infinite where
    /// it is not their mean.
    fn chance_of_mean(&self, one: f64, rounding: f64) -> f64 {
        let others = self.moments.without(one);
        // Both the value and the mean are rounded.
        let within = 2.0 * rounding * 1.000_001;
        match (one - others.mean()).abs() <= within {
            true => (2.0 * within / (SCATTER * others.deviation())).min(1.0),
            false => f64::INFINITY,
        }
    }
}

/// Asks which rows count, if a column tells things apart whose velocities lie apart, too.
fn refuse_different_things(
    name: &str,
    cells: &BTreeMap<String, CellRows>,
) -> Result<(), LocatedProblem> {
    let are_kinds = (2..=KINDS_MAX).contains(&cells.len());
    let is_word = |cell: &String| cell.starts_with(char::is_alphabetic);
    if !are_kinds
        || !cells.keys().all(is_word)
        || cells.values().any(|rows| rows.moments.count() < 2)
    {
        return Ok(());
    }
    let by_mean = |one: &(&String, &CellRows), other: &(&String, &CellRows)| {
        one.1.moments.mean().total_cmp(&other.1.moments.mean())
    };
    let (Some(low), Some(high)) = (cells.iter().min_by(by_mean), cells.iter().max_by(by_mean))
    else {
        return Ok(());
    };
    if high.1.moments.mean() < APART * low.1.moments.mean() {
        return Ok(());
    }
    let problem = Problem::DifferentThings {
        column: shortened(name),
        first: shortened(high.0),
        first_mean: high.1.moments.mean(),
        second: shortened(low.0),
        second_mean: low.1.moments.mean(),
    };
    Err((Some(low.1.first.0), problem))
}
