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

use crate::moments::Moments;

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
        Self::new(velocities, &subjects, repeatability)
    }

    /// Likelihood of velocities of which several belong to one subject: `subjects` has the index of
    /// the subject of each, the indices from 0 without gaps.
    pub fn of_subjects(velocities: &[f64], subjects: &[u32], repeatability: f64) -> Option<Self> {
        Self::new(velocities, subjects, repeatability)
    }

    /// Likelihood of `count` independent velocities of which only the moments are known.
    pub fn from_moments(moments: Moments, count: u64, repeatability: f64) -> Option<Self> {
        let deviation = moments.mean * moments.coefficient_of_variation;
        let count = count as f64;
        let squares = count * (deviation * deviation);
        let class = SubjectClass { size: 1.0, count, means: 0.0, squares, within: 0.0 };
        Self::from_classes(moments.mean, deviation, repeatability, vec![class])
    }

    fn new(velocities: &[f64], subjects: &[u32], repeatability: f64) -> Option<Self> {
        let centre = velocities.first().copied()?;
        let count = velocities.len() as f64;
        let mean = velocities.iter().map(|v| v - centre).sum::<f64>() / count;
        let centre = centre + mean;
        let squares: f64 = velocities.iter().map(|v| (v - centre) * (v - centre)).sum();
        let classes = classes(velocities, subjects, centre);
        Self::from_classes(centre, (squares / count).sqrt(), repeatability, classes)
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
            weight + log_of_sum(self.shares.iter().map(of_share))
        };
        log_of_sum(self.model_errors.iter().map(of))
    }

    /// Returns the logarithms of the data's mean and coefficient of variation.
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

/// Returns the logarithm of the sum of the exponentials.
fn log_of_sum(logs: impl ExactSizeIterator<Item = f64>) -> f64 {
    if logs.len() == 1 {
        return logs.sum();
    }
    let logs: Vec<f64> = logs.collect();
    let largest = logs.iter().fold(f64::NEG_INFINITY, |largest, log| largest.max(*log));
    if !largest.is_finite() {
        return f64::NEG_INFINITY;
    }
    largest + libm::log(logs.iter().map(|log| libm::exp(log - largest)).sum())
}

/// Sums the velocities by subject, and the subjects by the number of their velocities.
fn classes(velocities: &[f64], subjects: &[u32], centre: f64) -> Vec<SubjectClass> {
    let count = subjects.iter().max().map_or(0, |last| *last as usize + 1);
    let mut sums = vec![[0.0; 3]; count];
    for (velocity, &subject) in velocities.iter().zip(subjects) {
        let off = velocity - centre;
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

#[cfg(test)]
mod tests {
    use super::*;

    const VELOCITIES: [f64; 6] = [3900.0, 4010.0, 3805.0, 3950.0, 4100.0, 3870.0];

    fn log(likelihood: &DataLikelihood, mean: f64, variation: f64) -> f64 {
        likelihood.log([libm::log(mean), libm::log(variation)])
    }

    /// Logarithm of the density of a normal law with this covariance matrix of two values.
    fn pair(x: [f64; 2], mean: f64, variance: f64, covariance: f64) -> f64 {
        let determinant = variance * variance - covariance * covariance;
        let [a, b] = x.map(|x| x - mean);
        let square = (variance * (a * a + b * b) - 2.0 * covariance * a * b) / determinant;
        -0.5 * (libm::log(determinant) + square)
    }

    #[test]
    fn independent_velocities_have_the_likelihood_of_a_normal_sample() {
        let likelihood = DataLikelihood::independent(&VELOCITIES, 0.0).unwrap();
        let direct = |mean: f64, variation: f64| -> f64 {
            let sigma = mean * variation;
            let square = |v: &f64| (v - mean) / sigma * ((v - mean) / sigma);
            let of = |v: &f64| -0.5 * square(v) - libm::log(sigma);
            VELOCITIES.iter().map(of).sum()
        };
        let found = log(&likelihood, 3950.0, 0.03) - log(&likelihood, 3800.0, 0.02);
        let expected = direct(3950.0, 0.03) - direct(3800.0, 0.02);
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }

    #[test]
    fn the_instrument_adds_its_variance() {
        let with = DataLikelihood::independent(&VELOCITIES, 30.0).unwrap();
        let without = DataLikelihood::independent(&VELOCITIES, 0.0).unwrap();
        let (mean, sigma) = (3940.0, 80.0);
        let total = (sigma * sigma + 900.0_f64).sqrt();
        let found = log(&with, mean, sigma / mean);
        assert!((found - log(&without, mean, total / mean)).abs() < 1e-9);
        assert_eq!(DataLikelihood::independent(&VELOCITIES, 300.0), None);
    }

    #[test]
    fn velocities_of_one_subject_are_correlated() {
        let velocities = [3900.0, 3930.0, 4050.0, 4010.0];
        let found = DataLikelihood::of_subjects(&velocities, &[0, 0, 1, 1], 10.0).unwrap();
        let direct = |mean: f64, variation: f64| {
            let variance = (mean * variation) * (mean * variation);
            let of = |k: usize| {
                let share = (k as f64 + 0.5) / SHARES as f64;
                let (total, both) = (variance + 100.0, share * variance);
                let [a, b, c, d] = velocities;
                libm::exp(pair([a, b], mean, total, both) + pair([c, d], mean, total, both))
            };
            libm::log((0..SHARES).map(of).sum::<f64>() / SHARES as f64)
        };
        let difference = log(&found, 3980.0, 0.02) - log(&found, 3900.0, 0.03);
        let expected = direct(3980.0, 0.02) - direct(3900.0, 0.03);
        assert!((difference - expected).abs() < 1e-9, "{difference} {expected}");
    }

    /// Compares with the average over many errors of the model's mean, of the size of the data's.
    #[test]
    fn errors_of_the_model_are_averaged_over() {
        let exact = DataLikelihood::independent(&VELOCITIES, 0.0).unwrap();
        let error = exact.errors()[0];
        let blurred = exact.clone().with_model_errors([error, 0.0]);
        let average = |mean: f64| {
            let of = |k: i32| {
                let z = f64::from(k) / 20.0;
                let log = exact.log([libm::log(mean) + z * error, libm::log(0.025)]);
                libm::exp(log - 0.5 * z * z)
            };
            libm::log((-120..=120).map(of).sum::<f64>())
        };
        let found = log(&blurred, 3900.0, 0.025) - log(&blurred, 4000.0, 0.025);
        let expected = average(3900.0) - average(4000.0);
        assert!((found - expected).abs() < 0.01, "{found} {expected}");
        let same = exact.clone().with_model_errors([0.01 * error, 0.0]);
        assert_eq!(log(&same, 3900.0, 0.02), log(&exact, 3900.0, 0.02));
    }

    #[test]
    fn moments_with_a_count_stand_for_a_sample() {
        let sample = DataLikelihood::independent(&VELOCITIES, 0.0).unwrap();
        let moments = crate::statistics::moments(&VELOCITIES).unwrap();
        let found = DataLikelihood::from_moments(moments, 6, 0.0).unwrap();
        let difference = log(&found, 3800.0, 0.05) - log(&sample, 3800.0, 0.05);
        assert!(difference.abs() < 1e-9, "{difference}");
    }
}
