//! Solutions of searches from several starts: a sample of the points that match the data equally
//! well.

use crate::bone_structure::BoneStructure;
use crate::conclusions::{Solution, Spread, Spreads};
use crate::elasticity::Elasticity;
use crate::parameters::Point;
use crate::results::Evaluation;

/// Returns the best point of each start of set number `set` that found a feasible one.
pub fn solutions(set: usize, history: &[Evaluation]) -> Vec<Solution> {
    let mut solutions: Vec<Solution> = Vec::new();
    for row in history.iter().filter(|row| row.belongs_to(set) && row.role.is_of_search()) {
        let cost = row.cost.unwrap_or(f64::INFINITY);
        let here = Solution { start: row.role.start, point: row.point, cost, evaluations: 1 };
        match solutions.last_mut().filter(|last| last.start == row.role.start) {
            None => solutions.push(here),
            Some(last) => {
                let evaluations = last.evaluations + 1;
                *last = Solution { evaluations, ..if cost < last.cost { here } else { *last } };
            }
        }
    }
    solutions.retain(|solution| solution.cost.is_finite());
    solutions
}

/// Returns the spreads over points, of a bone of this structure; `None` if there are none.
pub fn spread(points: &[Point], structure: &BoneStructure) -> Option<Spreads> {
    let of = |values: &mut dyn Iterator<Item = f64>| {
        let mut spread = Spread { smallest: f64::INFINITY, largest: f64::NEG_INFINITY, mean: 0.0 };
        for value in values {
            spread.smallest = spread.smallest.min(value);
            spread.largest = spread.largest.max(value);
            spread.mean += value / points.len() as f64;
        }
        spread
    };
    let first = points.first()?;
    let of_parameter =
        |(parameter, _)| (parameter, of(&mut points.iter().map(|point| point.get(parameter))));
    let parameters = first.given().map(of_parameter).collect();
    // Points that were evaluated are always admissible.
    let mean = |point: &Point| Some(structure.mean_solid(point).ok()?.elasticity);
    let matrices: Vec<Elasticity> = points.iter().filter_map(mean).collect();
    let entries = (0..6).flat_map(|i| (i..6).map(move |j| (i, j)));
    let entries =
        entries.map(|(i, j)| (i, j, of(&mut matrices.iter().map(|matrix| matrix.rows()[i][j]))));
    Some(Spreads { parameters, entries: entries.collect() })
}
