//! Tables of numbers as `osteon` writes them: CSV whose first line names the columns.

use thiserror::Error;

/// A file of results that is not a table of numbers.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("line {line}: {problem}")]
pub struct TableError {
    /// Number of the line, from 1.
    line: usize,
    /// What is wrong with it.
    problem: String,
}

/// Columns of a table, by their names.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NumberTable {
    names: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl NumberTable {
    /// Reads a table.
    ///
    /// # Errors
    /// If it is empty, or a line has another number of fields than the first.
    pub(crate) fn read(text: &str) -> Result<Self, TableError> {
        let mut lines = text.lines().enumerate().filter(|(_, line)| !line.is_empty());
        let wrong =
            |line: usize, problem: &str| TableError { line: line + 1, problem: problem.to_owned() };
        let (_, first) = lines.next().ok_or_else(|| wrong(0, "the file is empty"))?;
        let names = fields(first);
        let row = |(line, text): (usize, &str)| {
            let row = fields(text);
            let problem = || format!("{} fields instead of {}", row.len(), names.len());
            if row.len() == names.len() { Ok(row) } else { Err(wrong(line, &problem())) }
        };
        let rows = lines.map(row).collect::<Result<_, _>>()?;
        Ok(Self { names, rows })
    }

    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// The names of the columns.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the numbers of a column, NaN where a field is empty; `None` if there is no such column.
    ///
    /// # Errors
    /// If a field is neither empty nor a number.
    pub(crate) fn numbers(&self, name: &str) -> Result<Option<Vec<f64>>, TableError> {
        let Some(place) = self.names.iter().position(|one| one == name) else { return Ok(None) };
        let number = |(row, fields): (usize, &Vec<String>)| match fields[place].as_str() {
            "" => Ok(f64::NAN),
            field => field.parse().map_err(|_| TableError {
                // The names are in the first line.
                line: row + 2,
                problem: format!("{name}: {:?} is not a number", field),
            }),
        };
        self.rows.iter().enumerate().map(number).collect::<Result<_, _>>().map(Some)
    }

    /// Returns the texts of a column; `None` if there is no such column.
    pub(crate) fn texts(&self, name: &str) -> Option<Vec<&str>> {
        let place = self.names.iter().position(|one| one == name)?;
        Some(self.rows.iter().map(|fields| fields[place].as_str()).collect())
    }
}

/// Returns the fields of a line, without quotes, and without what protects spreadsheets.
fn fields(line: &str) -> Vec<String> {
    let (mut found, mut field) = (Vec::new(), String::new());
    let (mut quoted, mut was_quoted) = (false, false);
    let mut characters = line.chars().peekable();
    while let Some(c) = characters.next() {
        match c {
            '"' if quoted && characters.peek() == Some(&'"') => {
                characters.next();
                field.push('"');
            }
            '"' => {
                quoted = !quoted;
                was_quoted = true;
            }
            ',' if !quoted => found.push(finish_field(&mut field, &mut was_quoted)),
            c => field.push(c),
        }
    }
    found.push(finish_field(&mut field, &mut was_quoted));
    found
}

fn finish_field(field: &mut String, was_quoted: &mut bool) -> String {
    let text = std::mem::take(field);
    if std::mem::take(was_quoted) { remove_protection(&text) } else { text }
}

/// Removes one `'` at the beginning, after any spaces, and after each `;`: there it was added.
fn remove_protection(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let (mut begins, mut removed) = (true, false);
    for c in text.chars() {
        if begins && !removed && c == '\'' {
            removed = true;
            continue;
        }
        out.push(c);
        begins = c == ';' || (begins && c == ' ');
        removed = false;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_those_that_were_written() {
        for name in ["a", "a,b", "say \"x\"", "=1+1", "a;=b", "  @x", "'quoted'", "+ü"] {
            let written = osteon_files::results_csv::field(name);
            assert_eq!(fields(&written), [name], "{written}");
        }
        assert_eq!(fields("1,,\"\""), ["1", "", ""]);
    }

    #[test]
    fn columns_are_found_by_name() {
        let table =
            NumberTable::read("index,velocity,failure\n0,4000.5,\n1,,no_arrival\n").unwrap();
        let velocities = table.numbers("velocity").unwrap().unwrap();
        assert!(velocities[0] == 4000.5 && velocities[1].is_nan());
        assert_eq!(table.texts("failure").unwrap(), ["", "no_arrival"]);
        assert_eq!((table.numbers("other").unwrap(), table.len()), (None, 2));
    }

    #[test]
    fn damage_is_named_with_its_line() {
        for (text, expected) in
            [("", "line 1: the file is empty"), ("a,b\n1,2\n3\n", "line 3: 1 fields instead of 2")]
        {
            assert_eq!(NumberTable::read(text).unwrap_err().to_string(), expected);
        }
        let table = NumberTable::read("a\n1\nx\n").unwrap();
        let error = table.numbers("a").unwrap_err();
        assert_eq!(error.to_string(), "line 3: a: \"x\" is not a number");
    }
}
