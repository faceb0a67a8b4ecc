//! Number of evaluations that the search methods need, and the points at which they end.

use std::convert::Infallible;

use osteon_common::case::Setup;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{
    Data, JobKind, JobSpecification, MonteCarlo, Objective, Range, Search, SearchMethod,
};
use osteon_common::moments::MOMENTS;
use osteon_common::parameters::{Parameter, Point};
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::realization::PointError;
use osteon_common::results::{Moments, Status};
use osteon_common::statistics;
use osteon_common::systematic::Systematic;
use osteon_search::{CompletedJob, IdentifyError, newton};

use crate::draws::{Draws, OPTIMUM};
use crate::identify::{RealizationCache, identify, outcomes};
use crate::models::{BOUNDS, mean_model};
use crate::table::{MarkdownTable, two_digits};
use crate::{RowCallback, StudyError};

/// Default number of realizations of each evaluation.
pub const REALIZATIONS: u64 = 500;
/// Number of starts drawn at random.
const RANDOM_STARTS: u64 = 9;
/// Maximum number of evaluations of a search.
const EVALUATIONS_MAX: u64 = 1000;
/// Target cost of the simplex; `newton` has its default.
const SIMPLEX_COST: f64 = 1e-6;
/// Costs for which the number of evaluations is reported.
const COSTS: [f64; 3] = [1e-4, 1e-6, 1e-10];

/// Counts the evaluations of N realizations until the cost is below 1e-4, 1e-6 and 1e-10, from nine
/// starts that are uniform within the bounds and one corner where shear is slow, by both methods;
/// all seven parameters are free. The data are the moments at the paper's optimum by another seed.
///
/// The simplex is run to a cost of 1e-6. `distance` is the distance of the solution from the start
/// in edges of the box. `off` is the distance of the solution from the nearest point to the start
/// when the moments are linearised at the solution by central differences.
///
/// # Errors
/// If the optimum has no ensemble.
pub fn table(draws: &Draws, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&[
        "start",
        "method",
        "status",
        "evaluations",
        "cost",
        "below 1e-4 at",
        "1e-6",
        "1e-10",
        "distance",
        "off",
    ]);
    let data = data(draws)?;
    for (name, start) in starts(draws.seed) {
        for method in [SearchMethod::Newton, SearchMethod::Simplex] {
            let found = run_search(&start, method, data, draws)?;
            let mut row = vec![name.clone(), method.name().to_owned()];
            row.extend(cells(&found, data, draws)?);
            table.push(row);
            progress(&table.last_row());
        }
    }
    Ok(table)
}

/// Returns the starts with their names.
fn starts(seed: u64) -> Vec<(String, Point)> {
    let random = (0..RANDOM_STARTS).map(|k| (format!("random {}", k + 1), mean_model(seed, k)));
    let mut corner = Point::of_bone(BOUNDS.map(|(lower, upper)| 0.5 * (lower + upper)));
    corner.0[Parameter::Density as usize] = 1950.0;
    corner.0[Parameter::LongitudinalShearModulus as usize] = 3.3e9;
    random.chain([("slow shear".to_owned(), corner)]).collect()
}

/// Returns the moments at the optimum, with germs of another seed than the search's.
fn data(draws: &Draws) -> Result<Moments, PointError> {
    let other = MonteCarlo { seed: draws.seed + 1, ..monte_carlo(draws) };
    let outcomes = outcomes(&OPTIMUM, &other, draws.isa)?;
    let estimate = statistics::estimate(&other, &OPTIMUM, &outcomes);
    Ok(estimate.map_or(Moments::UNKNOWN, |estimate| estimate.moments))
}

fn monte_carlo(draws: &Draws) -> MonteCarlo {
    MonteCarlo { realizations: draws.realizations, seed: draws.seed, ..MonteCarlo::default() }
}

struct CompletedSearch {
    specification: JobSpecification,
    status: Status,
    /// Cost of each evaluation.
    costs: Vec<f64>,
    best: Option<Point>,
}

impl CompletedSearch {
    fn lowest(&self) -> f64 {
        self.costs.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Returns the number of evaluations until the cost was below `cost`.
    fn first_below(&self, cost: f64) -> Option<usize> {
        self.costs.iter().position(|&found| found < cost).map(|before| before + 1)
    }
}

fn run_search(
    start: &Point,
    method: SearchMethod,
    data: Moments,
    draws: &Draws,
) -> Result<CompletedSearch, IdentifyError<Infallible>> {
    let mut search =
        Search { max_evaluations: EVALUATIONS_MAX, sensitivities: false, ..Search::by(method) };
    if method == SearchMethod::Simplex {
        search.cost_tolerance = SIMPLEX_COST;
    }
    let Moments { mean, coefficient_of_variation } = data;
    let specification = JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(Data::from_moments(mean, coefficient_of_variation)),
        parameters: Range::of_bone(std::array::from_fn(|i| {
            let (lower, upper) = BOUNDS[i];
            Range::Free { start: start.0[i], lower, upper }
        })),
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: monte_carlo(draws),
        objective: Objective::default(),
        search,
        posterior: None,
    };
    let CompletedJob { result, history } =
        identify(&specification, &mut RealizationCache::new(), draws.isa)?;
    let costs = history.iter().map(|row| row.cost.unwrap_or(f64::INFINITY));
    Ok(CompletedSearch {
        status: result.status,
        costs: costs.collect(),
        best: result.best.map(|best| best.point),
        specification,
    })
}

