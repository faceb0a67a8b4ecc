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
mod report;
mod run;
mod scaling;
mod schema;
mod simulate;
mod slurm;
mod token;
mod umbridge;
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
        | Resolved::Report(_)
        | Resolved::Umbridge(_)
        | Resolved::Coordinator(_)
        | Resolved::Worker { .. }
        | Resolved::Certs(_)
        | Resolved::Token(_)
        | Resolved::Init(_)
        | Resolved::Schema(_)
        | Resolved::Materials(_)
        | Resolved::Completions(_)
        | Resolved::Man(_)
        | Resolved::JobScript(_)
        | Resolved::WorkerArray(_) => None,
        Resolved::Check { .. }
        | Resolved::Doctor { .. }
        | Resolved::Jobs { .. }
        | Resolved::Explain { .. }
        | Resolved::Workers { .. }
        | Resolved::Health { .. } => Some("nothing was changed"),
        Resolved::Simulate { .. } => Some("no results were saved"),
        Resolved::Observe { .. } => Some("no file was written"),
        Resolved::Submit { .. } => Some("the job may have been accepted (see `osteon job list`)"),
        Resolved::Prune { .. } => Some("jobs may have been deleted (see `osteon job list`)"),
        Resolved::Watch { .. } => {
            Some("the job continues (see `osteon job list`, `osteon job cancel`)")
        }
        Resolved::Recheck { .. } => Some("the job may be computed again (see `osteon job list`)"),
        Resolved::Unban { .. } => Some("the ban may have been lifted (see `osteon workers`)"),
        Resolved::Cancel { .. } => Some("the job may have been cancelled (see `osteon job list`)"),
        Resolved::Fetch { .. } => Some("run the same command again to fetch the results"),
        Resolved::DrainWorker { .. } => {
            Some("the worker may have been told to drain (see `osteon workers`)")
        }
        Resolved::ScaleWorkers { .. } => {
            Some("workers that wait or run stay, and end when they have had no work for a while")
        }
        Resolved::Backup { .. } => Some("no copy was kept"),
    }
}

async fn perform(resolved: Resolved) -> Result<ExitStatus, CommandFailure> {
    match resolved {
        Resolved::Run { run, isa } => run::run(run, isa).await,
        Resolved::Simulate { arguments, isa } => simulate::simulate(arguments, isa).await,
        Resolved::Check { arguments, isa, cores } => check::check(arguments, isa, cores).await,
        Resolved::Draw(arguments) => draw::draw(&arguments),
        Resolved::Report(arguments) => report::report(&arguments),
        Resolved::Observe { arguments, isa, threads } => {
            observe::observe(arguments, isa, threads).await
        }
        Resolved::Umbridge(service) => umbridge::serve(*service).await,
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
        Resolved::Submit { job, kind, request, options, coordinator, format } => {
            let submission = jobs::Submission { job: &job, kind, request: &request, options };
            jobs::submit(submission, &coordinator, format).await
        }
        Resolved::Prune { older_than, keep_last, coordinator, format } => {
            jobs::prune(older_than, keep_last, &coordinator, format).await
        }
        Resolved::Jobs { coordinator, format } => jobs::list(&coordinator, format).await,
        Resolved::Watch { job, coordinator, format } => {
            jobs::watch(&job, &coordinator, format).await
        }
        Resolved::Explain { job, coordinator, format } => {
            jobs::explain(&job, &coordinator, format).await
        }
        Resolved::Recheck { job, coordinator, format } => {
            jobs::recheck(&job, &coordinator, format).await
        }
        Resolved::Unban { host, coordinator } => operators::unban(&host, &coordinator).await,
        Resolved::Cancel { job, coordinator } => jobs::cancel(&job, &coordinator).await,
        Resolved::Fetch { job, coordinator, out } => jobs::fetch(&job, &coordinator, &out).await,
        Resolved::Workers { coordinator, format } => operators::workers(&coordinator, format).await,
        Resolved::DrainWorker { worker, coordinator, format } => {
            operators::drain(worker, &coordinator, format).await
        }
        Resolved::ScaleWorkers { plan, dry_run } => scaling::follow(&plan, dry_run).await,
        Resolved::JobScript(script) => slurm::job(&script),
        Resolved::WorkerArray(array) => slurm::array(&array),
        Resolved::Health { coordinator, limit, format } => {
            operators::health(&coordinator, limit, format).await
        }
        Resolved::Backup { directory, coordinator, format } => {
            operators::backup(&directory, &coordinator, format).await
        }
    }
}
