//! The tables of what was found from one set of data.

use osteon_common::job::Range;
use osteon_common::parameters::Parameter;
use osteon_files::report::{Moment, QuantityBudget, QuantityEstimate};

use super::markup::{Numbers, none, table, width_precision};
use crate::finding::Finding;
use crate::quantity::{NUMBER, Precision, Unit, VELOCITY, unit};
use crate::text::escape;

/// Returns the tables: the moments, what the data determine, and the parameters.
pub(super) fn tables(numbers: &Numbers, finding: &Finding<'_>) -> String {
    let mut out = moments(numbers, finding);
    if let Some(found) = moments_table(numbers, finding) {
        out.push_str(&found);
    }
    out.push_str(&parameters(numbers, finding));
    out.push_str(&budget(numbers, finding));
    if finding.cost.is_some() {
        let at = format!("{}/cost", finding.place);
        let cost = numbers.number(finding.cost, &at, NUMBER, Precision::Digits(3));
        out.push_str(&format!("<p>Cost of the best point: {cost}.</p>"));
    }
    out
}

fn moments(numbers: &Numbers, finding: &Finding<'_>) -> String {
    let row = |moment: Moment| {
        let (name, key, unit) = match moment {
            Moment::Mean => ("mean", "mean", VELOCITY),
            Moment::CoefficientOfVariation => {
                ("coefficient of variation", "coefficient_of_variation", NUMBER)
            }
        };
        let place = |object: &str| format!("{}/{object}/{key}", finding.place);
        let data = finding.data;
        let ends = data.and_then(|data| data.intervals()).map(|both| both.get(moment));
        let error = finding.velocity.standard_error.get(moment);
        let precision = error.map_or(Precision::Unknown, Precision::Error);
        let measured = numbers.number(
            data.and_then(|data| data.moments.get(moment)),
            &place("data"),
            unit,
            ends.map_or(Precision::Unknown, width_precision),
        );
        vec![
            with_unit(name, unit),
            numbers.number(
                finding.velocity.moments.get(moment),
                &place("velocity"),
                unit,
                precision,
            ),
            numbers.number(error, &place("velocity/standard_error"), unit, Precision::Digits(2)),
            measured,
            numbers.interval(ends, &place("data/interval"), unit),
        ]
    };
    let columns =
        ["Velocities", "Model", "Standard error by sampling", "Measured", "95 % interval"];
    table("Moments of the velocities", &columns, &Moment::ALL.map(row))
}

/// Returns the table of the two quantities that the moments determine; `None` of a propagation, and
/// where derivatives and posterior are missing.
fn moments_table(numbers: &Numbers, finding: &Finding<'_>) -> Option<String> {
    let columns = ["Quantity", "Value", "95 % interval", "What it is"];
    let name = "Quantities that the moments determine";
    let bulk = with_unit("√(c₁₁₁₁/ρ)", VELOCITY);
    let dispersion = "dispersion δ".to_owned();
    if let Some(posterior) = finding.posterior {
        let place = format!("{}/posterior", finding.place);
        let of =
            |heading: String, one: &osteon_files::report::QuantityPosterior, at: &str, unit| {
                let ends = one.ends();
                let precision = ends.map_or(Precision::Unknown, width_precision);
                vec![
                    heading,
                    numbers.number(one.mean, &format!("{place}/{at}/mean"), unit, precision),
                    numbers.interval(ends, &format!("{place}/{at}/interval_95"), unit),
                    "posterior mean".to_owned(),
                ]
            };
        let mut rows = vec![of(bulk, &posterior.bulk_velocity, "bulk_velocity", VELOCITY)];
        if let Some(one) = posterior.parameters.get(&Parameter::Dispersion) {
            rows.push(of(dispersion, one, "parameters/dispersion", NUMBER));
        }
        return Some(table(name, &columns, &rows));
    }
    let identified = finding.identified?;
    let row = |heading: String, one: &QuantityEstimate, at: &str, unit| {
        let place = format!("{}/identified/{at}", finding.place);
        let known = one.ends().is_some();
        let precision = one.ends().map_or(Precision::Free, width_precision);
        let what = if known {
            "determined by the data"
        } else if !identified.matched {
            "the model misses the data"
        } else {
            "no interval: directions are open, or the data are too few"
        };
        vec![
            heading,
            numbers.number(one.value, &format!("{place}/value"), unit, precision),
            numbers.interval(one.ends(), &format!("{place}/interval"), unit),
            what.to_owned(),
        ]
    };
    let rows = [
        row(bulk, &identified.bulk_velocity, "bulk_velocity", VELOCITY),
        row(dispersion, &identified.dispersion, "dispersion", NUMBER),
    ];
    Some(table(name, &columns, &rows))
}

