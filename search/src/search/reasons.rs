//! Explanations of how a search ended.

use osteon_common::job::{JobSpecification, Objective, SearchMethod};
use osteon_common::results::{Evaluation, Status};

use super::{Ending, advice};
use crate::proposal::StopReason;
use crate::search_box::{SearchBox, Side};
use crate::simplex::RESTARTS_MAX;

/// The observations from which an explanation is made.
pub(super) struct Evidence<'a> {
    /// The best feasible evaluation.
    pub(super) best: Option<&'a Evaluation>,
    /// The first evaluation.
    pub(super) first: Option<&'a Evaluation>,
    /// Number of evaluations.
    pub(super) evaluations: u64,
}

/// Returns status and explanation of a search that stopped for this reason.
pub(super) fn ending(
    stop: StopReason,
    evidence: &Evidence<'_>,
    specification: &JobSpecification,
) -> Ending {
    let (status, reason) = match stop {
        StopReason::CostReached => (Status::Converged, None),
        StopReason::Converged => (Status::Converged, out_of_reach(evidence.best, specification)),
        StopReason::EvaluationsUsedUp if evidence.best.is_none() => {
            (Status::Failed, Some(no_feasible_point(evidence, specification)))
        }
        StopReason::EvaluationsUsedUp => (Status::MaxEvaluations, None),
        StopReason::RestartsUsedUp => {
            let reason = format!(
                "the simplex collapsed, was restarted {RESTARTS_MAX} times and was still \
                 finding better points; start another search from the best point"
            );
            (Status::MaxEvaluations, Some(reason))
        }
        StopReason::Infeasible => {
            (Status::Failed, Some(no_feasible_point(evidence, specification)))
        }
    };
    Ending::from_search(status, reason)
}

/// Describes the failed realizations of an evaluation.
pub(super) fn failed(row: &Evaluation, specification: &JobSpecification) -> String {
    let kinds: Vec<String> =
        row.failures.iter().map(|(kind, count)| format!("{count} {}", kind.name())).collect();
    format!(
        "{} of {} realizations failed ({}); max_failed_fraction is {}",
        row.failures.total(),
        specification.monte_carlo.realizations,
        kinds.join(", "),
        specification.monte_carlo.max_failed_fraction
    )
}

/// Explains why a search that converged has no lower cost, if its method can tell.
fn out_of_reach(best: Option<&Evaluation>, specification: &JobSpecification) -> Option<String> {
    let best = best.filter(|_| specification.search.method == SearchMethod::Newton)?;
    let on_bounds = SearchBox::new(specification.parameters).on_bounds(&best.point);
    let on_bounds: Vec<String> = on_bounds
        .iter()
        .map(|(parameter, side)| match side {
            Side::Lower => format!("{} on its lower bound", parameter.name()),
            Side::Upper => format!("{} on its upper bound", parameter.name()),
        })
        .collect();
    let (where_it_is, cure) = if on_bounds.is_empty() {
        (String::new(), "free more parameters")
    } else {
        (format!(" ({})", on_bounds.join(", ")), "widen the bounds, or free more parameters")
    };
    Some(format!(
        "converged at a cost of {:.3e}, above cost_tolerance {:?}: no nearby point fits better{}; \
         {}",
        best.cost.unwrap_or(f64::NAN),
        specification.search.cost_tolerance,
        where_it_is,
        cure
    ))
}

fn no_feasible_point(evidence: &Evidence<'_>, specification: &JobSpecification) -> String {
    if evidence.best.is_some() {
        return "all velocities at the evaluated points are equal: their coefficient of variation is \
                0 and has no logarithm; raise [monte_carlo] realizations"
            .to_owned();
    }
    // If all velocities are equal, a point has no likelihood even if no realization failed.
    if specification.objective == Objective::Likelihood
        && evidence.first.is_some_and(|row| row.failures.total() == 0)
    {
        return "all velocities at the first point are equal: they have no probability density; \
                raise [monte_carlo] realizations"
            .to_owned();
    }
    match evidence.first {
        None => "no feasible point: every point tried is inadmissible; \
                 change the starts or the bounds of [parameters]"
            .to_owned(),
        Some(row) => format!(
            "no feasible point among the {} evaluated; at the first {}; {}",
            evidence.evaluations,
            failed(row, specification),
            advice::after_failures(row, specification)
        ),
    }
}
