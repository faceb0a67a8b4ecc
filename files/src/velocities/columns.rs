//! The columns of a CSV file of velocities, and its rows.

use osteon_common::check::{DECAY, VELOCITY};
use osteon_common::parameters::Parameter;

use super::problem::{COLUMN, Problem, listed, shortened};

/// Names of columns that seem to name the subject of each velocity.
const LIKE_SUBJECTS: [&str; 7] =
    ["subject", "subject_id", "patient", "patient_id", "specimen", "specimen_id", "id"];

/// The columns that are named in a job file.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct NamedColumns<'a> {
    /// The column of the group of each velocity.
    pub(crate) group: Option<&'a str>,
    /// The column of the subject of each velocity.
    pub(crate) subject: Option<&'a str>,
    /// The column of the decay that was measured with each velocity.
    pub(crate) decay: Option<&'a str>,
    /// The columns of quantities that are known of each group, for each of [`Parameter::OF_SETUP`].
    pub(crate) known: [Option<&'a str>; Parameter::OF_SETUP.len()],
}

/// Positions of velocity, group, subject and known quantities in each row.
pub(super) struct Columns {
    count: usize,
    velocity: usize,
    group: Option<NamedColumn>,
    subject: Option<NamedColumn>,
    decay: Option<NamedColumn>,
    known: [Option<NamedColumn>; Parameter::OF_SETUP.len()],
    /// A column that seems to name subjects, if none is named.
    like_subjects: Option<NamedColumn>,
}

/// A column of names.
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
    /// Decay, dB/cm, if there is a column of decays.
    pub(super) decay: Option<f64>,
    /// Quantities that are known of the group.
    pub(super) known: [Option<f64>; Parameter::OF_SETUP.len()],
}

impl Columns {
    /// Finds the columns in the header.
    pub(super) fn from_header(header: &str, named: NamedColumns<'_>) -> Result<Self, Problem> {
        let names = fields(header)?;
        if !names.iter().any(|name| name == COLUMN)
            && names.iter().all(|name| name.parse::<f64>().is_ok())
        {
            return Err(Problem::NoHeader);
        }
        let column = |name: Option<&str>, named| match name {
            Some(name) => {
                let place = place_of(name, &names)?;
                Ok(Some(NamedColumn { place, name: name.to_owned(), named }))
            }
            None => Ok(None),
        };
        let group = column(named.group, "group")?;
        let subject = column(named.subject, "subject")?;
        let decay = column(named.decay, "decay")?;
        let is_like = |name: &&String| {
            LIKE_SUBJECTS.contains(&name.to_lowercase().as_str())
                && named.group != Some(name.as_str())
        };
        let like = names.iter().find(is_like).filter(|_| subject.is_none());
        // A column that is there twice is none.
        let like_subjects = column(like.map(String::as_str), "subject").unwrap_or(None);
        let velocity = place_of(COLUMN, &names)?;
        let mut known = [const { None }; Parameter::OF_SETUP.len()];
        for (found, name) in known.iter_mut().zip(named.known) {
            *found = column(name, "value")?;
        }
        Ok(Self { count: names.len(), velocity, group, subject, decay, known, like_subjects })
    }

    /// Returns the fields of a line that are used.
    pub(super) fn row(&self, line: &str) -> Result<Row, Problem> {
        let mut fields = fields(line)?;
        if fields.len() != self.count {
            return Err(Problem::FieldCount { found: fields.len(), expected: self.count });
        }
        let velocity = velocity(&fields[self.velocity])?;
        let group = match &self.group {
            Some(column) => column.name_in(&fields)?,
            None => String::new(),
        };
        let subject = match (&self.subject, &self.like_subjects) {
            (Some(column), _) => Some(column.name_in(&fields)?),
            (None, Some(column)) => Some(std::mem::take(&mut fields[column.place])),
            (None, None) => None,
        };
        let decay = self.decay.as_ref().map(|column| column.decay_in(&fields)).transpose()?;
        let mut known = [None; Parameter::OF_SETUP.len()];
        for (value, column) in known.iter_mut().zip(&self.known) {
            *value = column.as_ref().map(|column| column.number_in(&fields)).transpose()?;
        }
        Ok(Row { group, subject, velocity, decay, known })
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
    fn decay_in(&self, fields: &[String]) -> Result<f64, Problem> {
        let text = fields[self.place].as_str();
        match text.parse::<f64>() {
            Ok(decay) if DECAY.contains(decay) => Ok(decay),
            _ => Err(Problem::NoDecay { column: shortened(&self.name), found: shortened(text) }),
        }
    }

    fn number_in(&self, fields: &[String]) -> Result<f64, Problem> {
        let text = fields[self.place].as_str();
        let column = || shortened(&self.name);
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ if text.is_empty() => Err(Problem::NoKnownValue { column: column() }),
            _ => Err(Problem::NotAKnownValue { column: column(), found: shortened(text) }),
        }
    }
}

fn place_of(column: &str, names: &[String]) -> Result<usize, Problem> {
    let mut found = names.iter().enumerate().filter(|(_, name)| name.as_str() == column);
    let column = || shortened(column);
    match (found.next(), found.next()) {
        (Some((place, _)), None) => Ok(place),
        (Some(_), Some(_)) => Err(Problem::RepeatedColumn { column: column() }),
        (None, _) => Err(Problem::NoColumn { column: column(), columns: listed(names) }),
    }
}

fn velocity(field: &str) -> Result<f64, Problem> {
    match field.parse::<f64>() {
        Ok(velocity) if VELOCITY.contains(velocity) => Ok(velocity),
        Ok(found) => Err(Problem::Refused { found }),
        Err(_) if field.is_empty() => Err(Problem::NoNumber),
        Err(_) => Err(Problem::NotANumber { found: shortened(field) }),
    }
}

/// Returns the fields of one line, without surrounding space and quotes.
fn fields(line: &str) -> Result<Vec<String>, Problem> {
    let mut fields = Vec::new();
    let mut rest = line;
    loop {
        let (field, after) = match rest.trim_start().strip_prefix('"') {
            Some(quoted) => quoted_field(quoted)?,
            None => {
                let end = rest.find(',').unwrap_or(rest.len());
                if rest[..end].contains('"') {
                    return Err(Problem::Quote);
                }
                (rest[..end].trim().to_owned(), &rest[end..])
            }
        };
        fields.push(field);
        match after.strip_prefix(',') {
            Some(next) => rest = next,
            None => return Ok(fields),
        }
    }
}

/// Reads a field after its opening quote; returns it and the text after its closing quote, which is
/// empty or begins with a comma.
fn quoted_field(mut rest: &str) -> Result<(String, &str), Problem> {
    let mut field = String::new();
    loop {
        let (before, after) = rest.split_once('"').ok_or(Problem::Quote)?;
        field.push_str(before);
        // A doubled quote stands for one.
        if let Some(after) = after.strip_prefix('"') {
            field.push('"');
            rest = after;
            continue;
        }
        let after = after.trim_start();
        if after.is_empty() || after.starts_with(',') {
            return Ok((field.trim().to_owned(), after));
        }
        return Err(Problem::Quote);
    }
}
