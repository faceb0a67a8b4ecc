//! A job in this process, without a coordinator and without gRPC: a search asks for one point after the
//! other, and all cores compute its realizations.
//!
//!     cargo run --release --example identify -- examples/quick.toml

use std::convert::Infallible;
use std::path::Path;

use anyhow::Context as _;
use osteon_common::job::{JobKind, JobSpecification};
use osteon_files::job_file;
use osteon_search::{CompletedJob, IdentifyError, Realizations, identify};
use osteon_solver::{Solver, Workspace};
use rayon::prelude::*;

/// Does the job on all cores.
pub(crate) fn run(
    specification: &JobSpecification,
) -> Result<CompletedJob, IdentifyError<Infallible>> {
    let mut solver = Solver::new(&specification.setup);
    identify(specification, |realizations| {
        // It differs from the job's if quantities of the setup are searched.
        solver.change_setup(&realizations.point.setup(&specification.setup));
        let solve = |workspace: &mut Workspace, index| {
            let Realizations { observables, ensemble, .. } = realizations;
            solver.realization_with(*observables, ensemble, index, workspace)
        };
        let indices = (0..realizations.count).into_par_iter();
        Ok(indices.map_init(Workspace::default, solve).collect())
    })
}

#[expect(clippy::print_stdout, reason = "an example shows what it found")]
fn main() -> anyhow::Result<()> {
    let path = std::env::args().nth(1).context("usage: identify JOB.toml")?;
    let specification = job_file::read(Path::new(&path), JobKind::Identification)?;
    let CompletedJob { result, history } = run(&specification)?;
    println!("{} after {} evaluations", result.status.name(), history.len());
    if let Some(best) = &result.best {
        for (parameter, value) in best.point.given() {
            println!("{:<27} {value:?}", parameter.name());
        }
    }
    println!("{:<27} {}", "digest", result.digest);
    Ok(())
}
