//! Explanations of how a search ended.

use osteon_common::inference::Agreement;
use osteon_common::job::{JobSpecification, Objective, Range, Search};
use osteon_common::moments::MOMENTS;
use osteon_common::parameters::{Parameter, Point};
use osteon_common::results::{Evaluation, Status};

use super::advice as failure_advice;
use super::ending::Ending;
use crate::posterior::{SearchOutcome, closed_form};
use crate::proposal::StopReason;
use crate::search_box::{SearchBox, Side};
use crate::simplex::RESTARTS_MAX;

/// The observations from which an explanation is made.
pub(super) struct Evidence<'a> {
    /// The best feasible evaluation.
    pub(super) best: Option<&'a Evaluation>,
    /// Its comparison with the data.
    pub(super) agreement: Option<Agreement>,
    /// The points after it.
    pub(super) trials: Trials,
    /// The first evaluation.
    pub(super) first: Option<&'a Evaluation>,
    /// Number of evaluations.
    pub(super) evaluations: u64,
    /// How the search for the posterior ended, if the job asks for one.
    pub(super) posterior: Option<SearchOutcome>,
}

/// Points that a search evaluated after its best one, which lowered the cost no further.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Trials {
    points: u64,
    refused: u64,
    last_refused: Option<Evaluation>,
}

impl Trials {
    /// Takes the next point, and whether too many of its realizations failed.
    pub(super) fn take(&mut self, row: &Evaluation, refused: bool) {
        self.points += 1;
        if refused {
            self.refused += 1;
            self.last_refused = Some(*row);
        }
    }
}

/// Said of a posterior that does not exist.
const NO_POSTERIOR: &str = "no parameter set within the bounds and the priors comes near the data, \
                            so there is no posterior; widen them, or free more parameters";

const UNKNOWN_EFFECT: &str = "there is no posterior, because too many realizations fail with a setup that is \
                              shifted as [systematic] says; lower its spread, or leave it out";

/// A search was stopped by failed realizations if at least one point in this many had too many of
/// them. Points that measure slopes lie beside the best one and are rarely refused.
const REFUSED_IN: u64 = 4;

/// Distance beyond a bound, in edges of the box, at which the moments are compared with those on it.
const BEYOND: f64 = 0.01;

/// Returns status and explanation of a search that stopped for this reason.
pub(super) fn ending(
    stop: StopReason,
    evidence: &Evidence<'_>,
    specification: &JobSpecification,
) -> Ending {
    let (status, reason) = match stop {
        StopReason::CostReached => (Status::Converged, None),
        StopReason::Converged => settled(evidence, specification),
        StopReason::EvaluationsUsedUp if evidence.best.is_none() => {
            (Status::Failed, Some(no_usable_point(evidence, specification)))
        }
        StopReason::EvaluationsUsedUp => (Status::MaxEvaluations, used_up(evidence, specification)),
        StopReason::RestartsUsedUp => {
            let reason = format!(
                "the simplex collapsed, was restarted {RESTARTS_MAX} times and was still \
                 finding better points; start another search from the best point"
            );
            (Status::MaxEvaluations, Some(reason))
        }
        StopReason::Infeasible => (Status::Failed, Some(no_usable_point(evidence, specification))),
    };
    let reason = match &evidence.posterior {
        Some(outcome) if specification.is_searched() && why_none(outcome).is_some() => {
            let [of_search, none] = [reason.as_deref(), why_none(outcome)];
            Some([of_search, none].into_iter().flatten().collect::<Vec<&str>>().join("; "))
        }
        _ => reason,
    };
    Ending::from_search(status, reason)
}

/// Returns why there is no posterior; `None` if there is one.
fn why_none(outcome: &SearchOutcome) -> Option<&'static str> {
    match outcome {
        SearchOutcome::NothingMatches => Some(NO_POSTERIOR),
        SearchOutcome::UnknownEffect => Some(UNKNOWN_EFFECT),
        SearchOutcome::Converged | SearchOutcome::Doubtful(_) => None,
    }
}

/// Returns status and explanation of a job that asks for nothing but the posterior.
fn of_posterior(outcome: Option<&SearchOutcome>) -> (Status, Option<String>) {
    match outcome {
        Some(SearchOutcome::Converged) | None => (Status::Converged, None),
        Some(SearchOutcome::Doubtful(reason)) => (Status::MaxEvaluations, Some(reason.clone())),
        Some(outcome) => (Status::NotMatched, why_none(outcome).map(str::to_owned)),
    }
}

