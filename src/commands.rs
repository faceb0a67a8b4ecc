//! The commands: one file per command, or per family of commands.

mod certs;
mod check;
mod cite;
mod coordinator;
mod demo;
mod design;
mod doctor;
mod draw;
mod init;
mod jobs;
mod man;
mod materials;
mod modes;
mod observe;
mod operators;
mod pick;
mod run;
mod schema;
mod simulate;
mod synthesize;
mod token;
mod wave_image;
mod worker;

use crate::arguments::{Arguments, Command, Noun};
use crate::exit_status::CommandFailure;
use crate::prepared_command::PreparedCommand;
use crate::process_context::ProcessContext;

/// Prepares what the command line asks for.
///
/// # Errors
/// When the environment holds something that cannot be meant.
pub(crate) fn prepare(arguments: Arguments) -> Result<PreparedCommand, CommandFailure> {
    prepare_command(arguments.command, &ProcessContext::from_process()?)
}

fn prepare_command(
    command: Command,
    context: &ProcessContext,
) -> Result<PreparedCommand, CommandFailure> {
    let isa = ProcessContext::isa;
    Ok(match command {
        Command::Init(arguments) => PreparedCommand::brief(move || init::write(&arguments)),
        Command::Demo(arguments) => demo::prepare(&arguments, context)?,
        Command::Identify(arguments) => run::prepare_identification(arguments, context)?,
        Command::Propagate(arguments) => run::prepare_propagation(arguments, context)?,
        Command::Simulate(arguments) => PreparedCommand::interruptible(
            "no results were saved",
            simulate::simulate(arguments, isa()?),
        ),
        Command::Pick(arguments) => PreparedCommand::interruptible(
            "no file was written",
            pick::pick(arguments, isa()?, context.cores),
        ),
        Command::Modes(arguments) => PreparedCommand::interruptible(
            "no files were written",
            modes::modes(arguments, isa()?, context.cores),
        ),
        Command::Check(arguments) => {
            PreparedCommand::harmless(check::check(arguments, isa()?, context.cores))
        }
        Command::Draw(arguments) => PreparedCommand::brief(move || draw::draw(&arguments)),
        Command::Observe(arguments) => {
            let observed = observe::observe(arguments, isa()?, context.cores);
            PreparedCommand::interruptible("no file was written", observed)
        }
        Command::Synthesize(arguments) => {
            let written = synthesize::synthesize(arguments, isa()?, context.cores);
            PreparedCommand::interruptible("no file was written", written)
        }
        Command::Design(arguments) => {
            PreparedCommand::harmless(design::design(arguments, isa()?, context.cores))
        }
        Command::JobWing(command) => command.prepare(context)?,
        Command::Coordinator(Noun::Service(arguments)) => coordinator::prepare(arguments),
        Command::Coordinator(Noun::Command(command)) => {
            operators::prepare_for_coordinator(command, context)?
        }
        Command::Worker(Noun::Service(arguments)) => worker::prepare(arguments, context)?,
        Command::Worker(Noun::Command(command)) => operators::prepare_for_worker(command, context)?,
        Command::Job(command) => jobs::prepare(command, context)?,
        Command::ClusterWing(command) => command.prepare(context)?,
        Command::Certs(arguments) => PreparedCommand::brief(move || certs::make(&arguments)),
        Command::Token(arguments) => PreparedCommand::brief(move || token::make(&arguments)),
        Command::Materials(arguments) => {
            PreparedCommand::brief(move || materials::print(&arguments))
        }
        Command::Cite(arguments) => PreparedCommand::brief(move || cite::print(&arguments)),
        Command::Schema(arguments) => PreparedCommand::brief(move || schema::print(&arguments)),
        Command::Doctor(arguments) => doctor::prepare(arguments, context)?,
        Command::Completions(arguments) => {
            PreparedCommand::brief(move || man::completions(&arguments))
        }
        Command::Man(arguments) => PreparedCommand::brief(move || man::write(&arguments)),
        Command::Earlier(command) => prepare_command(command.into(), context)?,
    })
}
