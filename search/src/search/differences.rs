//! The points beside the best one that measure derivatives, and effects of the setup.

use osteon_common::job::{JobSpecification, Range};
use osteon_common::parameters::{Parameter, Point};

use crate::search_box::admissible;

/// Step of the finite differences that measure derivatives, in edges of the box.
const DIFFERENCE: f64 = 1e-4;

/// Returns points close to `best`, each differing in one free parameter, the first parameter last, after
/// those that measure what uncertain quantities of the setup move.
pub(super) fn differences(
    specification: &JobSpecification,
    best: &Point,
) -> Vec<(Option<Parameter>, Point)> {
    let beside = |parameter: Parameter| {
        let Range::Free { lower, upper, .. } = specification.range(parameter) else {
            return None;
        };
        let step = DIFFERENCE * specification.range(parameter).edge();
        let value = best.get(parameter);
        let moved = |value: f64| {
            let mut point = *best;
            point.0[parameter as usize] = value;
            (Some(parameter), point)
        };
        let steps = [value + step, value - step].into_iter();
        let mut within = steps.filter(|value| (lower..=upper).contains(value)).map(moved);
        within.find(|(_, point)| admissible(&specification.setup.structure, point))
    };
    let free = Parameter::ALL.into_iter().rev().filter_map(beside);
    shifted_points(specification, best).into_iter().chain(free).collect()
}

/// Returns the points with which the effects of uncertain quantities of the setup are measured.
fn shifted_points(
    specification: &JobSpecification,
    best: &Point,
) -> Vec<(Option<Parameter>, Point)> {
    let shifts = specification.shifts(&best.setup(&specification.setup));
    shifts.into_iter().map(|shift| (None, best.shifted(Some(shift)))).collect()
}
