//! `token`: creates a token for a client, and its line for the coordinator's list.

use anyhow::anyhow;
use osteon_coordinator::access::tokens::{self, Role};
use osteon_transport::token::Token;
use zeroize::Zeroizing;

use crate::arguments::TokenArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::new_files::{self, NewFile};
use crate::output;
use crate::prepared_command::Ended;
use crate::resolved::OutputFormat;

/// Writes the token to its file, and its line to the coordinator's list or to stdout.
pub(super) fn make(arguments: &TokenArguments) -> Ended {
    let TokenArguments { name, role, out, tokens: list } = arguments;
    let role = Role::named(role).ok_or_else(|| {
        CommandFailure::bad_input(anyhow!(
            "`{role}` is not a role; allowed are read, submit, admin"
        ))
    })?;
    if !tokens::is_name(name) {
        return Err(CommandFailure::bad_input(anyhow!(
            "`{name}` cannot be a token's name; allowed are 1 to 256 letters, digits and . _ - @, \
             without osteon_ and without 32 hexadecimal digits in a row"
        )));
    }
    let token = Token::generate().map_err(CommandFailure::failed)?;
    let content = Zeroizing::new(format!("{}\n", token.reveal()).into_bytes());
    new_files::create(&[NewFile { path: out.clone(), content, secret: true }])?;
    let line = tokens::line(name, role, &token.hash());
    match list {
        Some(list) => {
            if let Err(failure) = new_files::append(list, &line) {
                // A token without an entry in the list is useless.
                drop(std::fs::remove_file(out));
                return Err(failure);
            }
        }
        None => output::stdout(OutputFormat::Text)
            .verbatim(&format!("{line}\n"))
            .map_err(stdout_failure)?,
    }
    Ok(ExitStatus::Done)
}
