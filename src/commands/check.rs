//! `check`: reads a job as the commands that run it do, and estimates what it costs.

use osteon_common::job::JobKind;
use osteon_files::job_file::{self, FilePurpose};
use osteon_solver::Isa;

use crate::arguments::CheckArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output::{self, ShownCost};
use crate::prepared_command::Ended;
use crate::{resolved, unsearched_groups, warnings};
use osteon_local::cost::{Effort, JobCost};

/// Checks the job, and prints what it will do and cost.
pub(super) async fn check(arguments: CheckArguments, isa: Isa, cores: u32) -> Ended {
    let CheckArguments { job, propagate, json } = arguments;
    let input = job.open().map_err(CommandFailure::bad_input)?;
    let kind = match job_file::purpose(&input).map_err(CommandFailure::bad_input)? {
        FilePurpose::Job(kind) if !propagate => kind,
        FilePurpose::Job(_) | FilePurpose::Case => JobKind::Propagation,
    };
    let noted = job_file::of_input(&input, kind).map_err(CommandFailure::bad_input)?;
    let specification = &noted.specification;
    unsearched_groups::warn(input.path(), &noted);
    warnings::say_of_job(specification, &noted.warnings).await;
    let cost = JobCost::measure(specification, isa, Effort::THOROUGH, cores).await;
    let shown = ShownCost { specification, cost: &cost, isa };
    output::stdout(resolved::format(json)).cost(&shown).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}
