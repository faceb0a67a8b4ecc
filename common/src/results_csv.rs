//! Results as CSV: `history.csv` and `realizations.csv`.

use std::fmt::{self, Write as _};

use crate::job::{Data, JobSpecification};
use crate::outcome::Outcome;
use crate::parameters::Parameter;
use crate::results::Evaluation;

/// The text of `history.csv`: one row per evaluation of the search, the seven parameters between its
/// number and its moments; with groups or several starts, also which of them it was for.
///
/// Moments are empty where every realization failed; a cost is `inf` at an infeasible point.
pub fn history(specification: &JobSpecification, evaluations: &[Evaluation]) -> String {
    let parameters = Parameter::ALL.map(Parameter::name).join(",");
    let names: Vec<&str> = specification.data.iter().flat_map(Data::names).collect();
    let several = specification.search.starts > 1;
    let mut out = format!("evaluation,{parameters},mean,coefficient_of_variation,cost,failures");
    out.push_str(if several { ",start" } else { "" });
    out.push_str(if names.is_empty() { "\n" } else { ",group\n" });
    for evaluation in evaluations.iter().filter(|evaluation| evaluation.role.varied.is_none()) {
        // Writing to a string does not fail.
        let _infallible = history_row(&mut out, evaluation);
        if several {
            let _infallible = write!(out, ",{}", evaluation.role.start);
        }
        if let Some(name) = names.get(evaluation.role.group as usize) {
            let _infallible = write!(out, ",{}", field(name));
        }
        out.push('\n');
    }
    out
}

/// A text as a field: in quotes where it must be.
fn field(text: &str) -> String {
    if text.contains([',', '"', '#']) || text.trim() != text {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
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
    write!(out, ",{}", evaluation.failures.total())
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
