//! The interface for other programs: the keys of every JSON file and the columns of every table,
//! their order and their types. A change here changes the result schema.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use osteon_common::parameters::Parameter;
use serde_json::{Map, Value};
use support::{Scratch, job, run, text};

/// Returns one line for each key below `value`: its path and the type of its content.
fn keys(value: &Value) -> String {
    let mut lines = String::new();
    add_keys(&mut lines, "", value);
    lines
}

fn add_keys(lines: &mut String, path: &str, value: &Value) {
    let kind = match value {
        // Null if it was built outside a repository.
        Value::Null if path == "commit" => "text",
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(number) if number.is_f64() => "number",
        Value::Number(_) => "integer",
        Value::String(_) => "text",
        Value::Array(_) => "list",
        Value::Object(_) => "object",
    };
    if !path.is_empty() {
        lines.push_str(&format!("{path}: {kind}\n"));
    }
    let inside = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match value {
        Value::Object(entries) => {
            let trees: BTreeSet<String> = entries.values().map(tree).collect();
            if entries.len() >= ALIKE_MIN && trees.len() == 1 {
                let names: Vec<&str> = entries.keys().map(String::as_str).collect();
                lines.push_str(&format!("{path}.*: {}\n", names.join(", ")));
                add_keys(lines, &inside("*"), &entries[names[0]]);
                return;
            }
            for (key, value) in entries {
                add_keys(lines, &inside(key), value);
            }
        }
        // The elements of a list have the same form: the one with most keys represents all.
        Value::Array(elements) => {
            let fullest = elements.iter().max_by_key(|element| keys(element).lines().count());
            if let Some(element) = fullest {
                add_keys(lines, &format!("{path}[]"), element);
            }
        }
        _ => {}
    }
}

/// Minimum number of similar entries of an object, such as parameters, that are shown as one.
const ALIKE_MIN: usize = 6;

/// Returns the type of a value, and those of the values below it.
fn tree(value: &Value) -> String {
    let mut lines = String::new();
    add_keys(&mut lines, "*", value);
    lines
}

/// Returns one line for each column of a table: its name and the type of its fields.
fn columns(table: &str) -> String {
    let mut lines = table.lines();
    let names = fields(lines.next().unwrap());
    let rows: Vec<Vec<String>> = lines.map(fields).collect();
    let kind = |column: usize| {
        let kinds: BTreeSet<&str> = rows.iter().map(|row| kind(&row[column])).collect();
        let mut kinds: Vec<&str> = kinds.into_iter().collect();
        // If some fields are whole numbers and some are not, the column consists of numbers.
        if kinds.contains(&"number") {
            kinds.retain(|kind| *kind != "integer");
        }
        kinds.join(" or ")
    };
    let line = |(at, name): (usize, &String)| format!("{name}: {}\n", kind(at));
    names.iter().enumerate().map(line).collect()
}

fn kind(field: &str) -> &'static str {
    if field.is_empty() {
        "empty"
    } else if field.parse::<u64>().is_ok() {
        "integer"
    } else if field.parse::<f64>().is_ok() {
        "number"
    } else {
        "text"
    }
}

fn fields(line: &str) -> Vec<String> {
    let mut fields = vec![String::new()];
    let mut quoted = false;
    for character in line.chars() {
        match character {
            '"' => quoted = !quoted,
            ',' if !quoted => fields.push(String::new()),
            _ => fields.last_mut().unwrap().push(character),
        }
    }
    fields
}

fn read(directory: &Path, name: &str) -> String {
    fs::read_to_string(directory.join(name)).unwrap()
}

fn json(directory: &Path, name: &str) -> Value {
    serde_json::from_str(&read(directory, name)).unwrap()
}

/// The directories of one run of each kind.
struct Runs {
    _scratch: Scratch,
    identified: PathBuf,
    grouped: PathBuf,
    propagated: PathBuf,
    simulated: PathBuf,
}

