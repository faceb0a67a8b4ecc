//! `simulate`: one deterministic case.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use osteon_common::case::Case;
use osteon_common::case_file;
use osteon_solver::{Arrival, Isa, Solver, TraceError, Traces, Workspace};
use osteon_study::check::Check;

use crate::arguments::SimulateArguments;
use crate::ending::{Ending, Failure, stdout_failure};
use crate::output::{self, ShownSimulation};
use crate::resolved;
use crate::results_directory;

/// Solves the case, writes the traces if they are wanted, prints.
pub(super) async fn simulate(arguments: SimulateArguments, isa: Isa) -> Result<Ending, Failure> {
    let format = resolved::format(arguments.json);
    let case = case_file::read(&arguments.case).map_err(Failure::bad_input)?;
    let solved = tokio::task::spawn_blocking(move || solve(&case, &arguments, isa));
    let solved = solved.await.map_err(Failure::failed)??;
    let shown = ShownSimulation {
        setup: &case.setup,
        arrival: &solved.arrival,
        traces: solved.traces.as_deref(),
        check: solved.check.as_ref(),
    };
    output::stdout(format).simulation(&shown).map_err(stdout_failure)?;
    let passed = solved.check.as_ref().is_none_or(Check::passed);
    Ok(if passed && solved.arrival.is_ok() { Ending::Done } else { Ending::RunFailed })
}

struct Solved {
    arrival: Result<Arrival, osteon_solver::Failure>,
    /// The file of the traces.
    traces: Option<PathBuf>,
    check: Option<Check>,
}

fn solve(case: &Case, arguments: &SimulateArguments, isa: Isa) -> Result<Solved, Failure> {
    let solver = Solver::with_isa(&case.setup, isa);
    let traces = match &arguments.out {
        Some(directory) => {
            let traces = solver
                .traces(&case.bone, arguments.duration, arguments.time_step)
                .map_err(trace_failure)?;
            let text = csv(&traces, case.setup.probe.receivers.positions());
            Some(write(directory, &text).map_err(Failure::Failed)?)
        }
        None => None,
    };
    let arrival = solver.arrival(&case.bone, &mut Workspace::default());
    let check = arguments.check.then(|| Check::of(case, isa));
    Ok(Solved { arrival, traces, check })
}

fn trace_failure(error: TraceError) -> Failure {
    match error {
        TraceError::Samples { .. } | TraceError::TooLong { .. } => Failure::bad_input(error),
        TraceError::NotFinite => Failure::failed(error),
    }
}

fn write(directory: &Path, text: &str) -> anyhow::Result<PathBuf> {
    std::fs::create_dir_all(directory)
        .with_context(|| format!("cannot create the directory {}", directory.display()))?;
    let path = directory.join("traces.csv");
    results_directory::write(&path, text)?;
    Ok(path)
}

/// `time`, then one column per receiver headed by its x1.
fn csv(traces: &Traces, positions: impl Iterator<Item = f64>) -> String {
    let mut text = "time".to_owned();
    // Writing to a string does not fail.
    for x1 in positions {
        let _infallible = write!(text, ",{x1:?}");
    }
    text.push('\n');
    for (sample, time) in traces.times.iter().enumerate() {
        let _infallible = write!(text, "{time:?}");
        for pressure in &traces.pressures {
            let _infallible = write!(text, ",{:?}", pressure[sample]);
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn traces_are_a_column_per_receiver() {
        let traces = Traces {
            times: vec![0.0, 1e-8],
            pressures: vec![vec![0.0, 1.5], vec![-0.25, 1e-30], vec![0.0, 0.0]],
        };
        assert_eq!(
            csv(&traces, [0.011, 0.0118, 0.0126].into_iter()),
            "time,0.011,0.0118,0.0126\n0.0,0.0,-0.25,0.0\n1e-8,1.5,1e-30,0.0\n"
        );
    }
}
