//! The columns of a table that a job uses, and its rows.

use osteon_common::check::{REPEATABILITY, VELOCITY};
use osteon_common::observables::{Observable, PerObservable};
use osteon_common::parameters::Parameter;

use super::column_choice::ColumnChoice;
use super::column_roles::is_like_subject;
use super::encodings::normalised;
use super::number::CellNumber;
use super::problem::{Problem, shortened};
use super::table::{VelocityTable, place_of};

/// The columns that are named in a job file.
#[derive(Debug, Clone, Default)]
pub(crate) struct NamedColumns<'a> {
    /// The columns of the group of each velocity, whose names are joined; none if empty.
    pub(crate) group: Vec<&'a str>,
    /// The column of the subject of each velocity.
    pub(crate) subject: Option<&'a str>,
    /// The column of the standard error of each velocity.
    pub(crate) error: Option<&'a str>,
    /// The columns of other observables that were measured with each velocity.
    pub(crate) observables: PerObservable<Option<&'a str>>,
    /// The columns of quantities that are known of each group, for each of [`Parameter::OF_SETUP`].
    pub(crate) known: [Option<&'a str>; Parameter::OF_SETUP.len()],
}

/// Positions of velocity, group, subject and known quantities in each row.
pub(super) struct Columns<'a> {
    choice: &'a ColumnChoice,
    velocity: NamedColumn,
    group: Vec<NamedColumn>,
    subject: Option<NamedColumn>,
    error: Option<NamedColumn>,
    observables: PerObservable<Option<NamedColumn>>,
    known: [Option<NamedColumn>; Parameter::OF_SETUP.len()],
    /// A column that seems to name subjects, if none is named.
    like_subjects: Option<NamedColumn>,
}

/// Maximum number of characters of a text that may stand for a missing value.
const MISSING_CHARACTERS_MAX: usize = 12;
/// Between the parts of a group's name that come from several columns.
const BETWEEN_PARTS: &str = " / ";

/// A column that is used.
struct NamedColumn {
    place: usize,
    name: String,
    /// Kind of thing that it names.
    named: &'static str,
}

/// One row.
pub(super) struct Row {
    /// Name of the group; empty if there is no column of groups.
    pub(super) group: String,
    /// Name of the subject, if there is a column of subjects, or one that seems to be.
    pub(super) subject: Option<String>,
    /// Velocity, m/s.
    pub(super) velocity: f64,
    /// Whether an error follows the velocity in its cell.
    pub(super) has_error: bool,
    /// Standard error of the velocity, m/s, if there is a column of it.
    pub(super) error: Option<f64>,
    /// Other observables, each in its unit, if there is a column of it.
    pub(super) observables: PerObservable<Option<f64>>,
    /// Quantities that are known of the group.
    pub(super) known: [Option<f64>; Parameter::OF_SETUP.len()],
}

impl<'a> Columns<'a> {
    /// Finds the columns in the header.
    pub(super) fn of_table(
        table: &'a VelocityTable,
        named: &NamedColumns<'_>,
    ) -> Result<Self, Problem> {
        let names = table.names();
        let column = |name: Option<&str>, named| match name {
            Some(name) => {
                let name = normalised(name.to_owned());
                let place = place_of(names, &name)?;
                Ok(Some(NamedColumn { place, name, named }))
            }
            None => Ok(None),
        };
        let velocity = NamedColumn {
            place: table.place(),
            name: names.get(table.place()).cloned().unwrap_or_default(),
            named: "velocity",
        };
        let group = named.group.iter().map(|name| column(Some(name), "group"));
        let group: Vec<_> = group.filter_map(Result::transpose).collect::<Result<_, _>>()?;
        let subject = column(named.subject, "subject")?;
        let error = column(named.error, "standard error")?;
        let mut observables = PerObservable::default();
        for (observable, name) in named.observables.iter() {
            observables[observable] = column(*name, observable.name())?;
        }
        let is_like = |name: &&String| {
            is_like_subject(&name.to_lowercase()) && !named.group.contains(&name.as_str())
        };
        let like = names.iter().find(is_like).filter(|_| subject.is_none());
        // A column that is there twice is none.
        let like_subjects = column(like.map(String::as_str), "subject").unwrap_or(None);
        let mut known = [const { None }; Parameter::OF_SETUP.len()];
        for (found, name) in known.iter_mut().zip(named.known) {
            *found = column(name, "value")?;
        }
        let choice = &table.choice;
        Ok(Self { choice, velocity, group, subject, error, observables, known, like_subjects })
    }

