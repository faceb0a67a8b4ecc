//! Checks of the repository that no compiler and no linter makes.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use cargo_metadata::{DependencyKind, MetadataCommand};

/// Longest source file, lines.
const FILE_LINES_MAX: usize = 500;
/// Longest function, lines.
const FUNCTION_LINES_MAX: usize = 70;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Returns the files below the root with one of these endings, without build output.
fn files(endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root().to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            if path.is_dir() {
                if !name.starts_with('.') && name != "target" {
                    folders.push(path);
                }
            } else if endings.iter().any(|ending| name.ends_with(ending)) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

#[test]
fn crates_depend_on_each_other_along_the_allowed_arrows_only() {
    let metadata = MetadataCommand::new().no_deps().exec().unwrap();
    let arrows: BTreeSet<(String, String)> = metadata
        .packages
        .iter()
        .flat_map(|package| package.dependencies.iter().map(move |to| (package, to)))
        .filter(|(_, to)| to.kind == DependencyKind::Normal && to.name.starts_with("osteon"))
        .map(|(from, to)| (from.name.to_string(), to.name.clone()))
        .collect();
    let allowed = [
        (
            "osteon",
            "client common coordinator files local proto search signals slurm solver transport umbridge worker",
        ),
        ("osteon-client", "common coordinator files proto report transport"),
        ("osteon-coordinator", "common files http proto report search transport"),
        ("osteon-files", "common"),
        ("osteon-local", "common files search solver"),
        ("osteon-proto", "common"),
        ("osteon-python", "common files proto solver"),
        ("osteon-report", "common files"),
        ("osteon-search", "common"),
        ("osteon-signals", "common files solver"),
        ("osteon-slurm", "client common proto transport"),
        ("osteon-solver", "common"),
        ("osteon-study", "common local search signals solver"),
        ("osteon-transport", "common files proto"),
        ("osteon-umbridge", "client common files http proto search solver transport"),
        ("osteon-worker", "common proto solver transport"),
    ];
    let allowed = allowed.iter().flat_map(|(from, to)| {
        to.split(' ').map(|to| ((*from).to_owned(), format!("osteon-{to}")))
    });
    assert_eq!(arrows, allowed.collect());
}

/// As the arrows above show, no crate depends on `osteon-study`. Features that only it enables are
/// therefore not part of the program as long as no other crate enables them.
#[test]
fn what_only_measures_is_not_shipped() {
    let metadata = MetadataCommand::new().no_deps().exec().unwrap();
    for package in metadata.packages.iter().filter(|package| *package.name != "osteon-study") {
        let dependencies =
            package.dependencies.iter().filter(|to| to.kind == DependencyKind::Normal);
        for to in dependencies.filter(|to| to.name == "osteon-solver") {
            assert_eq!(to.features, Vec::<String>::new(), "{}", package.name);
        }
        // One that were there by default would be in the program, too.
        let by_default = package.features.get("default");
        let ships = *package.name == "osteon-solver" && by_default.is_some_and(|it| !it.is_empty());
        assert!(!ships, "{by_default:?}");
    }
}

#[test]
fn state_and_reactions_know_no_clock_no_socket_and_no_future() {
    let core = ["coordinator/src/core", "coordinator/src/core.rs"];
    let pure = ["common/src", "search/src", "solver/src"];
    let single = ["coordinator/src/access.rs", "worker/src/state.rs", "worker/src/backend.rs"];
    let paths: Vec<_> =
        pure.iter().chain(&core).chain(&single).map(|path| root().join(path)).collect();
    let pure = files(&[".rs"]).into_iter().filter(|file| {
        let test =
            file.components().any(|part| part.as_os_str() == "tests") || file.ends_with("tests.rs");
        !test && paths.iter().any(|path| file.starts_with(path))
    });
    let mut count = 0;
    for path in pure {
        count += 1;
        let text = fs::read_to_string(&path).unwrap();
        for word in [
            "async ",
            ".await;",
            ".await?",
            "Instant::now",
            "SystemTime",
            "tokio::",
            "tonic::",
            "std::net",
            "std::fs",
        ] {
            assert!(!text.contains(word), "{} contains {word:?}", path.display());
        }
    }
    assert!(count > 60, "only {count} files were found");
}

/// `proptest!` reads environment variables, uses a new seed each time, and writes files.
/// Only the solver needs code that the compiler cannot check, for registers and instruction sets.
#[test]
fn unsafe_code_is_forbidden_outside_of_the_solver() {
    let is_root = |path: &PathBuf| path.parent().is_some_and(|folder| folder.ends_with("src"));
    let roots = files(&["lib.rs", "main.rs"]).into_iter().filter(is_root);
    let roots: Vec<_> = roots.filter(|root| !root.ends_with("solver/src/lib.rs")).collect();
    assert!(roots.len() > 10, "{roots:?}");
    for root in roots {
        let text = fs::read_to_string(&root).unwrap();
        assert!(text.contains("\n#![forbid(unsafe_code)]\n"), "{}", root.display());
    }
}

#[test]
fn properties_are_tested_on_the_same_cases_everywhere() {
    let helper = root().join("fuzz/src");
    let mut count = 0;
    for path in files(&[".rs"]) {
        let text = fs::read_to_string(&path).unwrap();
        count += text.matches("properties! {").count();
        if !path.starts_with(&helper) && !path.ends_with("tests/tidy.rs") {
            for word in ["proptest! {", "proptest!(", "TestRunner::", "ProptestConfig"] {
                assert!(!text.contains(word), "{} contains {word:?}", path.display());
            }
        }
    }
    assert!(count > 10, "only {count} blocks were found");
    let folders = files(&[".txt"])
        .into_iter()
        .filter(|path| path.to_string_lossy().contains("proptest-regressions"));
    assert_eq!(folders.collect::<Vec<_>>(), Vec::<PathBuf>::new());
}

/// Names of types that are defined more than once, with the reason.
const REPEATED_TYPE_NAMES: [(&str, &str); 19] = [
    ("Arguments", "the command line of each program"),
    ("Data", "a part of a job, and its JSON form in a result"),
    ("Direction", "a part of the conclusions, and its JSON form in a result"),
    ("Effect", "the effects of the state machines of coordinator and worker"),
    ("Event", "the events of the state machines of coordinator and worker"),
    ("Failure", "the failure of a solver and that of a worker, never in one file"),
    ("Group", "a group of the data, and the JSON form of its result"),
    ("Lanes", "numbers computed together, of the solver and of the posterior"),
    ("MomentIntervals", "a part of the conclusions, and its JSON form in a result"),
    ("Moments", "the two moments, and their JSON form in a result"),
    ("Noise", "a part of the conclusions, and its JSON form in a result"),
    ("Scaled", "scaled features of the posterior, and a scaled determinant of the solver"),
    ("Search", "a search, and the section of a job that configures it"),
    ("Settings", "the settings of each search method, named with their module"),
    ("Solution", "a part of the conclusions, and its JSON form in a result"),
    ("Solutions", "a part of the conclusions, and its JSON form in a result"),
    ("Solver", "the solver, and its JSON form in a result"),
    ("Spreads", "a part of the conclusions, and its JSON form in a result"),
    ("State", "the states of the state machines of coordinator and worker"),
];

/// A name that means two things makes readers guess.
#[test]
fn type_names_are_unique() {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for path in files(&[".rs"]).iter().filter(|path| !is_of_tests(path)) {
        let text = fs::read_to_string(path).unwrap();
        let end = text.find("\n#[cfg(test)]\nmod tests {").unwrap_or(text.len());
        for (line, code) in text[..end].lines().enumerate() {
            if let Some(name) = defined_type(code) {
                let place = format!("{}:{}", path.display(), line + 1);
                places.entry(name.to_owned()).or_default().push(place);
            }
        }
    }
    assert!(places.len() > 500, "only {} types were found", places.len());
    let repeated = places.iter().filter(|(_, places)| places.len() > 1);
    let repeated: BTreeMap<&str, &Vec<String>> =
        repeated.map(|(name, places)| (name.as_str(), places)).collect();
    let allowed: BTreeSet<&str> = REPEATED_TYPE_NAMES.iter().map(|(name, _)| *name).collect();
    for (name, places) in &repeated {
        let problem = "is defined more than once; rename one, or give a reason in this file";
        assert!(allowed.contains(name), "{name} {problem}: {places:?}");
    }
    for name in allowed {
        assert!(repeated.contains_key(name), "{name} is no longer defined more than once");
    }
}

/// Returns whether a file contains tests or benchmarks only.
fn is_of_tests(path: &Path) -> bool {
    let path = path.strip_prefix(root()).unwrap();
    path.iter().any(|part| ["tests", "benches", "fuzz"].iter().any(|folder| part == *folder))
        || ["tests.rs", "fuzz.rs"].iter().any(|name| path.ends_with(name))
}

/// Returns the name of the type that a line of formatted code defines outside of any block.
fn defined_type(code: &str) -> Option<&str> {
    let code = match code.strip_prefix("pub") {
        Some(rest) if rest.starts_with('(') => rest.split_once(") ")?.1,
        Some(rest) => rest.strip_prefix(' ')?,
        None => code,
    };
    let kinds = ["struct ", "enum ", "trait ", "type "];
    let name = kinds.iter().find_map(|kind| code.strip_prefix(kind))?;
    name.split(|c: char| !c.is_alphanumeric()).next()
}

#[test]
fn files_and_functions_are_short() {
    let mut long = Vec::new();
    for path in files(&[".rs"]) {
        let text = fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        if lines.len() > FILE_LINES_MAX {
            long.push(format!("{}: {} lines", path.display(), lines.len()));
        }
        for start in 0..lines.len() {
            let length = function_length(&lines[start..]).unwrap_or(0);
            if length > FUNCTION_LINES_MAX {
                long.push(format!("{}:{}: {length} lines", path.display(), start + 1));
            }
        }
    }
    assert!(long.is_empty(), "too long:\n{}", long.join("\n"));
}

/// Returns the number of lines of the function that begins with the first of formatted lines; `None` if
/// none does, or if it has no body.
fn function_length(lines: &[&str]) -> Option<usize> {
    let first = lines.first()?;
    let code = first.trim_start();
    if !is_function(code) {
        return None;
    }
    let signature_end = lines.iter().position(|line| line.ends_with([';', '{', '}']))?;
    if !lines[signature_end].ends_with('{') {
        return None;
    }
    // The code is formatted, so a function ends at its own indentation.
    let end = format!("{}}}", &first[..first.len() - code.len()]);
    lines.iter().position(|line| *line == end)
}

/// Returns whether a function begins with this code, whatever words come before `fn`.
fn is_function(code: &str) -> bool {
    let Some((before, _)) = code.split_once("fn ") else { return false };
    let words = ["pub", "default", "const", "async", "unsafe", "safe", "extern"];
    let mut rest = before;
    while !rest.is_empty() {
        let after = match rest.strip_prefix("pub(").or_else(|| rest.strip_prefix('"')) {
            // To whom it is visible, or the name of a calling convention.
            Some(inside) => inside.split_once([')', '"']).map(|(_, after)| after),
            None => words.iter().find_map(|word| rest.strip_prefix(word)),
        };
        match after.and_then(|after| after.strip_prefix(' ')) {
            Some(after) => rest = after,
            None => return false,
        }
    }
    true
}

#[test]
fn functions_of_every_form_are_measured() {
    let body = ["    a();", "    b();", "}"];
    for before in [
        "",
        "pub ",
        "pub(crate) ",
        "pub(in crate::a) ",
        "async ",
        "pub(super) async ",
        "const ",
        "pub const unsafe ",
        "unsafe extern \"C\" ",
        "pub extern \"system\" ",
        "extern ",
        "default async ",
    ] {
        for signature in
            [&["fn f() {"][..], &["fn f(", "    a: A,", ") -> B", "where", "    A: C,", "{"]]
        {
            let first = format!("{before}{}", signature[0]);
            let lines: Vec<&str> = [first.as_str()]
                .into_iter()
                .chain(signature[1..].iter().copied())
                .chain(body)
                .collect();
            assert_eq!(function_length(&lines), Some(lines.len() - 1), "{lines:?}");
            // A method ends at its own indentation.
            let indented: Vec<String> = lines.iter().map(|line| format!("    {line}")).collect();
            let mut inside: Vec<&str> = indented.iter().map(String::as_str).collect();
            inside.push("}");
            assert_eq!(function_length(&inside), Some(lines.len() - 1), "{inside:?}");
        }
    }
    for line in [
        "let a = |b| b;",
        "// A fn f() {",
        "table: fn(&Draws) -> Table,",
        "impl<F: Fn(A)> B for F {",
        "fn f(&self);",
        "fn f() {}",
        "fn f() -> A { b() }",
        "println!(\"fn f() {",
    ] {
        assert_eq!(function_length(&[line, "}"]), None, "{line}");
    }
}

#[test]
fn nothing_is_left_over() {
    // Split in two, so that this file does not match itself.
    let words = [
        concat!("todo", "!("),
        concat!("unimplemented", "!("),
        concat!("dbg", "!("),
        concat!("#[ig", "nore"),
        concat!("#[al", "low("),
        concat!("FIX", "ME"),
    ];
    for path in files(&[".rs", ".proto", ".toml", ".md"]) {
        let text = fs::read_to_string(&path).unwrap();
        for word in words {
            // CONTRIBUTING.md lists what must not be used.
            if !path.ends_with("CONTRIBUTING.md") {
                assert!(!text.contains(word), "{} contains {word:?}", path.display());
            }
        }
    }
}

/// Cargo.toml has the version; other files are compared where their contents are tested.
#[test]
fn what_names_a_version_or_its_year_names_this_one() {
    let read = |name: &str| fs::read_to_string(root().join(name)).unwrap();
    let places = [
        ("deploy/conda/recipe.yaml", "\n  version: \""),
        ("deploy/docker/Dockerfile", "osteon:"),
        ("deploy/kubernetes/osteon/Chart.yaml", "\nversion: "),
        ("docs/deploy.md", "osteon:"),
        ("docs/deploy.md", "version       "),
        ("docs/deploy.md", "osteon_"),
    ];
    for (name, before) in places {
        let text = read(name);
        let starts = text.split(before).skip(1);
        let named = starts
            .map(|rest| rest.split(|c: char| !c.is_ascii_digit() && c != '.').next().unwrap())
            .filter(|version| !version.is_empty());
        let named: BTreeSet<_> = named.collect();
        assert_eq!(named, BTreeSet::from([env!("CARGO_PKG_VERSION")]), "{name}: {before}");
    }
    let bibliography = read("src/commands/cite/references.bib");
    let (_, rest) = bibliography.split_once("@misc{osteon,").unwrap();
    let (_, year) = rest.split_once("year = {").unwrap();
    let year = &year[..4];
    assert!(read("Cargo.toml").contains(&format!("copyright = \"{year},")), "{year}");
    for (name, before) in
        [("CITATION.cff", "date-released: "), ("codemeta.json", "datePublished\": ")]
    {
        let text = read(name);
        // Only a release has a date.
        if let Some((_, date)) = text.split_once(before) {
            assert!(date.trim_start_matches('"').starts_with(year), "{name}: {date}");
        }
    }
}

#[test]
fn links_in_the_documentation_lead_somewhere() {
    let mut count = 0;
    for path in files(&[".md"]) {
        let text = fs::read_to_string(&path).unwrap();
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if target.starts_with("http") || target.starts_with('#') {
                continue;
            }
            count += 1;
            let (file, heading) = target.split_once('#').unwrap_or((target, ""));
            let linked = path.parent().unwrap().join(file);
            assert!(linked.exists(), "{}: {target} does not exist", path.display());
            if !heading.is_empty() {
                let text = fs::read_to_string(&linked).unwrap();
                let mut headings = text.lines().filter(|line| line.starts_with('#'));
                let found = headings.any(|line| anchor(line.trim_start_matches('#')) == heading);
                assert!(found, "{}: {target} is no heading", path.display());
            }
        }
    }
    assert!(count > 5, "only {count} links were found");
}

/// Returns the anchor of a heading: lower case, with words joined by hyphens.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().to_lowercase();
    kept.chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}