const DATA: &str = "[data]\nmean = 3906.0\ncoefficient_of_variation = 0.0271\n";

impl Runs {
    fn new() -> Self {
        let scratch = Scratch::new();
        let velocities = [3820.5, 3850.25, 3885.0, 3906.0, 3930.5, 3960.0, 3995.75];
        let search = |data: &str, search: &str| {
            let text = job(32, 30).replace(DATA, data);
            text.replace("[search]\n", &format!("[search]\nmethod = \"newton\"\n{search}"))
        };
        let run_job = |name: &str, command: &str, text: &str| {
            let job = scratch.write(&format!("{name}.toml"), text);
            let out = scratch.path(name);
            run(&[command, support::text(&job), "--out", support::text(&out)]).succeeded();
            out
        };
        let measured = format!("[data]\nvelocities = {velocities:?}\n");
        let identified = run_job("identified", "identify", &search(&measured, "starts = 2\n"));
        let groups = format!(
            "[data.groups]\nlonely = [3900.0]\nleft = {velocities:?}\nright = [3800.0, 3900.0, 3950.0, 3850.0, 3920.0]\n"
        );
        let grouped = run_job("grouped", "identify", &search(&groups, "starts = 2\n"));
        let propagated = run_job("propagated", "propagate", &job(8, 1));
        let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/cases/D.toml");
        let simulated = scratch.path("simulated");
        let step = ["--duration", "2e-6", "--time-step", "1e-6"];
        run(&[&["simulate", text(&case), "--out", text(&simulated)], &step[..]].concat())
            .succeeded();
        Self { identified, grouped, propagated, simulated, _scratch: scratch }
    }

    fn all(&self) -> [&Path; 4] {
        [&self.identified, &self.grouped, &self.propagated, &self.simulated]
    }
}

/// Returns the documentation of results.
fn page() -> String {
    read(Path::new(env!("CARGO_MANIFEST_DIR")), "docs/results.md")
}

/// Returns the keys or columns that the documentation of results lists for a file.
fn documented(heading: &str) -> Vec<String> {
    let page = page();
    let mut sections = page.split("\n## ").flat_map(|chapter| chapter.split("\n### "));
    let section = sections.find(|section| section.lines().next() == Some(heading));
    let section = section.unwrap_or_else(|| panic!("no section {heading:?}"));
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    let first = rows.filter_map(|line| line.split('|').nth(1));
    first
        .flat_map(|cell| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>())
        .collect()
}

fn names(value: &Value) -> Vec<String> {
    value.as_object().map(Map::keys).unwrap().cloned().collect()
}

fn header(directory: &Path, name: &str) -> Vec<String> {
    fields(read(directory, name).lines().next().unwrap())
}

#[test]
fn keys_and_columns_are_those_that_other_programs_know() {
    let runs = Runs::new();
    let mut text = String::new();
    for directory in runs.all() {
        let mut files: Vec<_> = fs::read_dir(directory).unwrap().map(Result::unwrap).collect();
        files.sort_by_key(|entry| entry.file_name());
        for file in files {
            let name = file.file_name().into_string().unwrap();
            let shown = if name.ends_with(".json") {
                keys(&json(directory, &name))
            } else if name.ends_with(".csv") {
                columns(&read(directory, &name))
            } else {
                continue;
            };
            let of = directory.file_name().unwrap().to_str().unwrap();
            text.push_str(&format!("==== {of}/{name}\n{shown}\n"));
        }
    }
    insta::assert_snapshot!(text);
    documented_is_real(&runs);
    provenance_tells_of_every_file(&runs);
}

