//! Checks in the sources that the files of a crate do not refer to each other in a circle, so that
//! each can be read after those that it builds upon.
//!
//! An arrow leads from a file to the file that defines an item which it names by a path:
//! `crate::…`, `super::…`, `self::…`, or the name of a module that it declares. `mod x;` alone is
//! not an arrow. `pub use x::Y` is a signpost: it is not an arrow of its own file, and a path
//! through it leads to the file that it points to. Code that is compiled only for tests is ignored.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Directories whose files must not form a circle, each the `src` of a crate.
const DIRECTORIES: [&str; 19] = [
    "client/src",
    "common/src",
    "coordinator/src",
    "files/src",
    "fuzz/src",
    "http/src",
    "local/src",
    "proto/src",
    "python/src",
    "report/src",
    "search/src",
    "signals/src",
    "slurm/src",
    "solver/src",
    "study/src",
    "transport/src",
    "umbridge/src",
    "worker/src",
    "xtask/src",
];
/// Maximum number of re-exports that are followed one after another.
const SIGNPOSTS_MAX: usize = 8;

/// A path of names, from the root of the crate.
type Names = Vec<String>;

/// The source of one module that has a file of its own.
struct Module {
    file: String,
    /// Paths named in its code, as far as they may lead to another file.
    named: Vec<Names>,
    /// Its re-exports, by name (`*` for all), with their origin.
    exported: Vec<(String, Names)>,
}

#[test]
fn no_files_of_a_crate_form_a_circle() {
    for directory in DIRECTORIES {
        let sources = sources(directory);
        assert!(sources.len() > 2, "only {} files were found in {directory}", sources.len());
        for sources in by_root(&sources) {
            if let Some(circle) = circle(arrows(&sources)) {
                panic!("{directory} has a circle: {}", circle.join(" -> "));
            }
        }
    }
}

#[test]
fn layers_of_the_reactor_call_downwards_only() {
    let layers = ["core/reactor/dispatch", "core/reactor/lifecycle", "core/reactor/integrity"];
    let layer = |file: &str| layers.iter().position(|layer| file.starts_with(layer));
    let mut count = 0;
    for (from, targets) in arrows(&sources("coordinator/src")) {
        for to in targets {
            if let Some((from_layer, to_layer)) = layer(&from).zip(layer(&to)) {
                count += 1;
                assert!(from_layer >= to_layer, "{from} calls {to} in a layer above");
            }
        }
    }
    assert!(count > 20, "only {count} calls were found");
}

/// Returns the files of a crate, by their paths below a directory.
fn sources(directory: &str) -> BTreeMap<String, String> {
    let mut sources = BTreeMap::new();
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(directory), "", &mut sources);
    sources
}

/// Reads the files below a folder, by their paths.
fn read(folder: &Path, prefix: &str, sources: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = format!("{prefix}{}", path.file_name().unwrap().to_str().unwrap());
        if path.is_dir() {
            read(&path, &format!("{name}/"), sources);
        } else if name.ends_with(".rs") {
            sources.insert(name, fs::read_to_string(&path).unwrap());
        }
    }
}

/// Returns the files of a library and of the program beside it, if there are both: each has a root,
/// and the modules that the root declares.
fn by_root(sources: &BTreeMap<String, String>) -> Vec<BTreeMap<String, String>> {
    let of_root = |root: &&str| {
        let code = words(sources.get(*root)?);
        let declared = code.windows(3).filter(|words| words[0] == "mod" && words[2] == ";");
        let declared: BTreeSet<&str> = declared.map(|words| words[1].as_str()).collect();
        let belongs = |file: &str| {
            let first = file.split('/').next().unwrap_or(file);
            file == *root || declared.contains(first.trim_end_matches(".rs"))
        };
        let own = sources.iter().filter(|(file, _)| belongs(file));
        Some(own.map(|(file, text)| (file.clone(), text.clone())).collect())
    };
    ["lib.rs", "main.rs"].iter().filter_map(of_root).collect()
}

/// Returns the files to which each file refers.
fn arrows(sources: &BTreeMap<String, String>) -> BTreeMap<String, BTreeSet<String>> {
    let modules = modules(sources);
    let targets = |module: &Module| {
        let targets = module.named.iter().filter_map(|path| target(&modules, path, SIGNPOSTS_MAX));
        targets.filter(|file| *file != module.file).map(str::to_owned).collect()
    };
    modules.values().map(|module| (module.file.clone(), targets(module))).collect()
}

