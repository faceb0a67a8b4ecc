//! Parses TOML text into a tree, with the line of every key and element.

mod cures;
mod size_limits;
mod spans;

use toml::Spanned;
use toml::de::{DeInteger, DeTable, DeValue};

use super::node::{Format, Node, SyntaxError, Value};
use crate::excerpt::Excerpt;

pub(crate) use spans::FieldSpans;

/// Parses a TOML text.
pub(super) fn parse(text: &str) -> Result<Node, SyntaxError> {
    if let Err((offset, exceeded)) = size_limits::check(text) {
        return Err(SyntaxError {
            format: Format::Toml,
            excerpt: Box::new(Excerpt::new(text, offset..offset + 1)),
            message: exceeded.to_string(),
            help: None,
        });
    }
    let table = DeTable::parse(text).map_err(|error| syntax_error(text, &error))?;
    let builder = TreeBuilder::new(text);
    Ok(Node { line: None, value: builder.convert_table(table.get_ref()) })
}

fn syntax_error(text: &str, error: &toml::de::Error) -> SyntaxError {
    let span = error.span().unwrap_or(0..1);
    SyntaxError {
        format: Format::Toml,
        excerpt: Box::new(Excerpt::new(text, span.clone())),
        message: error.message().trim_end().replace('\n', "; "),
        help: cures::cure(text, span.start, error.message()),
    }
}

/// Converts the parser's tree into ours, with line numbers.
struct TreeBuilder {
    /// Byte offsets at which the lines of the text begin.
    line_starts: Vec<usize>,
}

impl TreeBuilder {
    fn new(text: &str) -> Self {
        let after_newline =
            text.bytes().enumerate().filter(|&(_, b)| b == b'\n').map(|(i, _)| i + 1);
        Self { line_starts: std::iter::once(0).chain(after_newline).collect() }
    }

    fn line_at(&self, offset: usize) -> usize {
        self.line_starts.partition_point(|&start| start <= offset)
    }

    fn convert_table(&self, table: &DeTable<'_>) -> Value {
        let mut entries: Vec<_> = table.iter().collect();
        // The parser sorts by name; restore the order of the file.
        entries.sort_by_key(|(key, _)| key.span().start);
        Value::Table(
            entries
                .into_iter()
                .map(|(key, value)| {
                    let line = Some(self.line_at(key.span().start));
                    (
                        key.get_ref().to_string(),
                        Node { line, value: self.convert_value(value.get_ref()) },
                    )
                })
                .collect(),
        )
    }

    fn convert_value(&self, value: &DeValue<'_>) -> Value {
        match value {
            DeValue::String(text) => Value::Text(text.to_string()),
            DeValue::Integer(digits) => integer(digits),
            DeValue::Float(digits) => Value::Number(digits.as_str().parse().unwrap_or(f64::NAN)),
            DeValue::Boolean(value) => Value::Boolean(*value),
            DeValue::Datetime(_) => Value::Date,
            DeValue::Array(elements) => {
                Value::List(elements.iter().map(|element| self.convert_element(element)).collect())
            }
            DeValue::Table(table) => self.convert_table(table),
        }
    }

    fn convert_element(&self, element: &Spanned<DeValue<'_>>) -> Node {
        Node {
            line: Some(self.line_at(element.span().start)),
            value: self.convert_value(element.get_ref()),
        }
    }
}

/// Parses an integer of any size. Beyond 128 bits a decimal one becomes a floating-point number, any
/// other one infinity.
fn integer(digits: &DeInteger<'_>) -> Value {
    match i128::from_str_radix(digits.as_str(), digits.radix()) {
        Ok(value) => Value::Integer(value),
        Err(_) if digits.radix() == 10 => {
            Value::Number(digits.as_str().parse().unwrap_or(f64::NAN))
        }
        Err(_) => Value::Number(f64::INFINITY),
    }
}
