//! `doctor`, `completions` and `man`, as a user runs them.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;

use serde_json::Value;
use support::{Coordinator, Finished, Scratch, run, run_with, text};

/// Returns the finding of one check.
fn finding<'a>(found: &'a Value, check: &str) -> &'a Value {
    let checks = found["checks"].as_array().unwrap();
    checks.iter().find(|finding| finding["check"] == check).unwrap_or(&Value::Null)
}

fn json(finished: &Finished) -> Value {
    serde_json::from_str(&finished.stdout).unwrap()
}

#[test]
fn a_machine_that_passes_its_tests_can_compute() {
    let scratch = Scratch::new();
    let store = scratch.path("store");
    let examined = run(&["doctor", "--store", text(&store), "--json"]);
    let found = json(&examined);
    for check in ["version", "numerics", "clock"] {
        assert_eq!(finding(&found, check)["status"], "ok", "{found}");
        assert_eq!(finding(&found, check)["advice"], Value::Null, "{found}");
    }
    for check in ["cores", "instructions", "open files", "temporary", "store"] {
        assert!(finding(&found, check)["found"].is_string(), "{check}: {found}");
    }
    assert!(finding(&found, "coordinator").is_null(), "{found}");
    assert!(!store.exists());
    // The exit code follows the worst of the findings.
    let expected = if found["status"] == "problem" { 1 } else { 0 };
    assert_eq!(examined.code, Some(expected), "{examined:?}");
    let lines = run(&["doctor", "--store", text(&store)]).stdout;
    assert!(lines.lines().all(|line| line.chars().count() <= 80), "{lines}");
    let passed = |line: &str| line.starts_with("ok ") && line.contains(" numerics ");
    assert!(lines.lines().any(passed), "{lines}");
}

#[test]
fn what_is_wrong_is_said_with_advice() {
    // The slowest instruction set, where there is a faster one.
    let slow = run_with(("OSTEON_INSTRUCTION_SET", "baseline"), &["doctor", "--json"]);
    let found = json(&slow);
    assert_eq!(finding(&found, "instructions")["status"], "warning", "{found}");
    assert_eq!(finding(&found, "numerics")["status"], "ok", "{found}");
    // Nobody, not even root, can create files there.
    let nowhere = run(&["doctor", "--store", "/proc/osteon", "--json"]);
    assert_eq!(nowhere.code, Some(1), "{nowhere:?}");
    let store = json(&nowhere);
    let store = finding(&store, "store");
    assert_eq!(store["status"], "problem");
    assert!(store["advice"].as_str().unwrap().contains("right to write"), "{store}");
    let unusable = run_with(("TMPDIR", "/proc"), &["doctor", "--json"]);
    let found = json(&unusable);
    assert_eq!(finding(&found, "temporary")["status"], "problem", "{found}");
}

#[test]
fn a_coordinator_is_asked() {
    let scratch = Scratch::new();
    let coordinator = Coordinator::start(&scratch.path("store"));
    let found = json(&run(&["doctor", "--coordinator", &coordinator.url, "--json"]));
    assert_ne!(finding(&found, "coordinator")["status"], "problem", "{found}");
    drop(coordinator);
    let gone = format!("unix:{}", text(&scratch.path("gone")));
    let examined = run_with(("OSTEON_COORDINATOR", &gone), &["doctor", "--json"]);
    assert_eq!(examined.code, Some(1), "{examined:?}");
    assert_eq!(finding(&json(&examined), "coordinator")["status"], "problem", "{examined:?}");
}

#[test]
fn shells_and_man_know_the_commands() {
    let scratch = Scratch::new();
    let script = run(&["completions", "bash"]).succeeded().to_owned();
    let file = scratch.write("osteon.bash", &script);
    // As a user would have it: `osteon ident<Tab>`, and `osteon identify --se<Tab>`.
    let complete = format!(
        "source {}\n\
         COMP_WORDS=(osteon ident) COMP_CWORD=1\n_osteon osteon ident osteon\necho \"${{COMPREPLY[@]}}\"\n\
         COMP_WORDS=(osteon identify --se) COMP_CWORD=2\n_osteon osteon --se identify\necho \"${{COMPREPLY[@]}}\"\n",
        text(&file)
    );
    let bash =
        std::process::Command::new("bash").args(["--norc", "-c", &complete]).output().unwrap();
    let completed = String::from_utf8_lossy(&bash.stdout).into_owned();
    assert_eq!(completed.lines().collect::<Vec<_>>(), ["identify", "--set --seed"], "{bash:?}");
    for shell in ["zsh", "fish", "elvish", "powershell"] {
        assert!(run(&["completions", shell]).succeeded().contains("identify"), "{shell}");
    }
    let unknown = run(&["completions", "cmd"]);
    assert_eq!(unknown.code, Some(2));
    assert!(unknown.stderr.contains("bash"), "{unknown:?}");
    let pages = scratch.path("man");
    run(&["man", text(&pages)]).succeeded();
    let page = fs::read_to_string(pages.join("osteon-identify.1")).unwrap();
    assert!(page.contains("job file"), "{page}");
    let refused = run(&["man", "/proc/man"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
}
