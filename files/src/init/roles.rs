//! Which columns hold velocities, groups and subjects.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use osteon_common::limits;

use super::layout::Layout;
use crate::velocities::{VelocityUnit, is_like_subject, is_like_velocity};

/// Fewest velocities of a group, on average, for a search of its own.
const OF_A_GROUP_MIN: usize = 5;
/// Maximum number of texts that a job file names as missing.
const MISSING_MAX: usize = 20;
/// Velocities of sound in bone, m/s, as wide as the program accepts them.
const POSSIBLE: (f64, f64) = (100.0, 20_000.0);
/// Names of columns whose values are groups rather than subjects.
const LIKE_GROUPS: [&str; 10] = [
    "group",
    "cohort",
    "class",
    "site",
    "side",
    "sex",
    "treatment",
    "diagnosis",
    "region",
    "gruppe",
];

/// The columns that a job uses, and their values in short.
#[derive(Debug)]
pub(super) struct Roles {
    pub(super) velocity: String,
    /// The unit, and whether it is a guess from the size of the values.
    pub(super) unit: VelocityUnit,
    is_unit_guessed: bool,
    /// Number and mean of the velocities, m/s.
    count: usize,
    mean: f64,
    /// Texts that stand for missing values.
    pub(super) missing: Vec<String>,
    /// Number of rows with one of them.
    left_out: usize,
    pub(super) group: Option<NameColumn>,
    pub(super) subject: Option<NameColumn>,
}

/// A column of names that repeat.
#[derive(Debug, Clone)]
pub(super) struct NameColumn {
    pub(super) name: String,
    /// Number of different names.
    different: usize,
    /// Whether its name is one of groups.
    is_group: bool,
}

impl Roles {
    /// Returns the columns' roles, or why there are none.
    pub(super) fn of(layout: &Layout) -> Result<Self, String> {
        let place = velocity_column(layout)?;
        let name = layout.names[place].clone();
        let (texts, numbers) = cells(layout, place);
        let written =
            named_unit(&name).or_else(|| texts.keys().find_map(|text| VelocityUnit::of_text(text)));
        let unit = match written.or_else(|| unit_of_size(&numbers)) {
            Some(unit) => unit,
            None => {
                return Err(format!(
                    "the median of the column `{name}` is {}; velocities of bone are 1000 to 8000 m/s, and \
                     no usual unit explains it",
                    median(&numbers)
                ));
            }
        };
        let in_si = |text: &str| unit.velocity(text, layout.decimal);
        let is_velocity = |value: &f64| (POSSIBLE.0..POSSIBLE.1).contains(value);
        let mut missing: BTreeSet<String> = texts.into_keys().collect();
        // Numbers such as -999 and 0, which stand for nothing.
        let none = |text: &&str| in_si(text).is_some_and(|value| value <= 0.0);
        missing.extend(layout.column(place).filter(none).map(str::to_owned));
        if missing.len() > MISSING_MAX {
            return Err(format!(
                "the column `{name}` has {} different texts that are no velocity, such as {:?}; name the \
                 column of velocities in the header, and correct these",
                missing.len(),
                missing.first().map_or("", String::as_str)
            ));
        }
        let left_out = layout.column(place).filter(|&cell| missing.contains(cell)).count();
        let velocities: Vec<f64> = layout
            .column(place)
            .filter(|&cell| !missing.contains(cell))
            .filter_map(in_si)
            .filter(is_velocity)
            .collect();
        let count = velocities.len();
        if count < 2 {
            return Err(format!(
                "the column `{name}` has {count} velocities; at least two are needed"
            ));
        }
        let (group, subject) = names(layout, place);
        Ok(Self {
            velocity: name,
            unit,
            is_unit_guessed: written.is_none(),
            count,
            mean: velocities.iter().sum::<f64>() / count as f64,
            missing: missing.into_iter().collect(),
            left_out,
            group,
            subject,
        })
    }

    /// Says what was found.
    pub(super) fn described(&self) -> Vec<String> {
        let guess = if self.is_unit_guessed { ", a guess from their size" } else { "" };
        let mut said = vec![format!(
            "{} velocities in the column {:?} (unit {}{guess}), mean {:.1} m/s",
            self.count,
            self.velocity,
            self.unit.name(),
            self.mean
        )];
        if self.left_out > 0 {
            let rows = if self.left_out == 1 { "row is" } else { "rows are" };
            let mut sentence = format!("{} {rows} left out: the velocity is ", self.left_out);
            for (i, text) in self.missing.iter().enumerate() {
                let between = if i == 0 { "" } else { " or " };
                // Writing to a string cannot fail.
                let _ = write!(sentence, "{between}{text:?}");
            }
            said.push(sentence);
        }
        if let Some(NameColumn { name, different, .. }) = &self.group {
            said.push(format!("{different} groups in the column {name:?}: a search for each"));
        }
        if let Some(NameColumn { name, different, .. }) = &self.subject {
            said.push(format!(
                "{different} subjects in the column {name:?}, with several velocities each: their noise is \
                 that of whole subjects"
            ));
        }
        said
    }
}

