//! Walks the tree of a file and records keys that are unknown, missing or of the wrong type.
//!
//! Ranges of numbers are not checked here but in [`osteon_common::check`], which also serves specifications
//! that do not come from a file.

mod section;
mod suggestions;

use std::fmt;
use std::slice;

use osteon_common::field_path::{element_path, entry_path, quoted};
use osteon_common::fields::{Choice, WholeRange};
use osteon_common::violations::{Violation, Violations};

use crate::document::{Node, Value};
use crate::document_text::DocumentText;
use crate::file_error::Invalid;

use self::suggestions::Suggestion;

pub(crate) use self::section::section;

/// Maximum number of violations reported for one list, and of unknown keys for one table.
const REPORTED_MAX: usize = 10;

/// Collects the violations of a file while it is read.
#[derive(Debug, Default)]
pub(crate) struct Reader {
    /// Violations found so far.
    pub(crate) violations: Violations,
    /// Paths of known keys that an unknown key was assumed to mean.
    suggested: Vec<String>,
    /// Paths of unknown keys.
    unknown: Vec<String>,
    /// The sections that the file may have.
    sections: Vec<&'static str>,
    /// Violations that are only consequences of a misspelt key.
    repeated: Vec<Violation>,
}

/// A table of a file; an absent table is empty.
#[derive(Debug, Clone)]
pub(crate) struct Table<'a> {
    path: String,
    entries: &'a [(String, Node)],
    is_table: bool,
}

impl<'a> Table<'a> {
    /// Returns the path of the table itself.
    pub(crate) fn own_path(&self) -> &str {
        &self.path
    }

    /// Returns the path of an entry.
    pub(crate) fn path(&self, key: &str) -> String {
        entry_path(&self.path, key)
    }

    /// Returns whether the node is present, and a table.
    pub(crate) fn is_table(&self) -> bool {
        self.is_table
    }

    /// Returns the entry with this key.
    pub(crate) fn get(&self, key: &str) -> Option<&'a Node> {
        self.entries.iter().find(|(name, _)| name == key).map(|(_, node)| node)
    }

    /// Returns whether there is an entry with this key.
    pub(crate) fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// Returns whether a key is there, and is a table.
    pub(crate) fn holds_table(&self, key: &str) -> bool {
        self.get(key).is_some_and(|node| matches!(node.value, Value::Table(_)))
    }
}

impl Reader {
    /// Returns the outermost table, which may have `keys` and no others.
    pub(crate) fn root<'a>(&mut self, root: &'a Node, keys: &[&'static str]) -> Table<'a> {
        self.sections = keys.to_vec();
        self.open(root, String::new(), keys)
    }

    /// Returns the table `key` of `parent`, which may have `keys` and no others.
    pub(crate) fn table<'a>(
        &mut self,
        parent: &Table<'a>,
        key: &str,
        keys: &[&'static str],
    ) -> Table<'a> {
        let path = parent.path(key);
        match parent.get(key) {
            Some(node) => self.open(node, path, keys),
            None => Table { path, entries: &[], is_table: false },
        }
    }

