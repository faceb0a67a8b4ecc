//! One tree type for TOML and JSON, with line numbers where the parser provides them.
//!
//! Nothing is interpreted here: the readers of job and case files decide which keys exist and what
//! they mean.

mod budget;
mod json;
mod toml;

use std::fmt;
use std::path::Path;

use thiserror::Error;

use crate::visible;

/// Format of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// TOML 1.
    Toml,
    /// JSON, with the same keys and nesting.
    Json,
}

impl Format {
    /// Returns the format that the extension of `path` denotes; `None` if it is neither `toml` nor
    /// `json`.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        if extension.eq_ignore_ascii_case("toml") {
            Some(Self::Toml)
        } else if extension.eq_ignore_ascii_case("json") {
            Some(Self::Json)
        } else {
            None
        }
    }

    /// Returns the name for messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Toml => "TOML",
            Self::Json => "JSON",
        }
    }
}

/// Syntax error of a text.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("line {line}, column {column}: not valid {}: {}", .format.name(), visible::line(message))]
pub struct Malformed {
    /// The expected format.
    pub format: Format,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The parser's message.
    pub message: String,
}

/// A value with its line number (for a table's entry: the line of its key).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Node {
    /// Line, from 1, if the format provides it.
    pub(crate) line: Option<usize>,
    /// The value.
    pub(crate) value: Value,
}

/// The values that a file may contain.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value {
    /// JSON's null.
    Null,
    /// true or false.
    Boolean(bool),
    /// A number written without fraction or exponent, within ±2⁶³ or so.
    Integer(i128),
    /// Any other number; may be NaN or infinite.
    Number(f64),
    /// A string.
    Text(String),
    /// TOML's date or time.
    Date,
    /// An array.
    List(Vec<Node>),
    /// A table (JSON: object), in the order of the file; keys are unique.
    Table(Vec<(String, Node)>),
}

/// Parses a text into a tree.
///
/// # Errors
/// Position and description of the syntax error. A duplicate key is such an error.
pub(crate) fn parse(text: &str, format: Format) -> Result<Node, Malformed> {
    match format {
        Format::Toml => toml::parse(text),
        Format::Json => json::parse(text),
    }
}

impl Node {
    /// Returns the line of the field with this path, or else of the innermost table around it that
    /// has one.
    ///
    /// Paths have the form of [`entry_path`] and [`element_path`].
    pub(crate) fn line_of(&self, path: &str) -> Option<usize> {
        let mut node = self;
        let mut rest = path;
        let mut line = None;
        while let Some((child, after)) = node.child_on(rest) {
            line = if child.is_implied() { None } else { child.line };
            node = child;
            rest = after;
        }
        line
    }

    /// Returns whether this is a table that no line of the file opens by itself, as `parameters` in
    /// `[parameters.density]`: the parser gives it the line of its first entry.
    fn is_implied(&self) -> bool {
        let Value::Table(entries) = &self.value else { return false };
        let first = entries.first().map(|(_, node)| node);
        first.is_some_and(|node| node.line == self.line && matches!(node.value, Value::Table(_)))
    }

    /// Returns the child that the first segment of `path` names, and the rest of the path.
    fn child_on<'a, 'p>(&'a self, path: &'p str) -> Option<(&'a Node, &'p str)> {
        match &self.value {
            Value::Table(entries) => entries.iter().find_map(|(key, node)| {
                let path = path.strip_prefix('.').unwrap_or(path);
                let rest = path.strip_prefix(shown_key(key).as_str())?;
                (rest.is_empty() || rest.starts_with(['.', '['])).then_some((node, rest))
            }),
            Value::List(elements) => {
                let (index, rest) = path.strip_prefix('[')?.split_once(']')?;
                Some((elements.get(index.parse::<usize>().ok()?)?, rest))
            }
            _ => None,
        }
    }
}

/// Returns the path of the entry `key` of the table at `table`; the root's path is empty.
pub(crate) fn entry_path(table: &str, key: &str) -> String {
    let key = shown_key(key);
    if table.is_empty() { key } else { format!("{table}.{key}") }
}

/// Returns the path of element `index` (from 0) of the list at `list`.
pub(crate) fn element_path(list: &str, index: usize) -> String {
    format!("{list}[{index}]")
}

/// Returns a key as it must be written in TOML, shortened if it is long.
fn shown_key(key: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !key.is_empty() && key.len() <= SHOWN_CHARACTERS_MAX && key.chars().all(bare) {
        key.to_owned()
    } else {
        quoted(key)
    }
}

