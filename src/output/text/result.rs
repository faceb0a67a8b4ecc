//! The table of a result. A stored result looks the same as one that was just computed.

use std::collections::BTreeMap;
use std::path::Path;

use osteon_client::result_status;
use osteon_common::job::{JobSpecification, Objective, Range};
use osteon_common::moments::ObservableEstimate;
use osteon_common::observables::{Observable, ObservableRow};
use osteon_common::outcome::FailureKind;
use osteon_common::parameters::{Parameter, Point};
use osteon_common::results::Status;
use osteon_common::visible;
use osteon_files::report::{Data, Identification, Moment, Propagation, ResultFile, Velocity};
use osteon_search::search_box::SearchBox;

use super::layout::{aligned, glued, wrapped};
use super::number::{DIGITS, Decimals, FREE_DIGITS, digits, measured, significant};
use super::{data_notes, details, fit, groups, identified, posterior, set_up, solver};
use crate::output::{Detail, ShownResult};

/// Returns the table.
pub(super) fn table(shown: &ShownResult<'_>) -> String {
    let mut text = String::new();
    if shown.detail == Detail::Summary {
        text.push_str(&summary(shown));
        text.push_str(&files(shown));
        return text;
    }
    let solver = match shown.result {
        ResultFile::Identification(found) => {
            identification(&mut text, found, shown);
            &found.solver
        }
        ResultFile::Propagation(found) => {
            propagation(&mut text, found, shown.specification);
            &found.solver
        }
    };
    if shown.detail == Detail::Full {
        text.push_str(&details::text(shown.result));
    }
    text.push_str(&format!("\n{}", wrapped(&solver::line(solver))));
    if let Some(integrity) = shown.result.integrity() {
        text.push_str(&wrapped(&visible::line(&format!("Hosts: {}", integrity.statement))));
    }
    text.push_str(&format!("\ndigest {}\n", visible::line(shown.result.digest())));
    text.push_str(&files(shown));
    text
}

/// Returns the line that names the directory of the files, if there is one.
fn files(shown: &ShownResult<'_>) -> String {
    let line = |directory: &Path| wrapped(&format!("files in {}", visible::path(directory)));
    shown.directory.map(line).unwrap_or_default()
}

/// Returns how the run ended, and its numbers without remarks.
fn summary(shown: &ShownResult<'_>) -> String {
    let specification = shown.specification;
    match shown.result {
        ResultFile::Identification(found) => {
            let headline = headline(found, specification);
            if let Some(groups) = &found.groups {
                let pooling = found.pooling.as_ref();
                let table = groups::table(groups, pooling, found.control_variate);
                return format!("{headline}{table}");
            }
            let point = found.cost.and_then(|_| found.parameters.point(found.dispersion));
            let Some(point) = point else { return headline };
            let parameters = parameters(found, &point, specification);
            format!("{headline}\n{}\n{parameters}", moments_and_cost(found))
        }
        ResultFile::Propagation(found) => {
            let failure = result_status::propagation_failure(specification, found);
            let failure = failure.map(|reason| wrapped(&format!("Failed: {reason}")));
            let moments = aligned(&moments(&found.velocity, None));
            format!("{}{moments}", failure.unwrap_or_default())
        }
    }
}

