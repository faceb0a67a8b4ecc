//! The values of a TOML or JSON file as a tree, with the key path and the line number of each value for
//! error messages.

use std::fmt;
use std::path::Path;

use osteon_common::field_path::{quoted, shown_key};
use osteon_common::visible;
use thiserror::Error;

use crate::excerpt::Excerpt;

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
    pub fn from_extension(path: &Path) -> Option<Self> {
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

/// A syntax error in the text of a file.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("line {}, column {}: {}", .excerpt.line, .excerpt.column, self.cause())]
pub struct SyntaxError {
    /// The expected format.
    pub format: Format,
    /// The place.
    pub excerpt: Box<Excerpt>,
    /// The parser's message.
    pub message: String,
    /// What to write instead, if that can be guessed.
    pub help: Option<String>,
}

impl SyntaxError {
    /// Returns the message without the place.
    pub(crate) fn cause(&self) -> String {
        let help = self.help.as_ref().map(|help| format!("; {help}")).unwrap_or_default();
        let (format, message) = (self.format.name(), visible::line(&self.message));
        format!("not valid {format}: {message}{}", visible::line(&help))
    }
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
    /// A number written without fraction or exponent; TOML: any that fits in 128 bits, JSON: from -2⁶³
    /// to 2⁶⁴ - 1.
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

impl Node {
    /// Returns whether this is a table with this key.
    pub(crate) fn has(&self, key: &str) -> bool {
        match &self.value {
            Value::Table(entries) => entries.iter().any(|(name, _)| name == key),
            _ => false,
        }
    }

    /// Returns whether there is a field with this path, which has the form that [`Node::line_of`] takes.
    pub(crate) fn holds(&self, path: &str) -> bool {
        let (mut node, mut rest) = (self, path);
        while let Some((child, after_child)) = node.next_on_path(rest) {
            (node, rest) = (child, after_child);
        }
        rest.is_empty()
    }

    /// Returns the line of the field with this path. If the field is absent, returns the line of the
    /// innermost existing table on the path; `None` if that table has no header line of its own.
    ///
    /// Paths have the form of [`entry_path`](osteon_common::field_path::entry_path) and
    /// [`element_path`](osteon_common::field_path::element_path).
    pub(crate) fn line_of(&self, path: &str) -> Option<usize> {
        let mut node = self;
        let mut rest = path;
        let mut line = None;
        while let Some((child, after_child)) = node.next_on_path(rest) {
            line = if child.is_implied() { None } else { child.line };
            node = child;
            rest = after_child;
        }
        line
    }

    /// Returns whether this is a table without a header of its own, which exists only because a nested
    /// table does, like `parameters` in `[parameters.density]`. The parser gives it the line of its
    /// first entry.
    fn is_implied(&self) -> bool {
        let Value::Table(entries) = &self.value else { return false };
        let first = entries.first().map(|(_, node)| node);
        first.is_some_and(|node| node.line == self.line && matches!(node.value, Value::Table(_)))
    }

    /// Returns the child that the first segment of `path` names, and the rest of the path.
    fn next_on_path<'a, 'p>(&'a self, path: &'p str) -> Option<(&'a Node, &'p str)> {
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

impl fmt::Display for Value {
    /// Formats the value as it appears in messages such as `is 3` or `expected a table, found 3`.
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
                1 => f.write_str("a list of 1 value"),
                count => write!(f, "a list of {count} values"),
            },
            Self::Table(_) => f.write_str("a table"),
        }
    }
}
