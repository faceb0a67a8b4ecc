//! Whether the model at a point matches the data, and whether a bound keeps it from matching better.

use super::noise::{DataNoise, Noise, noise, normal_law_noise, of_velocities};
use crate::job::{Data, JobSpecification, Objective};
use crate::moments::{ComparedMoments, MOMENTS, MomentMatrix, MomentVector};
use crate::observables::ObservableSet;
use crate::outcome::Outcome;
use crate::parameters::{Parameter, Point};
use crate::results::{BestPoint, Estimate, ObservableEstimates};
use crate::statistics::{LikelihoodFit, likelihood_fit};

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

/// Moments, observables and realizations of the model at one point.
#[derive(Debug, Clone, Copy)]
pub struct ModelAtPoint<'a> {
    /// The point.
    pub point: &'a Point,
    /// Moments of its velocities.
    pub velocity: &'a Estimate,
    /// Means of its observables.
    pub observables: &'a ObservableEstimates,
    /// Its realizations.
    pub outcomes: &'a [Outcome],
}

impl<'a> ModelAtPoint<'a> {
    /// Returns those at a best point; `None` if no realization succeeded there.
    pub fn of_best(best: &'a BestPoint) -> Option<Self> {
        Some(Self {
            point: &best.point,
            velocity: best.velocity.as_ref()?,
            observables: &best.observables,
            outcomes: &best.outcomes,
        })
    }
}

/// How far a model is from the data.
#[derive(Debug, Clone, Copy)]
pub(super) struct Misfit {
    /// Differences of the compared moments, model minus data; of the velocities, those by which the model's
    /// would be the likeliest, if a likelihood was maximised.
    pub(super) differences: MomentVector,
    /// Noise of these.
    pub(super) noise: Noise,
    /// Whether both are those of a likelihood's maximum.
    pub(super) by_likelihood: bool,
}

/// Compares a model with set number `set` of the data; `None` without data. Errors of the setup do not
/// count: they belong into the intervals, and excuse no difference.
pub fn agreement(
    specification: &JobSpecification,
    set: usize,
    model: ModelAtPoint<'_>,
) -> Option<Agreement> {
    Some(misfit(specification, set, model)?.agreement(specification, set, model.point))
}

/// Returns how far a model is from set number `set` of the data; `None` without data.
pub(super) fn misfit(
    specification: &JobSpecification,
    set: usize,
    model: ModelAtPoint<'_>,
) -> Option<Misfit> {
    let data = specification.data.as_ref()?;
    let moments = ComparedMoments::of_estimates(model.velocity, model.observables);
    let mut found = Misfit {
        differences: moments.differences(&data.compared(set)),
        noise: noise(data, set, model.velocity, model.observables),
        by_likelihood: false,
    };
    if let Some(LikelihoodFit { residual, covariance }) = by_likelihood(specification, set, model) {
        found.differences[..2].copy_from_slice(&residual.map(|residual| -residual));
        let covariance = match found.noise.data {
            Some(noise) => with_block(noise.covariance, covariance),
            None => of_velocities(covariance),
        };
        let freedom = data.set(set).map_or(1, |given| given.independent_count() as u64 - 1);
        found.noise.data = Some(DataNoise { covariance, freedom });
        found.by_likelihood = true;
    }
    Some(found)
}

impl Misfit {
    /// Returns whether the model at `point` matches set number `set` of the data.
    pub(super) fn agreement(
        &self,
        specification: &JobSpecification,
        set: usize,
        point: &Point,
    ) -> Agreement {
        let Self { differences, noise, .. } = self;
        let variances = variances(noise);
        let limit = |axis: usize| (NEGLIGIBLE * NEGLIGIBLE * variances[axis]).max(EXACT * EXACT);
        let is_met = (0..MOMENTS).all(|axis| differences[axis] * differences[axis] <= limit(axis));
        let held = is_on_bound(specification, point) && !is_met;
        let normal = specification.data.as_ref().filter(|_| held);
        let counted = normal.map_or(variances, |data| at_most_normal(data, set, noise));
        Agreement {
            differences: *differences,
            errors: noise.data.map(|_| counted.map(f64::sqrt)),
            observables: specification.observables(),
            matched: is_within(*differences, counted),
            held,
        }
    }
}

/// Returns residual and covariance of the moments of the velocities by which these are most likely, if a
/// likelihood was maximised; `None` if it was not, or has no maximum.
fn by_likelihood(
    specification: &JobSpecification,
    set: usize,
    model: ModelAtPoint<'_>,
) -> Option<LikelihoodFit> {
    if specification.objective != Objective::Likelihood {
        return None;
    }
    let velocities = specification.data.as_ref()?.set(set)?;
    likelihood_fit(&specification.monte_carlo, model.point, model.outcomes, &velocities)
}

/// Returns a covariance with another one of the moments of the velocities. The covariances with the
/// observables change with it, so that their correlations stay.
fn with_block(mut covariance: MomentMatrix, block: [[f64; 2]; 2]) -> MomentMatrix {
    for (axis, row) in block.into_iter().enumerate() {
        let factor = (row[axis] / covariance[axis][axis]).sqrt();
        covariance[axis][2..].iter_mut().for_each(|with_other| *with_other *= factor);
        covariance[2..].iter_mut().for_each(|row_of_other| row_of_other[axis] *= factor);
        covariance[axis][..2].copy_from_slice(&row);
    }
    covariance
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
