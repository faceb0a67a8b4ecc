//! The columns of a CSV file of velocities, and its rows.

use osteon_common::check::{DECAY, VELOCITY};
use osteon_common::parameters::Parameter;

use super::csv_format::{CsvFormat, DecimalMark, Separator};
use super::fields::csv_fields;
use super::problem::{COLUMN, CsvHint, Problem, listed, shortened};

/// Names of columns that seem to name the subject of each velocity.
const LIKE_SUBJECTS: [&str; 7] =
    ["subject", "subject_id", "patient", "patient_id", "specimen", "specimen_id", "id"];

/// Words, in lower case, one of which the name of a column of velocities usually contains.
const LIKE_VELOCITY: [&str; 6] =
    ["velocity", "speed", "fas", "geschwindigkeit", "vitesse", "velocidad"];

/// The columns that are named in a job file.
#[derive(Debug, Clone, Default)]
pub(crate) struct NamedColumns<'a> {
    /// The columns of the group of each velocity, whose names are joined; none if empty.
    pub(crate) group: Vec<&'a str>,
    /// The column of the subject of each velocity.
    pub(crate) subject: Option<&'a str>,
    /// The column of the decay that was measured with each velocity.
    pub(crate) decay: Option<&'a str>,
    /// The columns of quantities that are known of each group, for each of [`Parameter::OF_SETUP`].
    pub(crate) known: [Option<&'a str>; Parameter::OF_SETUP.len()],
}

/// Positions of velocity, group, subject and known quantities in each row.
pub(super) struct Columns {
    format: CsvFormat,
    separator: char,
    count: usize,
    velocity: NamedColumn,
    group: Vec<NamedColumn>,
    subject: Option<NamedColumn>,
    decay: Option<NamedColumn>,
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

/// A line below the header, as it is read.
pub(super) enum CsvLine {
    Row(Row),
    /// A row in which a value is missing.
    Missing,
    /// Only separators.
    Blank,
}

/// One row.
pub(super) struct Row {
    /// Name of the group; empty if there is no column of groups.
    pub(super) group: String,
    /// Name of the subject, if there is a column of subjects, or one that seems to be.
    pub(super) subject: Option<String>,
    /// Velocity, m/s.
    pub(super) velocity: f64,
    /// Decay, dB/cm, if there is a column of decays.
    pub(super) decay: Option<f64>,
    /// Quantities that are known of the group.
    pub(super) known: [Option<f64>; Parameter::OF_SETUP.len()],
}

impl Columns {
    /// Finds the columns in the header, whose fields are separated by what the format or the line
    /// above it names.
    pub(super) fn from_header(
        header: &str,
        above: Option<Separator>,
        named: &NamedColumns<'_>,
        format: &CsvFormat,
    ) -> Result<Self, Problem> {
        let separator = format.separator.or(above).unwrap_or_default();
        let names = csv_fields(header, separator.character())?;
        let velocity = format.column.as_deref().unwrap_or(COLUMN);
        if !names.iter().any(|name| name == velocity)
            && names.iter().all(|name| format.decimal.number(name).is_some())
        {
            return Err(Problem::NoHeader);
        }
        let of_header = Header { names: &names, separator };
        let column = |name: Option<&str>, named| match name {
            Some(name) => {
                let place = of_header.place_of(name)?;
                Ok(Some(NamedColumn { place, name: name.to_owned(), named }))
            }
            None => Ok(None),
        };
        let velocity = NamedColumn {
            place: of_header.place_of_velocity(velocity, format)?,
            name: velocity.to_owned(),
            named: "velocity",
        };
        let group = named.group.iter().map(|name| column(Some(name), "group"));
        let group: Vec<_> = group.filter_map(Result::transpose).collect::<Result<_, _>>()?;
        let subject = column(named.subject, "subject")?;
        let decay = column(named.decay, "decay")?;
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
        let (format, separator) = (format.clone(), separator.character());
        let count = names.len();
        Ok(Self { format, separator, count, velocity, group, subject, decay, known, like_subjects })
    }

    /// Returns the fields of a line that are used.
    pub(super) fn row(&self, line: &str) -> Result<CsvLine, Problem> {
        let mut fields = csv_fields(line, self.separator)?;
        if fields.len() > 1 && fields.iter().all(String::is_empty) {
            return Ok(CsvLine::Blank);
        }
        // Spreadsheets end some lines with empty fields.
        while fields.len() > self.count && fields.last().is_some_and(String::is_empty) {
            fields.pop();
        }
        if fields.len() != self.count {
            return Err(Problem::FieldCount {
                found: fields.len(),
                expected: self.count,
                hint: self.hint_of_count(&fields),
            });
        }
        if self.used().any(|column| self.is_missing(&fields[column.place])) {
            return Ok(CsvLine::Missing);
        }
        let velocity = self.velocity_in(&fields[self.velocity.place])?;
        let names = self.group.iter().map(|column| column.name_in(&fields));
        let group = names.collect::<Result<Vec<_>, _>>()?.join(BETWEEN_PARTS);
        let subject = match (&self.subject, &self.like_subjects) {
            (Some(column), _) => Some(column.name_in(&fields)?),
            (None, Some(column)) => Some(std::mem::take(&mut fields[column.place])),
            (None, None) => None,
        };
        let number = |text: &str| self.format.decimal.number(text);
        let decay =
            self.decay.as_ref().map(|column| column.decay_in(&fields, number)).transpose()?;
        let mut known = [None; Parameter::OF_SETUP.len()];
        for (value, column) in known.iter_mut().zip(&self.known) {
            *value = column.as_ref().map(|column| column.number_in(&fields, number)).transpose()?;
        }
        Ok(CsvLine::Row(Row { group, subject, velocity, decay, known }))
    }

