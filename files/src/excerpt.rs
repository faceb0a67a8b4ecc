//! The line of a text to which a message refers, with carets below the place.

use std::fmt;
use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};

/// Longest part of a line that is shown, in characters.
const SHOWN_MAX: usize = 96;
/// Characters shown before the place, if the line is longer.
const BEFORE_MAX: usize = 40;
/// Stands for the part of a line that is not shown.
const CUT: char = '…';

/// A place in a text, with the part of its line around it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Excerpt {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The line, or a part of it.
    shown: String,
    /// Where the place is in `shown`, in bytes.
    marked: Range<usize>,
}

impl Excerpt {
    /// Takes the first line of the bytes `span` out of `text`.
    pub(crate) fn new(text: &str, span: Range<usize>) -> Self {
        let start = floor(text, span.start);
        let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let rest = &text[start..];
        let line_end = rest.find(['\n', '\r']).map_or(text.len(), |at| start + at);
        let end = floor(text, span.end).clamp(start, line_end);
        let before = &text[line_start..start];
        let column = before.chars().count();
        let mut shown = String::new();
        let length = column + text[start..line_end].chars().take(SHOWN_MAX + 1).count();
        let hidden = if length > SHOWN_MAX { column.saturating_sub(BEFORE_MAX) } else { 0 };
        if hidden > 0 {
            shown.push(CUT);
        }
        shown.extend(before.chars().skip(hidden));
        let marked_start = shown.len();
        let room = SHOWN_MAX.saturating_sub(column - hidden);
        let marked = text[start..end].chars().take(room);
        shown.extend(marked);
        let marked_end = shown.len();
        let room = SHOWN_MAX.saturating_sub(shown.chars().count());
        shown.extend(text[end..line_end].chars().take(room));
        if text[end..line_end].chars().nth(room).is_some() {
            shown.push(CUT);
        }
        Self {
            line: text[..line_start].matches('\n').count() + 1,
            column: column + 1,
            shown,
            marked: marked_start..marked_end,
        }
    }
}

/// Returns the last boundary between characters of `text` that is not behind `at`.
fn floor(text: &str, at: usize) -> usize {
    text.floor_char_boundary(at)
}

impl fmt::Display for Excerpt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mark = AnnotationKind::Primary.span(self.marked.clone());
        let snippet = Snippet::source(self.shown.as_str()).line_start(self.line).annotation(mark);
        let report = [Group::with_level(Level::ERROR).element(snippet)];
        f.write_str(Renderer::plain().render(&report).trim_end())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(text: &str, part: &str) -> String {
        let start = text.find(part).unwrap();
        Excerpt::new(text, start..start + part.len()).to_string()
    }

    #[test]
    fn the_place_is_marked_below_its_line() {
        let text = "[solver]\nrefinement = 99 # much\n";
        assert_eq!(shown(text, "99"), "  |\n2 | refinement = 99 # much\n  |              ^^");
        let excerpt = Excerpt::new(text, 22..24);
        assert_eq!((excerpt.line, excerpt.column), (2, 14));
    }

    #[test]
    fn of_several_lines_the_first_is_marked() {
        let text = "a = [\n  1,\n]\n";
        assert_eq!(shown(text, "[\n  1,\n]"), "  |\n1 | a = [\n  |     ^");
    }

    #[test]
    fn wide_characters_move_the_mark() {
        assert_eq!(shown("骨 = 1\n", "1"), "  |\n1 | 骨 = 1\n  |      ^");
    }

    #[test]
    fn of_a_long_line_a_part_is_shown() {
        let text = format!("a = [{}x{}]", "1, ".repeat(500), ", 2".repeat(500));
        let excerpt = Excerpt::new(&text, 1505..1506);
        assert_eq!((excerpt.line, excerpt.column), (1, 1506));
        let shown = excerpt.to_string();
        assert!(shown.lines().all(|line| line.chars().count() < SHOWN_MAX + 10), "{shown}");
        assert!(
            shown.contains("… 1, 1,") && shown.contains("x, 2") && shown.contains("^"),
            "{shown}"
        );
    }

    #[test]
    fn any_place_of_any_text_is_shown() {
        for text in ["", "\n", "a\r\nb", "ä\u{202e}\tß", "\u{1b}[2J"] {
            for start in 0..=text.len() + 2 {
                for end in start..=text.len() + 2 {
                    let excerpt = Excerpt::new(text, start..end);
                    let shown = excerpt.to_string();
                    assert!(!shown.contains(['\t', '\u{1b}', '\u{202e}']), "{shown:?}");
                }
            }
        }
    }
}
