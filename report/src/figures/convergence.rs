//! The path of the search: cost, moments and parameters of its evaluations.

use osteon_common::parameters::Parameter;
use osteon_files::report::Moment;

use super::Figure;
use crate::chart::{Axis, Chart, Ink, Shape};
use crate::finding::Finding;
use crate::number::digits;
use crate::quantity::{symbol, words};
use crate::table::NumberTable;

/// Most evaluations that are drawn: the lines of more are thinned.
const ROWS_MAX: usize = 600;

/// Returns the figures of the search, if its history is known.
pub(super) fn of(finding: &Finding<'_>) -> Vec<Figure> {
    let Some(rows) = SearchRows::of(finding) else { return Vec::new() };
    let mut figures = vec![cost(finding, &rows)];
    figures.extend(Moment::ALL.into_iter().filter_map(|moment| course(finding, moment, &rows)));
    figures.extend(parameters(finding, &rows));
    figures
}

/// The rows of `history.csv` that belong to one set of data.
struct SearchRows<'a> {
    table: &'a NumberTable,
    places: Vec<usize>,
}

impl<'a> SearchRows<'a> {
    fn of(finding: &'a Finding<'_>) -> Option<Self> {
        let table = finding.context.history.as_ref()?;
        let groups = table.texts("group");
        let belongs = |place: &usize| match (&groups, finding.group) {
            (Some(groups), Some(name)) => groups[*place] == name,
            _ => true,
        };
        let places: Vec<usize> = (0..table.len()).filter(belongs).collect();
        (places.len() > 1).then_some(Self { table, places })
    }

    /// Returns the numbers of a column; `None` if there is no such column.
    fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        let all = self.table.numbers(name).ok()??;
        Some(self.places.iter().map(|place| all[*place]).collect())
    }

    /// Returns a column against the number of the evaluation within this search.
    fn line(&self, values: &[f64]) -> Vec<[f64; 2]> {
        let every = values.len().div_ceil(ROWS_MAX).max(1);
        let last = values.len().saturating_sub(1);
        let kept = values.iter().enumerate();
        let kept = kept.filter(|(place, _)| place % every == 0 || *place == last);
        kept.map(|(place, value)| [place as f64, *value]).collect()
    }

    /// Number of the evaluation within this search that has this number in the job.
    fn place_of(&self, number: u64) -> Option<f64> {
        let numbers = self.numbers("evaluation")?;
        numbers.iter().position(|one| *one == number as f64).map(|place| place as f64)
    }
}

const X: &str = "evaluation";

fn cost(finding: &Finding<'_>, rows: &SearchRows<'_>) -> Figure {
    let costs = rows.numbers("cost").unwrap_or_default();
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
    let level = finding.noise_level();
    let y = if positive && smallest < largest {
        let low = level.map_or(smallest, |level| level.min(smallest)).max(largest * 1e-16);
        Axis::logarithmic("cost").spanning(low / 2.0, largest * 2.0)
    } else {
        Axis::linear("cost")
    };
    let title = format!("Cost of each evaluation{}", finding.suffix());
    let name = format!("{}cost", finding.prefix());
    let mut chart = Chart::new(name, title, Axis::linear(X), y);
    chart.description =
        format!("{} evaluations; the lowest cost is {}.", costs.len(), digits(lowest, 3));
    chart.layer("each", Ink::Muted, Shape::Points(rows.line(&costs)));
    chart.layer("best so far", Ink::First, Shape::Line(rows.line(&best)));
    let mut noise = String::new();
    if let Some(level) = level.filter(|_| positive) {
        chart.layer("sampling noise alone", Ink::Second, Shape::Level(level));
        noise = format!(
            " Below {}, the cost that sampling noise alone causes, further improvement says nothing of \
             the bone.",
            digits(level, 2)
        );
    }
    if let Some(place) = finding.below_noise_from.and_then(|number| rows.place_of(number)) {
        chart.layer("first below it", Ink::Third, Shape::Upright(place));
    }
    let reading = format!(
        "The line of the lowest cost so far falls and becomes level where the search cannot improve. \
         Infeasible points have no cost and are not drawn.{noise}"
    );
    Figure { chart, reading }
}

fn course(finding: &Finding<'_>, moment: Moment, rows: &SearchRows<'_>) -> Option<Figure> {
    let (name, title, label) = match moment {
        Moment::Mean => ("mean", "Mean of each evaluation", "mean (m/s)"),
        Moment::CoefficientOfVariation => (
            "coefficient_of_variation",
            "Coefficient of variation of each evaluation",
            "coefficient of variation",
        ),
    };
    let values = rows.numbers(name)?;
    let file = format!("{}search-{}", finding.prefix(), name.replace('_', "-"));
    let title = format!("{title}{}", finding.suffix());
    let mut chart = Chart::new(file, title, Axis::linear(X), Axis::linear(label));
    chart.description = format!("{} evaluations.", values.len());
    let data = finding.data;
    if let Some([low, high]) = data.and_then(|data| data.intervals()).map(|both| both.get(moment)) {
        let ends = [0.0, values.len() as f64 - 1.0];
        let band = ends.map(|x| [x, low, high]).to_vec();
        chart.layer("measured, 95 %", Ink::Second, Shape::Band(band));
    }
    if let Some(level) = data.and_then(|data| data.moments.get(moment)) {
        chart.layer("measured", Ink::Second, Shape::Level(level));
    }
    chart.layer("model", Ink::First, Shape::Line(rows.line(&values)));
    let reading = "The model's line should end within the band of the measured moment, which holds the \
                   moment of the distribution that the data come from with a confidence of 95 %. A \
                   line that ends elsewhere means that the model cannot reproduce this moment within \
                   the bounds.";
    Some(Figure { chart, reading: reading.to_owned() })
}

fn parameters(finding: &Finding<'_>, rows: &SearchRows<'_>) -> Option<Figure> {
    let free: Vec<Parameter> = finding.free();
    if free.is_empty() {
        return None;
    }
    let y = Axis::linear("place between the bounds (0: lower, 1: upper)").spanning(0.0, 1.0);
    let title = format!("Parameters within their bounds{}", finding.suffix());
    let name = format!("{}search-parameters", finding.prefix());
    let mut chart = Chart::new(name, title, Axis::linear(X), y);
    let names = free.iter().map(|one| format!("{} ({})", symbol(*one), words(*one)));
    chart.description = names.collect::<Vec<_>>().join(", ");
    for (place, parameter) in free.iter().enumerate() {
        let Some(values) = rows.numbers(parameter.name()) else { continue };
        let range = finding.range(*parameter);
        let within = |value: &f64| range.coordinate(*value).unwrap_or(f64::NAN);
        let line = rows.line(&values.iter().map(within).collect::<Vec<_>>());
        if free.len() > 4
            && let Some(end) = line.last()
        {
            // Colours repeat after four.
            let at = [end[0] * 0.985, end[1]];
            chart.layer("", Ink::of(place), Shape::Texts(vec![(at, symbol(*parameter).into())]));
        }
        chart.layer(symbol(*parameter), Ink::of(place), Shape::Line(line));
    }
    let reading = "Each line is one free parameter. One that still moves while the cost is level is \
                   not determined by the data; one that ends at 0 or 1 is held by its bound, which \
                   then is a part of the answer.";
    Some(Figure { chart, reading: reading.to_owned() })
}
