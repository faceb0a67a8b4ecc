//! The posterior as text.

use osteon_common::parameters::Parameter;
use osteon_files::report::{PosteriorReport, QuantityPosterior};

use super::layout::{aligned, glued, wrapped};
use super::number::{DIGITS, Decimals, digits, measured};
use super::result::{readable, scale};

/// Posterior probability below which the data would be surprising under the model.
const SURPRISING: f64 = 0.01;
/// Ratio of the posterior's standard deviation to the prior's from which it counts as wider.
const WIDER: f64 = 1.1;
/// Share of wrong velocities from which it is stated.
const NOTABLE: f64 = 0.005;

/// Posteriors of the moments differ from the intervals of the data: they count the noise of the model
/// and the prior.
const INTRODUCTION: &str = "Posterior of the mean velocity and the coefficient of variation, which the \
    data fix (the model's own noise counts), and of what is behind them:";

/// Returns the statement on what the data fix, the table of quantities, and the effort behind it.
pub(super) fn text(found: &PosteriorReport) -> String {
    if found.converged {
        introduced(INTRODUCTION, found)
    } else {
        introduced("Posterior, which did not converge:", found)
    }
}

/// Returns the same for a model that misses the data, of which nothing is said to be fixed.
pub(super) fn text_of_misfit(found: &PosteriorReport) -> String {
    introduced("Posterior of the model that comes closest:", found)
}

fn introduced(introduction: &str, found: &PosteriorReport) -> String {
    let mut text = format!("\n{}{}", wrapped(introduction), aligned(&rows(found)));
    let mut quantities = found.parameters.values().chain([&found.bulk_velocity]);
    let wider = match quantities.any(is_wider) {
        true => "; \"wider\": than the prior alone",
        false => "",
    };
    text.push_str(&wrapped(&format!(
        "`from data`: share of the prior variance that the data removed; near 0 %, the prior alone \
         makes the interval{wider}."
    )));
    text.push_str(&outliers(found).map_or_else(String::new, |remark| wrapped(&remark)));
    text.push_str(&wrapped(&effort(found)));
    text.push_str(&doubts(found));
    text
}

/// Returns a heading, and a row for each quantity: those of which the data say most first.
fn rows(found: &PosteriorReport) -> Vec<[String; 4]> {
    let mut rows = vec![["", "mean ± sd", "95 % interval", "from data"].map(str::to_owned)];
    rows.push(row("mean velocity", &found.mean, 1.0, " m/s"));
    rows.push(row("coefficient of variation", &found.coefficient_of_variation, 1.0, ""));
    rows.push(row("√(c1111/ρ)", &found.bulk_velocity, 1.0, " m/s"));
    let of = |parameter: Parameter, quantity: &QuantityPosterior| {
        let (scale, unit) = scale(parameter);
        row(&readable(parameter), quantity, scale, unit)
    };
    let dispersion = found.parameters.get_key_value(&Parameter::Dispersion);
    let others = found.parameters.iter().filter(|(name, _)| **name != Parameter::Dispersion);
    rows.extend(dispersion.into_iter().chain(others).map(|(name, found)| of(*name, found)));
    rows
}

/// Returns name, mean with standard deviation, interval and explained share of a quantity.
fn row(name: &str, quantity: &QuantityPosterior, scale: f64, unit: &str) -> [String; 4] {
    let [mean, deviation] = [quantity.mean, quantity.standard_deviation]
        .map(|number| number.unwrap_or(f64::NAN) * scale);
    [
        name.to_owned(),
        format!("{}{unit}", measured(mean, deviation)),
        limits(quantity, scale, unit),
        explained(quantity),
    ]
}

/// Returns the explained share in whole per cent; only what has no variance left is fully known, and
/// what has more than before is wider.
fn explained(quantity: &QuantityPosterior) -> String {
    if is_wider(quantity) {
        return "wider".to_owned();
    }
    let percent = 100.0 * quantity.explained;
    if (99.5..100.0).contains(&percent) { "> 99 %".to_owned() } else { format!("{percent:.0} %") }
}

/// Returns whether the data have made a quantity less certain than its prior, for example because
/// they contradict it.
fn is_wider(quantity: &QuantityPosterior) -> bool {
    let deviations = quantity.standard_deviation.zip(quantity.prior_standard_deviation);
    deviations.is_some_and(|(after, before)| after > WIDER * before)
}

/// Returns the ends of the 95 % interval, with two digits of the standard deviation.
fn limits(quantity: &QuantityPosterior, scale: f64, unit: &str) -> String {
    let Some(ends) = quantity.ends() else { return "unknown".to_owned() };
    let deviation = quantity.standard_deviation.unwrap_or(f64::NAN) * scale;
    let decimals = Decimals::for_standard_error(deviation);
    let [lower, upper] = ends.map(|end| match decimals {
        Some(decimals) => decimals.show(end * scale),
        None => digits(end * scale, DIGITS),
    });
    format!("{lower} to {upper}{unit}")
}

fn effort(found: &PosteriorReport) -> String {
    let PosteriorReport { evaluations, draws, .. } = found;
    let effective = found.effective_draws.map_or("?".to_owned(), |count| format!("{count:.0}"));
    format!(
        "{effective} effective draws from {evaluations} evaluations; posterior.csv has {draws} draws."
    )
}

/// Says how many of the velocities the posterior takes to be wrong, if some may be.
pub(super) fn outliers(found: &PosteriorReport) -> Option<String> {
    let share = found.outlier_share.filter(|share| *share >= NOTABLE)?;
    let percent = glued(&format!("{} %", digits(100.0 * share, 2)));
    Some(format!(
        "An estimated {percent} of the velocities are not from the model's law; they count little."
    ))
}

/// Returns the warnings: an accuracy that was not reached, and data that the model hardly explains.
fn doubts(found: &PosteriorReport) -> String {
    let mut text = String::new();
    if !found.converged {
        let reason = found.reason.as_deref().and_then(|reason| reason.lines().next());
        let reason = reason.map_or_else(String::new, |reason| format!(": {reason}"));
        let reason = reason.trim_end_matches('.');
        text.push_str(&wrapped(&format!(
            "Warning: the posterior did not converge{reason}. Its intervals may be off."
        )));
    }
    if let Some(p) = found.predictive_p_value.filter(|p| *p < SURPRISING) {
        let p = glued(&format!("p = {}", digits(p, 2)));
        text.push_str(&wrapped(&format!(
            "Warning: the model with the posterior means of both moments does not explain the \
             distribution of the data (Kolmogorov–Smirnov test: {p})."
        )));
    }
    text
}

#[cfg(test)]
mod tests;
