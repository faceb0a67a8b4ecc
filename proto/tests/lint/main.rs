//! The rules of the public interface, held by reading the descriptor set of `osteon/v1/*.proto`:
//! those that the linter `buf` calls STANDARD and COMMENTS, and two of our own (every number has a
//! unit, every call says how it fails).

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

mod comments;
mod names;
mod structure;

use std::collections::BTreeSet;
use std::fmt;

use osteon_proto::v1::FILE_DESCRIPTOR_SET;
use prost::Message as _;
use prost_types::{FileDescriptorProto, FileDescriptorSet};

/// A breach of a rule.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Finding {
    /// Name of the rule.
    rule: &'static str,
    /// Full name of what breaks it.
    place: String,
    /// What it should be.
    message: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} breaks {}: {}", self.place, self.rule, self.message)
    }
}

/// What collects findings.
#[derive(Default)]
struct Findings(Vec<Finding>);

impl Findings {
    /// Records a breach unless `holds`.
    fn demand(&mut self, holds: bool, rule: &'static str, place: &str, message: &str) {
        if !holds {
            let (place, message) = (place.to_owned(), message.to_owned());
            self.0.push(Finding { rule, place, message });
        }
    }
}

/// What may break a rule, and why.
const EXCEPTIONS: [(&str, &str, &str); 2] = [
    ("SERVICE_SUFFIX", "osteon.v1.Jobs", "the name is on the wire and in programs of users"),
    ("SERVICE_SUFFIX", "osteon.v1.Workers", "named as the other one"),
];

/// Everything that breaks a rule in the files of our package.
fn lint(set: &FileDescriptorSet) -> Vec<Finding> {
    let mut findings = Findings::default();
    for file in set.file.iter().filter(|file| !file.name().starts_with("google/")) {
        structure::file(file, set, &mut findings);
        names::file(file, &mut findings);
        comments::file(file, &mut findings);
    }
    structure::calls(set, &mut findings);
    findings.0
}

fn full_name(file: &FileDescriptorProto, name: &str) -> String {
    format!("{}.{name}", file.package())
}

#[test]
fn the_interface_keeps_the_rules() {
    let set = FileDescriptorSet::decode(FILE_DESCRIPTOR_SET).unwrap();
    assert!(set.file.len() >= 3, "{} files", set.file.len());
    let mut unused: BTreeSet<_> =
        EXCEPTIONS.iter().map(|(rule, place, _)| (*rule, (*place).to_owned())).collect();
    let found: Vec<String> = lint(&set)
        .into_iter()
        .filter(|finding| !unused.remove(&(finding.rule, finding.place.clone())))
        .map(|finding| finding.to_string())
        .collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
    assert!(unused.is_empty(), "exceptions that nothing needs: {unused:?}");
}

/// A file that keeps every rule; the tests break one at a time.
const SOUND: &str = r#"
syntax = "proto3";
package a.v1;
// Does.
service DoService {
  // Does it. Errors: NOT_FOUND.
  rpc DoIt(DoItRequest) returns (DoItResponse);
}
// Asks.
message DoItRequest {
  // A speed, m/s.
  optional double top_speed = 1;
  // One of.
  oneof choice {
    // By name.
    string name = 2;
    // By number.
    uint32 number = 3;
  }
}
// Answers.
message DoItResponse {
  // How.
  DoState state = 1;
}
// States.
enum DoState {
  // None.
  DO_STATE_UNSPECIFIED = 0;
  // Over.
  DO_STATE_OVER = 1;
}
"#;

/// Compiles a file beside another one.
fn compiled(name: &str, source: &str) -> FileDescriptorSet {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(&path, source).unwrap();
    let other = "syntax = \"proto3\";\npackage a.v1;\n// Nothing.\nmessage Other {}\n";
    std::fs::write(path.with_file_name("other.proto"), other).unwrap();
    protox::compile([name], [directory.path()]).unwrap()
}

/// The names of the rules that a set breaks.
fn rules(set: &FileDescriptorSet) -> BTreeSet<&'static str> {
    lint(set).into_iter().map(|finding| finding.rule).collect()
}

#[test]
fn a_sound_file_has_no_findings() {
    assert_eq!(rules(&compiled("a/v1/do.proto", SOUND)), BTreeSet::new());
}

