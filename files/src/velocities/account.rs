//! What was taken of a file, and what was not.

use super::table::VelocityTable;

/// Most lines that are named.
const LINES_MAX: usize = 100;
/// Most lines that a sentence names.
const NAMED_MAX: usize = 5;

/// The velocities that were taken, and the rows that were left out.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Account {
    /// Number and name of the column, and its unit.
    column: String,
    /// Whether the unit follows from the size of the numbers alone.
    pub(super) is_unit_guessed: bool,
    count: usize,
    sum: f64,
    /// Lines of the first and of the last velocity.
    lines: Option<(usize, usize)>,
    /// Number of velocities with an error behind them.
    errors: usize,
    /// Rows that are no measurements, as in "line 70 \"Mean\"", and how many there are.
    left_out: Vec<String>,
    left_out_count: usize,
    /// Number of rows with a missing value.
    pub(super) missing: u32,
    /// Number of lines below the header that are comments.
    pub(super) comments: usize,
    /// A sentence for the user about a column that is not read.
    note: Option<String>,
    /// Two groups whose names hardly differ.
    pub(super) alike: Option<[String; 2]>,
}

impl Account {
    pub(super) fn of_column(table: &VelocityTable) -> Self {
        let place = table.place();
        let name = table.names().get(place).map_or("", String::as_str);
        let column = format!("column {} {name:?} (unit {}", place + 1, table.unit().name());
        Self {
            column,
            is_unit_guessed: table.is_unit_guessed(),
            count: 0,
            sum: 0.0,
            lines: None,
            errors: 0,
            left_out: Vec::new(),
            left_out_count: 0,
            missing: 0,
            comments: 0,
            note: table.note.clone(),
            alike: None,
        }
    }

    pub(super) fn take(&mut self, line: usize, velocity: f64, has_error: bool) {
        self.count += 1;
        self.sum += velocity;
        self.errors += usize::from(has_error);
        let first = self.lines.map_or(line, |(first, _)| first);
        self.lines = Some((first, line));
    }

    pub(super) fn leave_out(&mut self, line: usize, what: &str) {
        self.left_out_count += 1;
        if self.left_out.len() < LINES_MAX {
            self.left_out.push(format!("line {line} {what}"));
        }
    }

    /// Returns the rows that are no measurements, as far as they are named.
    pub(super) fn left_out(&self) -> &[String] {
        &self.left_out
    }

    /// Says what was taken, and what was not, in sentences.
    pub(crate) fn described(&self, missing: &[String]) -> Vec<String> {
        let (first, last) = self.lines.unwrap_or_default();
        let mean = self.sum / self.count as f64;
        let guess = if self.is_unit_guessed { ", a guess from their size" } else { "" };
        let mut said = vec![format!(
            "{} velocities from line {first} to {last}, {}{guess}), mean {mean:.1} m/s",
            self.count, self.column
        )];
        if self.left_out_count > 0 {
            let named = &self.left_out[..self.left_out.len().min(NAMED_MAX)];
            let more = match self.left_out_count - named.len() {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            said.push(format!(
                "{} left out: {}{more}",
                rows(self.left_out_count),
                named.join(", ")
            ));
        }
        if self.missing > 0 {
            let texts: Vec<_> = missing.iter().map(|text| format!("{text:?}")).collect();
            let are = if self.missing == 1 { "is" } else { "are" };
            let missing = rows(self.missing as usize);
            said.push(format!("{missing} {are} left out: the velocity is {}", texts.join(" or ")));
        }
        if self.comments > 0 {
            let lines = if self.comments == 1 { "line begins" } else { "lines begin" };
            let are = if self.comments == 1 { "is" } else { "are" };
            said.push(format!("{} {lines} with # and {are} not read", self.comments));
        }
        if self.errors > 0 {
            said.push(format!("the errors behind {} of the velocities are not used", self.errors));
        }
        said.extend(self.note.clone());
        if let Some([first, second]) = &self.alike {
            said.push(format!(
                "the groups {first:?} and {second:?} differ only by case or blanks: are they one?"
            ));
        }
        said
    }
}

fn rows(count: usize) -> String {
    format!("{count} row{}", if count == 1 { "" } else { "s" })
}
