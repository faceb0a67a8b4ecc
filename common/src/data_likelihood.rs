//! The likelihood of measured velocities as a function of the two moments of a model.
//!
//! The law of the model's velocities is close to normal (`docs/validation.md`), so the data's
//! likelihood depends on the model through its mean v and standard deviation σ = v Δ alone. With
//! independent velocities it is that of a normal sample, which also holds for few of them. With
//! several velocities of each subject it is that of random effects: a share ρ of the variance
//! belongs to the subjects, the rest to the velocities of one subject, and ρ, which is unknown, is
//! integrated out under a uniform prior (`random_effects.rs`). The scatter of the instrument adds a
//! known variance to each velocity.
//!
//! A few wrong velocities would move the moments of such a sample without limit. So each velocity
//! has a small unknown probability of coming from a broad law instead (`contamination.rs`).

mod contamination;
mod correlated;
mod nodes;
mod random_effects;
#[cfg(test)]
mod tests;

use self::contamination::{Contamination, log_of_sum};
use self::correlated::CorrelatedErrors;
use self::nodes::normal_nodes;
use self::random_effects::{SubjectClass, Subjects};
use crate::data_statistics::rounding;
use crate::moments::Moments;
use crate::robust::RobustScale;

pub use self::contamination::OutlierShare;
pub use self::nodes::MODEL_ERROR_MAX;

/// Distance from the data's moments, in units of their errors, beyond which the likelihood is
/// negligible.
const FAR: f64 = 15.0;
/// The same where errors of the setup give the model's moments a normal law much wider than the data's errors: its
/// density hardly changes over the distance, so that less of it is enough.
const REACH: f64 = 5.0;
/// Rounding that adds less than this share of the variance is negligible.
const ROUNDING: f64 = 1e-3;

/// The likelihood of one set of data.
#[derive(Debug, Clone, PartialEq)]
pub struct DataLikelihood {
    /// Value near the mean, about which sums are taken, m/s.
    centre: f64,
    /// Standard deviation of the velocities without the instrument's, m/s.
    deviation: f64,
    /// Variance of the instrument, m²/s².
    instrument: f64,
    subjects: Subjects,
    /// Velocities that may be wrong, which are not among those of the subjects; `None` if there are none.
    contamination: Option<Contamination>,
    /// Relative standard errors of the model's moments by sampling.
    model: [f64; 2],
    /// Covariance of their relative errors by the setup; `None` if this is known exactly.
    systematic: Option<[[f64; 2]; 2]>,
    /// Errors of the model's moments over which the likelihood is averaged.
    model_errors: ModelErrors,
}

/// Errors of the model's moments.
#[derive(Debug, Clone, PartialEq)]
enum ModelErrors {
    /// Those of sampling: differences of both logarithms, and logarithms of their weights. A single zero if
    /// the model is exact.
    Sampling(Vec<([f64; 2], f64)>),
    /// Those of sampling and of the setup.
    WithSystematic(CorrelatedErrors),
}

impl DataLikelihood {
    /// Likelihood of independent velocities (m/s), with the standard deviation of the instrument
    /// (m/s). `None` if they have no scatter beyond the instrument's.
    pub fn independent(velocities: &[f64], repeatability: f64) -> Option<Self> {
        let subjects: Vec<u32> = (0..).take(velocities.len()).collect();
        Self::new(velocities, &subjects, (repeatability, false))
    }

    /// Likelihood of velocities of which several belong to one subject: `subjects` has the index of
    /// the subject of each, the indices from 0 without gaps.
    pub fn of_subjects(velocities: &[f64], subjects: &[u32], repeatability: f64) -> Option<Self> {
        Self::new(velocities, subjects, (repeatability, true))
    }

    /// Likelihood of `count` independent velocities of which only the moments are known.
    pub fn from_moments(moments: Moments, count: u64, repeatability: f64) -> Option<Self> {
        let deviation = moments.mean * moments.coefficient_of_variation;
        let subjects = Subjects(vec![SubjectClass::of_moments(count as f64, deviation)]);
        Self::from_subjects(moments.mean, deviation, repeatability, subjects)
    }

