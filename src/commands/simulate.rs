//! `simulate`: one deterministic case.

use std::io::{self, Write};
use std::time::Duration;

use osteon_client::simulation_directory::{SimulationKey, TRACES};
use osteon_common::case::{Case, Setup};
use osteon_common::sampling::NominalSampling;
use osteon_common::warnings::case_warnings;
use osteon_files::case_file;
use osteon_local::simulation::SolvedCase;
use osteon_solver::check::Check;
use osteon_solver::{Isa, Solver, TraceError, Traces};
use tokio::task::JoinHandle;

use crate::arguments::SimulateArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output::{self, ShownSimulation};
use crate::prepared_command::Ended;
use crate::program;
use crate::progress::say;
use crate::resolved;
use crate::warnings;

/// Time without a word, at first and later.
const FIRST_WORD: Duration = Duration::from_secs(5);
const LATER_WORDS: Duration = Duration::from_secs(60);

/// Solves the case, writes its files if requested, and prints the result.
pub(super) async fn simulate(arguments: SimulateArguments, isa: Isa) -> Ended {
    let format = resolved::format(arguments.json);
    let input = arguments.case.open().map_err(CommandFailure::bad_input)?;
    let case = case_file::of_input(&input).map_err(CommandFailure::bad_input)?;
    warnings::say_all(&case_warnings(&case));
    let traces = arguments.out.as_ref().map(|directory| directory.join(TRACES));
    let setup = case.setup.clone();
    let (report, out) = (arguments.report.clone(), arguments.out.clone());
    let solved = tokio::task::spawn_blocking(move || solve(&case, &arguments, isa));
    let solved = said_while(solved, &setup).await.map_err(CommandFailure::failed)??;
    let shown = ShownSimulation { solved: &solved, traces: traces.as_deref() };
    output::stdout(format).simulation(&shown).map_err(stdout_failure)?;
    report.write(out.as_deref())?;
    let passed = solved.check.as_ref().is_none_or(Check::passed);
    Ok(if passed && solved.arrival.is_ok() { ExitStatus::Done } else { ExitStatus::RunFailed })
}

/// Waits for a computation, and says now and then that it goes on, and how large it is.
async fn said_while<T>(
    computation: JoinHandle<T>,
    setup: &Setup,
) -> Result<T, tokio::task::JoinError> {
    let mut computation = computation;
    let mut waited = FIRST_WORD;
    let mut next = FIRST_WORD;
    loop {
        match tokio::time::timeout(next, &mut computation).await {
            Ok(solved) => return solved,
            Err(_) => {
                let size =
                    NominalSampling::from_setup(setup).map_or_else(String::new, |sampling| {
                        format!(
                            ": its sampling has {} pairs of frequency and wavenumber",
                            sampling.pairs
                        )
                    });
                say(&format!("still computing after {} s{size}", waited.as_secs()));
                next = LATER_WORDS;
                waited += LATER_WORDS;
            }
        }
    }
}

fn solve(
    case: &Case,
    arguments: &SimulateArguments,
    isa: Isa,
) -> Result<SolvedCase, CommandFailure> {
    let solver = Solver::with_isa(&case.setup, isa);
    let SimulateArguments { duration, time_step, .. } = *arguments;
    let simulated = SimulationKey { case, duration, time_step };
    let traces = match &arguments.out {
        Some(directory) => {
            simulated.refuse_other(directory)?;
            let traces = solver.traces(&case.bone, duration, time_step).map_err(trace_failure)?;
            Some((directory, traces))
        }
        None => None,
    };
    let mut solved = SolvedCase::solve(case, &solver);
    if let Some((directory, traces)) = traces {
        // A check concerns only the solvers; the files kept are the same with and without it.
        let program = program::current();
        let result = solved.report(program.clone()).to_json();
        let positions = case.setup.probe.receivers.positions();
        let print = |file: &mut dyn Write| csv(&traces, positions, file);
        simulated.write(directory, &program, &result, print)?;
    }
    solved.check = arguments.check.then(|| Check::run(case, isa));
    Ok(solved)
}

fn trace_failure(error: TraceError) -> CommandFailure {
    match error {
        TraceError::Times { .. } | TraceError::TooMany { .. } | TraceError::TooLong { .. } => {
            CommandFailure::bad_input(error)
        }
        TraceError::NotFinite => CommandFailure::failed(error),
    }
}

/// Writes the column `time`, then one column per receiver with its x1 as heading.
fn csv(
    traces: &Traces,
    positions: impl Iterator<Item = f64>,
    file: &mut dyn Write,
) -> io::Result<()> {
    write!(file, "time")?;
    for x1 in positions {
        write!(file, ",{x1:?}")?;
    }
    writeln!(file)?;
    for (sample, time) in traces.times.iter().enumerate() {
        write!(file, "{time:?}")?;
        for pressure in &traces.pressures {
            write!(file, ",{:?}", pressure[sample])?;
        }
        writeln!(file)?;
    }
    Ok(())
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
        let mut file = Vec::new();
        csv(&traces, [0.011, 0.0118, 0.0126].into_iter(), &mut file).unwrap();
        assert_eq!(
            String::from_utf8(file).unwrap(),
            "time,0.011,0.0118,0.0126\n0.0,0.0,-0.25,0.0\n1e-8,1.5,1e-30,0.0\n"
        );
    }
}
