//! One tree type for TOML and JSON, with line numbers where the parser provides them.
//!
//! Nothing is interpreted here: the readers of job and case files decide which keys exist and what
//! they mean.

mod budget;
mod json;
mod node;
mod toml;

pub use self::node::{Format, SyntaxError};
pub(crate) use self::node::{Node, Value};
pub(crate) use self::toml::FieldSpans;

/// Parses a text into a tree.
///
/// # Errors
/// Position and description of the syntax error. A duplicate key is such an error.
pub(crate) fn parse(text: &str, format: Format) -> Result<Node, SyntaxError> {
    match format {
        Format::Toml => toml::parse(text),
        Format::Json => json::parse(text),
    }
}

/// Finds the places of the fields of a text; a format without places has none.
pub(crate) fn spans(text: &str, format: Format) -> FieldSpans<'_> {
    match format {
        Format::Toml => FieldSpans::of_toml(text),
        Format::Json => FieldSpans::none(),
    }
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
        check(
            "a = 1\na = 2\n",
            Format::Toml,
            "line 2, column 1: not valid TOML: duplicate key; each section and key may occur once; put the \
             two together",
        );
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