/// What is replaced in the sound file by what, and the rules that this breaks.
const BREACHES: [(&str, &str, &[&str]); 25] = [
    (
        "package a.v1;",
        "package a.v1; import public \"a/v1/other.proto\";",
        &["IMPORT_NO_PUBLIC", "IMPORT_USED"],
    ),
    ("package a.v1;", "package a.v1; import \"a/v1/other.proto\";", &["IMPORT_USED"]),
    ("package a.v1;", "package a.v2;", &["PACKAGE_DIRECTORY_MATCH"]),
    ("service DoService", "service Does", &["SERVICE_SUFFIX"]),
    ("service DoService", "service do_Service", &["SERVICE_PASCAL_CASE"]),
    ("rpc DoIt(", "rpc do_it(", &["RPC_PASCAL_CASE"]),
    ("rpc DoIt(", "rpc DoThat(", &["RPC_REQUEST_STANDARD_NAME", "RPC_RESPONSE_STANDARD_NAME"]),
    (
        "returns (DoItResponse)",
        "returns (DoItRequest)",
        &["RPC_RESPONSE_STANDARD_NAME", "RPC_REQUEST_RESPONSE_UNIQUE"],
    ),
    ("// Answers.\n", "// Odd.\nmessage Do_it {}\n// Answers.\n", &["MESSAGE_PASCAL_CASE"]),
    ("top_speed", "topSpeed", &["FIELD_LOWER_SNAKE_CASE"]),
    ("oneof choice", "oneof Choice", &["ONEOF_LOWER_SNAKE_CASE"]),
    ("DoState", "Do_State", &["ENUM_PASCAL_CASE"]),
    ("DO_STATE_OVER", "DO_STATE_over", &["ENUM_VALUE_UPPER_SNAKE_CASE"]),
    ("DO_STATE_OVER", "OVER", &["ENUM_VALUE_PREFIX"]),
    ("DO_STATE_UNSPECIFIED", "DO_STATE_NONE", &["ENUM_ZERO_VALUE_SUFFIX"]),
    (
        "  // Over.\n",
        "  option allow_alias = true;\n  // Same.\n  DO_STATE_SAME = 1;\n  // Over.\n",
        &["ENUM_NO_ALLOW_ALIAS"],
    ),
    ("// Does.\n", "", &["COMMENT_SERVICE"]),
    ("  // Does it. Errors: NOT_FOUND.\n", "", &["COMMENT_RPC", "RPC_ERRORS"]),
    (" Errors: NOT_FOUND.", "", &["RPC_ERRORS"]),
    ("// Asks.\n", "", &["COMMENT_MESSAGE"]),
    ("  // A speed, m/s.\n", "", &["COMMENT_FIELD", "FIELD_UNIT"]),
    (", m/s.", ".", &["FIELD_UNIT"]),
    ("  // One of.\n", "", &["COMMENT_ONEOF"]),
    ("// States.\n", "", &["COMMENT_ENUM"]),
    ("  // Over.\n", "", &["COMMENT_ENUM_VALUE"]),
];

#[test]
fn each_breach_is_found_and_nothing_else() {
    for (from, to, expected) in BREACHES {
        assert!(SOUND.contains(from), "{from}");
        let set = compiled("a/v1/do.proto", &SOUND.replace(from, to));
        assert_eq!(rules(&set), expected.iter().copied().collect(), "{from} -> {to}");
    }
    for (name, package, expected) in [
        ("a/v1/DoIt.proto", "a.v1", "FILE_LOWER_SNAKE_CASE"),
        ("a/do.proto", "a", "PACKAGE_VERSION_SUFFIX"),
        ("A/v1/do.proto", "A.v1", "PACKAGE_LOWER_SNAKE_CASE"),
    ] {
        let source = SOUND.replace("package a.v1;", &format!("package {package};"));
        assert_eq!(rules(&compiled(name, &source)), BTreeSet::from([expected]), "{name}");
    }
    // What the compiler itself refuses in proto3.
    let mut set = compiled("a/v1/do.proto", SOUND);
    set.file[0].enum_type[0].value.reverse();
    assert_eq!(rules(&set), BTreeSet::from(["ENUM_FIRST_VALUE_ZERO"]));
    let mut set = compiled("a/v1/do.proto", SOUND);
    set.file[0].syntax = None;
    assert_eq!(rules(&set), BTreeSet::from(["SYNTAX_SPECIFIED"]));
}
