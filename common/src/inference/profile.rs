//! Profiles of the cost: the lowest cost with one parameter held at a value.
//!
//! They require no evaluation: the mean velocity is approximated by √(c1111/ρ), and the coefficient
//! of variation by δ, each times its factor at the best point. Over the whole box that holds to
//! about one per cent, so a profile shows where the data can be matched, but not small differences
//! from them.

use super::weights::MomentWeights;
use crate::conclusions::Profile;
use crate::job::{JobSpecification, Range};
use crate::parameters::{PARAMETERS, Parameter, Point};
use crate::results::Moments;

/// Number of points of a profile, from bound to bound.
pub const PROFILE_POINTS: usize = 11;

/// Returns the profile of each free parameter, given the best point and its moments: of χ² with
/// `weights`, and of the sum of relative squares without. There are none if a parameter of the setup is
/// free, which the approximation does not contain.
pub fn profiles(
    specification: &JobSpecification,
    best: &Point,
    model: Moments,
    data: Moments,
    weights: Option<&MomentWeights>,
) -> Vec<Profile> {
    let free =
        |parameter: &Parameter| matches!(specification.range(*parameter), Range::Free { .. });
    if Parameter::OF_SETUP.iter().any(free) {
        return Vec::new();
    }
    let profile = |parameter: Parameter| {
        let Range::Free { lower, upper, .. } = specification.range(parameter) else {
            return Profile { parameter, values: Vec::new(), costs: Vec::new() };
        };
        let last = (PROFILE_POINTS - 1) as f64;
        let value = |k: usize| lower + (upper - lower) * (k as f64 / last);
        let values: Vec<f64> = (0..PROFILE_POINTS).map(value).collect();
        let cost = |&value: &f64| {
            let mut ranges = specification.parameters;
            ranges[parameter as usize] = Range::Fixed(value);
            lowest_cost(&ranges, best, [model, data], weights)
        };
        let costs = values.iter().map(cost).collect();
        Profile { parameter, values, costs }
    };
    Parameter::ALL.into_iter().filter(free).map(profile).collect()
}

/// Returns the lowest cost over the box of these ranges, given the moments of model and data.
fn lowest_cost(
    ranges: &[Range; PARAMETERS],
    best: &Point,
    [model, data]: [Moments; 2],
    weights: Option<&MomentWeights>,
) -> f64 {
    let Some(here) = squared_velocities(&best.0.map(Range::Fixed)).map(|[only, _]| only) else {
        return f64::INFINITY;
    };
    let Some(reach) = squared_velocities(ranges) else { return f64::INFINITY };
    // Ratios of the moments to those of the best point: those within reach, and those of the data.
    let means = reach.map(|square| (square / here).sqrt());
    let variations = ends(ranges[Parameter::Dispersion as usize])
        .map(|dispersion| dispersion / best.dispersion());
    let wanted =
        [data.mean / model.mean, data.coefficient_of_variation / model.coefficient_of_variation];
    if let Some(weights) = weights {
        let ends = [0, 1].map(|end| [means[end] / wanted[0], variations[end] / wanted[1]]);
        let [lower, upper] = ends.map(|ratios| ratios.map(libm::log));
        return weights.smallest(lower, upper);
    }
    let off = |[lower, upper]: [f64; 2], wanted: f64| {
        relative_square(wanted.clamp(lower, upper) / wanted)
    };
    off(means, wanted[0]) + off(variations, wanted[1])
}

fn relative_square(ratio: f64) -> f64 {
    (1.0 - ratio) * (1.0 - ratio)
}

/// Returns the smallest and largest c1111/ρ of the admissible points of the box; `None` if there is
/// none.
///
/// c1111 = e_L / (1 - r) with r = 2 e_T ν_L² / (e_L (1 - ν_T)) grows with e_T, with ν_T and with
/// |ν_L|, and has its minimum over e_L at r = ½; it grows without bound as r approaches 1, the edge
/// of admissibility.
fn squared_velocities(ranges: &[Range; PARAMETERS]) -> Option<[f64; 2]> {
    let of = |parameter: Parameter| ends(ranges[parameter as usize]);
    let density = of(Parameter::Density);
    let young = of(Parameter::LongitudinalYoungModulus);
    let [low, high] = of(Parameter::LongitudinalPoissonRatio);
    let ratio_squares = [
        if low <= 0.0 && high >= 0.0 { 0.0 } else { (low * low).min(high * high) },
        (low * low).max(high * high),
    ];
    let transverse = of(Parameter::TransverseYoungModulus);
    let ratio = of(Parameter::TransversePoissonRatio);
    // 2 e_T ν_L² / (1 - ν_T): the factor of r that does not contain e_L.
    let part = [0, 1].map(|end| 2.0 * transverse[end] * ratio_squares[end] / (1.0 - ratio[end]));
    let stiffness = |young: f64, part: f64| young / (1.0 - part / young);
    if young[1] <= part[0] {
        return None;
    }
    let slowest_young = (2.0 * part[0]).clamp(young[0], young[1]);
    let smallest = stiffness(slowest_young, part[0]) / density[1];
    let largest = if young[0] <= part[1] {
        f64::INFINITY
    } else {
        stiffness(young[0], part[1]).max(stiffness(young[1], part[1])) / density[0]
    };
    Some([smallest, largest])
}

fn ends(range: Range) -> [f64; 2] {
    match range {
        Range::Fixed(value) => [value; 2],
        Range::Free { lower, upper, .. } => [lower, upper],
    }
}
