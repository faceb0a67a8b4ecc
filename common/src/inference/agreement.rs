//! Whether the model at a point matches the data, and whether a bound keeps it from matching better.

use super::noise::{Noise, noise, normal_law_noise};
use crate::job::{Data, JobSpecification};
use crate::moments::{ComparedMoments, MOMENTS, MomentVector};
use crate::observables::ObservableSet;
use crate::parameters::{Parameter, Point};
use crate::results::{Estimate, ObservableEstimates};

/// Relative difference below which moments always count as matched: no measurement is more
/// accurate.
const EXACT: f64 = 1e-4;
/// Standard errors by which a moment may be off.
const ERRORS_MAX: f64 = 3.0;
/// Standard errors below which a difference is negligible: a search may stop there.
const NEGLIGIBLE: f64 = 0.05;

/// Comparison of a model's moments with those of the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement {
    /// Differences of the compared moments, model minus data.
    pub differences: MomentVector,
    /// Standard errors of these, of data and sampling together, as they are counted; `None` if the
    /// data's are not known.
    pub errors: Option<MomentVector>,
    /// The observables that were measured.
    pub observables: ObservableSet,
    /// Whether all differences are at most three standard errors of data and sampling, or
    /// negligible. Where a parameter lies on a bound, errors count at most as those of a normal law:
    /// an outlier must not excuse the difference that it causes.
    pub matched: bool,
    /// Whether a parameter lies on a bound while a difference is not negligible: the search would go
    /// further, so that the point says little of where the truth is.
    pub held: bool,
}

/// Compares a model's `estimate`, and those of its observables, at `point` with set number `set` of the
/// data; `None` without data.
pub fn agreement(
    specification: &JobSpecification,
    set: usize,
    point: &Point,
    estimate: &Estimate,
    observables: &ObservableEstimates,
) -> Option<Agreement> {
    let data = specification.data.as_ref()?;
    let noise = noise(data, set, estimate, observables);
    let model = ComparedMoments::of_estimates(estimate, observables);
    let differences = model.differences(&data.compared(set));
    Some(compared(specification, set, point, differences, &noise))
}

/// Compares a model at `point`, given how far its moments are from those of the data, and their noise.
pub(super) fn compared(
    specification: &JobSpecification,
    set: usize,
    point: &Point,
    differences: MomentVector,
    noise: &Noise,
) -> Agreement {
    let variances = variances(noise);
    let limit = |axis: usize| (NEGLIGIBLE * NEGLIGIBLE * variances[axis]).max(EXACT * EXACT);
    let is_met = (0..MOMENTS).all(|axis| differences[axis] * differences[axis] <= limit(axis));
    let held = is_on_bound(specification, point) && !is_met;
    let normal = specification.data.as_ref().filter(|_| held);
    let counted = normal.map_or(variances, |data| at_most_normal(data, set, noise));
    Agreement {
        differences,
        errors: noise.data.map(|_| counted.map(f64::sqrt)),
        observables: specification.observables(),
        matched: is_within(differences, counted),
        held,
    }
}

/// Returns whether the differences are within the noise.
fn is_within(differences: MomentVector, variances: MomentVector) -> bool {
    // The errors of a single realization are unknown (NaN), and `max` ignores them.
    let limit = |variance: f64| (ERRORS_MAX * ERRORS_MAX * variance).max(EXACT * EXACT);
    differences.iter().zip(variances).all(|(one, variance)| one * one <= limit(variance))
}

fn variances(noise: &Noise) -> MomentVector {
    let covariance = noise.covariance();
    std::array::from_fn(|axis| covariance[axis][axis])
}

/// Returns the variances with the data's part of the moments of the velocities not larger than that of a
/// normal law.
fn at_most_normal(data: &Data, set: usize, found: &Noise) -> MomentVector {
    let mut all = variances(found);
    if let Some(normal) = normal_law_noise(data, set) {
        let [mean, variation, ..] = variances(&Noise { data: Some(normal), ..*found });
        (all[0], all[1]) = (all[0].min(mean), all[1].min(variation));
    }
    all
}

fn is_on_bound(specification: &JobSpecification, point: &Point) -> bool {
    let on_bound =
        |parameter: &Parameter| specification.range(*parameter).is_on_bound(point.get(*parameter));
    Parameter::ALL.iter().any(on_bound)
}