    /// Returns the table `node` at `path`, which may have `keys` and no others.
    pub(crate) fn table_at<'a>(
        &mut self,
        node: &'a Node,
        path: String,
        keys: &[&'static str],
    ) -> Table<'a> {
        self.open(node, path, keys)
    }

    fn open<'a>(&mut self, node: &'a Node, path: String, keys: &[&'static str]) -> Table<'a> {
        let Value::Table(entries) = &node.value else {
            let keys = keys.join(", ");
            self.violations
                .add(&path, format!("is {}; it must be a table (its keys: {keys})", node.value));
            return Table { path, entries: &[], is_table: false };
        };
        let unknown =
            entries.iter().map(|(key, _)| key).filter(|key| !keys.contains(&key.as_str()));
        for (count, key) in unknown.enumerate() {
            if count == REPORTED_MAX {
                self.violations.add_more(&path, "more unknown keys are not listed");
                break;
            }
            let suggestion = match suggestions::of_key(&path, key, keys) {
                // A case file lacks some sections of a job file.
                Suggestion::Section(section) if !self.sections.contains(&section) => {
                    Suggestion::None
                }
                suggestion => suggestion,
            };
            let message = match suggestion {
                Suggestion::Key(name) => format!("unknown key; did you mean `{name}`?"),
                Suggestion::Section(section) => {
                    format!("unknown key; `{key}` belongs to the section [{section}]")
                }
                Suggestion::None => format!("unknown key; known here: {}", keys.join(", ")),
            };
            self.violations.add(entry_path(&path, key), message);
            self.unknown.push(entry_path(&path, key));
            match suggestion {
                Suggestion::Key(name) => self.suggested.push(entry_path(&path, name)),
                Suggestion::Section(section) => self.suggested.push(entry_path(section, key)),
                Suggestion::None => {}
            }
        }
        Table { path, entries, is_table: true }
    }

    /// Records that `field` lacks something that each of `cures` (paths) would supply.
    ///
    /// If the user has misspelt one of them, only that is reported.
    pub(crate) fn lacks(&mut self, field: &str, cures: &[String], message: impl Into<String>) {
        let violation = Violation { field: field.to_owned(), message: message.into(), more: false };
        self.violations.add(&violation.field, &violation.message);
        if cures.iter().any(|cure| self.suggested.contains(cure)) {
            self.repeated.push(violation);
        }
    }

    /// Returns whether a key of `table` was assumed to be a misspelt `key`.
    pub(crate) fn is_misspelt(&self, table: &Table<'_>, key: &str) -> bool {
        self.suggested.contains(&table.path(key))
    }

    /// Records that the required `key` of `table` is absent.
    pub(crate) fn missing(&mut self, table: &Table<'_>, key: &str, expected: impl fmt::Display) {
        let path = table.path(key);
        self.lacks(&path, slice::from_ref(&path), format!("is missing; it must be {expected}"));
    }

    /// Returns all violations, each mistake once, with its place in `document`, whose tree is `root`.
    pub(crate) fn refuse(&self, document: DocumentText<'_>, root: &Node) -> Invalid {
        let once = |violation: &&Violation| !self.repeated.contains(violation);
        Invalid::locate(self.violations.iter().filter(once), &self.unknown, document, root)
    }

    /// Reads the number `key`; an integer is accepted.
    pub(crate) fn number(&mut self, table: &Table<'_>, key: &str) -> Option<f64> {
        let node = table.get(key)?;
        let number = as_number(&node.value);
        if number.is_none() {
            self.wrong_type(table.path(key), "a number", &node.value);
        }
        number
    }

    /// Reads the whole number `key` within `accepted`.
    pub(crate) fn whole(
        &mut self,
        table: &Table<'_>,
        key: &str,
        accepted: WholeRange,
    ) -> Option<u64> {
        let node = table.get(key)?;
        let Value::Integer(value) = node.value else {
            self.wrong_type(table.path(key), &accepted.to_string(), &node.value);
            return None;
        };
        let whole = u64::try_from(value).ok().filter(|&whole| accepted.contains(whole));
        if whole.is_none() {
            self.violations.add(table.path(key), accepted.refusal(&value));
        }
        whole
    }

    /// Reads the Boolean `key`.
    pub(crate) fn boolean(&mut self, table: &Table<'_>, key: &str) -> Option<bool> {
        let node = table.get(key)?;
        let Value::Boolean(truth) = node.value else {
            self.wrong_type(table.path(key), "true or false", &node.value);
            return None;
        };
        Some(truth)
    }

    /// Sets `field` to the choice that the string `key` names.
    pub(crate) fn choice(&mut self, table: &Table<'_>, key: &str, field: &mut dyn Choice) {
        let names: Vec<_> = field.names().iter().map(|name| format!("\"{name}\"")).collect();
        let names = names.join(" or ");
        let Some(node) = table.get(key) else { return };
        let Value::Text(text) = &node.value else {
            return self.wrong_type(table.path(key), &names, &node.value);
        };
        if !field.choose(text) {
            let meant = suggestions::of_choice(text, &field.names());
            let meant = meant.map(|meant| format!("; {meant}")).unwrap_or_default();
            let message = format!("is {}; it must be {names}{meant}", quoted(text));
            self.violations.add(table.path(key), message);
        }
    }

    /// Reads the text `key`.
    pub(crate) fn text<'a>(
        &mut self,
        table: &Table<'a>,
        key: &str,
        expected: &str,
    ) -> Option<&'a str> {
        match &table.get(key)?.value {
            Value::Text(text) => Some(text),
            other => {
                self.wrong_type(table.path(key), expected, other);
                None
            }
        }
    }

    /// Reads the texts `elements` of the list at `path`; `None` if one is not a text.
    pub(crate) fn texts<'a>(&mut self, path: &str, elements: &'a [Node]) -> Option<Vec<&'a str>> {
        let mut texts = Vec::with_capacity(elements.len());
        for (index, node) in elements.iter().enumerate() {
            match &node.value {
                Value::Text(text) => texts.push(text.as_str()),
                other => self.wrong_type(element_path(path, index), "a text in quotes", other),
            }
        }
        (texts.len() == elements.len()).then_some(texts)
    }

    /// Reads the elements of the list `key`.
    pub(crate) fn list<'a>(
        &mut self,
        table: &Table<'a>,
        key: &str,
        expected: &str,
    ) -> Option<&'a [Node]> {
        let node = table.get(key)?;
        if let Value::List(elements) = &node.value {
            return Some(elements);
        }
        self.wrong_type(table.path(key), expected, &node.value);
        None
    }

    /// Reads the numbers `elements` of the list at `path`; `None` if one is not a number.
    pub(crate) fn numbers(&mut self, path: &str, elements: &[Node]) -> Option<Vec<f64>> {
        self.elements(path, elements, "a number", as_number)
    }

    /// Reads the whole numbers `elements` of the list at `path`; `None` if one is not such a number,
    /// or not within `accepted`.
    pub(crate) fn whole_numbers(
        &mut self,
        path: &str,
        elements: &[Node],
        accepted: WholeRange,
    ) -> Option<Vec<u64>> {
        self.elements(path, elements, &accepted.to_string(), |value| match *value {
            Value::Integer(value) => u64::try_from(value).ok().filter(|&n| accepted.contains(n)),
            _ => None,
        })
    }

    /// Reads the elements of the list at `path`; `None` if one is not as expected.
    fn elements<T>(
        &mut self,
        path: &str,
        elements: &[Node],
        expected: &str,
        read: impl Fn(&Value) -> Option<T>,
    ) -> Option<Vec<T>> {
        let found: Vec<T> = elements.iter().filter_map(|element| read(&element.value)).collect();
        if found.len() == elements.len() {
            return Some(found);
        }
        let wrong = elements.iter().enumerate().filter(|(_, node)| read(&node.value).is_none());
        for (count, (index, node)) in wrong.enumerate() {
            if count == REPORTED_MAX {
                self.violations.add_more(path, "further wrong elements are not listed");
                break;
            }
            self.wrong_type(element_path(path, index), expected, &node.value);
        }
        None
    }

    /// Records that a value has the wrong type.
    pub(crate) fn wrong_type(&mut self, path: String, expected: &str, found: &Value) {
        let cure = match found {
            Value::Text(text) if expected.contains("number") => {
                suggestions::of_number_in_quotes(text)
            }
            Value::Number(number) if expected.contains("whole number") => whole(*number),
            _ => None,
        };
        let cure = cure.map(|cure| format!("; {cure}")).unwrap_or_default();
        self.violations.add(path, format!("is {found}; it must be {expected}{cure}"));
    }
}

/// Returns how to write a whole number that was written with a fraction or an exponent.
fn whole(number: f64) -> Option<String> {
    let is_whole = number.fract() == 0.0 && (0.0..1e15).contains(&number);
    is_whole.then(|| format!("write {number}"))
}

fn as_number(value: &Value) -> Option<f64> {
    match *value {
        Value::Number(number) => Some(number),
        // Correctly rounded, like the same digits with a decimal point.
        #[expect(clippy::cast_precision_loss, reason = "rounding is what is wanted")]
        Value::Integer(integer) => Some(integer as f64),
        _ => None,
    }
}
