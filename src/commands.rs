//! One file per subcommand, or per family of them.

mod certs;
mod coordinator;
mod draw;
mod jobs;
mod operators;
mod run;
mod simulate;
mod study;
mod token;
mod worker;

use crate::ending::{Ending, Failure};
use crate::resolved::Resolved;

/// Does what the command line says.
///
/// # Errors
/// When it cannot be done.
pub(crate) async fn run(resolved: Resolved) -> Result<Ending, Failure> {
    match resolved {
        Resolved::Run(run) => run::run(run).await,
        Resolved::Simulate { arguments, isa } => simulate::simulate(arguments, isa).await,
        Resolved::Study { study, isa } => study::run(study, isa).await,
        Resolved::Draw(arguments) => draw::draw(&arguments),
        Resolved::Coordinator(arguments) => coordinator::serve(arguments).await,
        Resolved::Worker { config, files } => worker::serve(config, &files).await,
        Resolved::Certs(arguments) => certs::make(&arguments),
        Resolved::Token(arguments) => token::make(&arguments),
        Resolved::Submit { job, kind, request, options, coordinator, format } => {
            let submission = jobs::Submission { job: &job, kind, request: &request, options };
            jobs::submit(submission, &coordinator, format).await
        }
        Resolved::Prune { older_than, keep_last, coordinator, format } => {
            jobs::prune(older_than, keep_last, &coordinator, format).await
        }
        Resolved::Jobs { coordinator, format } => jobs::list(&coordinator, format).await,
        Resolved::Workers { coordinator, format } => operators::workers(&coordinator, format).await,
        Resolved::DrainWorker { worker, coordinator, format } => {
            operators::drain(worker, &coordinator, format).await
        }
        Resolved::Health { coordinator, limit, format } => {
            operators::health(&coordinator, limit, format).await
        }
        Resolved::Backup { directory, coordinator, format } => {
            operators::backup(&directory, &coordinator, format).await
        }
        Resolved::Watch { job, coordinator } => jobs::watch(&job, &coordinator).await,
        Resolved::Cancel { job, coordinator } => jobs::cancel(&job, &coordinator).await,
        Resolved::Fetch { job, coordinator, out } => jobs::fetch(&job, &coordinator, &out).await,
    }
}