/// Returns status and explanation of a search that found nothing better, which is no match of the
/// data by itself.
fn settled(evidence: &Evidence<'_>, specification: &JobSpecification) -> (Status, Option<String>) {
    if !specification.is_searched() {
        return of_posterior(evidence.posterior.as_ref());
    }
    let Some((best, agreement)) = evidence.best.zip(evidence.agreement.as_ref()) else {
        return (Status::Converged, None);
    };
    let bounds = holding_bounds(best, agreement, specification);
    // How far off a compromise may be is unknown without the noise of the data, unless a bound holds
    // it back.
    let is_free = agreement.errors.is_none() && bounds.is_empty();
    let is_held = agreement.held && !bounds.is_empty();
    if is_compromise(specification) && (agreement.matched || is_free) && !is_held {
        return (Status::Converged, None);
    }
    let misfit = misfit(best, agreement, specification);
    let status = if agreement.matched { Status::Converged } else { Status::NotMatched };
    let advice = advice(specification, !bounds.is_empty());
    let advice = if advice.is_empty() { advice } else { format!("; {advice}") };
    let reason = match stopped_by_failures(&evidence.trials, specification) {
        Some(failures) => format!(
            "{failures}; {misfit}; raise [monte_carlo] max_failed_fraction, or narrow the bounds \
             of [parameters]"
        ),
        None if bounds.is_empty() => format!("no nearby point fits better: {misfit}{advice}"),
        None => format!("no nearby point fits better: {misfit}; {bounds}{advice}"),
    };
    (status, Some(reason))
}

/// Returns what may bring a search closer to the data.
fn advice(specification: &JobSpecification, held_by_bounds: bool) -> String {
    let is_fixed =
        |parameter: &Parameter| matches!(specification.range(*parameter), Range::Fixed(_));
    let choices = [
        (specification.has_priors(), "lower the weights of [search.priors]"),
        (held_by_bounds, "widen the bounds"),
        (Parameter::OF_BONE.iter().any(is_fixed), "free more parameters"),
    ];
    let choices: Vec<&str> =
        choices.into_iter().filter(|choice| choice.0).map(|choice| choice.1).collect();
    choices.join(", or ")
}

/// Returns whether the lowest cost need not match all moments: that of a likelihood, with priors, or with
/// other observables, of which there may be more than free parameters.
fn is_compromise(specification: &JobSpecification) -> bool {
    specification.objective == Objective::Likelihood
        || specification.has_priors()
        || !specification.observables().is_empty()
}

/// Explains how far off the best point is after the last evaluation; `None` if it matches, need not match,
/// or cannot be compared.
fn used_up(evidence: &Evidence<'_>, specification: &JobSpecification) -> Option<String> {
    let (best, agreement) = evidence.best.zip(evidence.agreement.as_ref())?;
    if agreement.matched || is_compromise(specification) {
        return None;
    }
    let Search { max_evaluations, starts, .. } = specification.search;
    let each = if starts > 1 { " from each start" } else { "" };
    let misfit = misfit(best, agreement, specification);
    let reached = format!("reached the limit of {max_evaluations} evaluations{each}");
    let failures = stopped_by_failures(&evidence.trials, specification);
    let failures = failures.map_or_else(String::new, |failures| format!("; {failures}"));
    Some(format!("{reached}: {misfit}{failures}; raise [search] max_evaluations"))
}