fn identification(text: &mut String, found: &Identification, shown: &ShownResult<'_>) {
    let specification = shown.specification;
    text.push_str(&headline(found, specification));
    let Identification { evaluations, realizations, .. } = found;
    let mut count = format!("{evaluations} evaluations of {realizations} realizations");
    if let Some(measured) = found.sensitivities() {
        count.push_str(&format!(" and {} for derivatives", measured.len()));
    }
    if let Some(posterior) = found.posterior() {
        count.push_str(&format!(" and {} for the posterior", posterior.evaluations));
    }
    if let Some(groups) = &found.groups {
        let posteriors = groups.iter().filter_map(|group| group.posterior.as_ref());
        match posteriors.map(|posterior| posterior.evaluations).sum() {
            0 => {}
            of_posteriors => count.push_str(&format!(" and {of_posteriors} for the posteriors")),
        }
        text.push_str(&count);
        text.push_str(&groups::table(groups, found.pooling.as_ref(), found.control_variate));
        return;
    }
    // A point without a finite cost allows no statement about the data.
    let point = found.cost.and_then(|_| found.parameters.point(found.dispersion));
    let Some(point) = point else {
        match found.posterior() {
            Some(known) => text.push_str(&format!("{}{}", wrapped(&count), posterior::text(known))),
            None => text.push_str(&wrapped(&format!("{count}; no point was feasible"))),
        }
        return;
    };
    let failed = failures(&found.failures);
    text.push_str(&wrapped(&format!("{count}; {failed} at the best point")));
    text.push('\n');
    text.push_str(&moments_and_cost(found));
    let data = found.data.as_ref();
    text.push_str(&notes(found.control_variate, &found.velocity, &found.failures));
    text.push_str(&data.map(data_notes::text).unwrap_or_default());
    text.push('\n');
    text.push_str(&parameters(found, &point, specification));
    if found.status == Status::Failed {
        return;
    }
    if fit::fits(found, specification) {
        text.push_str(&fit::uniqueness(found, &point, specification));
        text.push_str(&identified::text(found, &specification.setup.structure));
        text.push_str(&set_up::text(found, &specification.random, shown.usual_shifts));
    } else {
        text.push_str(&fit::misfit(found, &point, specification));
        let of_posterior = match fit::has_outliers(found) {
            true => posterior::text,
            false => posterior::text_of_misfit,
        };
        text.push_str(&found.posterior().map(of_posterior).unwrap_or_default());
    }
}

/// Describes how the search ended, and why.
fn headline(found: &Identification, specification: &JobSpecification) -> String {
    let reason = found.reason.as_deref().filter(|reason| !reason.is_empty());
    let headline = match found.status {
        Status::Converged => "Converged",
        Status::NotMatched => "Not matched",
        Status::MaxEvaluations => "Not converged",
        Status::Cancelled => "Cancelled",
        Status::Failed => "Failed",
    };
    let used_up = || {
        let search = &specification.search;
        let each = if search.starts > 1 { " from each start" } else { "" };
        format!("reached the limit of {} evaluations{each}", search.max_evaluations)
    };
    // The reason of a search that stops early is complete in itself.
    let reason = match reason {
        None if found.status == Status::MaxEvaluations => Some(used_up()),
        reason => reason.map(str::to_owned),
    };
    let Some(reason) = reason else { return format!("{headline}\n") };
    // A case file may follow the first line of a reason; it must not be changed.
    let (first, rest) = reason.split_once('\n').unwrap_or((&reason, ""));
    let first = wrapped(&format!("{headline}: {first}"));
    if rest.is_empty() { first } else { format!("{first}{}\n", visible::lines(rest.trim_end())) }
}

fn propagation(text: &mut String, found: &Propagation, specification: &JobSpecification) {
    if let Some(reason) = result_status::propagation_failure(specification, found) {
        text.push_str(&wrapped(&format!("Failed: {reason}")));
    }
    let failed = failures(&found.failures);
    text.push_str(&wrapped(&format!("{} realizations; {failed}", found.realizations)));
    text.push('\n');
    text.push_str(&aligned(&moments(&found.velocity, None)));
    text.push_str(&notes(found.control_variate, &found.velocity, &found.failures));
}

/// Returns the number of failed realizations of each kind, by name.
fn failures(counts: &BTreeMap<FailureKind, u64>) -> String {
    let all = failure_count(counts);
    let mut named = counts.iter().map(|(kind, count)| (kind.name().replace('_', " "), *count));
    match (named.next(), counts.len()) {
        (None, _) => "no failures".to_owned(),
        (Some((kind, 1)), 1) => format!("1 failure ({kind})"),
        (Some((kind, _)), 1) => format!("{all} failures ({kind})"),
        (Some(first), _) => {
            let counts = [first].into_iter().chain(named);
            let counts: Vec<String> =
                counts.map(|(kind, count)| format!("{count} {kind}")).collect();
            format!("{all} failures ({})", counts.join(", "))
        }
    }
}

