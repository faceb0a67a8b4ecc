//! Candidate points of a search for speculative evaluation. Finding them does not change the
//! search.

use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::Point;

use super::{Search, SearchPlan, Step};

impl Search {
    /// Returns at most `most` points that the search may ask for after the pending one, the most
    /// probable first.
    pub fn candidates(&self, most: usize) -> Vec<Point> {
        match (&self.plan, self.ask()) {
            (SearchPlan::Identification(identification), Step::Evaluate(point)) => {
                distinct(identification.candidates(most), Some(point))
            }
            _ => Vec::new(),
        }
    }

    /// Returns whether `tell` may take seconds: after the last point that a search with a posterior knows of, it draws
    /// the posterior of what it has interpolated.
    pub fn takes_long(&self) -> bool {
        self.specification.posterior.is_some() && self.candidates(1).is_empty()
    }

    /// Returns the point that the search will ask for once it is given these outcomes of the
    /// pending point, followed by candidates after that one; at most `most` points, the most
    /// probable first. The assessment of the outcomes is cached until they are passed to `tell`.
    pub fn candidates_after(&mut self, outcomes: &Outcomes, most: usize) -> Vec<Point> {
        let (SearchPlan::Identification(identification), Step::Evaluate(point)) =
            (&self.plan, self.ask())
        else {
            return Vec::new();
        };
        let assessment = self.assess(&point, outcomes);
        let row = self.row(point, &assessment);
        let mut after = identification.clone();
        after.tell(&self.specification, row, assessment.statistics, outcomes.clone());
        self.assessment = Some(assessment);
        let Some(next) = after.point() else {
            return Vec::new();
        };
        let others = after.candidates(most.saturating_sub(1));
        distinct([next].into_iter().chain(others), None)
    }
}

/// Returns each of these points once, without `but`.
fn distinct(points: impl IntoIterator<Item = Point>, but: Option<Point>) -> Vec<Point> {
    let mut distinct: Vec<Point> = Vec::new();
    for point in points {
        if !distinct.iter().chain(&but).any(|known| same_point(known, &point)) {
            distinct.push(point);
        }
    }
    distinct
}

/// Returns whether two points are equal to the bit.
pub fn same_point(a: &Point, b: &Point) -> bool {
    a.bits() == b.bits()
}
