//! Results as CSV: `history.csv` and `realizations.csv`.

use std::fmt::{self, Write as _};

use crate::outcome::Outcome;
use crate::parameters::Parameter;
use crate::results::Evaluation;

/// The text of `history.csv`: one row per evaluation, the seven parameters between its number
/// and its moments.
///
/// Moments are empty where every realization failed; a cost is `inf` at an infeasible point.
pub fn history(evaluations: &[Evaluation]) -> String {
    let parameters = Parameter::ALL.map(Parameter::name).join(",");
    let mut out = format!("evaluation,{parameters},mean,coefficient_of_variation,cost,failures\n");
    for evaluation in evaluations {
        // Writing to a string does not fail.
        let _infallible = history_row(&mut out, evaluation);
    }
    out
}

fn history_row(out: &mut String, evaluation: &Evaluation) -> fmt::Result {
    write!(out, "{}", evaluation.number)?;
    for value in evaluation.point.0 {
        write!(out, ",{value:?}")?;
    }
    let moments = evaluation.moments;
    for value in [
        moments.map(|moments| moments.mean),
        moments.map(|moments| moments.coefficient_of_variation),
        evaluation.cost,
    ] {
        match value {
            Some(value) => write!(out, ",{value:?}")?,
            None => out.push(','),
        }
    }
    writeln!(out, ",{}", evaluation.failures.total())
}

/// The text of `realizations.csv`: one row per index; the velocity (m/s) is empty where there is
/// a failure, and the failure where there is a velocity.
pub fn realizations(outcomes: &[Outcome]) -> String {
    let mut out = "index,velocity,failure\n".to_owned();
    for (index, outcome) in outcomes.iter().enumerate() {
        // Writing to a string does not fail.
        let _infallible = match outcome {
            Ok(velocity) => writeln!(out, "{index},{velocity:?},"),
            Err(kind) => writeln!(out, "{index},,{}", kind.name()),
        };
    }
    out
}
