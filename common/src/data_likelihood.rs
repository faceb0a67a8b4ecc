//! The likelihood of measured velocities as a function of the two moments of a model.
//!
//! The law of the model's velocities is close to normal (`docs/validation.md`), so the data's
//! likelihood depends on the model through its mean v and standard deviation σ = v Δ alone. With
//! independent velocities it is that of a normal sample, which also holds for few of them. With
//! several velocities of each subject it is that of random effects: a share ρ of the variance
//! belongs to the subjects, the rest to the velocities of one subject, and ρ, which is unknown, is
//! integrated out under a uniform prior (S. R. Searle, G. Casella and C. E. McCulloch, Variance
//! Components (1992), Sec. 3.7). The scatter of the instrument adds a known variance to each
//! velocity.
//!
//! A few wrong velocities would move the moments of such a sample without limit. So each velocity
//! has a small unknown probability of coming from a broad law instead (`contamination.rs`).

mod contamination;
#[cfg(test)]
mod tests;

use self::contamination::{Contamination, log_of_sum};
use crate::data_statistics::rounding;
use crate::moments::Moments;
use crate::robust::RobustScale;

pub use self::contamination::OutlierShare;

/// Number of values of ρ, the midpoints of equal intervals from 0 to 1, over which the likelihood
/// is averaged.
const SHARES: usize = 48;
/// Nodes and weights of Gauss-Hermite quadrature for the standard normal law (M. Abramowitz and
/// I. A. Stegun, Handbook of Mathematical Functions (1964), Table 25.10, n = 5).
const NORMAL_NODES: [(f64, f64); 5] = [
    (-2.856_970_013_872_806, 0.011_257_411_327_720_7),
    (-1.355_626_179_974_266, 0.222_075_922_005_612_6),
    (0.0, 0.533_333_333_333_333_3),
    (1.355_626_179_974_266, 0.222_075_922_005_612_6),
    (2.856_970_013_872_806, 0.011_257_411_327_720_7),
];
/// Rounding that adds less than this share of the variance is negligible.
const ROUNDING: f64 = 1e-3;
/// Errors of the model's moments below this fraction of the data's are negligible.
const NEGLIGIBLE: f64 = 0.02;

/// The likelihood of one set of data.
#[derive(Debug, Clone, PartialEq)]
pub struct DataLikelihood {
    /// Value near the mean, about which sums are taken, m/s.
    centre: f64,
    /// Standard deviation of the velocities without the instrument's, m/s.
    deviation: f64,
    /// Variance of the instrument, m²/s².
    instrument: f64,
    /// Subjects with equal numbers of velocities.
    classes: Vec<SubjectClass>,
    /// Velocities that may be wrong, which are not in the classes; `None` if there are none.
    contamination: Option<Contamination>,
    /// Values of ρ.
    shares: Vec<f64>,
    /// Errors of the model's moments, over which the likelihood is averaged: differences of both
    /// logarithms, and logarithms of their weights. A single zero if the model is exact.
    model_errors: Vec<([f64; 2], f64)>,
}