    fn new(
        velocities: &[f64],
        subjects: &[u32],
        (repeatability, has_subjects): (f64, bool),
    ) -> Option<Self> {
        let scale = RobustScale::from_velocities(velocities);
        let is_right = |velocity: &f64| scale.is_none_or(|scale| !scale.is_outlying(*velocity));
        let right: Vec<f64> = velocities.iter().copied().filter(is_right).collect();
        let first = right.first().copied()?;
        let count = right.len() as f64;
        let mean = right.iter().map(|v| v - first).sum::<f64>() / count;
        let centre = first + mean;
        let squares: f64 = right.iter().map(|v| (v - centre) * (v - centre)).sum();
        let deviation = (squares / count).sqrt();
        let all = || velocities.iter().copied().zip(subjects.iter().copied());
        let is_outside = |(velocity, _): &(f64, u32)| {
            scale.is_some_and(|scale| {
                Contamination::is_outside_core(&scale, *velocity, has_subjects)
            })
        };
        let outside: Vec<f64> = all().filter(is_outside).map(|(velocity, _)| velocity).collect();
        let subjects = Subjects::new(all().filter(|one| !is_outside(one)), centre);
        let within = subjects.within_variance().map_or(deviation, |within| within.sqrt());
        let repeatability = with_rounding(repeatability, velocities, deviation.min(within));
        let subjects = if repeatability > 0.0 { subjects } else { subjects.without_repeats() };
        let core = velocities.len() - outside.len();
        let contamination =
            scale.and_then(|scale| Contamination::new(&scale, core, &outside, centre));
        let found = Self::from_subjects(centre, deviation, repeatability, subjects)?;
        Some(Self { contamination, ..found })
    }

    fn from_subjects(
        centre: f64,
        deviation: f64,
        repeatability: f64,
        subjects: Subjects,
    ) -> Option<Self> {
        let instrument = repeatability * repeatability;
        let variance = deviation * deviation - instrument;
        let known = variance > 0.0 && centre > 0.0 && variance.is_finite();
        known.then(|| Self {
            centre,
            deviation: variance.sqrt(),
            instrument,
            subjects,
            contamination: None,
            model: [0.0; 2],
            systematic: None,
            model_errors: ModelErrors::Sampling(vec![([0.0; 2], 0.0)]),
        })
    }

    /// Returns the likelihood of a model whose moments have these relative standard errors, which
    /// are the same at every point, as common germs make them: its average over normal errors.
    #[must_use]
    pub fn with_model_errors(self, errors: [f64; 2]) -> Self {
        let model_errors = match self.systematic {
            None => ModelErrors::Sampling(sampling_errors(errors, self.errors())),
            Some(mut covariance) => {
                (0..2).for_each(|k| covariance[k][k] += errors[k] * errors[k]);
                let (noise, widest) = (self.errors(), self.errors_of([self.subjects.count(); 2]));
                let reach = REACH * f64::max(widest[0] / noise[0], widest[1] / noise[1]);
                let data = (self.moments(), noise);
                ModelErrors::WithSystematic(CorrelatedErrors::new(covariance, data, reach))
            }
        };
        Self { model_errors, model: errors, ..self }
    }

    /// Returns the likelihood of a model whose setup is not known exactly, which gives its moments relative
    /// errors with this covariance: its average over these, as a normal law.
    #[must_use]
    pub fn with_systematic(self, covariance: [[f64; 2]; 2]) -> Self {
        let sampling = self.model;
        Self { systematic: Some(covariance), ..self }.with_model_errors(sampling)
    }

    /// Returns the logarithm of the likelihood of a model with this logarithm of the mean (m/s) and
    /// of the coefficient of variation, up to a constant, nats.
    pub fn log(&self, at: [f64; 2]) -> f64 {
        match &self.model_errors {
            ModelErrors::Sampling(errors) => self.average(at, errors.iter().copied()),
            ModelErrors::WithSystematic(errors) => self.average(at, errors.nodes(at).into_iter()),
        }
    }

