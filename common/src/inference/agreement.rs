//! Whether the model at a point matches the data, and whether a bound keeps it from matching better.

use super::decay::DecayWeights;
use super::noise::{Noise, noise, normal_law_noise};
use crate::job::{Data, JobSpecification};
use crate::moments::log_ratios;
use crate::parameters::{Parameter, Point};
use crate::results::{DecayEstimate, Estimate};

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
    /// Differences of the logarithms of mean and coefficient of variation, model minus data.
    pub differences: [f64; 2],
    /// Standard errors of these, of data and sampling together, as they are counted; `None` if the
    /// data's are not known.
    pub errors: Option<[f64; 2]>,
    /// Difference of the mean decay relative to that of the data, model minus data, and its standard
    /// error of data and sampling together; `None` if no decays were measured.
    pub decay: Option<[f64; 2]>,
    /// Whether all differences are at most three standard errors of data and sampling, or
    /// negligible. Where a parameter lies on a bound, errors count at most as those of a normal law:
    /// an outlier must not excuse the difference that it causes.
    pub matched: bool,
    /// Whether a parameter lies on a bound while a difference is not negligible: the search would go
    /// further, so that the point says little of where the truth is.
    pub held: bool,
}

/// Compares a model's `estimate`, and that of its mean decay, at `point` with set number `set` of the
/// data; `None` without data.
pub fn agreement(
    specification: &JobSpecification,
    set: usize,
    point: &Point,
    estimate: &Estimate,
    decay: Option<&DecayEstimate>,
) -> Option<Agreement> {
    let data = specification.data.as_ref()?;
    let noise = noise(data, set, estimate);
    let differences = log_ratios(estimate.moments, data.moments(set));
    let decay = decay.and_then(|decay| off_decay(data, set, decay));
    Some(compared(specification, set, point, (differences, decay), &noise))
}

/// Returns the relative difference of a model's mean decay from that of the data, and its standard error.
pub(super) fn off_decay(data: &Data, set: usize, model: &DecayEstimate) -> Option<[f64; 2]> {
    let weights = DecayWeights::of_data(data, set)?;
    let difference = weights.difference_of_decays(model.mean);
    let of_sampling = weights.relative(model.standard_error);
    let variance = weights.covariance[2][2] + of_sampling * of_sampling;
    Some([difference, variance.sqrt()])
}

/// Compares a model at `point`, given how far its moments are from those of the data, the same of its
/// decay with its error, and the noise of the moments.
pub(super) fn compared(
    specification: &JobSpecification,
    set: usize,
    point: &Point,
    (differences, decay): ([f64; 2], Option<[f64; 2]>),
    noise: &Noise,
) -> Agreement {
    let variances = variances(noise);
    let limit = |axis: usize| (NEGLIGIBLE * NEGLIGIBLE * variances[axis]).max(EXACT * EXACT);
    let negligible = |axis: usize| differences[axis] * differences[axis] <= limit(axis);
    let is_met = negligible(0) && negligible(1) && is_near(decay, NEGLIGIBLE);
    let held = is_on_bound(specification, point) && !is_met;
    let normal = specification.data.as_ref().filter(|_| held);
    let counted = normal.map_or(variances, |data| at_most_normal(data, set, noise));
    Agreement {
        differences,
        errors: noise.data.map(|_| counted.map(f64::sqrt)),
        decay,
        matched: is_within(differences, counted) && is_near(decay, ERRORS_MAX),
        held,
    }
}

/// Returns whether the difference of decays is at most this many standard errors, or negligible.
fn is_near(decay: Option<[f64; 2]>, errors: f64) -> bool {
    decay.is_none_or(|[difference, error]| difference.abs() <= (errors * error).max(EXACT))
}

/// Returns whether the differences are within the noise.
fn is_within(differences: [f64; 2], variances: [f64; 2]) -> bool {
    let within = |axis: usize| {
        let square = differences[axis] * differences[axis];
        // The errors of a single realization are unknown (NaN), and `max` ignores them.
        square <= (ERRORS_MAX * ERRORS_MAX * variances[axis]).max(EXACT * EXACT)
    };
    within(0) && within(1)
}

fn variances(noise: &Noise) -> [f64; 2] {
    let covariance = noise.covariance();
    [covariance[0][0], covariance[1][1]]
}

/// Returns the variances with the data's part not larger than that of a normal law.
fn at_most_normal(data: &Data, set: usize, found: &Noise) -> [f64; 2] {
    let all = variances(found);
    let Some(normal) = normal_law_noise(data, set) else { return all };
    let normal = variances(&Noise { data: Some(normal), ..*found });
    [all[0].min(normal[0]), all[1].min(normal[1])]
}

fn is_on_bound(specification: &JobSpecification, point: &Point) -> bool {
    let on_bound =
        |parameter: &Parameter| specification.range(*parameter).is_on_bound(point.get(*parameter));
    Parameter::ALL.iter().any(on_bound)
}
