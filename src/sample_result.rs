//! Results for tests: what a test says of a result, and the rest from a complete one.

use osteon_common::report::ResultFile;
use serde_json::Value;

/// A complete result of an identification, with the keys of `partial` put into it.
pub(crate) fn identification(partial: &str) -> ResultFile {
    filled(include_str!("../fuzz/corpus/results/identification.json"), partial)
}

/// A complete result of a propagation, with the keys of `partial` put into it.
pub(crate) fn propagation(partial: &str) -> ResultFile {
    filled(include_str!("../fuzz/corpus/results/propagation.json"), partial)
}

fn filled(complete: &str, partial: &str) -> ResultFile {
    let mut value: Value = serde_json::from_str(complete).unwrap();
    put(&mut value, &serde_json::from_str(partial).unwrap());
    ResultFile::from_json(&value.to_string()).unwrap()
}

/// Puts keys into an object, and into the objects below it. Failures are counted anew.
pub(crate) fn put(into: &mut Value, partial: &Value) {
    let (Some(entries), Value::Object(new)) = (into.as_object_mut(), partial) else {
        *into = partial.clone();
        return;
    };
    for (key, value) in new {
        match entries.get_mut(key) {
            Some(old) if key != "failures" => put(old, value),
            _ => _ = entries.insert(key.clone(), value.clone()),
        }
    }
}