/// Subjects that have the same number of velocities each, and the sums over them that are
/// sufficient for the likelihood.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SubjectClass {
    /// Velocities of each subject.
    size: f64,
    /// Number of subjects.
    count: f64,
    /// Sum of their means, from the centre.
    means: f64,
    /// Sum of the squares of their means, from the centre.
    squares: f64,
    /// Sum of squares within the subjects.
    within: f64,
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
        let count = count as f64;
        let squares = count * (deviation * deviation);
        let class = SubjectClass { size: 1.0, count, means: 0.0, squares, within: 0.0 };
        Self::from_classes(moments.mean, deviation, repeatability, vec![class])
    }

    fn new(
        velocities: &[f64],
        subjects: &[u32],
        (repeatability, has_subjects): (f64, bool),
    ) -> Option<Self> {
        let scale = RobustScale::of(velocities);
        let is_right = |velocity: &f64| scale.is_none_or(|scale| !scale.is_far(*velocity));
        let right: Vec<f64> = velocities.iter().copied().filter(is_right).collect();
        let first = right.first().copied()?;
        let count = right.len() as f64;
        let mean = right.iter().map(|v| v - first).sum::<f64>() / count;
        let centre = first + mean;
        let squares: f64 = right.iter().map(|v| (v - centre) * (v - centre)).sum();
        let deviation = (squares / count).sqrt();
        let repeatability = with_rounding(repeatability, velocities, deviation);
        let all = || velocities.iter().copied().zip(subjects.iter().copied());
        let is_far = |(velocity, _): &(f64, u32)| {
            scale.is_some_and(|scale| Contamination::is_far(&scale, *velocity, has_subjects))
        };
        let far: Vec<f64> = all().filter(is_far).map(|(velocity, _)| velocity).collect();
        let classes = classes(all().filter(|one| !is_far(one)), centre);
        let core = velocities.len() - far.len();
        let contamination = scale.and_then(|scale| Contamination::new(&scale, core, &far, centre));
        let found = Self::from_classes(centre, deviation, repeatability, classes)?;
        Some(Self { contamination, ..found })
    }

    fn from_classes(
        centre: f64,
        deviation: f64,
        repeatability: f64,
        classes: Vec<SubjectClass>,
    ) -> Option<Self> {
        let instrument = repeatability * repeatability;
        let variance = deviation * deviation - instrument;
        let several = classes.iter().any(|class| class.size > 1.0);
        let middle = |k: usize| (k as f64 + 0.5) / SHARES as f64;
        let shares = if several { (0..SHARES).map(middle).collect() } else { vec![0.0] };
        let known = variance > 0.0 && centre > 0.0 && variance.is_finite();
        known.then(|| Self {
            centre,
            deviation: variance.sqrt(),
            instrument,
            classes,
            contamination: None,
            shares,
            model_errors: vec![([0.0; 2], 0.0)],
        })
    }

    /// Returns the likelihood of a model whose moments have these relative standard errors, which
    /// are the same at every point, as common germs make them: its average over normal errors.
    pub fn with_model_errors(self, errors: [f64; 2]) -> Self {
        let noise = self.errors();
        let nodes = |axis: usize| {
            let matters = errors[axis] > NEGLIGIBLE * noise[axis];
            if matters { NORMAL_NODES.to_vec() } else { vec![(0.0, 1.0)] }
        };
        let pairs = nodes(0).into_iter().flat_map(|mean| {
            nodes(1).into_iter().map(move |variation| {
                let steps = [mean.0 * errors[0], variation.0 * errors[1]];
                (steps, libm::log(mean.1 * variation.1))
            })
        });
        Self { model_errors: pairs.collect(), ..self }
    }

    /// Returns the logarithm of the likelihood of a model with this logarithm of the mean (m/s) and
    /// of the coefficient of variation, up to a constant, nats.
    pub fn log(&self, [mean, variation]: [f64; 2]) -> f64 {
        let of = |(step, weight): &([f64; 2], f64)| {
            let mean = libm::exp(mean + step[0]);
            let deviation = mean * libm::exp(variation + step[1]);
            let variance = deviation * deviation;
            let of_share = |share: &f64| self.log_with(mean - self.centre, variance, *share);
            let far = self.contamination.as_ref().map_or(0.0, |contamination| {
                contamination.log(mean - self.centre, variance + self.instrument)
            });
            weight + far + log_of_sum(self.shares.iter().map(of_share))
        };
        log_of_sum(self.model_errors.iter().map(of))
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

    /// Returns rough standard errors of these, for a grid of values or a measure of misfit: those
    /// of a normal sample, each subject counted once.
    pub fn errors(&self) -> [f64; 2] {
        let subjects: f64 = self.classes.iter().map(|class| class.count).sum();
        let total = self.deviation * self.deviation + self.instrument;
        let inflated = total / (self.deviation * self.deviation);
        [total.sqrt() / (self.centre * subjects.sqrt()), inflated / (2.0 * subjects).sqrt()]
    }

    /// Returns the logarithm of the likelihood, with the mean given as distance from the centre.
    fn log_with(&self, mean: f64, variance: f64, share: f64) -> f64 {
        let within = (1.0 - share) * variance + self.instrument;
        let between = share * variance;
        let of = |class: &SubjectClass| {
            let whole = within + class.size * between;
            let residual = class.squares - 2.0 * mean * class.means + class.count * (mean * mean);
            let logs = (class.size - 1.0) * libm::log(within) + libm::log(whole);
            class.count * logs + class.within / within + class.size * residual / whole
        };
        -0.5 * self.classes.iter().map(of).sum::<f64>()
    }
}

/// Returns the instrument's standard deviation together with that of a rounding error, for velocities
/// of which `deviation` is the standard deviation: a rounding error within a step h has the variance
/// h²/12 (W. F. Sheppard, Proc. London Math. Soc. 29 (1898)).
fn with_rounding(repeatability: f64, velocities: &[f64], deviation: f64) -> f64 {
    let variance = rounding(velocities).map_or(0.0, |step| step * step / 12.0);
    if variance < ROUNDING * deviation * deviation {
        return repeatability;
    }
    repeatability.mul_add(repeatability, variance).sqrt()
}

/// Sums the velocities by subject, and the subjects by the number of their velocities.
fn classes(velocities: impl Iterator<Item = (f64, u32)>, centre: f64) -> Vec<SubjectClass> {
    let mut sums: Vec<[f64; 3]> = Vec::new();
    for (velocity, subject) in velocities {
        let off = velocity - centre;
        sums.resize(sums.len().max(subject as usize + 1), [0.0; 3]);
        let [size, sum, square] = &mut sums[subject as usize];
        *size += 1.0;
        *sum += off;
        *square += off * off;
    }
    let mut classes: Vec<SubjectClass> = Vec::new();
    for [size, sum, square] in sums {
        if size == 0.0 {
            continue;
        }
        let mean = sum / size;
        let within = (square - sum * mean).max(0.0);
        let one = SubjectClass { size, count: 1.0, means: mean, squares: mean * mean, within };
        match classes.iter_mut().find(|class| class.size == size) {
            Some(class) => {
                class.count += 1.0;
                class.means += one.means;
                class.squares += one.squares;
                class.within += one.within;
            }
            None => classes.push(one),
        }
    }
    classes
}