/// Returns files that form a circle, with the first repeated at the end; `None` if there is none.
fn circle(mut arrows: BTreeMap<String, BTreeSet<String>>) -> Option<Vec<String>> {
    // A file without arrows is in no circle, nor is one whose arrows lead only to such files.
    loop {
        let left: BTreeSet<String> = arrows.keys().cloned().collect();
        arrows.retain(|_, to| {
            to.retain(|file| left.contains(file));
            !to.is_empty()
        });
        if arrows.len() == left.len() {
            break;
        }
    }
    // Each remaining file leads to another one of them, so following the arrows returns.
    let mut way: Vec<String> = arrows.keys().take(1).cloned().collect();
    while let Some(next) = way.last().and_then(|last| arrows[last].first()) {
        let seen = way.iter().position(|file| file == next);
        way.push(next.clone());
        if let Some(at) = seen {
            return Some(way.split_off(at));
        }
    }
    None
}

/// Returns the file that defines the target of a path; `None` if that is not a file of the crate.
fn target<'a>(
    modules: &'a BTreeMap<Names, Module>,
    path: &[String],
    most: usize,
) -> Option<&'a str> {
    let depth = (0..=path.len()).rev().find(|depth| modules.contains_key(&path[..*depth]))?;
    let module = &modules[&path[..depth]];
    let signpost = path.get(depth).and_then(|name| {
        module.exported.iter().find(|(exported, _)| exported == name || exported == "*")
    });
    match signpost {
        Some((name, to)) if most > 0 => {
            let mut to = to.clone();
            to.extend(path[depth + usize::from(name != "*")..].iter().cloned());
            target(modules, &to, most - 1)
        }
        _ => Some(&module.file),
    }
}

/// Returns the modules of a crate that are not only for tests, by their paths.
fn modules(sources: &BTreeMap<String, String>) -> BTreeMap<Names, Module> {
    let place = |file: &str| -> Names {
        let stem = file.trim_end_matches(".rs");
        let names = stem.split('/').filter(|name| !["lib", "main", "mod"].contains(name));
        names.map(str::to_owned).collect()
    };
    let code: BTreeMap<Names, (&String, Code)> =
        sources.iter().map(|(file, text)| (place(file), (file, Code::new(text)))).collect();
    let for_tests: BTreeSet<Names> = code
        .iter()
        .flat_map(|(place, (_, code))| code.test_modules.iter().map(|name| child(place, name)))
        .collect();
    let is_tested = |place: &Names| (0..=place.len()).any(|i| for_tests.contains(&place[..i]));
    let children = |place: &Names| -> BTreeSet<&str> {
        let below = code.keys().filter(|it| it.len() == place.len() + 1 && it.starts_with(place));
        below.map(|it| it[it.len() - 1].as_str()).collect()
    };
    let module = |(place, (file, code)): (&Names, &(&String, Code))| {
        let (exported, named) = code.paths(place, &children(place));
        (place.clone(), Module { file: (*file).clone(), named, exported })
    };
    code.iter().filter(|(place, _)| !is_tested(place)).map(module).collect()
}

fn child(place: &[String], name: &str) -> Names {
    place.iter().cloned().chain([name.to_owned()]).collect()
}

/// Code as words: names, `::`, and single characters. Comments, string literals and test code are
/// left out.
struct Code {
    words: Vec<String>,
    /// Modules in files of their own that are only for tests.
    test_modules: Vec<String>,
}

impl Code {
    fn new(text: &str) -> Self {
        let all = words(text);
        let (mut kept, mut test_modules) = (Vec::new(), Vec::new());
        let mut at = 0;
        while at < all.len() {
            if all[at..].starts_with(&["#", "[", "cfg", "(", "test", ")", "]"].map(str::to_owned)) {
                let end = at + item_length(&all[at..]);
                if let [.., word, name, last] = &all[at..end]
                    && (word, last) == (&"mod".to_owned(), &";".to_owned())
                {
                    test_modules.push(name.clone());
                }
                at = end;
            } else {
                kept.push(all[at].clone());
                at += 1;
            }
        }
        Self { words: kept, test_modules }
    }