fn failure_count(counts: &BTreeMap<FailureKind, u64>) -> u64 {
    // The counts come from a file and may be arbitrarily large.
    counts.values().copied().fold(0, u64::saturating_add)
}

/// Returns the moments with their standard errors next to the data's, and the cost.
fn moments_and_cost(found: &Identification) -> String {
    let level = found.data.as_ref().and_then(Data::intervals).map(|intervals| intervals.level);
    let interval = level.map(|level| format!("{} % interval", significant(100.0 * level, 3)));
    let header = ["", "model ± standard error", "data", &interval.unwrap_or_default()];
    let mut rows = vec![header.map(str::to_owned)];
    rows.extend(moments(&found.velocity, found.data.as_ref()));
    rows.extend(observables(found));
    if let Some(cost) = found.cost {
        let error = found.cost_standard_error.flatten().unwrap_or(f64::NAN);
        let (name, shown) = match found.objective {
            Objective::Likelihood => ("cost (nats)", measured(cost, error)),
            Objective::Moments => ("cost", digits(cost, 3)),
            Objective::ChiSquare if found.search.penalty.is_some() => {
                ("cost (χ² and priors)", digits(cost, 3))
            }
            Objective::ChiSquare => ("cost (χ²)", digits(cost, 3)),
        };
        rows.push([name.to_owned(), shown, String::new(), String::new()]);
    }
    aligned(&rows)
}

/// Returns a row for each moment: the model's with its standard error, and the data's.
fn moments(velocity: &Velocity, data: Option<&Data>) -> [[String; 4]; 2] {
    let row = |name: &str, moment: Moment| {
        let error = velocity.standard_error.get(moment).unwrap_or(f64::NAN);
        let model = velocity.moments.get(moment);
        let model = model.map_or("none".to_owned(), |number| measured(number, error));
        let [data, interval] = data.map(|data| of_data(data, moment, error)).unwrap_or_default();
        [name.to_owned(), model, data, interval]
    };
    [
        row("mean velocity (m/s)", Moment::Mean),
        row("coefficient of variation", Moment::CoefficientOfVariation),
    ]
}

/// Returns a row for the mean of each observable that was measured.
fn observables(found: &Identification) -> Vec<[String; 4]> {
    let of_data = found.data.as_ref().map(|data| data.observables).unwrap_or_default();
    let row = |(observable, model): (Observable, &ObservableEstimate)| {
        let data = of_data[observable]?;
        let model = measured(model.mean, model.standard_error);
        let data = measured(data.mean, data.standard_error);
        let ObservableRow { short, unit, .. } = observable.row();
        Some([format!("mean {short} ({unit})"), model, data, String::new()])
    };
    found.observables.present().filter_map(row).collect()
}

/// Returns a moment of the data and its interval, with the decimals of the interval's error;
/// without an interval, with those of the model's error.
fn of_data(data: &Data, moment: Moment, error_of_model: f64) -> [String; 2] {
    let Some(number) = data.moments.get(moment) else { return [String::new(), String::new()] };
    let Some([low, high]) = data.intervals().map(|intervals| intervals.get(moment)) else {
        let shown =
            Decimals::for_standard_error(error_of_model).map(|decimals| decimals.show(number));
        return [shown.unwrap_or_else(|| digits(number, DIGITS)), String::new()];
    };
    // An interval of 95 % reaches two standard errors to each side.
    match Decimals::for_standard_error((high - low) / 4.0) {
        Some(decimals) => {
            [decimals.show(number), format!("{} to {}", decimals.show(low), decimals.show(high))]
        }
        None => [digits(number, DIGITS), String::new()],
    }
}

/// Returns further remarks on the moments.
fn notes(
    control_variate: bool,
    velocity: &Velocity,
    failures: &BTreeMap<FailureKind, u64>,
) -> String {
    let uncontrolled = uncontrolled(control_variate, velocity, failures);
    let notes = [uncontrolled, effect_of_failures(velocity, failures)];
    notes.into_iter().flatten().map(|note| wrapped(&note)).collect()
}

