//! `umbridge`: serves the models of a job to clients of UM-Bridge until it is asked to end.

mod arguments;
mod resolved;

use std::future::pending;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use osteon_client::client::Remote;
use osteon_client::embedded::{Embedded, EmbeddedSetup, StoreLocation};
use osteon_common::job::JobKind;
use osteon_coordinator::service::open_files;
use osteon_files::job_file::{self, FilePurpose};
use osteon_umbridge::{Evaluator, ModelListener, ServedJob, router};

use self::resolved::ModelService;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output;
use crate::prepared_command::{Ended, PreparedCommand};
use crate::process_context::{ProcessContext, RunLocation};
use crate::progress::say;
use crate::resolved::OutputFormat;
use crate::signals;
use crate::user;
use crate::{program, warnings};

pub(super) use self::arguments::UmbridgeArguments;

/// Time that an embedded coordinator keeps evaluated points: long enough to be fetched.
const KEPT: Duration = Duration::from_secs(60);

/// Prepares a server.
///
/// # Errors
/// If arguments and environment do not say where the models are evaluated.
pub(super) fn prepare(
    arguments: UmbridgeArguments,
    context: &ProcessContext,
) -> Result<PreparedCommand, CommandFailure> {
    Ok(PreparedCommand::new(serve(resolved::service(arguments, context)?)))
}

/// Serves until SIGINT or SIGTERM, or until the workers cannot continue. The URL is printed.
async fn serve(service: ModelService) -> Ended {
    let ModelService { job, address, hosts, location, isa } = service;
    let input = job.open().map_err(CommandFailure::bad_input)?;
    let kind = match job_file::purpose(&input).map_err(CommandFailure::bad_input)? {
        FilePurpose::Job(kind) => kind,
        FilePurpose::Case => JobKind::Propagation,
    };
    let noted = job_file::of_input(&input, kind).map_err(CommandFailure::bad_input)?;
    warnings::say_of_job(&noted.specification, &noted.warnings).await;
    if kind == JobKind::Propagation {
        say("the job has no [data]: there is no model \"posterior\"");
    }
    let mut interruption = pin!(signals::interruption()?);
    let listener = ModelListener::bind(address).await.map_err(CommandFailure::failed)?;
    let evaluated = Arc::new(AtomicU64::new(0));
    let mut embedded = None;
    let remote = match location {
        RunLocation::Coordinator(remote) => {
            user::announce(&remote);
            remote
        }
        RunLocation::Local { workers, threads } => {
            open_files::require_for_run(workers).map_err(CommandFailure::failed)?;
            let (store, keep_ended) = (StoreLocation::Memory, Some(KEPT));
            let setup = EmbeddedSetup {
                executable: program::executable()?,
                commit: program::COMMIT,
                store,
                workers,
                threads,
                page: None,
                keep_ended,
            };
            let started = Embedded::start(setup, Arc::clone(&evaluated), user::listener()).await?;
            let endpoint = started.endpoint().clone();
            embedded = Some(started);
            Remote::at(endpoint)
        }
    };
    let served = async {
        let client = user::connect(&remote).await?;
        let evaluator = Evaluator::new(client, program::current(), evaluated);
        let models = Arc::new(ServedJob::new(noted.specification, evaluator.clone(), isa));
        say(&format!("serving {}; Ctrl-C ends it", models.models().join(", ")));
        let url = format!("{}\n", listener.url());
        output::stdout(OutputFormat::Text).verbatim(&url).map_err(stdout_failure)?;
        Ok::<_, CommandFailure>((router(models, hosts), evaluator))
    };
    let ended = async {
        let (router, evaluator) = served.await?;
        tokio::select! {
            () = listener.serve(router) => {}
            _ = interruption.as_mut() => {}
        }
        evaluator.end().await;
        Ok(ExitStatus::Done)
    };
    let ended = tokio::select! {
        ended = ended => ended,
        failure = failed(&mut embedded) => Err(failure),
    };
    if let Some(embedded) = embedded {
        embedded.end().await;
    }
    ended
}

/// Completes when embedded workers or their coordinator cannot continue; never, if there are none.
async fn failed(embedded: &mut Option<Embedded>) -> CommandFailure {
    match embedded {
        Some(embedded) => embedded.failed().await.into(),
        None => pending().await,
    }
}