/// Returns the table of what makes each variance, the largest part of the first quantity's on top; empty where the job
/// names no systematic error.
fn budget(numbers: &Numbers, finding: &Finding<'_>) -> String {
    let Some(first) = finding.budget.first() else { return String::new() };
    let mut sources: Vec<usize> = (0..first.contributions.len()).collect();
    let share = |source: &usize| first.contributions[*source].variance_share;
    sources.sort_by(|a, b| share(b).total_cmp(&share(a)));
    let row = |source: usize| {
        let cell = |(quantity, budget): (usize, &QuantityBudget)| {
            let place = format!(
                "{}/budget/{quantity}/contributions/{source}/variance_share",
                finding.place
            );
            let share = budget.contributions.get(source).map(|one| one.variance_share);
            numbers.number(share, &place, NUMBER, Precision::Digits(2))
        };
        let name = escape(&first.contributions[source].source.replace('_', " "));
        [name].into_iter().chain(finding.budget.iter().enumerate().map(cell)).collect()
    };
    let rows: Vec<Vec<String>> = sources.into_iter().map(row).collect();
    let title = |budget: &QuantityBudget| {
        let parameter = Parameter::ALL.into_iter().find(|one| one.name() == budget.quantity);
        parameter.map_or("√(c₁₁₁₁/ρ)", |parameter| parameter.row().title)
    };
    let columns: Vec<&str> =
        ["Part of the variance of"].into_iter().chain(finding.budget.iter().map(title)).collect();
    table("What makes the errors", &columns, &rows)
}

fn parameters(numbers: &Numbers, finding: &Finding<'_>) -> String {
    let structure = &finding.specification().setup.structure;
    let has_value = |parameter: &Parameter| {
        finding.value(*parameter).0.is_some() && !structure.ignores(*parameter)
    };
    let rows: Vec<Vec<String>> = Parameter::ALL
        .into_iter()
        .filter(has_value)
        .map(|parameter| parameter_row(numbers, finding, parameter))
        .collect();
    if rows.is_empty() {
        return "<p>No point was found.</p>".to_owned();
    }
    let columns = ["Parameter", "Value", "95 % interval", "Bounds", "What it is"];
    table("Parameters of the mean model, and dispersion", &columns, &rows)
}

fn parameter_row(numbers: &Numbers, finding: &Finding<'_>, parameter: Parameter) -> Vec<String> {
    let unit = unit(parameter);
    let heading = with_unit(&format!("{} {}", parameter.row().title, parameter.row().symbol), unit);
    let (value, place) = finding.value(parameter);
    let (lower, upper) = match finding.range(parameter) {
        Range::Fixed(_) => {
            let shown = numbers.number(value, &place, unit, Precision::Given);
            let what = match finding.status {
                Some(_) => "fixed by the job",
                None => "given by the job",
            };
            return vec![heading, shown, none(), none(), what.to_owned()];
        }
        Range::Free { lower, upper, .. } => (lower, upper),
    };
    let bound = |value: f64| unit.show(value, Precision::Given);
    let bounds = format!("{} to {}", bound(lower), bound(upper));
    if finding.status.is_none() {
        let shown = numbers.number(value, &place, unit, Precision::Given);
        return vec![heading, shown, none(), bounds, "start value of the job".to_owned()];
    }
    if let Some(one) = finding.posterior.and_then(|found| found.parameters.get(&parameter)) {
        let place = format!("{}/posterior/parameters/{}", finding.place, parameter.name());
        let precision = one.ends().map_or(Precision::Free, width_precision);
        let share = (100.0 * one.explained).round();
        return vec![
            heading,
            numbers.number(one.mean, &format!("{place}/mean"), unit, precision),
            numbers.interval(one.ends(), &format!("{place}/interval_95"), unit),
            bounds,
            format!("posterior mean; the data removed {share} % of the prior variance"),
        ];
    }
    let known = finding.identified.and_then(|found| found.parameters.get(&parameter));
    let estimate = known.and_then(Option::as_ref);
    if let Some(ends) = estimate.and_then(QuantityEstimate::ends) {
        let at = format!("{}/identified/parameters/{}/interval", finding.place, parameter.name());
        return vec![
            heading,
            numbers.number(value, &place, unit, width_precision(ends)),
            numbers.interval(Some(ends), &at, unit),
            bounds,
            "determined by the data".to_owned(),
        ];
    }
    let shown = numbers.number(value, &place, unit, Precision::Free);
    let shown = format!("<span class=\"free\">{shown}</span>");
    vec![heading, shown, none(), bounds, why_unknown(finding, parameter).to_owned()]
}

/// Says why there is no interval of a free parameter.
fn why_unknown(finding: &Finding<'_>, parameter: Parameter) -> &'static str {
    let Some(identified) = finding.identified else {
        return "free; the derivatives were not measured";
    };
    let on_bound =
        finding.value(parameter).0.is_some_and(|value| finding.range(parameter).is_on_bound(value));
    if !identified.matched {
        return "free; the model misses the data";
    }
    if !identified.free_directions.is_empty() {
        return if on_bound {
            "not determined: one of many values, on a bound"
        } else {
            "not determined: one of many values"
        };
    }
    match identified.parameters.get(&parameter) {
        Some(None) => "not unique: another value may give the same velocity",
        _ => "free; the data are too few for an interval",
    }
}

/// Returns a name with its unit, as HTML.
fn with_unit(name: &str, unit: Unit) -> String {
    escape(&unit.axis_label(name))
}
