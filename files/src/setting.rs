//! Settings of a command line: keys of a job or case file, with values that replace those of the file.

use std::fmt;

use osteon_common::field_path::{entry_path, quoted};
use thiserror::Error;

use crate::document::{self, Format, Node, Value};

/// A key with a value, as in `search.max_evaluations=50`.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The option as it was given, for messages.
    option: String,
    /// The key, from the outermost table.
    keys: Vec<String>,
    /// The value, without lines.
    value: Value,
}

/// Reason why a text is no setting.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SettingError {
    /// There is no `=`.
    #[error("it must be KEY=VALUE, such as search.max_evaluations=50")]
    NoValue,
    /// The text before `=` is no key.
    #[error("{key} is not a key of a job or case file, such as search.max_evaluations")]
    NotKey {
        /// The text.
        key: String,
    },
    /// The text after `=` is no value.
    #[error(
        "{value} is not a value of TOML, such as 50, 4e-3, true, \"newton\" or [1.0, 2.0]: {reason}"
    )]
    NotValue {
        /// The text.
        value: String,
        /// Why it is none.
        reason: String,
    },
}

impl Setting {
    /// Reads `KEY=VALUE`: a key of TOML, with dots, and a value of TOML. A single word needs no
    /// quotation marks.
    ///
    /// ```
    /// use osteon_files::setting::Setting;
    ///
    /// assert!(Setting::parse("search.method=newton").is_ok());
    /// assert!(Setting::parse("parameters.density={ fixed = 1700.0 }").is_ok());
    /// assert!(Setting::parse("search.method").is_err());
    /// ```
    ///
    /// # Errors
    /// If the text has another form.
    pub fn parse(text: &str) -> Result<Self, SettingError> {
        let (key, value) = text.split_once('=').ok_or(SettingError::NoValue)?;
        let (key, value) = (key.trim(), value.trim());
        let keys = keys(key).ok_or_else(|| SettingError::NotKey { key: quoted(key) })?;
        let value = if is_word(value) { Ok(Value::Text(value.to_owned())) } else { parsed(value) };
        let option = format!("--set {text}");
        value.map(|value| Self { option, keys, value })
    }

    /// Returns the setting of the key `monte_carlo.seed`, which has an option of its own.
    pub fn seed(seed: u64) -> Self {
        Self {
            option: format!("--seed {seed}"),
            keys: ["monte_carlo", "seed"].map(str::to_owned).into(),
            value: Value::Integer(seed.into()),
        }
    }

    /// Returns whether the field with this path is the value that is set, or part of it.
    pub(crate) fn has(&self, field: &str) -> bool {
        let path = self.keys.iter().fold(String::new(), |path, key| entry_path(&path, key));
        let rest = field.strip_prefix(path.as_str());
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
    }

    /// Sets the value in the tree. What is no table on the way to it becomes one, which the rules
    /// for that key will then refuse.
    pub(crate) fn apply(&self, root: &mut Node) {
        let mut node = root;
        for key in &self.keys {
            if !matches!(node.value, Value::Table(_)) {
                node.value = Value::Table(Vec::new());
            }
            let Value::Table(entries) = &mut node.value else { return };
            let found = entries.iter().position(|(name, _)| name == key);
            let place = found.unwrap_or_else(|| {
                entries.push((key.clone(), Node { line: None, value: Value::Null }));
                entries.len() - 1
            });
            node = &mut entries[place].1;
        }
        node.value = self.value.clone();
    }
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.option)
    }
}

/// Returns the parts of a dotted key.
fn keys(key: &str) -> Option<Vec<String>> {
    let mut node = document::parse(&format!("{key} = 0"), Format::Toml).ok()?;
    let mut keys = Vec::new();
    while let Value::Table(entries) = node.value {
        let [(key, child)] = <[_; 1]>::try_from(entries).ok()?;
        keys.push(key);
        node = child;
    }
    Some(keys)
}

/// Returns a value of TOML.
fn parsed(value: &str) -> Result<Value, SettingError> {
    let refused = |reason: String| SettingError::NotValue { value: quoted(value), reason };
    let root = document::parse(&format!("x = {value}"), Format::Toml);
    let root = root.map_err(|error| refused(error.cause()))?;
    match root.value {
        Value::Table(entries) => match <[_; 1]>::try_from(entries) {
            Ok([(_, node)]) => Ok(without_lines(node).value),
            Err(_) => Err(refused("it has more than one line".to_owned())),
        },
        _ => Err(refused("it is none".to_owned())),
    }
}

/// Returns whether this is a word that TOML would not read as a value of its own.
fn is_word(text: &str) -> bool {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let reserved = ["true", "false", "inf", "nan"];
    text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.chars().all(allowed)
        && !reserved.contains(&text)
}

fn without_lines(node: Node) -> Node {
    let value = match node.value {
        Value::List(elements) => Value::List(elements.into_iter().map(without_lines).collect()),
        Value::Table(entries) => {
            let cleared = entries.into_iter().map(|(key, node)| (key, without_lines(node)));
            Value::Table(cleared.collect())
        }
        other => other,
    };
    Node { line: None, value }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn applied(file: &str, settings: &[&str]) -> Node {
        let mut root = document::parse(file, Format::Toml).unwrap();
        for setting in settings {
            Setting::parse(setting).unwrap().apply(&mut root);
        }
        without_lines(root)
    }

    fn check(file: &str, settings: &[&str], expected: &str) {
        assert_eq!(applied(file, settings), applied(expected, &[]), "{settings:?}");
    }

    #[test]
    fn a_value_replaces_the_files() {
        check("[a]\nb = 1\nc = 2\n", &["a.b=3"], "[a]\nb = 3\nc = 2\n");
        check("[a]\nb = 1\n", &["a = { c = 2 }"], "[a]\nc = 2\n");
        check("[a]\nb = 1\n", &["a.c.d = [1.5, 2]", "a.b=true"], "[a]\nb = true\nc.d = [1.5, 2]\n");
        check("", &["a.\"x y\"='v'", "a.\"x y\"=w"], "[a]\n'x y' = 'w'\n");
        check("a = 1\n", &["a.b = 2"], "a.b = 2\n");
        check("", &["a=nan-1", "b=exact", "c=-1e-3"], "a = 'nan-1'\nb = 'exact'\nc = -1e-3\n");
    }

    #[test]
    fn what_is_no_setting_is_refused() {
        let check = |text: &str, expected: &str| {
            let refused = Setting::parse(text).unwrap_err().to_string();
            assert!(refused.contains(expected), "{text}: {refused}");
        };
        check("a.b", "it must be KEY=VALUE");
        check("=1", "\"\" is not a key");
        check("a..b=1", "\"a..b\" is not a key");
        check("[a]=1", "\"[a]\" is not a key");
        check("a = 1\nb=2", "is not a value");
        check("a=", "\"\" is not a value of TOML");
        check("a=1,5", "\"1,5\" is not a value of TOML");
        check("a=two words", "\"two words\" is not a value of TOML");
        check("a={b=1", "is not a value");
    }

    #[test]
    fn fields_belong_to_the_setting_that_holds_them() {
        let setting = Setting::parse("parameters.\"a b\"={ start = 1 }").unwrap();
        assert!(setting.has("parameters.\"a b\"") && setting.has("parameters.\"a b\".start"));
        assert!(!setting.has("parameters") && !setting.has("parameters.\"a b\"c"));
        assert!(Setting::seed(3).has("monte_carlo.seed"));
        assert_eq!(Setting::seed(3).to_string(), "--seed 3");
    }
}
