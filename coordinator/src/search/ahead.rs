//! Where a search may go next: nothing is told, and nothing is changed.

use osteon_common::outcome::Outcome;
use osteon_common::parameters::Point;
use osteon_common::statistics::Verdict;

use super::{Plan, Search, Step};
use crate::ask::Ask;
use crate::search_box::admissible;

impl Search {
    /// Points that may be asked for after the present one, at most `most`, the likeliest first.
    pub fn likely(&self, most: usize) -> Vec<Point> {
        match (&self.plan, self.ask()) {
            (Plan::Identification { method, .. }, Step::Evaluate(point)) => {
                self.distinct(method.likely(most), Some(point))
            }
            _ => Vec::new(),
        }
    }

    /// The point that will be asked for once these outcomes of the present one are told, and those
    /// that may be asked for after it, at most `most`, the likeliest first.
    pub fn likely_after(&self, outcomes: &[Outcome], most: usize) -> Vec<Point> {
        let (Plan::Identification { method, data }, Step::Evaluate(point)) =
            (&self.plan, self.ask())
        else {
            return Vec::new();
        };
        let verdict = Verdict::of(&self.specification.monte_carlo, &point, outcomes);
        let mut method = method.clone();
        method.tell(verdict.cost(*data), verdict.moments);
        method.refuse_inadmissible(&self.space);
        let Ask::At(next) = method.ask() else {
            return Vec::new();
        };
        let next = next.to_vec();
        let others = method.likely(most.saturating_sub(1));
        self.distinct([next].into_iter().chain(others), None)
    }

    /// The admissible points with these coordinates, each once, and not `but`.
    fn distinct(&self, at: impl IntoIterator<Item = Vec<f64>>, but: Option<Point>) -> Vec<Point> {
        let mut distinct: Vec<Point> = Vec::new();
        for point in at.into_iter().map(|at| self.space.point(&at)).filter(admissible) {
            if !distinct.iter().chain(&but).any(|known| same_point(known, &point)) {
                distinct.push(point);
            }
        }
        distinct
    }
}

/// Whether two points are the same to the bit.
pub(crate) fn same_point(a: &Point, b: &Point) -> bool {
    a.0.map(f64::to_bits) == b.0.map(f64::to_bits)
}
