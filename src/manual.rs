//! Manual pages and completions, made from the definition of the command line.

use std::fs;
use std::io::{self, Write as _};
use std::path::Path;

use clap::CommandFactory as _;
use clap_complete::Shell;
use clap_mangen::Man;
use osteon_common::version::VERSION;

use crate::arguments::Arguments;

/// Name of the program.
const NAME: &str = "osteon";
/// What the first page says beside its commands; the definition does not know it.
const FURTHER: &str = include_str!("manual/further.1");

/// Returns the definition; its version without the commit, so that pages of one version are the same.
fn definition() -> clap::Command {
    Arguments::command().version(VERSION)
}

/// Returns the script by which a shell completes commands and options.
pub(crate) fn completions(shell: Shell) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut definition(), NAME, &mut script);
    String::from_utf8_lossy(&script).into_owned()
}

/// Writes a page for the program and for each of its commands.
///
/// # Errors
/// If the directory cannot be written.
pub(crate) fn write(directory: &Path) -> io::Result<()> {
    fs::create_dir_all(directory)?;
    clap_mangen::generate_to(definition(), directory)?;
    let mut page = Vec::new();
    Man::new(definition()).render(&mut page)?;
    page.write_all(FURTHER.as_bytes())?;
    fs::write(directory.join(format!("{NAME}.1")), page)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the names of the pages of the commands below this one, which is called `name`.
    fn names(name: &str, command: &clap::Command) -> Vec<String> {
        let commands = command.get_subcommands().filter(|command| !command.is_hide_set());
        let named = commands.map(|command| (format!("{name}-{}", command.get_name()), command));
        named.flat_map(|(name, command)| [names(&name, command), vec![name]].concat()).collect()
    }

    #[test]
    fn every_command_has_a_page_and_is_completed() {
        let directory = tempfile::tempdir().unwrap();
        write(directory.path()).unwrap();
        let read = |name: &str| fs::read_to_string(directory.path().join(name)).unwrap();
        let first = read("osteon.1");
        assert!(first.contains("EXIT STATUS") && first.contains("OSTEON_COORDINATOR"), "{first}");
        assert!(!first.contains("commit"), "{first}");
        let scripts = [Shell::Bash, Shell::Zsh, Shell::Fish].map(completions);
        let definition = definition();
        let names = names("osteon", &definition);
        for name in &names {
            assert!(read(&format!("{name}.1")).contains("SYNOPSIS"), "{name}");
            let word = name.rsplit('-').next().unwrap();
            assert!(scripts.iter().all(|script| script.contains(word)), "{name}");
        }
        assert!(names.iter().any(|name| name == "osteon-worker-list"), "{names:?}");
        assert!(names.len() > 30, "{names:?}");
        assert!(read("osteon-identify.1").contains("\\-\\-set"));
        assert!(!directory.path().join("osteon-man.1").exists());
    }
}
