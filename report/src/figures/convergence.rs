//! The path of the search: cost, moments and parameters of its evaluations.

use osteon_files::report::Moment;

use super::figure::Figure;
use crate::chart::{Axis, Chart, Ink, Shape};
use crate::course::SearchCourse;
use crate::finding::Finding;
use crate::number::digits;

/// Most evaluations that are drawn: the lines of more are thinned.
const ROWS_MAX: usize = 600;

/// Returns the figures of the search, if its history is known.
pub(super) fn figures(finding: &Finding<'_>) -> Vec<Figure> {
    SearchCourse::from_finding(finding).map(|course| course_figures(&course)).unwrap_or_default()
}

/// Returns the figures of a search of two evaluations or more.
pub(crate) fn course_figures(course: &SearchCourse) -> Vec<Figure> {
    if course.rows.len() < 2 {
        return Vec::new();
    }
    let mut figures = vec![cost(course)];
    figures.extend(Moment::ALL.into_iter().map(|moment| moments(course, moment)));
    figures.extend(parameters(course));
    figures
}

/// Returns values of the evaluations against their numbers.
fn line(course: &SearchCourse, values: &[f64]) -> Vec<[f64; 2]> {
    let every = values.len().div_ceil(ROWS_MAX).max(1);
    let last = values.len().saturating_sub(1);
    let kept = course.rows.iter().zip(values).enumerate();
    let kept = kept.filter(|(place, _)| place % every == 0 || *place == last);
    kept.map(|(_, (row, value))| [row.place, *value]).collect()
}

const X: &str = "evaluation";

fn cost(course: &SearchCourse) -> Figure {
    let costs: Vec<f64> = course.rows.iter().map(|row| row.cost).collect();
    let mut lowest = f64::INFINITY;
    let best: Vec<f64> = costs
        .iter()
        .map(|cost| {
            lowest = lowest.min(if cost.is_finite() { *cost } else { f64::INFINITY });
            lowest
        })
        .collect();
    // A likelihood's cost may be negative.
    let positive = costs.iter().all(|cost| !cost.is_finite() || *cost >= 0.0);
    let above = costs.iter().copied().filter(|cost| *cost > 0.0 && cost.is_finite());
    let (smallest, largest) =
        above.fold((f64::INFINITY, 0.0_f64), |(low, high), cost| (low.min(cost), high.max(cost)));
    let level = course.noise_level;
    let y = if positive && smallest < largest {
        let low = level.map_or(smallest, |level| level.min(smallest)).max(largest * 1e-16);
        Axis::logarithmic("cost").with_ends(low / 2.0, largest * 2.0)
    } else {
        Axis::linear("cost")
    };
    let title = format!("Cost of each evaluation{}", course.suffix);
    let name = format!("{}cost", course.prefix);
    let mut chart = Chart::new(name, title, Axis::linear(X), y);
    chart.description =
        format!("{} evaluations; the lowest cost is {}.", course.count(), digits(lowest, 3));
    chart.layer("each", Ink::Muted, Shape::Points(line(course, &costs)));
    chart.layer("best so far", Ink::First, Shape::Line(line(course, &best)));
    let mut noise = String::new();
    if let Some(level) = level.filter(|_| positive) {
        chart.layer("sampling noise alone", Ink::Second, Shape::Level(level));
        noise = format!(
            " Below {}, the cost that sampling noise alone causes, further improvement says nothing of \
             the bone.",
            digits(level, 2)
        );
    }
    if let Some(place) = course.below_noise_from {
        chart.layer("first below it", Ink::Third, Shape::Upright(place));
    }
    let reading = format!(
        "The line of the lowest cost so far falls and becomes level where the search cannot improve. \
         Infeasible points have no cost and are not drawn.{noise}"
    );
    Figure { chart, reading }
}

fn moments(course: &SearchCourse, moment: Moment) -> Figure {
    let (name, title, label) = match moment {
        Moment::Mean => ("mean", "Mean of each evaluation", "mean (m/s)"),
        Moment::CoefficientOfVariation => (
            "coefficient_of_variation",
            "Coefficient of variation of each evaluation",
            "coefficient of variation",
        ),
    };
    let values = course.moments(moment);
    let file = format!("{}search-{}", course.prefix, name.replace('_', "-"));
    let title = format!("{title}{}", course.suffix);
    let mut chart = Chart::new(file, title, Axis::linear(X), Axis::linear(label));
    chart.description = format!("{} evaluations.", course.count());
    if let Some([low, high]) = course.intervals.map(|both| both.get(moment)) {
        let ends = [0.0, course.count() as f64 - 1.0];
        let band = ends.map(|x| [x, low, high]).to_vec();
        chart.layer("measured, 95 %", Ink::Second, Shape::Band(band));
    }
    if let Some(level) = course.measured.get(moment) {
        chart.layer("measured", Ink::Second, Shape::Level(level));
    }
    chart.layer("model", Ink::First, Shape::Line(line(course, &values)));
    let reading = "The model's line should end within the band of the measured moment, which holds the \
                   moment of the distribution that the data come from with a confidence of 95 %. A \
                   line that ends elsewhere means that the model cannot reproduce this moment within \
                   the bounds.";
    Figure { chart, reading: reading.to_owned() }
}

fn parameters(course: &SearchCourse) -> Option<Figure> {
    let free = &course.free;
    if free.is_empty() {
        return None;
    }
    let y = Axis::linear("place between the bounds (0: lower, 1: upper)").with_ends(0.0, 1.0);
    let title = format!("Parameters within their bounds{}", course.suffix);
    let name = format!("{}search-parameters", course.prefix);
    let mut chart = Chart::new(name, title, Axis::linear(X), y);
    let names = free.iter().map(|one| format!("{} ({})", one.row().symbol, one.row().title));
    chart.description = names.collect::<Vec<_>>().join(", ");
    for (place, parameter) in free.iter().enumerate() {
        let values: Vec<f64> = course.rows.iter().map(|row| row.within[place]).collect();
        let line = line(course, &values);
        if free.len() > 4
            && let Some(end) = line.last()
        {
            // Colours repeat after four.
            let at = [end[0] * 0.985, end[1]];
            chart.layer(
                "",
                Ink::nth(place),
                Shape::Texts(vec![(at, parameter.row().symbol.into())]),
            );
        }
        chart.layer(parameter.row().symbol, Ink::nth(place), Shape::Line(line));
    }
    let reading = "Each line is one free parameter. One that still moves while the cost is level is \
                   not determined by the data; one that ends at 0 or 1 is held by its bound, which \
                   then is a part of the answer.";
    Some(Figure { chart, reading: reading.to_owned() })
}
