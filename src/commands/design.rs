//! `design`: which further measurement would narrow most what is known.

use indicatif::{ProgressBar, ProgressStyle};
use osteon_client::job_point;
use osteon_common::job::{JobKind, JobSpecification};
use osteon_files::input_file::InputFile;
use osteon_files::job_file::{self, FilePurpose};
use osteon_local::design::{Design, DesignError, DesignRequest};
use osteon_solver::Isa;

use crate::arguments::DesignArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output::{self, ShownDesign};
use crate::prepared_command::Ended;
use crate::resolved;

/// Progress on a terminal.
const BAR: &str = "{bar:30} {pos} of {len} realizations, {eta} left";

/// Computes the design and prints it.
pub(super) async fn design(arguments: DesignArguments, isa: Isa, cores: u32) -> Ended {
    let DesignArguments { job, at, group, wanted, with, velocities, threads, json } = arguments;
    let input = job.open().map_err(CommandFailure::bad_input)?;
    let specification = specification(&input)?;
    let set = set_of_data(&specification, group.as_deref())?;
    let point = job_point::choose(at.as_deref(), group.as_deref(), &input, &specification)
        .map_err(CommandFailure::BadInput)?;
    let style = ProgressStyle::with_template(BAR).map_err(CommandFailure::failed)?;
    let compute = move || {
        // Hidden unless stderr is a terminal.
        let bar = ProgressBar::new(0).with_style(style);
        let request = DesignRequest {
            specification: &specification,
            set,
            point,
            velocities,
            plans: (!with.is_empty()).then_some(with),
            isa,
            threads: threads.unwrap_or(cores) as usize,
        };
        let computed = Design::compute(&request, &|all| {
            bar.set_length(all);
            bar.inc(1);
        });
        bar.finish_and_clear();
        computed
    };
    let computed = tokio::task::spawn_blocking(compute).await.map_err(CommandFailure::failed)?;
    let design = computed.map_err(|error| match error {
        DesignError::Threads(_) => CommandFailure::failed(error),
        _ => CommandFailure::bad_input(error),
    })?;
    let design = only(design, &wanted)?;
    let shown = ShownDesign { design: &design, ranked: !wanted.is_empty() };
    output::stdout(resolved::format(json)).design(&shown).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// Reads the job, which may be one without data.
fn specification(input: &InputFile) -> Result<JobSpecification, CommandFailure> {
    let kind = match job_file::purpose(input).map_err(CommandFailure::bad_input)? {
        FilePurpose::Job(kind) => kind,
        FilePurpose::Case => JobKind::Identification,
    };
    let noted = job_file::of_input(input, kind).map_err(CommandFailure::bad_input)?;
    Ok(noted.specification)
}

/// Returns the number of the set of the data that a group is.
fn set_of_data(
    specification: &JobSpecification,
    group: Option<&str>,
) -> Result<usize, CommandFailure> {
    let names: Vec<&str> = specification.data.iter().flat_map(|data| data.names()).collect();
    let refused = |why: String| Err(CommandFailure::BadInput(anyhow::anyhow!(why)));
    match group {
        None if names.is_empty() => Ok(0),
        None => refused(format!(
            "the data are of groups; choose one with --group: {}",
            names.join(", ")
        )),
        Some(group) => match names.iter().position(|name| *name == group) {
            Some(set) => Ok(set),
            None if names.is_empty() => {
                refused(format!("--group {group}: the data have no groups"))
            }
            None => refused(format!(
                "--group {group}: the data have no such group; they have {}",
                names.join(", ")
            )),
        },
    }
}

/// Leaves the quantities that are wanted, in their order; all if none is named.
fn only(design: Design, wanted: &[String]) -> Result<Design, CommandFailure> {
    if wanted.is_empty() {
        return Ok(design);
    }
    let mut quantities = Vec::new();
    for name in wanted {
        let found = design.quantities.iter().find(|one| one.target.name() == name);
        quantities.push(found.cloned().ok_or_else(|| {
            let names: Vec<&str> = design.quantities.iter().map(|one| one.target.name()).collect();
            CommandFailure::BadInput(anyhow::anyhow!(
                "--for {name}: the job searches no such quantity; possible are {}",
                names.join(", ")
            ))
        })?);
    }
    Ok(Design { quantities, ..design })
}