    /// Returns the re-exports of a module, and the other paths that it names.
    fn paths(
        &self,
        place: &[String],
        children: &BTreeSet<&str>,
    ) -> (Vec<(String, Names)>, Vec<Names>) {
        let (mut exported, mut named) = (Vec::new(), Vec::new());
        let mut at = 0;
        let mut public = false;
        while at < self.words.len() {
            let word = self.words[at].as_str();
            let begins = at == 0 || !["::", "."].contains(&self.words[at - 1].as_str());
            let leads = self.words.get(at + 1).is_some_and(|next| next == "::");
            public = match word {
                "use" => at > 0 && ["pub", ")"].contains(&self.words[at - 1].as_str()),
                ";" => false,
                _ => public,
            };
            let known = ["crate", "super", "self"].contains(&word) || children.contains(word);
            // `pub(in crate::…)` says who may name an item, and names none itself.
            let grants = self.words[..at].ends_with(&["pub", "(", "in"].map(str::to_owned));
            if !(begins && leads && known) || grants {
                at += 1;
                continue;
            }
            let mut leaves = Vec::new();
            at = self.leaves(at, &start(place, word), &mut leaves);
            if public {
                exported.extend(leaves);
            } else {
                named.extend(leaves.into_iter().map(|(_, path)| path));
            }
        }
        (exported, named)
    }

    /// Collects the targets of a path or a tree of `use` that begins at a word, with their names;
    /// returns the index of the word after it.
    fn leaves(&self, at: usize, from: &[String], leaves: &mut Vec<(String, Names)>) -> usize {
        let mut path = from.to_vec();
        let mut at = at + 1;
        while self.words.get(at).is_some_and(|word| word == "::") {
            at += 1;
            match self.words.get(at).map(String::as_str) {
                Some("{") => {
                    at += 1;
                    while self.words.get(at).is_some_and(|word| word != "}") {
                        if self.words[at] == "," {
                            at += 1;
                        } else if self.words[at] == "self" {
                            leaves.push((path.last().cloned().unwrap_or_default(), path.clone()));
                            at += 1;
                        } else {
                            at = self.leaves(at, &child(&path, &self.words[at]), leaves);
                        }
                    }
                    return at + 1;
                }
                Some("super") => drop(path.pop()),
                Some("<") | None => break,
                Some(word) => path.push(word.to_owned()),
            }
            at += 1;
        }
        let mut name = path.last().cloned().unwrap_or_default();
        if name == "*" {
            path.pop();
        }
        if self.words.get(at).is_some_and(|word| word == "as") {
            name.clone_from(&self.words[at + 1]);
            at += 2;
        }
        leaves.push((name, path));
        at
    }
}

/// Returns the path that the first word of a path denotes in a module.
fn start(place: &[String], word: &str) -> Names {
    match word {
        "crate" => Names::new(),
        "self" => place.to_vec(),
        "super" => place[..place.len().saturating_sub(1)].to_vec(),
        name => child(place, name),
    }
}

/// Returns the number of words of an item: up to its `;` or the end of its block.
fn item_length(words: &[String]) -> usize {
    let mut depth = 0;
    for (at, word) in words.iter().enumerate() {
        match word.as_str() {
            "{" => depth += 1,
            "}" if depth == 1 => return at + 1,
            "}" => depth -= 1,
            ";" if depth == 0 => return at + 1,
            _ => {}
        }
    }
    words.len()
}

/// Returns the words of a Rust source text.
fn words(text: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if let Some(quoted) = quoted(rest) {
            quoted
        } else if first.is_alphanumeric() || first == '_' {
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            words.push(rest[..end].to_owned());
            end
        } else if rest.starts_with("::") {
            words.push("::".to_owned());
            2
        } else {
            if !first.is_whitespace() {
                words.push(first.to_string());
            }
            first.len_utf8()
        };
        rest = &rest[length..];
    }
    words
}

/// Returns the length of the string or character literal at the beginning, if there is one.
fn quoted(text: &str) -> Option<usize> {
    if let Some(raw) = text.strip_prefix('r') {
        let signs = raw.find(|c| c != '#').filter(|at| raw[*at..].starts_with('"'))?;
        let end = format!("\"{}", "#".repeat(signs));
        let from = 1 + signs + 1;
        return text[from..].find(&end).map(|at| from + at + end.len());
    }
    let sign = text.chars().next().filter(|sign| ['"', '\''].contains(sign))?;
    // A lifetime does not end with a quotation mark.
    let is_lifetime = sign == '\'' && !text[1..].starts_with('\\') && {
        let second = text.char_indices().nth(2).map(|(_, second)| second);
        second != Some('\'')
    };
    if is_lifetime {
        return Some(1);
    }
    let mut escaped = false;
    let end = text.char_indices().skip(1).find(|(_, c)| {
        let ends = *c == sign && !escaped;
        escaped = *c == '\\' && !escaped;
        ends
    });
    end.map(|(at, _)| at + 1)
}

