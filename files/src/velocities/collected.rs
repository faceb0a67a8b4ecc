//! Velocities that are gathered from the rows of a table, in groups.

use std::collections::BTreeMap;
use std::path::Path;

use osteon_common::job::Group;
use osteon_common::known_quantities::KnownQuantities;
use osteon_common::limits;
use osteon_common::observables::PerObservable;
use osteon_common::origin::Origin;
use osteon_common::parameters::Parameter;

use super::account::Account;
use super::columns::{Columns, Row};
use super::problem::{Problem, shortened};
use super::table::VelocityTable;

/// A column that seems to name subjects is an index of the rows if it has more names than this.
const UNUSED_NAMES_MAX: usize = 10_000;

/// Measured velocities of a file, one set or a set for each group.
#[derive(Debug)]
pub(crate) struct Measured<T> {
    /// The velocities, m/s.
    pub(crate) data: T,
    /// The root mean square of their standard errors, m/s, if there is a column of them.
    pub(crate) repeatability: Option<f64>,
    /// Their positions in the file.
    pub(crate) origin: Origin,
    /// What was taken and what was not.
    pub(crate) account: Account,
}

/// The velocities read so far.
pub(super) struct CollectedVelocities {
    groups: Vec<CollectedGroup>,
    /// Position of each group, by its name.
    places: BTreeMap<String, usize>,
    pub(super) count: usize,
    /// Sum of the squared standard errors, (m/s)², if there is a column of them.
    squared_errors: Option<f64>,
    /// What is taken and what is not.
    pub(super) account: Account,
    /// Number of rows with a value that is missing.
    left_out: u32,
    /// Whether a column of subjects is named.
    has_subjects: bool,
    /// Number of subjects in all groups.
    subjects: usize,
    /// Whether the column that seems to name subjects has too many names for that.
    is_index: bool,
}

/// The velocities of one group.
struct CollectedGroup {
    name: String,
    velocities: Vec<f64>,
    /// Line of each velocity, from 1.
    lines: Vec<u32>,
    /// Number of the subject of each velocity; empty if there is no such column.
    subjects: Vec<u32>,
    /// Numbers of the subjects, by their names.
    numbers: BTreeMap<String, u32>,
    /// Other observables of each velocity; empty if there is no such column.
    observables: PerObservable<Vec<f64>>,
    /// Quantities that are known of the group.
    known: [Option<f64>; Parameter::OF_SETUP.len()],
}

impl CollectedVelocities {
    pub(super) fn new(has_subjects: bool, table: &VelocityTable) -> Self {
        Self {
            groups: Vec::new(),
            places: BTreeMap::new(),
            count: 0,
            squared_errors: None,
            account: Account::of_column(table),
            left_out: 0,
            has_subjects,
            subjects: 0,
            is_index: false,
        }
    }

    /// Takes the row in a line, or leaves it out if a value is missing; returns whether it was taken.
    pub(super) fn row(
        &mut self,
        line: usize,
        fields: Vec<String>,
        columns: &Columns<'_>,
    ) -> Result<bool, Problem> {
        let Some(row) = columns.row(fields)? else {
            self.left_out += 1;
            return Ok(false);
        };
        match self.contradiction(&row, columns) {
            Some(problem) => Err(problem),
            None => self.add(line, row).map(|()| true),
        }
    }

    /// Returns how a row contradicts what is known of its group from the first of its rows.
    fn contradiction(&self, row: &Row, columns: &Columns<'_>) -> Option<Problem> {
        let group = &self.groups[*self.places.get(&row.group)?];
        let pairs = group.known.iter().zip(row.known).enumerate();
        let mut different = pairs.filter_map(|(quantity, (first, found))| {
            let (first, found) = ((*first)?, found?);
            (first.to_bits() != found.to_bits()).then_some((quantity, first, found))
        });
        let (quantity, first, found) = different.next()?;
        Some(Problem::OtherKnownValue {
            column: shortened(columns.known(quantity)),
            found,
            first,
            line: group.lines.first().copied().unwrap_or_default(),
            group: shortened(&row.group),
        })
    }

