//! Where a result comes from, and how to compute it again.

use osteon_common::job::MonteCarlo;
use osteon_files::report::Solver;

use super::markup::table;
use crate::input::{ReportedRun, RunContent};
use crate::text::escape;

/// Returns the table of the origin of a result, and the command that reproduces it.
pub(super) fn origin_table(run: &ReportedRun) -> String {
    let mut rows: Vec<(&str, String)> = Vec::new();
    let command = match &run.content {
        RunContent::Identification(result, context) => {
            rows.push(("computed by", program(&result.version, result.commit.as_deref())));
            rows.push(("revision of the numerics", result.numerics.to_string()));
            rows.push(("digest of the evaluations", result.digest.clone()));
            rows.extend(sampling_rows(&context.specification.monte_carlo));
            rows.push(("evaluations of the search", result.evaluations.to_string()));
            rows.push(("search", result.search.method.name().to_owned()));
            rows.push(("objective", result.objective.name().replace('_', " ")));
            rows.push(("solver", solver(&result.solver)));
            "osteon identify job.toml --out again"
        }
        RunContent::Propagation(result, context) => {
            rows.push(("computed by", program(&result.version, result.commit.as_deref())));
            rows.push(("revision of the numerics", result.numerics.to_string()));
            rows.push(("digest of the evaluation", result.digest.clone()));
            rows.extend(sampling_rows(&context.specification.monte_carlo));
            rows.push(("solver", solver(&result.solver)));
            "osteon propagate job.toml --out again"
        }
        RunContent::Simulation(result, _) => {
            rows.push(("computed by", program(&result.version, result.commit.as_deref())));
            rows.push(("revision of the numerics", result.numerics.to_string()));
            rows.push(("solver", solver(&result.solver)));
            "osteon simulate case.toml --out again"
        }
    };
    let rows: Vec<Vec<String>> = rows
        .into_iter()
        .map(|(name, value)| vec![name.to_owned(), format!("<code>{}</code>", escape(&value))])
        .collect();
    let repeat = match &run.content {
        RunContent::Simulation(..) => {
            "repeats it; the first line of case.toml has the options of the traces."
        }
        _ => {
            "computes it again; with the same revision of the numerics the digest is the same, on any \
             number of machines."
        }
    };
    format!(
        "{}<p>In the directory of the results, <code>{command}</code> {repeat} The same directory gives \
         this report again, byte for byte.</p>",
        table("Origin of the result", &["Item", "Value"], &rows)
    )
}

fn program(version: &str, commit: Option<&str>) -> String {
    match commit {
        Some(commit) => format!("osteon {version} ({commit})"),
        None => format!("osteon {version}"),
    }
}

fn sampling_rows(settings: &MonteCarlo) -> Vec<(&'static str, String)> {
    vec![
        ("realizations of each evaluation", settings.realizations.to_string()),
        ("seed", settings.seed.to_string()),
        ("sampling", settings.sampling.name().replace('_', " ")),
        ("control variate", if settings.control_variate { "yes" } else { "no" }.to_owned()),
    ]
}

fn solver<E>(solver: &Solver<E>) -> String {
    match solver {
        Solver::Exact { refinement, .. } => format!("exact, refinement {refinement}"),
        Solver::Hybrid { refinement, .. } => format!("hybrid, refinement {refinement}"),
    }
}
