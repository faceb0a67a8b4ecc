//! What xtask itself prints.

use std::io::{self, Write as _};
use std::process::Command;

use anyhow::{Context as _, Result};

/// Prints a command before it is run.
pub(crate) fn announce(command: &Command) {
    let words: Vec<_> = command.get_args().map(|word| word.to_string_lossy()).collect();
    eprintln!("+ {} {}", command.get_program().to_string_lossy(), words.join(" "));
}

/// Prints a line on stdout.
pub(crate) fn say(text: &str) -> Result<()> {
    writeln!(io::stdout(), "{text}").context("cannot write to stdout")
}