/// Checks that these files form the expected circle.
fn check(files: &[(&str, &str)], expected: &[&str]) {
    let sources = files.iter().map(|(file, text)| ((*file).to_owned(), (*text).to_owned()));
    let roots = by_root(&sources.collect());
    let found = roots.iter().find_map(|sources| circle(arrows(sources))).unwrap_or_default();
    assert_eq!(found, expected, "{files:?}");
}

#[test]
fn a_planted_circle_is_found() {
    let lib = ("lib.rs", "mod a; mod b; mod c;");
    let circle = ["a.rs", "b.rs", "a.rs"];
    for (a, b) in [
        ("use crate::b::B;", "use crate::a::A;"),
        ("use super::b::{B, c};", "use crate::{c::C, a::{self}};"),
        ("fn f() { crate::b::f() }", "impl T for super::a::A {}"),
        ("use crate::b::*;", "type A = Vec<crate::a::A>;"),
    ] {
        check(&[lib, ("a.rs", a), ("b.rs", b), ("c.rs", "use crate::b::B;")], &circle);
    }
    // A circle of three, and one of a parent with its child.
    let three = [("a.rs", "use crate::c::C;"), ("b.rs", "use crate::a::A;")];
    let expected = ["a.rs", "c.rs", "b.rs", "a.rs"];
    check(&[lib, three[0], three[1], ("c.rs", "use crate::b::B;")], &expected);
    let parent = "mod child; struct P; fn f() { child::f() }";
    let expected = ["a.rs", "a/child.rs", "a.rs"];
    check(&[("lib.rs", "mod a;"), ("a.rs", parent), ("a/child.rs", "use super::P;")], &expected);
    // A circle of a program beside a library, which has none.
    let main = ("main.rs", "mod p; struct M; fn f() { p::f() }");
    let program = ("p.rs", "use crate::M;");
    check(&[lib, ("a.rs", ""), main, program], &["main.rs", "p.rs", "main.rs"]);
    // A circle by way of a signpost.
    let files = [
        ("lib.rs", "mod a; mod b;"),
        ("a.rs", "mod child; pub use child::C;"),
        ("a/child.rs", "use crate::b::B;"),
        ("b.rs", "use crate::a::C;"),
    ];
    check(&files, &["a/child.rs", "b.rs", "a/child.rs"]);
}

#[test]
fn what_is_no_circle_is_none() {
    let lib = ("lib.rs", "mod a; mod b; pub use a::A; pub use b::B;");
    let a = ("a.rs", "use crate::b::B;");
    for b in [
        "use other::a::A;",
        "//! As `crate::a::A`.\n// use crate::a::A;",
        "const A: &str = \"use crate::a::A;\"; const B: char = '\"'; fn f<'a>() { \"\\\"crate::a::A\" }",
        "#[cfg(test)]\nmod tests { use crate::a::A; }",
        "#[cfg(test)]\nuse crate::a::A;",
        "use self::b::B; fn f() { x.crate::a::A }",
        "pub(in crate::a) struct B;",
    ] {
        check(&[lib, a, ("b.rs", b)], &[]);
    }
    // A program that uses what the library beside it has at its root.
    let lib_with_type = ("lib.rs", "mod a; struct L;");
    let main = ("main.rs", "mod p; fn f() { a::f(); p::f() }");
    check(&[lib_with_type, ("a.rs", "use crate::L;"), main, ("p.rs", "")], &[]);
    // Files for tests only, and a parent that only re-exports items of its children.
    let tests = ("b/tests.rs", "use crate::a::A;");
    check(&[lib, a, ("b.rs", "#[cfg(test)]\nmod tests;"), tests], &[]);
    let child = ("b/child.rs", "use super::other::O;");
    let b = ("b.rs", "mod child; mod other; pub(crate) use self::child::C; pub use other::O;");
    check(&[lib, a, b, child, ("b/other.rs", "")], &[]);
}
