//! Parses JSON text into a tree. Unlike `serde_json::Value`, it refuses duplicate keys, and a text
//! with more content than a file needs.

use std::collections::BTreeSet;
use std::fmt;

use osteon_common::field_path::quoted;
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};

use super::budget::Budget;
use super::node::{Format, Node, SyntaxError, Value};
use crate::excerpt::Excerpt;

/// Parses a JSON text.
pub(super) fn parse(text: &str) -> Result<Node, SyntaxError> {
    let mut deserializer = serde_json::Deserializer::from_str(text);
    let root = Tree { budget: &mut Budget::new() }.deserialize(&mut deserializer);
    let root = root.and_then(|root| deserializer.end().map(|()| root));
    root.map_err(|error| {
        let (line, column) = (error.line(), error.column());
        let message = error.to_string();
        let suffix = format!(" at line {line} column {column}");
        let start = offset(text, line, column);
        SyntaxError {
            format: Format::Json,
            excerpt: Box::new(Excerpt::new(text, start..start + 1)),
            message: message.strip_suffix(&suffix).unwrap_or(&message).to_owned(),
            help: None,
        }
    })
}

/// Returns the byte offset of a line and a column in bytes, both from 1.
fn offset(text: &str, line: usize, column: usize) -> usize {
    let lines = text.split_inclusive('\n').take(line.saturating_sub(1));
    lines.map(str::len).sum::<usize>() + column.saturating_sub(1)
}

/// Builds the tree of a JSON text within a budget.
struct Tree<'b> {
    budget: &'b mut Budget,
}

impl<'de> DeserializeSeed<'de> for Tree<'_> {
    type Value = Node;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Node, D::Error> {
        self.budget.value().map_err(D::Error::custom)?;
        deserializer.deserialize_any(self).map(|value| Node { line: None, value })
    }
}

impl<'de> Visitor<'de> for Tree<'_> {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(Value::Boolean(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(Value::Integer(value.into()))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(Value::Integer(value.into()))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        Ok(Value::Number(value))
    }

    fn visit_str<E>(self, text: &str) -> Result<Value, E> {
        Ok(Value::Text(text.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<Value, A::Error> {
        self.budget.keys(1).map_err(A::Error::custom)?;
        let mut list = Vec::new();
        while let Some(element) = elements.next_element_seed(Tree { budget: &mut *self.budget })? {
            list.push(element);
        }
        Ok(Value::List(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        self.budget.keys(1).map_err(A::Error::custom)?;
        let mut seen = BTreeSet::new();
        let mut table = Vec::new();
        while let Some(key) = entries.next_key::<String>()? {
            self.budget.keys(1).map_err(A::Error::custom)?;
            if !seen.insert(key.clone()) {
                let key = quoted(&key);
                return Err(A::Error::custom(format_args!("the key {key} is given twice")));
            }
            table.push((key, entries.next_value_seed(Tree { budget: &mut *self.budget })?));
        }
        Ok(Value::Table(table))
    }
}
