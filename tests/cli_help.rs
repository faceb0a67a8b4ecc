//! The help texts of all commands, and the version line.

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::path::Path;
use std::process::Command;
use std::{env, fs};

use osteon_common::version::{NUMERICS_REVISION, RESULT_SCHEMA};
use support::run;

/// Returns the subcommands that a help text lists.
fn subcommands(help: &str) -> Vec<&str> {
    let listed = help.split("\nCommands:\n").nth(1).unwrap_or_default();
    let entries = listed.lines().take_while(|line| !line.is_empty());
    // Continuation lines are indented further.
    let entries = entries.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names = entries.filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").collect()
}

/// Appends the help of a command and of all its subcommands.
fn help(words: &[&str], text: &mut String, count: &mut usize) {
    let own = run(&[words, &["--help"]].concat()).succeeded().to_owned();
    if !words.is_empty() {
        text.push_str(&format!("\n==== osteon {}\n", words.join(" ")));
    }
    text.push_str(&own);
    *count += 1;
    for name in subcommands(&own) {
        help(&[words, &[name]].concat(), text, count);
    }
}

#[test]
fn help_fits_a_terminal() {
    let (mut text, mut count) = (String::new(), 0);
    help(&[], &mut text, &mut count);
    assert!(count > 15, "only {count} commands were found");
    for line in text.lines().filter(|line| !line.starts_with("Usage: ")) {
        assert!(line.chars().count() <= 80, "{line}");
    }
}

/// What docs/cli.md says before the commands.
const PAGE_HEAD: &str = "\
<!-- Written by `cargo xtask generate reference`; do not edit. -->

# Command line

Each command prints this with `--help`. Results go to stdout, everything else to stderr. Exit codes: 0 if the run has
ended with a result, 1 if it failed or was cancelled, 2 on bad usage or bad input, 130 or 143 after Ctrl-C or SIGTERM.
";

/// What was written for an earlier version goes on.
#[test]
fn earlier_names_of_commands_say_the_new_ones() {
    for (earlier, noun, name) in [
        ("submit", "job", "submit"),
        ("jobs", "job", "list"),
        ("watch", "job", "watch"),
        ("explain", "job", "explain"),
        ("cancel", "job", "cancel"),
        ("fetch", "job", "fetch"),
        ("recheck", "job", "recheck"),
        ("workers", "worker", "list"),
        ("health", "coordinator", "health"),
        ("backup", "coordinator", "backup"),
    ] {
        let help = run(&[earlier, "-h"]).succeeded().to_owned();
        assert!(help.starts_with(&format!("Same as `osteon {noun} {name}`")), "{help}");
        let options = |help: &str| {
            let options = help.split_once("\nOptions:\n").unwrap().1;
            options.split_once("  -h, --help").unwrap().0.to_owned()
        };
        let new = run(&[noun, name, "-h"]).succeeded().to_owned();
        assert_eq!(options(&help), options(&new), "{earlier}");
    }
}

#[test]
fn the_page_of_commands_is_that_of_the_program() {
    let (mut text, mut count) = (String::new(), 0);
    help(&[], &mut text, &mut count);
    let mut page = format!("{PAGE_HEAD}\n## `osteon`\n\n```text\n");
    for line in text.lines() {
        match line.strip_prefix("==== ") {
            Some(command) => {
                page.truncate(page.trim_end().len());
                page += &format!("\n```\n\n## `{command}`\n\n```text\n");
            }
            None => page += &format!("{line}\n"),
        }
    }
    page.truncate(page.trim_end().len());
    page += "\n```\n";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/cli.md");
    if env::var_os("OSTEON_WRITE_DOCS").is_some() {
        fs::write(&path, &page).unwrap();
    }
    let committed = fs::read_to_string(&path).unwrap_or_default();
    assert!(committed == page, "docs/cli.md is stale; `cargo xtask generate reference` writes it");
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
    // The commit is current, because cargo rebuilds the program when the tree changes.
    let rest = rest.unwrap_or_else(|| panic!("{printed:?} at {commit}"));
    let rest = rest.strip_prefix("-dirty").unwrap_or(rest);
    assert_eq!(rest, format!(", numerics {NUMERICS_REVISION}, result schema {RESULT_SCHEMA})\n"));
}
