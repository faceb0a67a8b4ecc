//! The conclusions from the data as text.

use osteon_common::bone_structure::BoneStructure;
use osteon_common::inference::Spread;
use osteon_common::job::Objective;
use osteon_common::parameters::Parameter;
use osteon_files::report::{
    Contribution, Identification, Identified, Moments, QuantityBudget, QuantityEstimate, Solution,
};

use super::layout::{aligned, glued, wrapped};
use super::number::{DIGITS, Decimals, digits, measured, significant};
use super::posterior;
use super::result::{readable, scale};

/// Name of √(c1111/ρ).
const SPEED: &str = "√(c1111/ρ)";
/// Part of a variance below which a source is not named.
const SMALL_SHARE: f64 = 0.005;
/// Relative difference up to which the parameters of several solutions are the same.
const SAME: f64 = 1e-3;

/// Returns whether the uncertainty of any quantity is known.
pub(super) fn has_intervals(found: &Identification) -> bool {
    found.posterior().is_some() || has_confidence_intervals(found)
}

/// Returns whether there is a confidence interval of any quantity.
fn has_confidence_intervals(found: &Identification) -> bool {
    found.identified().is_some_and(|known| known.matched && !rows(known).is_empty())
}

/// Returns the posterior or, without one, the intervals of the identified quantities, and what
/// remains undetermined; empty if nothing is known.
pub(super) fn text(found: &Identification, structure: &BoneStructure) -> String {
    let mut text = String::new();
    if let Some(known) = found.posterior() {
        text.push_str(&posterior::text(known));
    } else if let Some(known) = found.identified().filter(|_| has_confidence_intervals(found)) {
        text.push_str(&format!(
            "\n{}{}",
            wrapped(&heading(known, found.objective)),
            aligned(&rows(known))
        ));
        text.push_str(&budget(&found.budget));
    }
    text.push_str(&solutions(found, structure));
    // Evaluations are counted from 0.
    let later = |from: &u64| from + 1 < found.evaluations;
    if let Some(from) = found.search.below_noise_from.filter(later) {
        text.push('\n');
        text.push_str(&wrapped(&format!(
            "After evaluation {from} all further improvement was below the sampling noise."
        )));
    }
    text
}

/// Returns a row for each quantity whose uncertainty is known.
fn rows(known: &Identified) -> Vec<[String; 3]> {
    let mut rows = Vec::new();
    rows.extend(row(SPEED, &known.bulk_velocity, 1.0, " m/s"));
    rows.extend(row("dispersion", &known.dispersion, 1.0, ""));
    for (parameter, quantity) in &known.parameters {
        if *parameter != Parameter::Dispersion
            && let Some(quantity) = quantity
        {
            let (scale, unit) = scale(*parameter);
            rows.extend(row(&readable(*parameter), quantity, scale, unit));
        }
    }
    rows
}

/// Says what makes the variance of each quantity, the largest part first, and what to know better; empty without a
/// budget.
fn budget(budgets: &[QuantityBudget]) -> String {
    let rows: Vec<[String; 2]> =
        budgets.iter().map(|budget| [budgeted(budget), parts(budget)]).collect();
    if rows.is_empty() {
        return String::new();
    }
    let advice = budgets.iter().find_map(advice);
    let advice = advice.map(|advice| wrapped(&advice)).unwrap_or_default();
    format!("\nParts of their variances:\n{}{advice}", aligned(&rows))
}

/// Returns the parts of a variance, the largest first, and the sum of those that are not worth their place.
fn parts(budget: &QuantityBudget) -> String {
    let percent = |name: &str, share: f64| glued(&format!("{name} {} %", digits(100.0 * share, 2)));
    let (mut large, small): (Vec<&Contribution>, Vec<&Contribution>) =
        budget.contributions.iter().partition(|one| one.variance_share >= SMALL_SHARE);
    large.sort_by(|a, b| b.variance_share.total_cmp(&a.variance_share));
    let source = |one: &&Contribution| percent(&one.source.replace('_', " "), one.variance_share);
    let mut parts: Vec<String> = large.iter().map(source).collect();
    if !small.is_empty() {
        let rest = small.iter().map(|one| one.variance_share).sum();
        parts.push(percent(&format!("{} others", small.len()), rest));
    }
    parts.join(", ")
}

/// Returns what would make a quantity better known; `None` if no part is most of its variance.
fn advice(budget: &QuantityBudget) -> Option<String> {
    let most = budget.contributions.iter().find(|one| one.variance_share > 0.5)?;
    let name = budgeted(budget);
    Some(match most.source.as_str() {
        "data" => {
            format!("Most of the variance of {name} is from the data: more of them reduce it.")
        }
        "sampling" => format!(
            "Most of the variance of {name} is from the model's sampling: raise [monte_carlo] realizations."
        ),
        source => format!(
            "Most of the variance of {name} is from the {}: measure it better first.",
            source.replace('_', " ")
        ),
    })
}