fn cells(found: &CompletedSearch, data: Moments, draws: &Draws) -> Result<Vec<String>, PointError> {
    let mut cells = vec![
        found.status.name().to_owned(),
        found.costs.len().to_string(),
        format!("{:.0e}", found.lowest()),
    ];
    cells.extend(COSTS.map(|cost| match found.first_below(cost) {
        Some(evaluations) => evaluations.to_string(),
        None => "–".to_owned(),
    }));
    let Some(best) = found.best else { return Ok(cells) };
    let start = found.specification.start();
    cells.push(two_digits(Some(distance(&start, &best))));
    if found.specification.search.method == SearchMethod::Newton {
        let nearest = nearest_match(&start, &best, data, draws)?;
        cells.push(two_digits(nearest.map(|nearest| distance(&nearest, &best))));
    }
    Ok(cells)
}

/// Step of the differences at the solution, in edges of the box.
const DIFFERENCE: f64 = 1e-4;

/// Returns the point nearest to `start` among those that match the data by the moments linearised
/// at `at`; `None` if they cannot be linearised.
fn nearest_match(
    start: &Point,
    at: &Point,
    data: Moments,
    draws: &Draws,
) -> Result<Option<Point>, PointError> {
    let y = |u: &[f64]| -> Result<Option<[f64; 2]>, PointError> {
        let (point, drawn) = (point_at(u), monte_carlo(draws));
        let estimate = statistics::estimate(&drawn, &point, &outcomes(&point, &drawn, draws.isa)?);
        Ok(estimate.map(|estimate| logarithms(estimate.moments)))
    };
    let unit = to_unit(at);
    let Some(found) = y(&unit)? else { return Ok(None) };
    let mut rows: newton::Rows = std::array::from_fn(|_| vec![0.0; 7]);
    for axis in 0..7 {
        let [mut below, mut above] = [unit, unit];
        below[axis] = (unit[axis] - DIFFERENCE).max(0.0);
        above[axis] = (unit[axis] + DIFFERENCE).min(1.0);
        let (Some(from), Some(to)) = (y(&below)?, y(&above)?) else { return Ok(None) };
        for i in 0..2 {
            rows[i][axis] = (to[i] - from[i]) / (above[axis] - below[axis]);
        }
    }
    let target = logarithms(data);
    let mut right = [0.0; MOMENTS];
    for i in 0..2 {
        let here: f64 = rows[i].iter().zip(unit).map(|(slope, u)| slope * u).sum();
        right[i] = here + target[i] - found[i];
    }
    Ok(Some(point_at(&newton::nearest(&to_unit(start), &rows, right))))
}

fn logarithms(moments: Moments) -> [f64; 2] {
    [moments.mean, moments.coefficient_of_variation].map(libm::log)
}

fn to_unit(point: &Point) -> [f64; 7] {
    std::array::from_fn(|i| (point.0[i] - BOUNDS[i].0) / (BOUNDS[i].1 - BOUNDS[i].0))
}

fn point_at(unit: &[f64]) -> Point {
    let mut unit = unit.iter();
    Point::of_bone(
        BOUNDS.map(|(lower, upper)| lower + unit.next().unwrap_or(&0.0) * (upper - lower)),
    )
}

/// Returns the distance in edges of the box.
fn distance(a: &Point, b: &Point) -> f64 {
    let (a, b) = (to_unit(a), to_unit(b));
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use osteon_solver::Isa;

    use super::*;

    /// Every start is admissible; `newton` matches the data to 1e-10 within ten evaluations from at
    /// least nine of the ten. The number of realizations has little influence on the counts.
    #[test]
    fn newton_needs_ten_evaluations_at_most() {
        let draws = Draws { realizations: 40, seed: 1, isa: Isa::fastest() };
        let data = data(&draws).unwrap();
        let starts = starts(draws.seed);
        assert_eq!(starts.len(), 10);
        let within = starts.iter().filter(|(name, start)| {
            assert!(start.constants().elasticity().is_ok(), "{name}");
            let found = run_search(start, SearchMethod::Newton, data, &draws).unwrap();
            assert_eq!(found.status, Status::Converged, "{name}: {:?}", found.costs);
            found.first_below(1e-10).is_some_and(|evaluations| evaluations <= 10)
        });
        assert!(within.count() >= 9);
    }

    /// From three of the starts, with few realizations: the complete study takes minutes.
    #[test]
    fn the_simplex_comes_to_one_in_a_million() {
        let draws = Draws { realizations: 12, seed: 1, isa: Isa::fastest() };
        let data = data(&draws).unwrap();
        for (name, start) in starts(draws.seed).into_iter().rev().step_by(4) {
            let found = run_search(&start, SearchMethod::Simplex, data, &draws).unwrap();
            assert_eq!(found.status, Status::Converged, "{name}: {:?}", found.costs.len());
            assert!(found.lowest() <= SIMPLEX_COST, "{name}: {}", found.lowest());
        }
    }

    #[test]
    fn distances_are_in_edges_of_the_box() {
        let lower = Point::of_bone(BOUNDS.map(|(lower, _)| lower));
        let upper = Point::of_bone(BOUNDS.map(|(_, upper)| upper));
        assert_eq!(distance(&lower, &upper), 7.0_f64.sqrt());
        assert!(distance(&point_at(&to_unit(&OPTIMUM)), &OPTIMUM) < 1e-15);
    }
}
