//! Regenerates the tables of docs/validation.md.
//!
//! A table is placed between two comments, of which the first contains the arguments of
//! `osteon-study` that produce it:
//!
//! ```text
//! <!-- table: failures --realizations 100000 -->
//! …
//! <!-- end -->
//! ```

use std::fs;

use anyhow::{Context as _, Result, bail};

use crate::places::root;
use crate::process::{cargo_command, output};

const PAGE: &str = "docs/validation.md";
const START: &str = "<!-- table: ";
const START_END: &str = " -->\n";
const END: &str = "<!-- end -->";

/// Replaces the tables made by the studies `named`, or all if none is named. The page is written
/// after each table, so that nothing is lost if a long one is interrupted.
pub(crate) fn rewrite(named: &[String]) -> Result<()> {
    let path = root().join(PAGE);
    let read = || fs::read_to_string(&path).with_context(|| format!("cannot read {PAGE}"));
    let commands = commands(&read()?)?;
    if let Some(name) = named.iter().find(|name| !commands.iter().any(|it| has_word(it, name))) {
        bail!("{PAGE} has no table of {name:?}; it has:\n  {}", commands.join("\n  "));
    }
    let is_named = |command: &&String| named.iter().any(|name| has_word(command, name));
    for command in commands.iter().filter(|command| named.is_empty() || is_named(command)) {
        let mut run =
            cargo_command(&["run", "--quiet", "--release", "--package", "osteon-study", "--"]);
        run.args(command.split(' '));
        let table = output(&mut run)?;
        fs::write(&path, replace_table(&read()?, command, &table)?)
            .with_context(|| format!("cannot write {PAGE}"))?;
    }
    Ok(())
}

/// Returns whether a command has this word, as the name of its study is one.
fn has_word(command: &str, word: &str) -> bool {
    command.split(' ').any(|it| it == word)
}

/// Returns the commands of all tables of a page.
fn commands(page: &str) -> Result<Vec<String>> {
    let blocks = page.split(START).skip(1);
    blocks
        .map(|block| match (block.split_once(START_END), block.contains(END)) {
            (Some((command, _)), true) => Ok(command.to_owned()),
            _ => bail!("{PAGE}: a table has no {END:?}: {}", block.lines().next().unwrap_or("")),
        })
        .collect()
}

/// Returns the page with the table of `command` replaced.
fn replace_table(page: &str, command: &str, table: &str) -> Result<String> {
    let start = format!("{START}{command}{START_END}");
    let split = page.split_once(&start).and_then(|(before, rest)| {
        let (_, after) = rest.split_once(END)?;
        Some((before, after))
    });
    let Some((before, after)) = split else {
        bail!("{PAGE} lost its table of {command:?} while it was made");
    };
    Ok(format!("{before}{start}\n{}\n\n{END}{after}", table.trim_end()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "a\n<!-- table: x -->\nold\n<!-- end -->\nb\n\
                        <!-- table: y --seed 2 -->\n<!-- end -->\n";

    #[test]
    fn one_table_is_replaced_and_all_else_is_kept() {
        assert_eq!(commands(PAGE).unwrap(), ["x", "y --seed 2"]);
        let page = replace_table(PAGE, "x", "| new |\n").unwrap();
        let expected = "a\n<!-- table: x -->\n\n| new |\n\n<!-- end -->\nb\n\
                        <!-- table: y --seed 2 -->\n<!-- end -->\n";
        assert_eq!(page, expected);
        assert_eq!(replace_table(&page, "x", "| new |").unwrap(), expected);
        let page = replace_table(&page, "y --seed 2", "| y |").unwrap();
        assert!(page.contains("| new |") && page.ends_with("\n| y |\n\n<!-- end -->\n"));
        assert!(replace_table(PAGE, "z", "").is_err());
    }

    #[test]
    fn a_table_without_an_end_is_refused() {
        assert!(commands("<!-- table: x -->\n| a |\n").is_err());
    }

    #[test]
    fn the_page_names_the_command_of_each_of_its_tables() {
        let page = fs::read_to_string(root().join(super::PAGE)).unwrap();
        let commands = commands(&page).unwrap();
        assert!(commands.len() > 5, "{commands:?}");
        let is_made = |command: &String| page.contains(&format!("\n`osteon-study {command}"));
        assert!(commands.iter().all(is_made), "{commands:?}");
    }
}
