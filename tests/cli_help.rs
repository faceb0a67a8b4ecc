//! Every help text, as a user sees it.

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::process::Command;

use osteon_common::version::{NUMERICS_REVISION, RESULT_SCHEMA};
use support::run;

#[test]
fn help_of_every_command() {
    let mut text = run(&["--help"]).succeeded().to_owned();
    for command in [
        "identify",
        "propagate",
        "simulate",
        "draw",
        "coordinator",
        "worker",
        "submit",
        "jobs",
        "watch",
        "cancel",
        "fetch",
        "certs",
        "token",
        "study",
        "study failures",
        "study accuracy",
        "study methods",
        "study refinement",
        "study setups",
        "study continuity",
        "study variance",
        "study digest",
        "study convergence",
    ] {
        text.push_str(&format!("\n==== osteon {command}\n"));
        let words: Vec<_> = command.split(' ').chain(["--help"]).collect();
        text.push_str(run(&words).succeeded());
    }
    for line in text.lines().filter(|line| !line.starts_with("Usage: ")) {
        assert!(line.chars().count() <= 80, "{line}");
    }
    insta::assert_snapshot!(text);
}

#[test]
fn the_version_names_the_commit_that_is_checked_out() {
    let git = |arguments: &[&str]| {
        let output = Command::new("git")
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .args(arguments)
            .output()
            .ok()
            .filter(|output| output.status.success())?;
        Some(String::from_utf8(output.stdout).unwrap().trim().to_owned())
    };
    let given = option_env!("OSTEON_COMMIT").map(str::to_owned);
    let commit = given.or_else(|| git(&["rev-parse", "HEAD"]));
    let commit = commit.unwrap_or_else(|| "unknown".to_owned());
    let printed = run(&["--version"]);
    let rest = printed
        .succeeded()
        .strip_prefix(&format!("osteon {} (commit {commit}", env!("CARGO_PKG_VERSION")));
    // What the tree says now it said when the program was built: cargo has looked at it.
    let rest = rest.unwrap_or_else(|| panic!("{printed:?} at {commit}"));
    let rest = rest.strip_prefix("-dirty").unwrap_or(rest);
    assert_eq!(rest, format!(", numerics {NUMERICS_REVISION}, result schema {RESULT_SCHEMA})\n"));
}
