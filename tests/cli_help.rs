//! Every help text, as a user sees it.

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

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
fn the_version_is_the_packages() {
    let expected = format!("osteon {}\n", env!("CARGO_PKG_VERSION"));
    assert_eq!(run(&["--version"]).succeeded(), expected);
}
