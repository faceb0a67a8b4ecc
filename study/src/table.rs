//! Tables in Markdown.

use std::fmt;

/// A table; every row has a cell for each column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MarkdownTable {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl MarkdownTable {
    /// Creates a table without rows.
    pub(crate) fn new(columns: &[&str]) -> Self {
        Self { columns: columns.iter().map(|&name| name.to_owned()).collect(), rows: Vec::new() }
    }

    /// Adds a row; missing cells are empty, surplus cells are dropped.
    pub(crate) fn push(&mut self, mut row: Vec<String>) {
        row.resize(self.columns.len(), String::new());
        self.rows.push(row);
    }

    /// Returns the last row with the names of its columns, for progress output.
    pub(crate) fn last_row(&self) -> String {
        let cells = self.rows.last().into_iter().flatten();
        let named = self.columns.iter().zip(cells).map(|(name, cell)| format!("{name} {cell}"));
        named.collect::<Vec<_>>().join(", ")
    }

    /// Returns the rows, each with a cell for every column.
    pub fn rows(&self) -> &[Vec<String>] {
        &self.rows
    }
}

impl fmt::Display for MarkdownTable {
    /// Formats Markdown with columns padded to one width and cells aligned to the right.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = |column: usize| {
            let cells = self.rows.iter().map(|row| &row[column]).chain([&self.columns[column]]);
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let line = |f: &mut fmt::Formatter<'_>, cells: &[String]| {
            for (cell, width) in cells.iter().zip(&widths) {
                write!(f, "| {cell:>width$} ")?;
            }
            writeln!(f, "|")
        };
        line(f, &self.columns)?;
        for width in &widths {
            write!(f, "|{}:", "-".repeat(width + 1))?;
        }
        writeln!(f, "|")?;
        self.rows.iter().try_for_each(|row| line(f, row))
    }
}

/// Formats a number with two significant digits, or a dash if there is none.
pub(crate) fn two_digits(value: Option<f64>) -> String {
    match value {
        None => "–".to_owned(),
        Some(0.0) => "0".to_owned(),
        Some(value) if (0.01..100.0).contains(&value.abs()) => {
            let decimals = match value.abs() {
                size if size < 0.1 => 3,
                size if size < 1.0 => 2,
                size if size < 10.0 => 1,
                _ => 0,
            };
            format!("{value:.decimals$}")
        }
        Some(value) => format!("{value:.1e}"),
    }
}

/// Formats the fraction `count` of `all` in percent.
pub(crate) fn percent(count: u64, all: u64) -> String {
    match (count, all) {
        (_, 0) => "–".to_owned(),
        (0, _) => "0".to_owned(),
        _ => format!("{:.3}", 100.0 * count as f64 / all as f64),
    }
}

/// Formats a length in millimetres.
pub(crate) fn millimetres(length: f64) -> String {
    format!("{}", (length * 1e7).round() / 1e4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_markdown() {
        let mut table = MarkdownTable::new(&["plate (mm)", "δ"]);
        table.push(vec![millimetres(1e-3), "0.1".to_owned()]);
        table.push(vec!["1.25".to_owned()]);
        assert_eq!(
            table.to_string(),
            "| plate (mm) |   δ |\n|-----------:|----:|\n|          1 | 0.1 |\n|       1.25 |     |\n"
        );
        assert_eq!(table.last_row(), "plate (mm) 1.25, δ ");
        assert_eq!(table.rows().len(), 2);
    }

    #[test]
    fn numbers_have_two_digits() {
        for (value, expected) in [
            (None, "–"),
            (Some(0.0), "0"),
            (Some(1.24e-5), "1.2e-5"),
            (Some(0.0124), "0.012"),
            (Some(0.126), "0.13"),
            (Some(1.26), "1.3"),
            (Some(12.6), "13"),
            (Some(1234.0), "1.2e3"),
        ] {
            assert_eq!(two_digits(value), expected);
        }
    }

    #[test]
    fn shares_are_percent() {
        assert_eq!(percent(0, 100_000), "0");
        assert_eq!(percent(3, 100_000), "0.003");
        assert_eq!(percent(1, 3), "33.333");
        assert_eq!(percent(0, 0), "–");
    }
}
