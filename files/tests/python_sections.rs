//! The sections of a job file as types of Python, made from the JSON Schema, which is made from the
//! declared keys: names, ranges, defaults and descriptions cannot differ.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on should say where")]

use std::fmt::Write as _;
use std::path::Path;
use std::{env, fs};

use osteon_files::job_file;
use serde_json::{Map, Value};

/// Longest line of the text, characters.
const WIDTH: usize = 99;

/// `[data]` also takes frames and arrays; its type is in `python/osteon/_data.py`.
const WRITTEN_BY_HAND: &str = "data";

/// `OSTEON_WRITE_DOCS=1` writes the file instead.
#[test]
fn sections_of_python_are_the_committed() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../python/osteon/sections.py");
    let text = module(&serde_json::from_str(&job_file::schema()).unwrap());
    if env::var_os("OSTEON_WRITE_DOCS").is_some() {
        fs::write(&path, &text).unwrap();
    }
    let committed = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == text,
        "{} differs; `cargo xtask generate reference` writes it",
        path.display()
    );
}

/// Returns the module.
fn module(schema: &Value) -> String {
    let mut text = "\"\"\"The sections of a job: the keyword arguments of :class:`osteon.Job`.\n\n\
                    Every key may be left out unless it says otherwise; units are SI.\n\n\
                    Written by `cargo xtask generate reference`; do not edit.\"\"\"\n\n\
                    from __future__ import annotations\n\n\
                    from collections.abc import Sequence\n\
                    from typing import Literal, TypedDict\n"
        .to_owned();
    for (name, section) in schema["properties"].as_object().unwrap() {
        if name != WRITTEN_BY_HAND {
            class(&mut text, &title(name), section);
        }
    }
    text
}

/// Appends the type of a table, after those of the tables in it, and returns its name.
fn class(text: &mut String, name: &str, table: &Value) -> String {
    let keys: &Map<String, Value> = table["properties"].as_object().unwrap();
    let fields: Vec<_> = keys
        .iter()
        .map(|(key, value)| {
            let kind = kind(text, &format!("{name}{}", title(key)), value);
            (key, kind, described(value))
        })
        .collect();
    write!(text, "\n\nclass {name}(TypedDict, total=False):\n").unwrap();
    docstring(text, &sentence(table));
    for (key, kind, description) in fields {
        writeln!(text, "\n    {key}: {kind}").unwrap();
        docstring(text, &description);
    }
    name.to_owned()
}

/// Returns the type of a value.
fn kind(text: &mut String, name: &str, value: &Value) -> String {
    if let Some(choices) = value["enum"].as_array() {
        let choices: Vec<_> = choices.iter().map(Value::to_string).collect();
        return format!("Literal[{}]", choices.join(", "));
    }
    match value["type"].as_str().unwrap() {
        "number" => "float".to_owned(),
        "integer" => "int".to_owned(),
        "boolean" => "bool".to_owned(),
        "string" => "str".to_owned(),
        "array" => format!("Sequence[{}]", kind(text, name, &value["items"])),
        "object" => class(text, name, value),
        other => panic!("{name}: the type {other} has no counterpart"),
    }
}

/// Returns the description of a value with its range and default.
fn described(value: &Value) -> String {
    let mut text = sentence(value);
    let limits = [
        ("exclusiveMinimum", "above "),
        ("minimum", "at least "),
        ("exclusiveMaximum", "below "),
        ("maximum", "at most "),
    ];
    let limits = limits.iter().filter_map(|(key, words)| {
        Some(format!("{words}{}", value.get(*key).filter(|limit| !limit.is_null())?))
    });
    let limits: Vec<_> = limits.collect();
    if !limits.is_empty() {
        write!(text, " Range: {}.", limits.join(", ")).unwrap();
    }
    if let Some(default) = value.get("default") {
        let default = match default {
            Value::Bool(true) => "True".to_owned(),
            Value::Bool(false) => "False".to_owned(),
            other => other.to_string(),
        };
        write!(text, " Default: {default}.").unwrap();
    }
    text
}

/// Returns the description as a sentence.
fn sentence(value: &Value) -> String {
    let text = value["description"].as_str().unwrap();
    let (first, rest) = text.split_at(text.chars().next().map_or(0, char::len_utf8));
    let end = if text.ends_with('.') { "" } else { "." };
    format!("{}{rest}{end}", first.to_uppercase())
}

/// Appends a docstring in lines of limited length.
fn docstring(text: &mut String, sentences: &str) {
    let mut line = "    \"\"\"".to_owned();
    let mut is_first = true;
    for word in sentences.split_whitespace() {
        if line.chars().count() + word.chars().count() + 4 > WIDTH {
            writeln!(text, "{}", line.trim_end()).unwrap();
            line = "    ".to_owned();
            is_first = true;
        }
        if !is_first {
            line.push(' ');
        }
        line.push_str(word);
        is_first = false;
    }
    let end = if line.ends_with('"') { " \"\"\"" } else { "\"\"\"" };
    writeln!(text, "{line}{end}").unwrap();
}

/// Returns a key as the name of a type.
fn title(key: &str) -> String {
    key.split('_')
        .map(|word| {
            let (first, rest) = word.split_at(1.min(word.len()));
            format!("{}{rest}", first.to_uppercase())
        })
        .collect()
}