/// Returns the texts of a column that are no numbers, with their counts, and its numbers.
fn cells(layout: &Layout, place: usize) -> (BTreeMap<String, usize>, Vec<f64>) {
    let (mut texts, mut numbers) = (BTreeMap::new(), Vec::new());
    for cell in layout.column(place) {
        match layout.decimal.number(cell).filter(|number| number.is_finite()) {
            Some(number) => numbers.push(number),
            None => *texts.entry(cell.to_owned()).or_default() += 1,
        }
    }
    (texts, numbers)
}

/// Returns the position of the column of velocities.
fn velocity_column(layout: &Layout) -> Result<usize, String> {
    let is_numeric = |place: &usize| {
        let (texts, numbers) = cells(layout, *place);
        numbers.len() >= 2 && numbers.len() >= texts.values().sum()
    };
    let numeric: Vec<usize> = (0..layout.names.len()).filter(is_numeric).collect();
    let of_size = |place: &&usize| {
        let (_, numbers) = cells(layout, **place);
        named_unit(&layout.names[**place]).is_some() || unit_of_size(&numbers).is_some()
    };
    let exact = numeric.iter().find(|&&place| layout.names[place] == "velocity");
    let mut named = numeric.iter().filter(|&&place| is_like_velocity(&layout.names[place]));
    let mut sized = numeric.iter().filter(of_size);
    let found =
        exact.or_else(|| named.next()).copied().or_else(|| match (sized.next(), sized.next()) {
            (Some(&place), None) => Some(place),
            _ => None,
        });
    found.ok_or_else(|| {
        let names: Vec<_> = layout.names.iter().take(20).map(|name| format!("`{name}`")).collect();
        format!(
            "no column is clearly that of the velocities; the header has {}. Name it `velocity`, or write \
             a job file with [data] column = \"…\"",
            names.join(", ")
        )
    })
}

/// Returns the unit that stands in the name of a column.
fn named_unit(name: &str) -> Option<VelocityUnit> {
    let parts = name.split(['(', ')', '[', ']', ' ', ',']);
    parts.into_iter().find_map(VelocityUnit::of_text)
}

/// Returns the unit in which such numbers are velocities of bone.
fn unit_of_size(numbers: &[f64]) -> Option<VelocityUnit> {
    match median(numbers) {
        1000.0..10_000.0 => Some(VelocityUnit::MetrePerSecond),
        1.0..10.0 => Some(VelocityUnit::KilometrePerSecond),
        _ => None,
    }
}

fn median(numbers: &[f64]) -> f64 {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Returns the column of groups and that of subjects.
fn names(layout: &Layout, velocity: usize) -> (Option<NameColumn>, Option<NameColumn>) {
    let places = (0..layout.names.len()).filter(|&place| place != velocity);
    let columns: Vec<NameColumn> = places.filter_map(|place| repeated(layout, place)).collect();
    let first = |is_group| columns.iter().find(|column| column.is_group == is_group).cloned();
    let (group, subject) = (first(true), first(false));
    match (group, subject) {
        // The velocities of a subject are a set of their own if there are enough.
        (None, Some(subject)) if layout.rows.len() >= OF_A_GROUP_MIN * subject.different => {
            (Some(subject), None)
        }
        both => both,
    }
}

/// Returns the column at `place` if it has names that repeat, and seems to name groups or subjects.
fn repeated(layout: &Layout, place: usize) -> Option<NameColumn> {
    let name = &layout.names[place];
    let lower = name.to_lowercase();
    let is_group = LIKE_GROUPS.iter().any(|part| lower.contains(part));
    if !is_group && !is_like_subject(&lower) {
        return None;
    }
    let different: BTreeSet<&str> = layout.column(place).collect();
    let repeats = different.len() < layout.rows.len() && different.len() > 1;
    let is_named = !different.contains("") && different.len() <= limits::GROUPS_MAX;
    (repeats && is_named).then(|| NameColumn {
        name: name.clone(),
        different: different.len(),
        is_group,
    })
}
