//! Every result that stands in the repository, through the types and back to the same bytes.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use std::path::Path;
use std::{env, fs};

use osteon_files::report::{ResultFile, Simulation};

/// The files of a folder of the repository whose names end so.
fn files(folder: &str, ending: &str) -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(folder);
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let paths = paths.filter(|path| path.to_str().unwrap().ends_with(ending));
    paths.map(|path| (path.display().to_string(), fs::read_to_string(path).unwrap())).collect()
}

/// With `INSTA_UPDATE=always`, as for snapshots, the files are written instead: a key that every result has
/// gets its default.
#[test]
fn results_of_jobs_are_written_as_they_were_read() {
    let mut results = files("coordinator/tests/wire", ".json");
    results.extend(files("fuzz/corpus/results", ".json"));
    assert!(results.len() >= 9, "only {} results were found", results.len());
    let renews = env::var_os("INSTA_UPDATE").is_some_and(|mode| mode == "always");
    for (name, text) in results {
        let read = ResultFile::from_json(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
        if renews {
            fs::write(name, read.to_json()).unwrap();
        } else {
            assert_eq!(read.to_json(), text, "{name}");
        }
    }
}

#[test]
fn results_of_simulations_are_written_as_they_were_read() {
    let snapshots = files("src/output/tests/snapshots", ".snap");
    let parts = snapshots.iter().filter_map(|(name, text)| Some((name, text.find("\n{\n")?, text)));
    let texts = parts.filter(|(_, _, text)| text.contains("\"kind\": \"simulation\""));
    let mut count = 0;
    for (name, begin, text) in texts {
        let text = &text[begin + 1..];
        let read: Simulation = serde_json::from_str(text).unwrap();
        assert_eq!(read.to_json(), text, "{name}");
        count += 1;
    }
    assert_eq!(count, 2);
}
