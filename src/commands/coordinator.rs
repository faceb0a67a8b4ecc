//! `coordinator`: serves jobs to clients and workers until it is asked to end.

use std::fs;
use std::path::{Path, PathBuf};
use std::pin::pin;

use anyhow::Context as _;
use osteon_client::result_files;
use osteon_common::visible;
use osteon_coordinator::service::open_files;
use osteon_coordinator::store::sqlite::{LostJobs, SqliteStore};
use osteon_coordinator::{BindError, Config, Coordinator, ListenAddress, MetricsListener};

use crate::arguments::CoordinatorArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::listener_security::ListenerSecurity;
use crate::output;
use crate::prepared_command::{Ended, PreparedCommand};
use crate::program;
use crate::resolved::OutputFormat;
use crate::signals;
use crate::telemetry;

/// Heartbeats within the duration of a lease; several, because some may come late.
const HEARTBEATS_PER_LEASE: u32 = 5;

/// Prepares a coordinator.
pub(super) fn prepare(arguments: CoordinatorArguments) -> PreparedCommand {
    PreparedCommand::service("osteon-coordinator", arguments.log_format, serve(arguments))
}

/// Serves until SIGINT or SIGTERM, or until a part of it has ended unexpectedly. The URL in use is
/// printed, and stands in DIR/address; those of the metrics and the live page stand in
/// DIR/metrics-address and DIR/http-address.
async fn serve(arguments: CoordinatorArguments) -> Ended {
    let address: ListenAddress = arguments.listen.parse().map_err(CommandFailure::bad_input)?;
    // Read before anything is bound or created.
    let security = ListenerSecurity::from_arguments(&arguments, &address)?;
    let mut interruption = pin!(signals::interruption()?);
    let mut reload = match &security {
        // SIGHUP keeps its default effect if there is nothing to reload.
        ListenerSecurity::None => None,
        _ => Some(signals::hangups()?),
    };
    let directory = arguments.store.clone();
    if matches!(address, ListenAddress::Unix(_)) {
        // The socket may be located in the directory of the store.
        SqliteStore::make_directory(&directory)
            .with_context(|| format!("cannot create the directory {}", directory.display()))
            .map_err(CommandFailure::Failed)?;
    }
    open_files::raise_limit().map_err(CommandFailure::failed)?;
    let listener = security.bind(&address, arguments.insecure).await.map_err(bind_failure)?;
    let listener = match arguments.metrics {
        None => listener,
        Some(address) => {
            let metrics = MetricsListener::bind(address).await.map_err(CommandFailure::failed)?;
            listener.with_metrics(metrics)
        }
    };
    let listener = arguments.page.add_to(listener, arguments.insecure).await?;
    let listener = listener.with_spans(telemetry::recorder());
    let lost = if arguments.accept_lost_jobs { LostJobs::Accept } else { LostJobs::Refuse };
    let store = SqliteStore::open_with(&directory, lost).map_err(CommandFailure::failed)?;
    let config = Config {
        audit_fraction: arguments.audit_fraction,
        speculation: !arguments.no_speculation,
        keep_ended: arguments.keep_ended,
        heartbeat: arguments.lease / HEARTBEATS_PER_LEASE,
        expiry: arguments.lease,
        commit: program::COMMIT,
        ..Config::default()
    };
    let coordinator = osteon_coordinator::start(listener, Box::new(store), config)
        .await
        .map_err(CommandFailure::failed)?;
    let address_files = write_addresses(&directory, &coordinator)?;
    let printed = output::stdout(OutputFormat::Text).verbatim(&format!("{}\n", coordinator.url()));
    let served = match printed {
        Ok(()) => loop {
            tokio::select! {
                _ = interruption.as_mut() => break Ok(ExitStatus::Done),
                failed = coordinator.failed() => break Err(CommandFailure::failed(failed)),
                () = signals::next(&mut reload) => reload_credentials(&coordinator, &arguments, &address),
            }
        },
        Err(error) => Err(stdout_failure(error)),
    };
    tracing::info!("stopping");
    for file in address_files {
        drop(fs::remove_file(file));
    }
    coordinator.shutdown().await;
    tracing::info!("stopped");
    served
}

/// Writes the URL of a coordinator, and those of its metrics and its live page, to files in its
/// directory.
fn write_addresses(
    directory: &Path,
    coordinator: &Coordinator,
) -> Result<Vec<PathBuf>, CommandFailure> {
    let urls = [
        ("address", Some(coordinator.url())),
        ("metrics-address", coordinator.metrics_url()),
        ("http-address", coordinator.page_url()),
    ];
    let urls = urls.into_iter().filter_map(|(name, url)| Some((directory.join(name), url?)));
    let written = urls.map(|(file, url)| {
        result_files::write(&file, &format!("{url}\n")).map_err(CommandFailure::Failed)?;
        Ok(file)
    });
    written.collect()
}

/// Reloads tokens and certificates; if any of them cannot be used, all stay as they are.
fn reload_credentials(
    coordinator: &Coordinator,
    arguments: &CoordinatorArguments,
    address: &ListenAddress,
) {
    let kept = "the previous tokens and certificates stay in use";
    // A pipe need not be written a second time, and everything else would have to wait for it.
    if let Some(pipe) = ListenerSecurity::first_pipe(arguments) {
        let reason = format!(
            "{} is a pipe, which cannot be read again; name a regular file at the next start",
            visible::path(pipe)
        );
        tracing::error!(reason, "{kept}");
        return;
    }
    let tokens = match ListenerSecurity::from_arguments(arguments, address) {
        Ok(ListenerSecurity::None) => return,
        Ok(ListenerSecurity::Tokens(tokens)) => tokens,
        Ok(ListenerSecurity::Tls(tls, tokens)) => {
            coordinator.replace_tls(tls);
            tokens
        }
        Err(failure) => {
            let reason = failure.to_string();
            tracing::error!(reason, "{kept}");
            return;
        }
    };
    let count = tokens.count();
    coordinator.replace_tokens(tokens);
    tracing::info!(tokens = count, "tokens and certificates are read again");
}

fn bind_failure(error: BindError) -> CommandFailure {
    match error {
        BindError::NotLoopback { .. } => CommandFailure::bad_input(error),
        _ => CommandFailure::failed(error),
    }
}
