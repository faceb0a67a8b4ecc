//! Words that run a service, and with a command after them ask a running one.

use clap::error::Error;
use clap::{ArgMatches, Args, Command, FromArgMatches, Subcommand};

/// The arguments of such a word: the options of its service, or a command. It is written by hand because a derived
/// `Args` cannot require options of the service that its commands do not have.
#[derive(Debug)]
pub(crate) enum Noun<S, C> {
    /// The options of the service.
    Service(S),
    /// A command.
    Command(C),
}

impl<S: Args, C: Subcommand> FromArgMatches for Noun<S, C> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        match matches.subcommand_name() {
            None => S::from_arg_matches(matches).map(Self::Service),
            Some(_) => C::from_arg_matches(matches).map(Self::Command),
        }
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl<S: Args, C: Subcommand> Args for Noun<S, C> {
    fn augment_args(word: Command) -> Command {
        C::augment_subcommands(S::augment_args(word))
            .args_conflicts_with_subcommands(true)
            .subcommand_negates_reqs(true)
    }

    fn augment_args_for_update(word: Command) -> Command {
        Self::augment_args(word)
    }
}