    /// Returns what a row says; `None` if a value is missing.
    pub(super) fn row(&self, mut fields: Vec<String>) -> Result<Option<Row>, Problem> {
        if self.used().any(|column| self.is_missing(&fields[column.place])) {
            return Ok(None);
        }
        let (velocity, has_error) = self.velocity_in(&fields[self.velocity.place])?;
        let names = self.group.iter().map(|column| column.name_in(&fields));
        let group = names.collect::<Result<Vec<_>, _>>()?.join(BETWEEN_PARTS);
        let subject = match (&self.subject, &self.like_subjects) {
            (Some(column), _) => Some(column.name_in(&fields)?),
            (None, Some(column)) => Some(std::mem::take(&mut fields[column.place])),
            (None, None) => None,
        };
        let number = |text: &str| self.choice.decimal.number(text);
        let error = self.error.as_ref().map(|column| self.error_in(column, &fields)).transpose()?;
        let mut observables = PerObservable::default();
        for (observable, column) in self.observables.present() {
            observables[observable] = Some(column.observed_in(observable, &fields, number)?);
        }
        let mut known = [None; Parameter::OF_SETUP.len()];
        for (value, column) in known.iter_mut().zip(&self.known) {
            *value = column.as_ref().map(|column| column.number_in(&fields, number)).transpose()?;
        }
        Ok(Some(Row { group, subject, velocity, has_error, error, observables, known }))
    }

    /// Returns the columns that must have a value in each row.
    fn used(&self) -> impl Iterator<Item = &NamedColumn> {
        let observables = self.observables.iter().map(|(_, column)| column);
        let optional =
            [&self.subject, &self.error].into_iter().chain(observables).chain(&self.known);
        [&self.velocity].into_iter().chain(&self.group).chain(optional.flatten())
    }

    fn is_missing(&self, field: &str) -> bool {
        self.choice.missing.iter().any(|missing| missing == field)
    }

    /// Returns the velocity in a cell, m/s, and whether an error follows it.
    fn velocity_in(&self, field: &str) -> Result<(f64, bool), Problem> {
        let Some(number) = CellNumber::read(field, self.choice.decimal) else {
            if field.is_empty() {
                return Err(Problem::NoNumber);
            }
            let other = CellNumber::read(field, self.choice.decimal.other());
            return Err(Problem::NotANumber {
                found: shortened(field),
                decimal: other.map(|_| self.choice.decimal.other()),
                is_missing: is_no_number(field),
            });
        };
        if let Some(unit) = number.unit
            && unit.power() != self.choice.unit.power()
        {
            let (found, given) = (shortened(field), self.choice.unit.name());
            return Err(Problem::UnitOfCell { found, given });
        }
        let velocity = number.velocity(self.choice.unit);
        match VELOCITY.contains(velocity) {
            true => Ok((velocity, number.has_error)),
            false => Err(Problem::Refused { found: velocity }),
        }
    }

    /// Returns the standard error in a row, m/s.
    fn error_in(&self, column: &NamedColumn, fields: &[String]) -> Result<f64, Problem> {
        let text = fields[column.place].as_str();
        let error = self.choice.decimal.number(text).map(|error| error * self.choice.unit.factor());
        error.filter(|error| REPEATABILITY.contains(*error)).ok_or_else(|| Problem::NotAnError {
            column: shortened(&column.name),
            found: shortened(text),
        })
    }

    /// Returns the name of the column of a known quantity, by its position.
    pub(super) fn known(&self, quantity: usize) -> &str {
        let column = self.known.get(quantity).and_then(Option::as_ref);
        column.map_or("", |column| column.name.as_str())
    }

    /// Returns the name of the column of standard errors.
    pub(super) fn error(&self) -> Option<&str> {
        self.error.as_ref().map(|column| column.name.as_str())
    }

    /// Returns the name of a column that seems to name subjects, if none is named.
    pub(super) fn like_subjects(&self) -> Option<&str> {
        self.like_subjects.as_ref().map(|column| column.name.as_str())
    }
}

impl NamedColumn {
    fn name_in(&self, fields: &[String]) -> Result<String, Problem> {
        match fields[self.place].as_str() {
            "" => Err(Problem::NoName { column: shortened(&self.name), named: self.named }),
            name => Ok(name.to_owned()),
        }
    }
}

impl NamedColumn {
    fn observed_in(
        &self,
        observable: Observable,
        fields: &[String],
        number: impl Fn(&str) -> Option<f64>,
    ) -> Result<f64, Problem> {
        let text = fields[self.place].as_str();
        match number(text) {
            Some(value) if observable.row().accepted.contains(value) => Ok(value),
            _ => {
                let (column, found) = (shortened(&self.name), shortened(text));
                Err(Problem::NotObserved { column, found, observable })
            }
        }
    }

    fn number_in(
        &self,
        fields: &[String],
        number: impl Fn(&str) -> Option<f64>,
    ) -> Result<f64, Problem> {
        let text = fields[self.place].as_str();
        let column = || shortened(&self.name);
        match number(text) {
            Some(number) if number.is_finite() => Ok(number),
            _ if text.is_empty() => Err(Problem::NoKnownValue { column: column() }),
            _ => Err(Problem::NotAKnownValue { column: column(), found: shortened(text) }),
        }
    }
}

/// Returns whether a text may stand for a missing value: it is short, and no number in any reading.
fn is_no_number(text: &str) -> bool {
    text.chars().count() <= MISSING_CHARACTERS_MAX && !text.contains(|c: char| c.is_numeric())
}
