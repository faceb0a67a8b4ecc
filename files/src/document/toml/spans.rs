//! Finds the place of a field in a text of TOML, once something is to be said of it.

use std::ops::Range;

use osteon_common::field_path::shown_key;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The places of all fields of a text.
#[derive(Debug)]
pub(crate) struct FieldSpans<'t>(Option<Spanned<DeTable<'t>>>);

impl<'t> FieldSpans<'t> {
    /// Finds the places in a text of TOML. A malformed text has none.
    pub(in crate::document) fn of_toml(text: &'t str) -> Self {
        Self(DeTable::parse(text).ok())
    }

    /// Returns no places.
    pub(in crate::document) fn none() -> Self {
        Self(None)
    }

    /// Returns the bytes of the value of the field at `path` (of a table with a header: those of the
    /// header), or of its `key`. If the field is absent, they are those of the innermost table on the path.
    pub(crate) fn span(&self, path: &str, key: bool) -> Option<Range<usize>> {
        let root = self.0.as_ref()?;
        let (mut found, mut rest) = child_of_table(root.get_ref(), path)?;
        while let Some((child, after)) = found.child(rest) {
            (found, rest) = (child, after);
        }
        Some(if key && rest.is_empty() { found.key } else { found.value.span() })
    }
}

/// A field, with the bytes of its key; an element of a list has none, and those of its value instead.
struct Field<'a, 't> {
    key: Range<usize>,
    value: &'a Spanned<DeValue<'t>>,
}

impl<'a, 't> Field<'a, 't> {
    fn child<'p>(&self, path: &'p str) -> Option<(Field<'a, 't>, &'p str)> {
        match self.value.get_ref() {
            DeValue::Table(table) => child_of_table(table, path),
            DeValue::Array(elements) => {
                let (index, rest) = path.strip_prefix('[')?.split_once(']')?;
                let value = elements.get(index.parse::<usize>().ok()?)?;
                Some((Field { key: value.span(), value }, rest))
            }
            _ => None,
        }
    }
}

/// Returns the entry that the first segment of `path` names, and the rest of the path.
fn child_of_table<'a, 't, 'p>(
    table: &'a DeTable<'t>,
    path: &'p str,
) -> Option<(Field<'a, 't>, &'p str)> {
    let path = path.strip_prefix('.').unwrap_or(path);
    table.iter().find_map(|(key, value)| {
        let rest = path.strip_prefix(shown_key(key.get_ref()).as_str())?;
        let found = rest.is_empty() || rest.starts_with(['.', '[']);
        found.then(|| (Field { key: key.span(), value }, rest))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_values_are_found() {
        let text = "a = 1\n[b.c]\n'x y' = { z = [1, 2.5] }\n";
        let spans = FieldSpans::of_toml(text);
        let check = |path: &str, key: bool, expected: Option<&str>| {
            let found = spans.span(path, key).and_then(|span| text.get(span));
            assert_eq!(found, expected, "{path}");
        };
        check("a", true, Some("a"));
        check("a", false, Some("1"));
        check("b.c", false, Some("[b.c]"));
        check("b.c.missing", false, Some("[b.c]"));
        check("b.c.\"x y\"", true, Some("'x y'"));
        check("b.c.\"x y\".z", false, Some("[1, 2.5]"));
        check("b.c.\"x y\".z[1]", false, Some("2.5"));
        check("b.c.\"x y\".w", false, Some("{ z = [1, 2.5] }"));
        check("missing", false, None);
        assert_eq!(FieldSpans::of_toml("a = ").span("a", true), None);
    }
}
