//! The estimated cost of a job.

use osteon_common::job::{Data, JobKind, JobSpecification, Measurements, SearchMethod};
use osteon_common::parameters::Parameter;

use super::layout::{aligned, glued, wrapped};
use super::number::significant;
use super::result::{readable, scale};
use crate::output::ShownCost;
use crate::progress::span;
use osteon_local::cost::{JobCost, PlaceCost};

/// Digits of a time, which the next measurement will not repeat.
const TIME_DIGITS: usize = 2;
/// Digits of the coordinates of a point.
const POINT_DIGITS: usize = 3;

/// Returns what the job will do, what realizations take, and what all of it takes.
pub(super) fn table(shown: &ShownCost<'_>) -> String {
    let ShownCost { specification, cost, isa } = *shown;
    let mut text = wrapped(&task(specification));
    text.push_str(&wrapped(&evaluations(specification)));
    text.push('\n');
    text.push_str(&measured(cost));
    text.push_str(&wrapped(&worst(specification, cost)));
    text.push('\n');
    text.push_str(&wrapped(&expected(specification, cost, isa.name())));
    text
}

fn task(specification: &JobSpecification) -> String {
    let Some(data) = specification.data.as_ref() else {
        return "the job is valid: a propagation, the moments at the fixed and start values, without \
                a search"
            .to_owned();
    };
    let free: Vec<&str> = specification.free().map(Parameter::name).collect();
    let method = match specification.search.method {
        SearchMethod::Posterior => "the posterior, without a search,".to_owned(),
        method => format!("a search by {}", method.name()),
    };
    let posterior = specification.posterior.is_some() && specification.is_searched();
    let posterior = if posterior { ", and their posterior" } else { "" };
    format!(
        "the job is valid: an identification from {}; {method} for {} ({}){posterior}",
        described(data),
        counted(free.len() as u64, "free parameter"),
        free.join(", "),
    )
}

fn described(data: &Data) -> String {
    match &data.measurements {
        Measurements::Velocities { velocities, .. } => counted(velocities.len() as u64, "velocity"),
        Measurements::Moments { .. } => "the moments of the velocities".to_owned(),
        Measurements::Groups(groups) => {
            let count = groups.iter().map(|group| group.velocities.len()).sum::<usize>();
            let [groups, searched] =
                [groups.len(), data.searchable_count()].map(|count| count as u64);
            let velocities = counted(count as u64, "velocity");
            let rest = if searched < groups {
                format!(", of which {searched} can be searched")
            } else {
                String::new()
            };
            format!("{velocities} of {}{rest}", counted(groups, "group"))
        }
    }
}

fn evaluations(specification: &JobSpecification) -> String {
    let realizations = specification.monte_carlo.realizations;
    if specification.kind == JobKind::Propagation {
        return format!("one evaluation of {}", counted(realizations, "realization"));
    }
    let starts = match specification.search.starts {
        starts if starts > 1 && specification.is_searched() => {
            format!(" from {}", counted(starts, "start"))
        }
        _ => String::new(),
    };
    format!(
        "at most {}{starts}, each of {}",
        counted(specification.evaluations_max(), "evaluation"),
        counted(realizations, "realization")
    )
}

/// Returns the table of the times of realizations.
fn measured(cost: &JobCost) -> String {
    let row = |name: &str, mean_s: Option<f64>, measured: usize, failed: usize| {
        let time = mean_s.map_or("–".to_owned(), milliseconds);
        [name.to_owned(), time, measured.to_string(), failed.to_string()]
    };
    let header = ["", "ms per realization", "measured", "failed"].map(str::to_owned);
    let of = |place: Option<&PlaceCost>, name: &str| match place {
        Some(place) => row(name, Some(place.mean_s), place.measured, place.failed),
        None => row(name, None, 0, 0),
    };
    let mut rows = vec![header, of(cost.start.as_ref(), "at the start")];
    if !cost.places.is_empty() {
        let sum = |count: fn(&PlaceCost) -> usize| cost.places.iter().map(count).sum();
        let (measured, failed) = (sum(|place| place.measured), sum(|place| place.failed));
        let median = format!("median of {} points of the box", cost.places.len());
        rows.push(row(&median, cost.median_s(), measured, failed));
        rows.push(of(cost.worst(), "worst of these points"));
    }
    aligned(&rows)
}

fn worst(specification: &JobSpecification, cost: &JobCost) -> String {
    let mut sentences = Vec::new();
    if let Some(worst) = cost.worst() {
        let at = specification.free().map(|parameter| {
            let (factor, unit) = scale(parameter);
            let value = significant(factor * worst.point.get(parameter), POINT_DIGITS);
            glued(&format!("{} {value}{unit}", readable(parameter)))
        });
        sentences.push(format!("the worst has {}", at.collect::<Vec<_>>().join(", ")));
    }
    if cost.unmeasured > 0 {
        let count = counted(cost.unmeasured as u64, "point");
        let limit = glued(&span(cost.limit_s));
        sentences.push(format!("{count} of the box could not be measured within {limit}"));
    }
    sentences.join("\n")
}

fn expected(specification: &JobSpecification, cost: &JobCost, isa: &str) -> String {
    let machine = format!("{} of this machine ({isa})", counted(cost.cores.into(), "core"));
    let (Some([least, most]), Some(wall)) = (cost.processor_s(), cost.wall_s()) else {
        let limit = glued(&span(cost.limit_s));
        return format!("not one realization at the start was computed within {limit} on a core");
    };
    let range = |low: f64, high: f64| {
        let [low, high] = [low, high].map(|seconds| glued(&span(seconds)));
        if low == high { format!("about {low}") } else { format!("{low} to {high}") }
    };
    let times = format!(
        "{} of processor time, {} on the {machine}",
        range(least, most),
        range(wall[0], wall[1])
    );
    if specification.kind == JobKind::Propagation {
        return format!("expected: {times}");
    }
    let (fewest, most) = (cost.expected.fewest, cost.expected.most);
    let evaluations =
        if fewest == most { fewest.to_string() } else { format!("{fewest} to {most}") };
    format!("expected: {evaluations} evaluations, {times}")
}

fn milliseconds(seconds: f64) -> String {
    significant(seconds * 1e3, TIME_DIGITS)
}

/// Returns a number with its noun, in the plural unless it is one.
fn counted(count: u64, noun: &str) -> String {
    match (count, noun.strip_suffix('y')) {
        (1, _) => format!("1 {noun}"),
        (_, Some(stem)) => format!("{count} {stem}ies"),
        (_, None) => format!("{count} {noun}s"),
    }
}
