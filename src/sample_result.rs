//! Complete results for tests, in which a test sets only the keys that matter to it.

use osteon_files::report::ResultFile;
use serde_json::Value;

/// Returns a complete result of an identification, in which the keys of `partial` are replaced.
pub(crate) fn identification(partial: &str) -> ResultFile {
    filled(include_str!("../fuzz/corpus/results/identification.json"), partial)
}

/// Returns a complete result of a propagation, in which the keys of `partial` are replaced.
pub(crate) fn propagation(partial: &str) -> ResultFile {
    filled(include_str!("../fuzz/corpus/results/propagation.json"), partial)
}

fn filled(complete: &str, partial: &str) -> ResultFile {
    let mut value: Value = serde_json::from_str(complete).unwrap();
    put(&mut value, &serde_json::from_str(partial).unwrap());
    ResultFile::from_json(&value.to_string()).unwrap()
}

/// Sets keys of an object and of nested objects. Failures are counted again.
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