fn documented_is_real(runs: &Runs) {
    let group = |value: &Value| value["groups"][1].clone();
    let (one, many) = (json(&runs.identified, "result.json"), json(&runs.grouped, "result.json"));
    let propagated = json(&runs.propagated, "result.json");
    let simulated = json(&runs.simulated, "result.json");
    let mut whole = names(&one);
    whole.extend(names(&many));
    for (heading, real) in [
        ("`result.json` of `identify`", whole),
        ("`groups` of a result", names(&group(&many))),
        ("`identified` of a result", names(&one["identified"])),
        ("`result.json` of `propagate`", names(&propagated)),
        ("`result.json` of `simulate`", names(&simulated)),
        ("`provenance.json`", names(&json(&runs.grouped, "provenance.json"))),
        ("`history.csv`", header(&runs.grouped, "history.csv")),
        ("`realizations.csv`", header(&runs.grouped, "realizations.csv")),
        ("`groups.csv`", header(&runs.grouped, "groups.csv")),
        ("`comparison.csv`", header(&runs.grouped, "comparison.csv")),
    ] {
        let (told, real): (BTreeSet<String>, BTreeSet<String>) =
            (documented(heading).into_iter().collect(), real.into_iter().collect());
        // Some keys occur only in certain runs, and some columns are named after the free
        // parameters. Quantities of the setup are there if they are searched.
        let of_setup = Parameter::OF_SETUP.map(Parameter::name);
        let told: BTreeSet<_> = told
            .into_iter()
            .flat_map(|name| match name.as_str() {
                "NAME" => vec!["longitudinal_young_modulus".to_owned()],
                "NAME_lower" => vec!["longitudinal_young_modulus_lower".to_owned()],
                "NAME_upper" => vec!["longitudinal_young_modulus_upper".to_owned()],
                "reason"
                | "check"
                | "cost_standard_error"
                | "failure"
                | "integrity"
                | "decay"
                | "other_velocity"
                | "center_frequency"
                | "budget"
                | "pooling"
                | "pooled"
                | "errors"
                    if !real.contains(&name) =>
                {
                    Vec::new()
                }
                name if name.contains("_pooled") => Vec::new(),
                name if of_setup.contains(&name.trim_start_matches("best_")) => Vec::new(),
                _ => vec![name],
            })
            .collect();
        let missing: Vec<_> = real.difference(&told).collect();
        let unreal: Vec<_> = told.difference(&real).collect();
        assert!(
            missing.is_empty() && unreal.is_empty(),
            "{heading}: not in docs/results.md {missing:?}, only there {unreal:?}"
        );
    }
}

fn provenance_tells_of_every_file(runs: &Runs) {
    for directory in runs.all() {
        let (result, provenance) =
            (json(directory, "result.json"), json(directory, "provenance.json"));
        for key in ["schema", "kind", "version", "numerics", "commit"] {
            assert_eq!(provenance[key], result[key], "{key}");
        }
        for key in ["digest", "seed"] {
            let expected = result.get(key).unwrap_or(&Value::Null);
            assert_eq!(provenance[key], *expected, "{key}");
        }
        let mut listed = BTreeSet::from(["provenance.json".to_owned()]);
        for file in provenance["files"].as_array().unwrap() {
            let name = file["name"].as_str().unwrap();
            let bytes = fs::read(directory.join(name)).unwrap();
            assert_eq!(file["bytes"], bytes.len(), "{name}");
            assert_eq!(file["blake3"], blake3::hash(&bytes).to_hex().as_str(), "{name}");
            listed.insert(name.to_owned());
        }
        let there = fs::read_dir(directory).unwrap().map(Result::unwrap);
        let there: BTreeSet<String> =
            there.map(|entry| entry.file_name().into_string().unwrap()).collect();
        assert_eq!(listed, there);
    }
}

/// Checks that a committed schema is the printed one, and returns it. With `OSTEON_WRITE_DOCS` the
/// committed one is written instead.
fn committed_schema(file: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("docs/{file}.schema.json"));
    let printed = run(&["schema", file]);
    if std::env::var_os("OSTEON_WRITE_DOCS").is_some() {
        fs::write(&path, printed.succeeded()).unwrap();
    }
    let committed = fs::read_to_string(path).unwrap();
    // The texts are too long to be shown.
    let is_committed = printed.succeeded() == committed;
    assert!(is_committed, "docs/{file}.schema.json is old: cargo xtask generate reference");
    let schema: Value = serde_json::from_str(&committed).unwrap();
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    schema
}