    fn average(
        &self,
        [mean, variation]: [f64; 2],
        errors: impl ExactSizeIterator<Item = ([f64; 2], f64)>,
    ) -> f64 {
        log_of_sum(errors.map(|(step, weight)| {
            let mean = libm::exp(mean + step[0]);
            let deviation = mean * libm::exp(variation + step[1]);
            let variance = deviation * deviation;
            let contaminated = self.contamination.as_ref().map_or(0.0, |contamination| {
                contamination.log(mean - self.centre, variance + self.instrument)
            });
            weight + contaminated + self.subjects.log(mean - self.centre, variance, self.instrument)
        }))
    }

    /// Returns what the data say about wrong velocities among them, given the logarithms of the
    /// model's mean (m/s) and coefficient of variation; `None` if all are near the median, or only
    /// their moments are known.
    pub fn outlier_share(&self, [mean, variation]: [f64; 2]) -> Option<OutlierShare> {
        let mean = libm::exp(mean);
        let deviation = mean * libm::exp(variation);
        let variance = deviation * deviation + self.instrument;
        let contamination = self.contamination.as_ref()?;
        Some(contamination.share(mean - self.centre, variance, self.centre))
    }

    /// Returns the logarithms of the mean and the coefficient of variation of the data without those
    /// far from the others.
    pub fn moments(&self) -> [f64; 2] {
        [libm::log(self.centre), libm::log(self.deviation / self.centre)]
    }

    /// Returns rough standard errors of these, as a measure of misfit: those of a normal sample in
    /// which the velocities of a subject are as alike as they seem to be.
    pub fn errors(&self) -> [f64; 2] {
        let variance = self.deviation * self.deviation;
        let share = self.subjects.share(variance, self.instrument);
        let counts = self.subjects.effective_counts(share * variance, self.total());
        self.errors_of(counts)
    }

    /// Returns the standard errors of the moments by the setup.
    pub fn systematic_errors(&self) -> [f64; 2] {
        self.systematic.map_or([0.0; 2], |found| [0, 1].map(|k| found[k][k].sqrt()))
    }

    /// Returns the distances from the moments beyond which the likelihood is negligible: each
    /// subject may count once only, and the model has its own errors.
    pub fn extent(&self) -> [f64; 2] {
        let (errors, systematic) =
            (self.errors_of([self.subjects.count(); 2]), self.systematic_errors());
        [0, 1].map(|k| {
            let of_model = self.model[k] * self.model[k] + systematic[k] * systematic[k];
            FAR * errors[k].mul_add(errors[k], of_model).sqrt()
        })
    }

    /// Returns the errors of a sample with as much information on the mean and on the variance as
    /// these numbers of velocities.
    fn errors_of(&self, counts: [f64; 2]) -> [f64; 2] {
        let total = self.total();
        let inflated = total / (self.deviation * self.deviation);
        [(total / counts[0]).sqrt() / self.centre, inflated / (2.0 * counts[1]).sqrt()]
    }

    /// Returns the variance of one velocity, with the instrument's.
    fn total(&self) -> f64 {
        self.deviation * self.deviation + self.instrument
    }
}

/// Returns the errors over which a likelihood of data with this `noise` is averaged, and the logarithms of their
/// weights, given their standard deviations.
fn sampling_errors(errors: [f64; 2], noise: [f64; 2]) -> Vec<([f64; 2], f64)> {
    let [of_mean, of_variation] = [0, 1].map(|axis| normal_nodes(errors[axis] / noise[axis]));
    let pairs = of_mean.iter().flat_map(|mean| {
        of_variation.iter().map(move |variation| {
            let steps = [mean.0 * errors[0], variation.0 * errors[1]];
            (steps, libm::log(mean.1 * variation.1))
        })
    });
    pairs.collect()
}

/// Returns the instrument's standard deviation together with that of a rounding error, for velocities
/// of which `deviation` is the smallest standard deviation that matters: a rounding error within a step h has the variance
/// h²/12 (W. F. Sheppard, Proc. London Math. Soc. 29 (1898)).
fn with_rounding(repeatability: f64, velocities: &[f64], deviation: f64) -> f64 {
    let variance = rounding(velocities).map_or(0.0, |step| step * step / 12.0);
    if variance < ROUNDING * deviation * deviation {
        return repeatability;
    }
    repeatability.mul_add(repeatability, variance).sqrt()
}