/// Describes how far the moments of the best point are from the data's.
fn misfit(best: &Evaluation, agreement: &Agreement, specification: &JobSpecification) -> String {
    let off = |axis: usize| {
        let ratio = libm::exp(agreement.differences[axis]);
        let errors = agreement.errors.map_or_else(String::new, |errors| {
            let count = agreement.differences[axis].abs() / errors[axis];
            format!(" ({} standard errors)", rounded(count))
        });
        // A large difference may be due to data in other units than the model's.
        if !(0.5..=2.0).contains(&ratio) {
            return format!("{} times the data's{errors}", rounded(ratio));
        }
        let side = if ratio < 1.0 { "below" } else { "above" };
        format!("{} % {side} the data's{errors}", rounded(100.0 * (ratio - 1.0).abs()))
    };
    let held = if agreement.matched && agreement.held {
        ", and no interval is stated because a bound holds the point back"
    } else {
        ""
    };
    let cost = match specification.objective {
        Objective::ChiSquare if specification.has_priors() => "best χ² with the priors' penalty",
        Objective::ChiSquare => &format!(
            "best χ² (of at most {} degrees of freedom)",
            2 + agreement.observables.members().count()
        ),
        Objective::Moments | Objective::Likelihood => "best cost",
    };
    let tolerance = match specification.objective {
        // The search for a likelihood's maximum does not end at a cost.
        Objective::Likelihood => String::new(),
        _ => format!(", cost_tolerance is {:?}", specification.search.cost_tolerance),
    };
    let observables = agreement.observables.members().map(|observable| {
        let axis = 2 + observable as usize;
        let difference = agreement.differences[axis];
        let side = if difference < 0.0 { "below" } else { "above" };
        let errors = agreement.errors.map_or_else(String::new, |errors| {
            format!(" ({} standard errors)", rounded(difference.abs() / errors[axis]))
        });
        let percent = rounded(100.0 * difference.abs());
        format!(", its mean {} {percent} % {side} the data's{errors}", observable.row().title)
    });
    let observables: String = observables.collect();
    format!(
        "the {cost} is {:.3e}{tolerance}; the model's mean velocity is {}, its coefficient of \
         variation {}{observables}{held}",
        best.cost.unwrap_or(f64::NAN),
        off(0),
        off(1)
    )
}

/// Formats a positive number for reading.
fn rounded(value: f64) -> String {
    match value {
        _ if value >= 10.0 => format!("{value:.0}"),
        _ if value >= 1.0 => format!("{value:.1}"),
        _ if value >= 0.1 => format!("{value:.2}"),
        _ if value >= 0.01 => format!("{value:.3}"),
        _ => format!("{value:.1e}"),
    }
}

/// Names the bounds that hold the best point back from the data; empty if there are none.
fn holding_bounds(
    best: &Evaluation,
    agreement: &Agreement,
    specification: &JobSpecification,
) -> String {
    let on_bounds = SearchBox::new(specification.parameters).on_bounds(&best.point);
    let holding =
        on_bounds.iter().filter(|one| holds_back(**one, &best.point, agreement, specification));
    let named = holding.map(|(parameter, side)| match side {
        Side::Lower => format!("{} is on its lower bound", parameter.name()),
        Side::Upper => format!("{} is on its upper bound", parameter.name()),
    });
    named.collect::<Vec<String>>().join(", ")
}

/// Returns whether the moments would come nearer to the data's beyond a bound, by the closed form:
/// v ∝ √(c1111/ρ), Δ ∝ δ. A search also leaves parameters on bounds that hardly matter.
fn holds_back(
    (parameter, side): (Parameter, Side),
    point: &Point,
    agreement: &Agreement,
    specification: &JobSpecification,
) -> bool {
    if !specification.observables().is_empty() {
        // The closed form knows nothing of other observables.
        return true;
    }
    let step = match side {
        Side::Lower => -BEYOND,
        Side::Upper => BEYOND,
    };
    let mut beyond = *point;
    beyond.0[parameter as usize] += step * specification.range(parameter).edge();
    let structure = &specification.setup.structure;
    let Some((before, after)) = closed_form(structure, point).zip(closed_form(structure, &beyond))
    else {
        return true;
    };
    let errors = agreement.errors.unwrap_or([1.0; MOMENTS]);
    let nearer = [0, 1].map(|axis| {
        let change = after[axis] - before[axis];
        -agreement.differences[axis] * change / (errors[axis] * errors[axis])
    });
    nearer[0] + nearer[1] > 0.0
}

/// Says that failed realizations stopped the search, if so many points were refused for them.
fn stopped_by_failures(trials: &Trials, specification: &JobSpecification) -> Option<String> {
    let last = trials.last_refused.filter(|_| REFUSED_IN * trials.refused >= trials.points)?;
    Some(format!(
        "stopped by failed realizations: {} of the last {} points had too many, and could not be \
         used (at the last of them {})",
        trials.refused,
        trials.points,
        failed(&last, specification)
    ))
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

/// Explains a failure: no point is feasible, or none has a cost from which the search could go on.
fn no_usable_point(evidence: &Evidence<'_>, specification: &JobSpecification) -> String {
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
            failure_advice::after_failures(row, specification)
        ),
    }
}
