//! Every help text, as a user sees it.

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use support::run;

/// The subcommands that a help text lists.
fn subcommands(help: &str) -> Vec<&str> {
    let listed = help.split("\nCommands:\n").nth(1).unwrap_or_default();
    let entries = listed.lines().take_while(|line| !line.is_empty());
    // What is wrapped is indented further.
    let entries = entries.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names = entries.filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").collect()
}

/// The help of a command and of all below it.
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
fn help_of_every_command() {
    let (mut text, mut count) = (String::new(), 0);
    help(&[], &mut text, &mut count);
    assert!(count > 30, "only {count} commands were found");
    insta::assert_snapshot!(text);
}

#[test]
fn the_version_is_the_packages() {
    let expected = format!("osteon {}\n", env!("CARGO_PKG_VERSION"));
    assert_eq!(run(&["--version"]).succeeded(), expected);
}