    /// Returns the columns that must have a value in each row.
    fn used(&self) -> impl Iterator<Item = &NamedColumn> {
        let optional = [&self.subject, &self.decay].into_iter().chain(&self.known);
        [&self.velocity].into_iter().chain(&self.group).chain(optional.flatten())
    }

    fn is_missing(&self, field: &str) -> bool {
        self.format.missing.iter().any(|missing| missing == field)
    }

    fn velocity_in(&self, field: &str) -> Result<f64, Problem> {
        match self.format.unit.velocity(field, self.format.decimal) {
            Some(velocity) if VELOCITY.contains(velocity) => Ok(velocity),
            Some(found) => Err(Problem::Refused { found }),
            None if field.is_empty() => Err(Problem::NoNumber),
            None => {
                let other = DecimalMark::ALL.into_iter().find(|&mark| mark != self.format.decimal);
                let read = |mark: &DecimalMark| self.format.unit.velocity(field, *mark).is_some();
                let hint = match other.filter(read) {
                    Some(mark) => CsvHint::Decimal(mark),
                    None if field.chars().count() <= MISSING_CHARACTERS_MAX => {
                        CsvHint::Missing(shortened(field))
                    }
                    None => CsvHint::None,
                };
                Err(Problem::NotANumber { found: shortened(field), hint })
            }
        }
    }

    /// Returns what may explain a line with too many fields.
    fn hint_of_count(&self, fields: &[String]) -> CsvHint {
        let is_comma = self.separator == ',' && self.format.decimal == DecimalMark::Point;
        let is_whole = |field: &String| field.bytes().all(|byte| byte.is_ascii_digit());
        if is_comma && fields.len() > self.count && fields.iter().any(is_whole) {
            return CsvHint::QuotedDecimal;
        }
        CsvHint::None
    }

    /// Returns the name of the column of a known quantity, by its position.
    pub(super) fn known(&self, quantity: usize) -> &str {
        let column = self.known.get(quantity).and_then(Option::as_ref);
        column.map_or("", |column| column.name.as_str())
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
    fn decay_in(
        &self,
        fields: &[String],
        number: impl Fn(&str) -> Option<f64>,
    ) -> Result<f64, Problem> {
        let text = fields[self.place].as_str();
        match number(text) {
            Some(decay) if DECAY.contains(decay) => Ok(decay),
            _ => Err(Problem::NoDecay { column: shortened(&self.name), found: shortened(text) }),
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

/// The names of the columns.
struct Header<'a> {
    names: &'a [String],
    separator: Separator,
}

impl Header<'_> {
    fn place_of_velocity(&self, column: &str, format: &CsvFormat) -> Result<usize, Problem> {
        self.place_of(column).map_err(|problem| match problem {
            Problem::NoColumn { column, columns, hint: CsvHint::None }
                if format.column.is_none() =>
            {
                let like = self.names.iter().find(|name| is_like_velocity(name));
                let hint = like.map_or(CsvHint::None, |name| CsvHint::Column(shortened(name)));
                Problem::NoColumn { column, columns, hint }
            }
            other => other,
        })
    }

    fn place_of(&self, column: &str) -> Result<usize, Problem> {
        let mut found = self.names.iter().enumerate().filter(|(_, name)| name.as_str() == column);
        let name = || shortened(column);
        match (found.next(), found.next()) {
            (Some((place, _)), None) => Ok(place),
            (Some(_), Some(_)) => Err(Problem::RepeatedColumn { column: name() }),
            (None, _) => Err(Problem::NoColumn {
                column: name(),
                columns: listed(self.names),
                hint: self.other_separator().map_or(CsvHint::None, CsvHint::Separator),
            }),
        }
    }

    /// Returns another separator, if the header is one name with such characters.
    fn other_separator(&self) -> Option<Separator> {
        let [name] = self.names else { return None };
        let mut others = Separator::ALL.into_iter().filter(|&other| other != self.separator);
        others.find(|other| name.contains(other.character()))
    }
}

/// Returns whether a column seems to name subjects, given its name in lower case.
pub(crate) fn is_like_subject(name: &str) -> bool {
    LIKE_SUBJECTS.contains(&name)
}

/// Returns whether a column seems to be one of velocities.
pub(crate) fn is_like_velocity(name: &str) -> bool {
    let name = name.to_lowercase();
    LIKE_VELOCITY.iter().any(|part| name.contains(part))
}
