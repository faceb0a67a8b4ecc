//! A file of which is known how it is written.

use std::path::Path;

use super::choice;
use super::column_choice::{ColumnChoice, POSSIBLE};
use super::content::Content;
use super::csv_format::{CsvFormat, DecimalMark, Separator, VelocityUnit};
use super::encodings::normalised;
use super::header::Header;
use super::lines::{TableLine, TableLines};
use super::number::CellNumber;
use super::opening;
use super::problem::{COLUMN, LocatedProblem, Problem, listed, shortened};
use super::row_kinds;
use super::summaries::{self, Summaries};
use super::units::NamedUnit;

/// The table of a file: its text, and how it is read.
#[derive(Debug)]
pub(crate) struct VelocityTable {
    pub(super) content: Content,
    pub(super) header: Header,
    pub(super) choice: ColumnChoice,
    /// Rows that sum up others.
    pub(super) summaries: Summaries,
    /// A sentence for the user about a column that is not read.
    pub(super) note: Option<String>,
}

impl VelocityTable {
    /// Reads the file at `path`, and finds out how it is written as far as no key says it.
    pub(super) fn open(path: &Path, format: &CsvFormat) -> Result<Self, LocatedProblem> {
        let format = &CsvFormat {
            column: format.column.clone().map(normalised),
            missing: format
                .missing
                .clone()
                .map(|texts| texts.into_iter().map(normalised).collect()),
            ..format.clone()
        };
        let mut contents = opening::of_file(path, format)?.into_iter();
        let (Some(first), second) = (contents.next(), contents.next()) else {
            return Err((None, Problem::Empty));
        };
        let Some(second) = second else { return Self::from_content(first, format) };
        // Of several tables, the one that has velocities.
        let mut understood = None;
        let mut first_problem = None;
        let mut broken = None;
        for content in [first, second].into_iter().chain(contents) {
            match (Self::from_content(content, format), &understood) {
                (Ok(table), None) => understood = Some(table),
                (Ok(table), Some(other)) => {
                    return Err((
                        None,
                        Problem::SeveralTables { first: other.origin(), second: table.origin() },
                    ));
                }
                (Err(problem), _) if problem.1.is_no_table() || !format.is_found_out => {
                    first_problem = first_problem.or(Some(problem));
                }
                (Err(problem), _) => broken = broken.or(Some(problem)),
            }
        }
        // A table of velocities that cannot be read is not replaced by another.
        if let Some(problem) = broken {
            return Err(problem);
        }
        understood.ok_or_else(|| first_problem.unwrap_or((None, Problem::Empty)))
    }

    fn from_content(content: Content, format: &CsvFormat) -> Result<Self, LocatedProblem> {
        // What was no text has tabs and decimal points, whatever the keys say.
        let of_table = CsvFormat {
            separator: content.separator(),
            decimal: Some(DecimalMark::Point),
            ..format.clone()
        };
        let format = if content.separator().is_some() { &of_table } else { format };
        let header = Header::find(&content, format)?;
        let choice = match format.is_found_out {
            true => choice::find_column(&content.text, &header, format)?,
            false => {
                let at_header = |problem| (Some(header.line).filter(|&line| line > 0), problem);
                let place = given_place(&header, format).map_err(at_header)?;
                let choice = ColumnChoice::from_keys(format, place);
                check_units(&content.text, &header, &choice)?;
                choice
            }
        };
        let summaries = summaries::of_table(&content.text, &header, &choice)?;
        let (text, is_found_out) = (&content.text, format.is_found_out);
        let note = row_kinds::check(text, &header, &choice, &summaries, is_found_out)?;
        Ok(Self { content, header, choice, summaries, note })
    }

    /// Returns where it comes from, for a message.
    fn origin(&self) -> String {
        self.content.origin.clone().unwrap_or_default()
    }

    /// Returns the names of the columns.
    pub(crate) fn names(&self) -> &[String] {
        &self.header.names
    }

    /// Returns the place of the column of velocities.
    pub(crate) fn place(&self) -> usize {
        self.choice.place
    }

    /// Returns the line of the header, from 1.
    pub(crate) fn header_line(&self) -> usize {
        self.header.line
    }

    pub(crate) fn separator(&self) -> Separator {
        self.header.separator
    }

    /// Returns whether a job file need not name the separator.
    pub(crate) fn is_separator_usual(&self) -> bool {
        self.header.is_separator_usual
    }

    pub(crate) fn decimal(&self) -> DecimalMark {
        self.choice.decimal
    }

    pub(crate) fn unit(&self) -> VelocityUnit {
        self.choice.unit
    }

    /// Returns whether the unit follows from the size of the numbers alone.
    pub(crate) fn is_unit_guessed(&self) -> bool {
        self.choice.is_unit_guessed
    }

    /// Returns the texts that stand for missing values.
    pub(crate) fn missing(&self) -> &[String] {
        &self.choice.missing
    }

    /// Returns the encoding by its name on the web, if a job file must name it.
    pub(crate) fn encoding(&self) -> Option<String> {
        self.content.encoding.map(|encoding| encoding.name().to_lowercase())
    }

    /// Returns whether the header is not where a job file need not say it.
    pub(crate) fn has_lines_above(&self) -> bool {
        let above = self.content.text.lines().take(self.header.line.saturating_sub(1));
        let mut above = above.filter(|line| {
            let is_said = line.trim().is_empty() || line.trim_start().starts_with('#');
            !is_said && Separator::of_first_line(line).is_none()
        });
        let header = self.content.text.lines().nth(self.header.line.saturating_sub(1));
        above.next().is_some() || header.is_some_and(|line| line.trim_start().starts_with('#'))
    }

