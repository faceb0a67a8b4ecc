//! `demo`: an identification from velocities that the program brings along.

use std::ffi::OsString;
use std::path::Path;

use clap::Parser as _;

use super::run;
use crate::arguments::{Arguments, Command, DemoArguments};
use crate::exit_status::CommandFailure;
use crate::new_files::{self, NewFile};
use crate::prepared_command::PreparedCommand;
use crate::process_context::ProcessContext;

/// The files, in a directory as the example has.
const FILES: [(&str, &str); 2] = [
    ("porosity.toml", include_str!("../../examples/porosity.toml")),
    ("data/velocities.csv", include_str!("../../examples/data/velocities.csv")),
];

/// Writes the files, and prepares their identification. What an earlier demonstration left is used.
pub(super) fn prepare(
    arguments: &DemoArguments,
    context: &ProcessContext,
) -> Result<PreparedCommand, CommandFailure> {
    let directory = arguments.directory.as_path();
    new_files::directory(&directory.join("data"))?;
    for (name, text) in FILES {
        let path = directory.join(name);
        if !path.exists() {
            let content = text.as_bytes().to_vec().into();
            new_files::create(&[NewFile { path, content, secret: false }])?;
        }
    }
    let parsed = Arguments::try_parse_from(command_line(directory));
    match parsed.map_err(CommandFailure::failed)?.command {
        Command::Identify(arguments) => run::prepare_identification(arguments, context),
        other => Err(CommandFailure::failed(anyhow::anyhow!("{other:?} is no identification"))),
    }
}

/// Returns the command that a user would type.
fn command_line(directory: &Path) -> Vec<OsString> {
    let mut words: Vec<OsString> = ["osteon", "identify"].map(OsString::from).to_vec();
    words.push(directory.join(FILES[0].0).into());
    words.extend([OsString::from("--out"), directory.join("results").into()]);
    words.extend(cfg!(feature = "report").then(|| OsString::from("--report")));
    words
}
