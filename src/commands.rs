//! The subcommands: one file per command, or per family of commands.

mod certs;
mod check;
mod coordinator;
mod doctor;
mod draw;
mod init;
mod jobs;
mod man;
mod materials;
mod observe;
mod operators;
mod run;
mod schema;
mod simulate;
mod token;
mod worker;

use crate::exit_status::{CommandFailure, ExitStatus};
use crate::resolved::Resolved;
use crate::signals::unless_interrupted;

/// Executes the command line.
///
/// # Errors
/// If the command fails, or was interrupted.
pub(crate) async fn run(resolved: Resolved) -> Result<ExitStatus, CommandFailure> {
    match left_by_interruption(&resolved) {
        Some(left) => unless_interrupted(perform(resolved), left).await,
        None => perform(resolved).await,
    }
}

/// Returns what is said of what an interrupted command leaves behind; `None` of commands that treat
/// interruptions themselves, or end at once.
fn left_by_interruption(resolved: &Resolved) -> Option<&'static str> {
    match resolved {
        Resolved::Run { .. }
        | Resolved::Draw(_)
        | Resolved::Coordinator(_)
        | Resolved::Worker { .. }
        | Resolved::Certs(_)
        | Resolved::Token(_)
        | Resolved::Init(_)
        | Resolved::Schema(_)
        | Resolved::Materials(_)
        | Resolved::Completions(_)
        | Resolved::Man(_) => None,
        Resolved::Check { .. }
        | Resolved::Doctor { .. }
        | Resolved::ListWorkers { .. }
        | Resolved::Health { .. } => Some("nothing was changed"),
        Resolved::Simulate { .. } => Some("no results were saved"),
        Resolved::Observe { .. } => Some("no file was written"),
        Resolved::Job { command, .. } => Some(jobs::left_by_interruption(command)),
        Resolved::Drain { .. } => {
            Some("the worker may have been told to drain (see `osteon worker list`)")
        }
        Resolved::Unban { .. } => Some("the ban may have been lifted (see `osteon worker list`)"),
        Resolved::Backup { .. } => Some("no copy was kept"),
        Resolved::Wing(command) => command.left_by_interruption(),
    }
}

async fn perform(resolved: Resolved) -> Result<ExitStatus, CommandFailure> {
    match resolved {
        Resolved::Run { run, isa } => run::run(run, isa).await,
        Resolved::Simulate { arguments, isa } => simulate::simulate(arguments, isa).await,
        Resolved::Check { arguments, isa, cores } => check::check(arguments, isa, cores).await,
        Resolved::Draw(arguments) => draw::draw(&arguments),
        Resolved::Observe { arguments, isa, threads } => {
            observe::observe(arguments, isa, threads).await
        }
        Resolved::Coordinator(arguments) => coordinator::serve(arguments).await,
        Resolved::Worker { config, files, unused, .. } => {
            worker::serve(config, &files, &unused).await
        }
        Resolved::Certs(arguments) => certs::make(&arguments),
        Resolved::Token(arguments) => token::make(&arguments),
        Resolved::Init(arguments) => init::write(&arguments),
        Resolved::Schema(arguments) => schema::print(&arguments),
        Resolved::Materials(arguments) => materials::print(&arguments),
        Resolved::Doctor { patient, format } => doctor::examine(patient, format).await,
        Resolved::Completions(arguments) => man::completions(&arguments),
        Resolved::Man(arguments) => man::write(&arguments),
        Resolved::Job { command, coordinator } => jobs::perform(command, &coordinator).await,
        Resolved::ListWorkers { coordinator, format } => {
            operators::workers(&coordinator, format).await
        }
        Resolved::Drain { worker, coordinator, format } => {
            operators::drain(worker, &coordinator, format).await
        }
        Resolved::Unban { host, coordinator } => operators::unban(&host, &coordinator).await,
        Resolved::Health { coordinator, limit, format } => {
            operators::health(&coordinator, limit, format).await
        }
        Resolved::Backup { directory, coordinator, format } => {
            operators::backup(&directory, &coordinator, format).await
        }
        Resolved::Wing(command) => command.perform().await,
    }
}
