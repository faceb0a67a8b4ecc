//! Where a search may go next: nothing is told, and nothing is changed.

use std::sync::Arc;

use osteon_common::outcome::Outcome;
use osteon_common::parameters::Point;

use super::{Plan, Search, Step};

impl Search {
    /// Points that may be asked for after the present one, at most `most`, the likeliest first.
    pub fn likely(&self, most: usize) -> Vec<Point> {
        match (&self.plan, self.ask()) {
            (Plan::Identification(identification), Step::Evaluate(point)) => {
                distinct(identification.likely(most), Some(point))
            }
            _ => Vec::new(),
        }
    }

    /// The point that will be asked for once these outcomes of the present one are told, and those
    /// that may be asked for after it, at most `most`, the likeliest first. What they say is kept until
    /// they are told.
    pub fn likely_after(&mut self, outcomes: &Arc<[Outcome]>, most: usize) -> Vec<Point> {
        let (Plan::Identification(identification), Step::Evaluate(point)) =
            (&self.plan, self.ask())
        else {
            return Vec::new();
        };
        let judged = self.judge(&point, outcomes);
        let row = self.row(point, &judged);
        let mut told = identification.clone();
        told.tell(&self.specification, row, judged.verdict, Arc::clone(outcomes));
        self.judged = Some(judged);
        let Some(next) = told.point() else {
            return Vec::new();
        };
        let others = told.likely(most.saturating_sub(1));
        distinct([next].into_iter().chain(others), None)
    }
}

/// Each of these points once, and not `but`.
fn distinct(points: impl IntoIterator<Item = Point>, but: Option<Point>) -> Vec<Point> {
    let mut distinct: Vec<Point> = Vec::new();
    for point in points {
        if !distinct.iter().chain(&but).any(|known| same_point(known, &point)) {
            distinct.push(point);
        }
    }
    distinct
}

/// Whether two points are the same to the bit.
pub fn same_point(a: &Point, b: &Point) -> bool {
    a.0.map(f64::to_bits) == b.0.map(f64::to_bits)
}
