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

/// Message for interrupted commands that have not started anything visible to others.
const NOTHING_LEFT: &str = "nothing was changed";

/// Executes the command line.
///
/// # Errors
/// If the command fails.
pub(crate) async fn run(resolved: Resolved) -> Result<ExitStatus, CommandFailure> {
    match resolved {
        Resolved::Run { run, isa } => run::run(run, isa).await,
        Resolved::Simulate { arguments, isa } => {
            let left = "no results were saved";
            unless_interrupted(simulate::simulate(arguments, isa), left).await
        }
        Resolved::Check { arguments, isa, cores } => {
            unless_interrupted(check::check(arguments, isa, cores), NOTHING_LEFT).await
        }
        Resolved::Draw(arguments) => draw::draw(&arguments),
        Resolved::Report(arguments) => report::report(&arguments),
        Resolved::Observe { arguments, isa, threads } => {
            let left = "no file was written";
            unless_interrupted(observe::observe(arguments, isa, threads), left).await
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
        Resolved::Doctor { patient, format } => {
            unless_interrupted(doctor::examine(patient, format), NOTHING_LEFT).await
        }
        Resolved::Completions(arguments) => man::completions(&arguments),
        Resolved::Man(arguments) => man::write(&arguments),
        Resolved::Submit { job, kind, request, options, coordinator, format } => {
            let submission = jobs::Submission { job: &job, kind, request: &request, options };
            let left = "the job may have been accepted (see `osteon jobs`)";
            unless_interrupted(jobs::submit(submission, &coordinator, format), left).await
        }
        Resolved::Prune { older_than, keep_last, coordinator, format } => {
            let left = "jobs may have been deleted (see `osteon jobs`)";
            let pruned = jobs::prune(older_than, keep_last, &coordinator, format);
            unless_interrupted(pruned, left).await
        }
        Resolved::Jobs { coordinator, format } => {
            unless_interrupted(jobs::list(&coordinator, format), NOTHING_LEFT).await
        }
        Resolved::Watch { job, coordinator, format } => {
            let left = "the job continues (see `osteon jobs`, `osteon cancel`)";
            unless_interrupted(jobs::watch(&job, &coordinator, format), left).await
        }
        Resolved::Explain { job, coordinator, format } => {
            unless_interrupted(jobs::explain(&job, &coordinator, format), NOTHING_LEFT).await
        }
        Resolved::Recheck { job, coordinator, format } => {
            let left = "the job may be computed again (see `osteon jobs`)";
            unless_interrupted(jobs::recheck(&job, &coordinator, format), left).await
        }
        Resolved::Unban { host, coordinator } => {
            let left = "the ban may have been lifted (see `osteon workers`)";
            unless_interrupted(operators::unban(&host, &coordinator), left).await
        }
        Resolved::Cancel { job, coordinator } => {
            let left = "the job may have been cancelled (see `osteon jobs`)";
            unless_interrupted(jobs::cancel(&job, &coordinator), left).await
        }
        Resolved::Fetch { job, coordinator, out } => {
            let left = "run the same command again to fetch the results";
            unless_interrupted(jobs::fetch(&job, &coordinator, &out), left).await
        }
        Resolved::Workers { coordinator, format } => {
            unless_interrupted(operators::workers(&coordinator, format), NOTHING_LEFT).await
        }
        Resolved::DrainWorker { worker, coordinator, format } => {
            let left = "the worker may have been told to drain (see `osteon workers`)";
            unless_interrupted(operators::drain(worker, &coordinator, format), left).await
        }
        Resolved::ScaleWorkers(plan) => {
            let left =
                "workers that wait or run stay, and end when they have had no work for a while";
            unless_interrupted(scaling::follow(*plan), left).await
        }
        Resolved::JobScript(script) => slurm::job(&script),
        Resolved::WorkerArray(array) => slurm::array(&array),
        Resolved::Health { coordinator, limit, format } => {
            unless_interrupted(operators::health(&coordinator, limit, format), NOTHING_LEFT).await
        }
        Resolved::Backup { directory, coordinator, format } => {
            let made = operators::backup(&directory, &coordinator, format);
            unless_interrupted(made, "no copy was kept").await
        }
    }
}