    /// Returns whether a line of another shape than the rows is none of them: it begins with a word, and no number
    /// in it can be a velocity.
    pub(super) fn is_below(&self, fields: &[String]) -> bool {
        let is_possible = |field: &String| {
            CellNumber::read(field, self.decimal())
                .is_some_and(|number| POSSIBLE.contains(&number.velocity(self.unit())))
        };
        let first = fields.iter().find(|field| !field.is_empty());
        first.is_some_and(|first| first.starts_with(char::is_alphabetic))
            && !fields.iter().any(is_possible)
    }

    /// Returns how a job says that the file is written: only what is not as documented.
    pub(crate) fn format(&self) -> CsvFormat {
        let name = self.header.names.get(self.choice.place).cloned().unwrap_or_default();
        let (unit, decimal) = (self.unit(), self.decimal());
        CsvFormat {
            header_line: self.has_lines_above().then_some(self.header.line),
            column: (name != COLUMN).then_some(name),
            unit: (unit != VelocityUnit::default()).then_some(unit),
            separator: (!self.is_separator_usual()).then_some(self.separator()),
            decimal: (decimal != DecimalMark::default()).then_some(decimal),
            encoding: self.content.encoding,
            missing: Some(self.missing().to_vec()).filter(|texts| !texts.is_empty()),
            ..CsvFormat::default()
        }
    }

    /// Returns the keys of `[data]` that say how the file is written, with their values as in a job file.
    pub(crate) fn keys(&self) -> Vec<(&'static str, String)> {
        let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
        let list = |texts: &Vec<String>| {
            let texts: Vec<_> = texts.iter().map(|text| quoted(text)).collect();
            format!("[{}]", texts.join(", "))
        };
        let format = self.format();
        let keys = [
            ("header_line", format.header_line.map(|line| line.to_string())),
            ("column", format.column.as_deref().map(quoted)),
            ("unit", format.unit.map(|unit| quoted(unit.name()))),
            ("separator", format.separator.map(|separator| quoted(separator.name()))),
            ("decimal", format.decimal.map(|decimal| quoted(decimal.name()))),
            ("encoding", self.encoding().as_deref().map(quoted)),
            ("missing", format.missing.as_ref().map(list)),
        ];
        keys.into_iter().filter_map(|(key, value)| Some((key, value?))).collect()
    }

    /// Returns how the file is written, for people.
    pub(crate) fn described(&self) -> String {
        let decimal = match self.decimal() {
            DecimalMark::Point => "decimal points",
            DecimalMark::Comma => "decimal commas",
        };
        let between = match (&self.content.origin, self.names().len()) {
            (Some(origin), _) => return format!("{origin}, header in line {}", self.header.line),
            (None, 1) => String::new(),
            _ => format!("fields separated by {}, ", self.separator().described()),
        };
        let encoding = self.encoding().map_or_else(String::new, |name| format!(", {name}"));
        let invisible =
            if self.content.had_invisible { "; characters without width are not read" } else { "" };
        format!("header in line {}, {between}{decimal}{encoding}{invisible}", self.header.line)
    }

    /// Returns the cells of each row that is a measurement or has a missing value.
    pub(crate) fn rows(&self) -> impl Iterator<Item = Vec<String>> {
        let lines =
            TableLines::after_header(&self.content.text, &self.header, Some(self.choice.place));
        lines.filter_map(|line| match line.ok()? {
            (line, TableLine::Data(fields) | TableLine::Labelled { fields, .. }) => {
                let is_row = fields.len() == self.header.names.len();
                (is_row && !self.summaries.contains_key(&line)).then_some(fields)
            }
            _ => None,
        })
    }
}

/// Returns the place of the column that a job names.
fn given_place(header: &Header, format: &CsvFormat) -> Result<usize, Problem> {
    let column = format.column.as_deref().unwrap_or(COLUMN);
    let is_header = header.names.iter().any(|name| name == column);
    let decimal = format.decimal.unwrap_or_default();
    if !is_header && header.names.iter().all(|name| decimal.number(name).is_some()) {
        return Err(Problem::NoHeader);
    }
    place_of(&header.names, column)
}

/// Returns the place of a name among those of the header.
pub(super) fn place_of(names: &[String], column: &str) -> Result<usize, Problem> {
    let mut found = names.iter().enumerate().filter(|(_, name)| name.as_str() == column);
    match (found.next(), found.next()) {
        (Some((place, _)), None) => Ok(place),
        (Some(_), Some(_)) => Err(Problem::RepeatedColumn { column: shortened(column) }),
        (None, _) => Err(Problem::NoColumn { column: shortened(column), columns: listed(names) }),
    }
}

/// Refuses a unit below the header that is not that of the job.
fn check_units(text: &str, header: &Header, choice: &ColumnChoice) -> Result<(), LocatedProblem> {
    let Some(Ok((line, TableLine::Units(units)))) =
        TableLines::after_header(text, header, Some(choice.place)).next()
    else {
        return Ok(());
    };
    match units.get(choice.place).copied().flatten() {
        Some(NamedUnit::Velocity(unit)) if unit.power() != choice.unit.power() => {
            Err((Some(line), Problem::UnitBelow { found: unit.name(), given: choice.unit.name() }))
        }
        Some(NamedUnit::Velocity(_)) | None => Ok(()),
        Some(_) => {
            let column = header.names.get(choice.place).map_or("", String::as_str);
            Err((Some(line), Problem::UnknownUnit { column: shortened(column) }))
        }
    }
}