    fn add(&mut self, line: usize, row: Row) -> Result<(), Problem> {
        self.count += 1;
        if self.count > limits::DATA_VELOCITIES_MAX {
            return Err(Problem::TooMany);
        }
        if self.has_subjects && self.count > limits::DATA_SUBJECTS_MAX {
            return Err(Problem::TooManySubjects);
        }
        let place = match self.places.get(&row.group) {
            Some(&place) => place,
            None if self.groups.len() == limits::GROUPS_MAX => return Err(Problem::TooManyGroups),
            None => {
                self.groups.push(CollectedGroup::new(row.group.clone(), row.known));
                self.places.insert(row.group, self.groups.len() - 1);
                self.groups.len() - 1
            }
        };
        self.account.take(line, row.velocity, row.has_error);
        if let Some(error) = row.error {
            *self.squared_errors.get_or_insert_default() += error * error;
        }
        let group = &mut self.groups[place];
        group.velocities.push(row.velocity);
        for (observable, value) in row.observables.present() {
            group.observables[observable].push(*value);
        }
        // The limit on a file's bytes keeps the number of lines far below this.
        group.lines.push(u32::try_from(line).unwrap_or(u32::MAX));
        if let Some(subject) = row.subject.filter(|_| !self.is_index) {
            self.subjects += usize::from(group.add_subject(subject));
            self.is_index = !self.has_subjects && self.subjects > UNUSED_NAMES_MAX;
        }
        Ok(())
    }

    /// Returns the groups and what is known of their rows.
    pub(super) fn finish(mut self, path: &Path, columns: &Columns<'_>) -> Measured<Vec<Group>> {
        let repeats = !self.is_index && self.groups.iter().any(CollectedGroup::repeats);
        let unused = columns.like_subjects().filter(|_| repeats);
        let origin = Origin {
            path: path.to_owned(),
            unused_subjects: unused.map(shortened),
            left_out: self.left_out,
            no_rows: self.account.left_out().to_vec(),
            lines: Vec::with_capacity(self.groups.len()),
            error_column: columns.error().map(shortened),
            picking: None,
        };
        self.account.missing = self.left_out;
        self.account.alike = alike(&self.groups);
        let account = self.account;
        let repeatability = self.squared_errors.map(|sum| (sum / self.count as f64).sqrt());
        let data = Vec::with_capacity(self.groups.len());
        let mut measured = Measured { data, repeatability, origin, account };
        for CollectedGroup { name, velocities, lines, subjects, observables, known, .. } in
            self.groups
        {
            let subjects = self.has_subjects.then_some(subjects);
            let known = KnownQuantities::new(known);
            // Rows have a value of an observable each, or none has.
            let observables = observables.map(|values| (!values.is_empty()).then_some(values));
            measured.data.push(Group { name, velocities, subjects, observables, known });
            measured.origin.lines.push(lines);
        }
        measured
    }
}

impl CollectedGroup {
    fn new(name: String, known: [Option<f64>; Parameter::OF_SETUP.len()]) -> Self {
        let (velocities, lines, subjects) = (Vec::new(), Vec::new(), Vec::new());
        let (observables, numbers) = (PerObservable::default(), BTreeMap::new());
        Self { name, velocities, lines, subjects, observables, numbers, known }
    }

    /// Adds the subject of a velocity; returns whether it is a new one.
    fn add_subject(&mut self, name: String) -> bool {
        // At most as many as there are velocities.
        let next = u32::try_from(self.numbers.len()).unwrap_or(u32::MAX);
        let number = *self.numbers.entry(name).or_insert(next);
        self.subjects.push(number);
        number == next
    }

    /// Returns whether there are several subjects, of which some have several velocities.
    fn repeats(&self) -> bool {
        (2..self.subjects.len()).contains(&self.numbers.len())
    }
}

/// Returns the names of two groups that differ only by upper and lower case, or by blanks.
fn alike(groups: &[CollectedGroup]) -> Option<[String; 2]> {
    let mut names = BTreeMap::new();
    for group in groups {
        let form = group.name.to_lowercase().split_whitespace().collect::<String>();
        if let Some(first) = names.insert(form, &group.name) {
            return Some([shortened(first), shortened(&group.name)]);
        }
    }
    None
}
