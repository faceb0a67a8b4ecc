//! `observe`: all observables of a job's realizations.

use osteon_common::job::JobKind;
use osteon_files::job_file;
use osteon_solver::Isa;

use crate::arguments::ObserveArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::job_point;
use crate::new_files::{self, NewFile};
use crate::observations::Observations;
use crate::output::{self, ShownObservations};
use crate::resolved;

/// Computes the realizations, writes their rows if requested, and prints the summary.
pub(super) async fn observe(
    arguments: ObserveArguments,
    isa: Isa,
    threads: u32,
) -> Result<ExitStatus, CommandFailure> {
    let ObserveArguments { job, place, threads: _, out, json } = arguments;
    let input = job.open().map_err(CommandFailure::bad_input)?;
    let noted =
        job_file::of_input(&input, JobKind::Propagation).map_err(CommandFailure::bad_input)?;
    let specification = noted.specification;
    let point = job_point::chosen(&place, &input, &specification)?;
    if let Some(out) = &out {
        new_files::refuse_existing(out)?;
    }
    let compute = move || Observations::compute(&specification, &point, isa, threads as usize);
    let computed = tokio::task::spawn_blocking(compute).await;
    let observations = computed.map_err(CommandFailure::failed)??;
    if let Some(path) = &out {
        let text = observations.to_csv();
        new_files::create(&[NewFile { path: path.clone(), text: text.into(), secret: false }])?;
    }
    let summary = observations.summary();
    let shown = ShownObservations { point: &point, summary: &summary, file: out.as_deref() };
    output::stdout(resolved::format(json)).observations(&shown).map_err(stdout_failure)?;
    Ok(if summary.has_velocity() { ExitStatus::Done } else { ExitStatus::RunFailed })
}
