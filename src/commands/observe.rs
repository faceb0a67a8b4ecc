//! `observe`: all observables of a job's realizations.

use indicatif::{ProgressBar, ProgressStyle};
use osteon_client::job_point;
use osteon_common::job::JobKind;
use osteon_files::job_file;
use osteon_local::observations::{ObservationError, Observations};
use osteon_solver::Isa;

use crate::arguments::{ObserveArguments, PlaceArguments};
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::new_files::{self, NewFile};
use crate::output::{self, ShownObservations};
use crate::prepared_command::Ended;
use crate::resolved;

/// Progress on a terminal.
const BAR: &str = "{bar:30} {pos} of {len} realizations, {eta} left";

/// Computes the realizations, writes their rows if requested, and prints the summary.
pub(super) async fn observe(arguments: ObserveArguments, isa: Isa, cores: u32) -> Ended {
    let ObserveArguments { job, place, threads, out, json } = arguments;
    let threads = threads.unwrap_or(cores);
    let input = job.open().map_err(CommandFailure::bad_input)?;
    let noted =
        job_file::of_input(&input, JobKind::Propagation).map_err(CommandFailure::bad_input)?;
    let specification = noted.specification;
    let PlaceArguments { at, group } = &place;
    let point = job_point::choose(at.as_deref(), group.as_deref(), &input, &specification)
        .map_err(CommandFailure::BadInput)?;
    if let Some(out) = &out {
        new_files::refuse_existing(out)?;
    }
    let style = ProgressStyle::with_template(BAR).map_err(CommandFailure::failed)?;
    let compute = move || {
        // Hidden unless stderr is a terminal.
        let bar = ProgressBar::new(specification.monte_carlo.realizations).with_style(style);
        let done = || bar.inc(1);
        let computed = Observations::compute(&specification, &point, isa, threads as usize, done);
        bar.finish_and_clear();
        computed
    };
    let computed = tokio::task::spawn_blocking(compute).await.map_err(CommandFailure::failed)?;
    let observations = computed.map_err(|error| match error {
        ObservationError::Point(_) => CommandFailure::bad_input(error),
        ObservationError::Threads(_) => CommandFailure::failed(error),
    })?;
    if let Some(path) = &out {
        let content = observations.to_csv().into_bytes().into();
        new_files::create(&[NewFile { path: path.clone(), content, secret: false }])?;
    }
    let summary = observations.summary();
    let shown = ShownObservations { point: &point, summary: &summary, file: out.as_deref() };
    output::stdout(resolved::format(json)).observations(&shown).map_err(stdout_failure)?;
    Ok(if summary.has_velocity() { ExitStatus::Done } else { ExitStatus::RunFailed })
}