/// Returns the name of the quantity that a budget is of.
fn budgeted(budget: &QuantityBudget) -> String {
    match Parameter::ALL.into_iter().find(|one| one.name() == budget.quantity) {
        Some(parameter) => readable(parameter),
        None => SPEED.to_owned(),
    }
}

/// Returns name, value and interval of a known quantity, to the same decimal.
fn row(name: &str, quantity: &QuantityEstimate, scale: f64, unit: &str) -> Option<[String; 3]> {
    let value = quantity.value? * scale;
    let error = quantity.standard_error? * scale;
    let [lower, upper] = quantity.ends()?.map(|end| end * scale);
    let shown = |number: f64| match Decimals::for_standard_error(error) {
        Some(decimals) => decimals.show(number),
        None => digits(number, DIGITS),
    };
    Some([
        name.to_owned(),
        format!("{}{unit}", measured(value, error)),
        format!("{} to {}{unit}", shown(lower), shown(upper)),
    ])
}

/// Returns a heading that says what the intervals are, and which noise they include.
fn heading(known: &Identified, objective: Objective) -> String {
    let percent = |error: Option<f64>| {
        let error = error.map_or("?".to_owned(), |error| digits(100.0 * error, 2));
        glued(&format!("{error} %"))
    };
    let of = |noise: &Moments| {
        format!("{} and {}", percent(noise.mean), percent(noise.coefficient_of_variation))
    };
    let level = significant(100.0 * known.level, 3);
    let sampling = format!("sampling {}", of(&known.noise.sampling));
    let data = known.noise.data.as_ref().map(|data| format!("data {}, ", of(data)));
    let of_what = match objective {
        Objective::Moments | Objective::ChiSquare => "relative noise",
        // An outlier hardly moves these, unlike the data's own moments.
        Objective::Likelihood => "relative errors of the likelihood's estimates",
    };
    format!(
        "{level} % confidence intervals ({of_what} of mean and coefficient of variation: \
         {}{sampling}):",
        data.unwrap_or_default()
    )
}

/// Describes how far apart the solutions of several starts are.
fn solutions(found: &Identification, structure: &BoneStructure) -> String {
    let Some(solutions) = found.solutions.as_ref().filter(|found| found.matching > 1) else {
        return String::new();
    };
    let spreads = solutions.spread.iter().flat_map(|spread| &spread.parameters);
    let row = |(parameter, spread): (&Parameter, &Spread)| {
        let (scale, unit) = scale(*parameter);
        let ends = [spread.smallest * scale, spread.largest * scale];
        [readable(*parameter), format!("{}{unit}", range(ends))]
    };
    let mut rows = Vec::new();
    let speeds = speeds(found, &solutions.points, structure);
    rows.extend(speeds.map(|ends| [SPEED.to_owned(), format!("{} m/s", range(ends))]));
    rows.extend(spreads.map(row));
    let matching = solutions.matching;
    let same = solutions.spread.as_ref().is_some_and(|spread| {
        spread.parameters.values().all(|one| one.largest - one.smallest <= SAME * one.largest.abs())
    });
    if same {
        let text = format!(
            "The searches from {matching} starts found the same parameter set, to a thousandth of \
             each value."
        );
        return format!("\n{}", wrapped(&text));
    }
    let heading = format!(
        "The searches from {matching} starts found different parameter sets that fit the data. \
         Their ranges:"
    );
    format!("\n{}{}", wrapped(&heading), aligned(&rows))
}

/// Returns both ends to the third digit of their distance.
fn range([smallest, largest]: [f64; 2]) -> String {
    let ends = [smallest, largest];
    let [smallest, largest] = match Decimals::new(largest - smallest, 3) {
        Some(decimals) => ends.map(|end| decimals.show(end)),
        None => ends.map(|end| digits(end, DIGITS)),
    };
    format!("{smallest} to {largest}")
}

/// Returns the smallest and the largest √(c1111/ρ) of the points that match the data, m/s.
fn speeds(
    found: &Identification,
    points: &[Solution],
    structure: &BoneStructure,
) -> Option<[f64; 2]> {
    // Same criterion as for counting the solutions: a likelihood has no cost that is low enough.
    let best = found.cost?;
    let most = found.search.cost_tolerance.map_or(best, |most| most.max(best));
    let matching = points.iter().filter(|one| one.cost.is_some_and(|cost| cost <= most));
    let speeds = matching.filter_map(|one| {
        let point = one.parameters.point(one.dispersion)?;
        Some(structure.bulk_logarithm(&point).ok()?.exp())
    });
    let ends = speeds.fold([f64::INFINITY, f64::NEG_INFINITY], |[smallest, largest], speed| {
        [speed.min(smallest), speed.max(largest)]
    });
    Some(ends).filter(|[smallest, largest]| smallest <= largest)
}
