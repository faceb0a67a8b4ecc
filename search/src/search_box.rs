//! The box of the free parameters, in units of its edges: each coordinate runs from 0 at the lower
//! bound to 1 at the upper.

use osteon_common::bone_structure::BoneStructure;
use osteon_common::ensemble::DISPERSION_MAX;
use osteon_common::job::{ON_BOUND, Range};
use osteon_common::parameters::{BONE_PARAMETERS, PARAMETERS, Parameter, Point};

/// The ranges within which a search moves.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchBox {
    ranges: [Range; PARAMETERS],
    structure: BoneStructure,
}

/// The bound of a parameter on which a point lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The lower bound.
    Lower,
    /// The upper bound.
    Upper,
}

impl SearchBox {
    /// Creates the box of these ranges, which are in the order of [`Parameter::ALL`] and have been
    /// checked.
    pub fn new(ranges: [Range; PARAMETERS]) -> Self {
        Self { ranges, structure: BoneStructure::default() }
    }

    /// Returns the box for bones of this structure.
    #[must_use]
    pub fn with_structure(self, structure: BoneStructure) -> Self {
        Self { structure, ..self }
    }

    /// Returns the structure of the bone in the setup; a point may have porosities of its own.
    pub(crate) fn structure(&self) -> &BoneStructure {
        &self.structure
    }

    /// Returns whether realizations can be drawn at a point.
    pub fn admits(&self, point: &Point) -> bool {
        admissible(&self.structure, point)
    }

    /// Returns the coordinates of the start.
    pub fn start(&self) -> Vec<f64> {
        self.ranges.iter().filter_map(unit_start).collect()
    }

    /// Returns the first coordinate that √(c1111/ρ) and the dispersion do not depend on, as those of other
    /// parameters of the setup; the number of coordinates if there is none.
    pub fn first_unknown(&self) -> usize {
        let known = self.ranges.iter().take(BONE_PARAMETERS + Parameter::OF_PORES.len());
        known.filter(|range| matches!(range, Range::Free { .. })).count()
    }

    /// Returns the box with its start at these coordinates; surplus coordinates are ignored.
    pub fn started_at(&self, coordinates: &[f64]) -> Self {
        let mut coordinates = coordinates.iter();
        Self {
            structure: self.structure.clone(),
            ranges: self.ranges.map(|range| match range {
                Range::Fixed(_) => range,
                Range::Free { lower, upper, start } => match coordinates.next() {
                    Some(u) => {
                        let start = (lower + u * (upper - lower)).clamp(lower, upper);
                        Range::Free { start, lower, upper }
                    }
                    None => Range::Free { start, lower, upper },
                },
            }),
        }
    }

    /// Returns the point with these coordinates. A coordinate that never moved keeps the bits of
    /// its start.
    pub fn point(&self, at: &[f64]) -> Point {
        let mut at = at.iter();
        Point::new(self.ranges.map(|range| match range {
            Range::Fixed(value) => value,
            Range::Free { start, lower, upper } => match at.next() {
                Some(u) if Some(*u) != unit_start(&range) => {
                    (lower + u * (upper - lower)).clamp(lower, upper)
                }
                _ => start,
            },
        }))
    }

    /// Converts derivatives with respect to [`Parameter::ALL`] to derivatives with respect to the
    /// coordinates.
    pub fn per_edge(&self, gradient: &[f64; PARAMETERS]) -> Vec<f64> {
        let of = |(range, slope): (&Range, &f64)| match range {
            Range::Fixed(_) => None,
            Range::Free { .. } => Some(slope * range.edge()),
        };
        self.ranges.iter().zip(gradient).filter_map(of).collect()
    }

    /// Returns the free parameters that lie on a bound at `point`, with the bound.
    pub fn on_bounds(&self, point: &Point) -> Vec<(Parameter, Side)> {
        let side = |parameter: Parameter| {
            let at = self.ranges[parameter as usize].coordinate(point.get(parameter))?;
            match at {
                _ if at < ON_BOUND => Some((parameter, Side::Lower)),
                _ if at > 1.0 - ON_BOUND => Some((parameter, Side::Upper)),
                _ => None,
            }
        };
        Parameter::ALL.into_iter().filter_map(side).collect()
    }
}

/// Returns whether realizations can be drawn at `point`, of a bone of this structure.
pub fn admissible(structure: &BoneStructure, point: &Point) -> bool {
    let dispersion = point.dispersion();
    dispersion > 0.0 && dispersion < DISPERSION_MAX && structure.mean_solid(point).is_ok()
}

fn unit_start(range: &Range) -> Option<f64> {
    range.coordinate(range.start()).map(|at| at.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use osteon_common::parameters::extended;

    use super::*;

    fn example() -> SearchBox {
        let mut ranges =
            Range::of_bone([1598.8, 0.0, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.0].map(Range::Fixed));
        ranges[1] = Range::Free { start: 15.2e9, lower: 12e9, upper: 25e9 };
        ranges[6] = Range::Free { start: 0.12, lower: 0.02, upper: 0.3 };
        SearchBox::new(ranges)
    }

    #[test]
    fn coordinates_are_those_of_the_free_parameters() {
        let space = example();
        assert_eq!(space.start().len(), 2);
        assert_eq!(space.point(&space.start()).0[1].to_bits(), 15.2e9_f64.to_bits());
        let corner = space.point(&[0.0, 1.0]);
        assert_eq!((corner.0[1], corner.0[6], corner.0[0]), (12e9, 0.3, 1598.8));
    }

    #[test]
    fn slopes_are_those_along_an_edge() {
        let slopes = example().per_edge(&extended([9.0, 1e-9, 9.0, 9.0, 9.0, 9.0, 2.0], 9.0));
        assert!((slopes[0] - 13.0).abs() < 1e-12 && (slopes[1] - 0.56).abs() < 1e-12);
        assert_eq!(slopes.len(), 2);
    }

    #[test]
    fn parameters_on_a_bound_are_named() {
        let space = example();
        assert_eq!(space.on_bounds(&space.point(&[0.5, 0.5])), []);
        let expected = [
            (Parameter::LongitudinalYoungModulus, Side::Upper),
            (Parameter::Dispersion, Side::Lower),
        ];
        assert_eq!(space.on_bounds(&space.point(&[1.0, 0.0])), expected);
    }
}
