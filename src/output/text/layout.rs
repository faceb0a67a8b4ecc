//! Lines and tables of at most 80 columns, whatever the width of the terminal, so that the output
//! can be sent, compared and pasted.

use osteon_common::visible;
use unicode_width::UnicodeWidthStr as _;

/// Maximum number of columns of every text.
pub(super) const WIDTH: usize = 80;

/// Indentation of continuation lines.
pub(super) const INDENT: usize = 2;

/// Minimum width of a last column whose words are wrapped; if there is less room, a cell that does
/// not fit is placed below its row.
const CELL_WIDTH_MIN: usize = 40;

/// Stands for a space at which no line may break. It is printed as a space.
const GLUE: char = '\u{a0}';

/// Returns `text` with spaces at which no line may break, e.g. between a number and its unit.
pub(super) fn glued(text: &str) -> String {
    text.replace(' ', &GLUE.to_string())
}

/// Wraps the lines of `text` between words, with a final newline; continuation lines are indented.
/// A word that is longer than a line, such as a path, is not broken.
pub(crate) fn wrapped(text: &str) -> String {
    let lines = text.lines().flat_map(|line| {
        words(&visible::line(line), WIDTH, WIDTH - INDENT).into_iter().enumerate()
    });
    let indented = lines.map(|(place, line)| {
        let indent = if place == 0 { 0 } else { INDENT };
        format!("{:indent$}{line}\n", "")
    });
    indented.collect()
}

/// Returns the rows in columns of equal width, with two spaces between them. The words of the last
/// column are wrapped if the row would be too long.
pub(super) fn aligned<const COLUMNS: usize>(rows: &[[String; COLUMNS]]) -> String {
    // Some cells contain names and reasons given by others.
    let cells =
        |row: &[String; COLUMNS]| row.each_ref().map(|cell| visible::line(cell).into_owned());
    let rows: Vec<[String; COLUMNS]> = rows.iter().map(cells).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].width()).max().unwrap_or(0);
    let widths: [usize; COLUMNS] = std::array::from_fn(width);
    let before: usize = widths.iter().take(COLUMNS.saturating_sub(1)).map(|width| width + 2).sum();
    let mut text = String::new();
    for row in &rows {
        let mut line = String::new();
        let (last, others) =
            row.split_last().map_or(("", row.as_slice()), |(last, rest)| (last, rest));
        for (cell, width) in others.iter().zip(widths) {
            line.push_str(cell);
            // Spaces are counted by display width, in which a Chinese character has two columns.
            line.push_str(&" ".repeat(width - cell.width() + 2));
        }
        push_last(&mut text, line, last, before);
    }
    text
}

/// Appends the last cell to a row that begins with `line`, which has `before` columns.
fn push_last(text: &mut String, line: String, cell: &str, before: usize) {
    let room = WIDTH.saturating_sub(before);
    let (mut line, indent, room) = if room < CELL_WIDTH_MIN && cell.width() > room {
        text.push_str(line.trim_end());
        text.push('\n');
        (" ".repeat(INDENT), INDENT, WIDTH - INDENT)
    } else {
        (line, before, room)
    };
    for (place, part) in words(cell, room, room).into_iter().enumerate() {
        if place > 0 {
            line = " ".repeat(indent);
        }
        line.push_str(&part);
        text.push_str(line.trim_end());
        text.push('\n');
    }
}

/// Breaks `line` into lines of these widths; returns at least one line.
fn words(line: &str, first: usize, others: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in line.split(' ') {
        let width = if lines.len() == 1 { first } else { others };
        let last = lines.last_mut().map(|last| (last.width(), last));
        match last {
            Some((0, last)) if last.is_empty() => last.push_str(word),
            Some((there, last)) if there + 1 + word.width() <= width => {
                last.push(' ');
                last.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines.iter().map(|line| line.replace(GLUE, " ")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn widest(text: &str) -> usize {
        text.lines().map(|line| line.width()).max().unwrap_or(0)
    }

    #[test]
    fn lines_end_between_words() {
        let text = wrapped(&"every word is whole ".repeat(20));
        assert!(widest(&text) <= WIDTH && text.lines().count() > 4, "{text}");
        assert!(
            text.lines().skip(1).all(|line| line.starts_with("  every") || line.starts_with("  "))
        );
        let read: Vec<&str> = text.split_whitespace().collect();
        assert_eq!(read.join(" "), "every word is whole ".repeat(20).trim_end());
        assert_eq!(wrapped("short\nlines"), "short\nlines\n");
    }

    #[test]
    fn a_long_word_stays_whole() {
        let path = "/a".repeat(60);
        assert_eq!(wrapped(&format!("files in {path}")), format!("files in\n  {path}\n"));
    }

    #[test]
    fn a_number_keeps_its_unit() {
        let text = wrapped(&format!("{} {}", "x".repeat(75), glued("3907.7 m/s")));
        assert_eq!(text, format!("{}\n  3907.7 m/s\n", "x".repeat(75)));
    }

    #[test]
    fn columns_are_aligned_by_what_is_seen() {
        let row = |name: &str| [name.to_owned(), "1".to_owned()];
        assert_eq!(
            aligned(&[row("骨密度"), row("abc"), row("e\u{301}")]),
            "骨密度  1\nabc     1\ne\u{301}       1\n"
        );
    }

    #[test]
    fn the_last_column_is_wrapped_below_itself() {
        let row = ["name".to_owned(), "a few words ".repeat(12).trim_end().to_owned()];
        let text = aligned(&[row]);
        assert!(widest(&text) <= WIDTH && text.lines().count() == 2, "{text}");
        assert!(text.starts_with("name  a few") && text.contains("\n      few words"), "{text}");
        let row = ["n".repeat(41), "a few words ".repeat(12).trim_end().to_owned()];
        let text = aligned(&[row]);
        assert!(widest(&text) <= WIDTH && text.contains("n\n  a few"), "{text}");
    }
}