/// Editors and programs use the schemas from the repository.
#[test]
fn the_schemas_are_the_committed_ones_and_describe_every_key() {
    for (file, least) in [("job", 50), ("result", 100)] {
        let mut undescribed = Vec::new();
        let count = undescribed_keys(&committed_schema(file), "", &mut undescribed);
        assert!(count > least, "{file}: only {count} keys were found");
        assert!(undescribed.is_empty(), "{file}: without a description: {undescribed:?}");
    }
}

/// The keys of a posterior as the schema has them, and as the documentation lists them.
#[test]
fn every_key_of_a_posterior_is_documented() {
    let schema = committed_schema("result");
    let real: BTreeSet<String> =
        names(&schema["$defs"]["PosteriorReport"]["properties"]).into_iter().collect();
    let told: BTreeSet<String> = documented("`posterior` of a result").into_iter().collect();
    assert_eq!(told, real);
}

/// The runs of these tests use one method; the schema has the keys of all of them.
#[test]
fn every_key_of_every_solver_is_documented() {
    let (schema, page) = (committed_schema("result"), page());
    let methods = schema["$defs"]["Solver"]["oneOf"].as_array().unwrap();
    for method in methods {
        let properties = &method["properties"];
        let mut told = names(properties);
        told.push(properties["method"]["const"].as_str().unwrap().to_owned());
        told.retain(|name| !page.contains(&format!("`{name}`")));
        assert!(told.is_empty(), "not in docs/results.md: {told:?}");
    }
}

/// Lists the keys of `value` that `schema` does not know, or that it lacks.
fn unlike(schema: &Value, value: &Value, path: &str, found: &mut Vec<String>) {
    let Some(entries) = value.as_object() else { return };
    let forms = schema["anyOf"].as_array().into_iter().flatten();
    let table = forms.into_iter().find(|form| form["properties"].is_object());
    let schema = table.unwrap_or(schema);
    for (name, value) in entries {
        let path = format!("{path}.{name}");
        match (&schema["properties"][name], &schema["additionalProperties"]) {
            (Value::Null, Value::Object(_)) => {}
            (Value::Null, _) => found.push(path),
            (known, _) => unlike(known, value, &path, found),
        }
    }
}

#[test]
fn the_schema_of_job_files_knows_every_key_of_the_examples() {
    let schema = committed_schema("job");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for file in [
        "fuzz/corpus/jobs/every-key.json",
        "fuzz/corpus/jobs/every-key.toml",
        "examples/paper.toml",
    ] {
        let text = fs::read_to_string(root.join(file)).unwrap();
        let job: Value = match file.ends_with(".json") {
            true => serde_json::from_str(&text).unwrap(),
            false => toml::from_str(&text).unwrap(),
        };
        let mut found = Vec::new();
        unlike(&schema, &job, "", &mut found);
        assert!(found.is_empty(), "{file}: {found:?}");
    }
}

/// Counts the keys in a schema, and lists those without a description.
fn undescribed_keys(schema: &Value, path: &str, undescribed: &mut Vec<String>) -> usize {
    let mut count = 0;
    for (name, property) in schema["properties"].as_object().into_iter().flatten() {
        count += 1;
        // The alternatives are distinguished by the kind, and those of a solver by the method.
        if property.get("description").is_none() && property.get("const").is_none() {
            undescribed.push(format!("{path}.{name}"));
        }
    }
    let below: Vec<(String, &Value)> = match schema {
        Value::Object(entries) => entries.iter().map(|(key, value)| (key.clone(), value)).collect(),
        Value::Array(entries) => entries.iter().map(|value| (String::new(), value)).collect(),
        _ => Vec::new(),
    };
    for (key, value) in below {
        count += undescribed_keys(value, &format!("{path}/{key}"), undescribed);
    }
    count
}