/// Returns a remark if the requested control variate could not be used.
pub(super) fn uncontrolled(
    asked: bool,
    velocity: &Velocity,
    failures: &BTreeMap<FailureKind, u64>,
) -> Option<String> {
    let used = velocity.controlled?;
    let failed = match failure_count(failures) {
        0 => String::new(),
        count => format!(" ({count} failed)"),
    };
    (asked && !used).then(|| {
        format!(
            "Control variate not used: it requires at least three realizations and no \
             failures{failed}."
        )
    })
}

/// Estimates the bias that failed realizations may have caused, if there are any.
fn effect_of_failures(
    velocity: &Velocity,
    failures: &BTreeMap<FailureKind, u64>,
) -> Option<String> {
    if failures.is_empty() {
        return None;
    }
    let signed = |moment| {
        let number = velocity.failure_bias.get(moment)?;
        let sign = if number < 0.0 { "-" } else { "+" };
        Some(format!("{sign}{}", digits(number.abs(), 2)))
    };
    let mean = glued(&format!("{} m/s", signed(Moment::Mean)?));
    let variation = signed(Moment::CoefficientOfVariation)?;
    Some(format!(
        "Had the failed realizations succeeded, the mean would change by an estimated {mean} and \
         the coefficient of variation by {variation}."
    ))
}

/// Returns the best point, each parameter with the digits that its uncertainty justifies.
fn parameters(found: &Identification, point: &Point, specification: &JobSpecification) -> String {
    let identified = found.identified();
    let matched = identified.is_some_and(|known| known.matched);
    let is_determined = identified.is_some_and(|known| {
        known.free_directions.is_empty() && known.bulk_velocity.standard_error.is_some()
    });
    let on_bounds = SearchBox::new(specification.parameters).on_bounds(point);
    let row = |parameter: Parameter| {
        let (scale, unit) = scale(parameter);
        let number = point.get(parameter) * scale;
        let known = identified.and_then(|known| match parameter {
            Parameter::Dispersion => Some(known.dispersion),
            _ => *known.parameters.get(&parameter)?,
        });
        let error = known.and_then(|known| known.standard_error).map(|error| error * scale);
        let (shown, bounds, note) = match (specification.range(parameter), error) {
            (Range::Fixed(_), _) => (significant(number, 6), None, "fixed"),
            (Range::Free { lower, upper, .. }, Some(error)) => {
                (measured(number, error), Some([lower, upper]), "")
            }
            (Range::Free { lower, upper, .. }, None) if matched => {
                let on_bound = on_bounds.iter().any(|(bound, _)| *bound == parameter);
                let note = match on_bound {
                    true => "on a bound",
                    // The data determine c1111, and the bounds contain two values that give it.
                    false if is_determined => "not unique",
                    false => "not determined",
                };
                (digits(number, FREE_DIGITS), Some([lower, upper]), note)
            }
            (Range::Free { lower, upper, .. }, None) => {
                (digits(number, DIGITS), Some([lower, upper]), "")
            }
        };
        let bounds = bounds.map(|ends| ends.map(|end| significant(end * scale, 4)).join(" to "));
        let name = readable(parameter);
        [name, format!("{shown}{unit}"), bounds.unwrap_or_default(), note.to_owned()]
    };
    let mut rows = vec![["", "best point", "bounds", ""].map(str::to_owned)];
    rows.extend(specification.parameters_given().map(row));
    aligned(&rows)
}

/// Returns the name of a parameter.
pub(super) fn readable(parameter: Parameter) -> String {
    parameter.name().replace('_', " ").replace("young", "Young").replace("poisson", "Poisson")
}

/// Returns factor and unit that make a parameter readable.
pub(super) fn scale(parameter: Parameter) -> (f64, &'static str) {
    match parameter.unit() {
        "Pa" => (1e-9, " GPa"),
        "" => (1.0, ""),
        "m" => (1e3, " mm"),
        "m/s" => (1.0, " m/s"),
        _ => (1.0, " kg/m³"),
    }
}