/// Returns `text` in quotes, with control characters escaped, shortened if it is long.
pub(crate) fn quoted(text: &str) -> String {
    let mut shown: String = text.chars().take(SHOWN_CHARACTERS_MAX).collect();
    if shown.len() < text.len() {
        shown.push('…');
    }
    format!("{shown:?}")
}

/// Longest part of a user's text that is quoted in a message.
const SHOWN_CHARACTERS_MAX: usize = 60;

impl fmt::Display for Value {
    /// Formats the value for a message, after "is" or "found".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Null => f.write_str("null"),
            Self::Boolean(value) => write!(f, "{value}"),
            Self::Integer(value) => write!(f, "{value}"),
            Self::Number(value) => write!(f, "{value:?}"),
            Self::Text(text) => write!(f, "the string {}", quoted(text)),
            Self::Date => f.write_str("a date or time"),
            Self::List(elements) => match elements.len() {
                0 => f.write_str("an empty list"),
                count => write!(f, "a list of {count}"),
            },
            Self::Table(_) => f.write_str("a table"),
        }
    }
}

/// Returns line and column, both from 1, of a byte offset.
pub(crate) fn position(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_found_by_path() {
        let text = "a = 1\n[b]\nc = [\n 1,\n 2]\n[b.d]\n'x.y' = 3\n[e]\nf.g = 1\n[h.i]\nj = 1\n";
        let root = parse(text, Format::Toml).unwrap();
        for (path, line) in [
            ("a", Some(1)),
            ("b", Some(2)),
            ("b.c", Some(3)),
            ("b.c[0]", Some(4)),
            ("b.c[1]", Some(5)),
            ("b.c[7]", Some(3)),
            ("b.d", Some(6)),
            ("b.d.\"x.y\"", Some(7)),
            ("b.d.missing", Some(6)),
            ("e.f.g", Some(9)),
            ("e.f", Some(9)),
            ("h", None),
            ("h.i", Some(10)),
            ("h.missing", None),
            ("missing", None),
            ("", None),
        ] {
            assert_eq!(root.line_of(path), line, "{path}");
        }
    }

    #[test]
    fn both_formats_give_one_tree() {
        let toml = "a = 1\nb = [1.5, -2, true]\n[c]\nd = 'text'\n";
        let json = r#"{"a": 1, "b": [1.5, -2, true], "c": {"d": "text"}}"#;
        assert_eq!(
            without_lines(parse(toml, Format::Toml).unwrap()),
            without_lines(parse(json, Format::Json).unwrap())
        );
    }

    #[test]
    fn a_malformed_text_is_located() {
        let check = |text: &str, format: Format, expected: &str| {
            assert_eq!(parse(text, format).unwrap_err().to_string(), expected);
        };
        check(
            "a = 1\nb = = 2\n",
            Format::Toml,
            "line 2, column 5: not valid TOML: extra `=`, expected nothing",
        );
        check("a = 1\na = 2\n", Format::Toml, "line 2, column 1: not valid TOML: duplicate key");
        check(
            "{\"a\": 1,\n \"a\": 2}",
            Format::Json,
            "line 2, column 4: not valid JSON: the key \"a\" is given twice",
        );
        check(
            "{\"a\": 1,\n \"b\": }",
            Format::Json,
            "line 2, column 7: not valid JSON: expected value",
        );
    }

    #[test]
    fn deep_nesting_is_an_error_and_no_overflow() {
        for open in ["[", "{\"a\":", "a=[", "a={b="] {
            for format in [Format::Toml, Format::Json] {
                assert!(parse(&open.repeat(100_000), format).is_err());
            }
        }
        assert!(parse(&format!("a = {}", "[".repeat(100_000)), Format::Toml).is_err());
        assert!(parse(&format!("{} = 1", vec!["a"; 100_000].join(".")), Format::Toml).is_err());
    }

    #[test]
    fn a_number_that_overflows_is_kept_for_the_check() {
        let root = parse("a = 1e400", Format::Toml).unwrap();
        assert_eq!(
            without_lines(root).value,
            Value::Table(vec![(
                "a".to_owned(),
                Node { line: None, value: Value::Number(f64::INFINITY) }
            )])
        );
    }

    fn without_lines(node: Node) -> Node {
        let value = match node.value {
            Value::List(list) => Value::List(list.into_iter().map(without_lines).collect()),
            Value::Table(entries) => Value::Table(
                entries.into_iter().map(|(key, node)| (key, without_lines(node))).collect(),
            ),
            other => other,
        };
        Node { line: None, value }
    }
}
