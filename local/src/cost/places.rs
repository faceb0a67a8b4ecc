//! The points at which realizations are measured.

use osteon_common::job::{JobKind, JobSpecification, Range};
use osteon_common::parameters::{PARAMETERS, Parameter, Point};
use osteon_search::search_box::SearchBox;

/// Maximum number of points of the sequence that are tried for each one that is admissible.
const TRIED_MAX: usize = 16;
/// Steps of the iteration for the sequence's ratio: it gains a digit in every few.
const RATIO_STEPS: usize = 64;

/// Returns the start, and for an identification at most `count` admissible points of the box: first the corner whose bones are
/// probably slowest to compute, then a sequence that fills the box evenly.
pub(super) fn points(specification: &JobSpecification, count: usize) -> Vec<Point> {
    // Where groups have setups of their own, the first that is searched stands for all.
    let set =
        specification.data.as_ref().and_then(|data| data.searchable_sets().next()).unwrap_or(0);
    let ranges = specification.ranges_of(set);
    let free = specification.free().count();
    let mut points = vec![specification.start_of(set)];
    if specification.kind == JobKind::Propagation || count == 0 {
        return points;
    }
    points.push(slowest_corner(&ranges));
    let space = SearchBox::new(ranges).with_structure(specification.setup.structure.clone());
    let sequence = EvenSequence::new(free);
    let tried = (1..=TRIED_MAX * count).map(|number| space.point(&sequence.coordinates(number)));
    points.extend(tried);
    let mut kept = points.into_iter();
    let start = kept.next();
    let of_box = kept.filter(|point| space.admits(point)).take(count);
    start.into_iter().chain(of_box).collect()
}

/// Returns the corner of the box with slow shear waves, a large dispersion, a thin plate and a strong
/// attenuation; other parameters are as at the start.
fn slowest_corner(ranges: &[Range; PARAMETERS]) -> Point {
    let mut corner = Point::new(ranges.map(|range| range.start()));
    for (parameter, upper_end) in [
        (Parameter::LongitudinalShearModulus, false),
        (Parameter::Dispersion, true),
        (Parameter::BoneThickness, false),
        (Parameter::BoneQualityFactor, false),
    ] {
        if let Range::Free { lower, upper, .. } = ranges[parameter as usize] {
            corner.0[parameter as usize] = if upper_end { upper } else { lower };
        }
    }
    corner
}

/// A sequence of points that fills a cube evenly: the multiples, modulo 1, of the powers of 1/g, where g
/// is the root above 1 of g^(d+1) = g + 1 (the golden ratio for d = 1).
struct EvenSequence {
    steps: Vec<f64>,
}

impl EvenSequence {
    fn new(dimensions: usize) -> Self {
        let degree = dimensions as f64 + 1.0;
        let mut ratio = 1.5_f64;
        for _ in 0..RATIO_STEPS {
            ratio = (1.0 + ratio).powf(1.0 / degree);
        }
        let power = |place: &f64| Some(place / ratio);
        let steps = std::iter::successors(Some(1.0 / ratio), power).take(dimensions).collect();
        Self { steps }
    }

    /// Returns the coordinates, from 0 to 1, of a point of the sequence.
    fn coordinates(&self, number: usize) -> Vec<f64> {
        self.steps.iter().map(|step| (0.5 + step * number as f64).fract()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::tests::job;

    #[test]
    fn points_fill_the_box() {
        let points = points(&job(&[]), 12);
        assert_eq!(points.len(), 13);
        assert_eq!(points[0], job(&[]).start());
        let searched = [Parameter::LongitudinalYoungModulus, Parameter::Dispersion];
        for parameter in searched {
            let range = job(&[]).range(parameter);
            let at = points[2..].iter().filter_map(|point| range.coordinate(point.get(parameter)));
            let mut at: Vec<f64> = at.collect();
            at.sort_by(f64::total_cmp);
            assert!(at[0] < 0.2 && at[10] > 0.8, "{at:?}");
            assert!(at.windows(2).all(|pair| pair[1] - pair[0] < 0.3), "{at:?}");
        }
    }

    #[test]
    fn the_first_point_is_the_slowest_corner() {
        let shear = "[parameters.longitudinal_shear_modulus]\nfixed = 4.795e9";
        let free = "[parameters.longitudinal_shear_modulus]\nstart = 4e9\nbounds = [3e9, 6e9]";
        let thickness = "[parameters.bone_thickness]\nbounds = [1e-3, 5e-3]\n[monte_carlo]";
        let corner = points(&job(&[(shear, free), ("[monte_carlo]", thickness)]), 12)[1];
        assert_eq!(corner.get(Parameter::LongitudinalShearModulus), 3e9);
        assert_eq!(corner.get(Parameter::Dispersion), 0.3);
        assert_eq!(corner.get(Parameter::BoneThickness), 1e-3);
    }

    #[test]
    fn a_propagation_has_its_start_alone() {
        let propagation = JobSpecification { kind: JobKind::Propagation, data: None, ..job(&[]) };
        assert_eq!(points(&propagation, 12), [propagation.start()]);
    }
}
