//! Kolmogorov's test of whether measured velocities can come from the model's law.
//!
//! The law was fitted to the same velocities, which makes the distance smaller than it would be
//! otherwise (H. W. Lilliefors, J. Am. Stat. Assoc. 62 (1967)). So the distance is compared with those
//! of samples of the model's law that are fitted in the same way (parametric bootstrap; W. Stute, W.
//! Gonzales Manteiga and M. Presedo Quindimil, Metrika 40 (1993)).

use rand_chacha::ChaCha20Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::lattice::rounding;
use crate::job::{JobSpecification, Range, Sampling};
use crate::moments::{KolmogorovTest, Moments};
use crate::outcome::Outcome;
use crate::parameters::Parameter;
use crate::quantile::quantile;

/// Number of independent draws to which a Sobol' point is equivalent for a distribution function,
/// on the safe side. Measured at the paper's optimum by the scatter of the fractions of velocities
/// below their 7, 30, 50 and 90 % quantiles over 40 scrambles: 14 to 52 at the dispersion 0.1 and 8
/// to 16 at 0.3 for 64 points, 33 to 78 and 14 to 22 for 256, 39 to 98 and 19 to 44 for 1024.
const SOBOL_WORTH: f64 = 10.0;
/// Number of samples of the model's law that the data are compared with.
pub(super) const SAMPLES: usize = 999;
/// Largest size of these samples. With the correction for the size the law of the distance of
/// larger ones is the same.
pub(super) const SAMPLE_MAX: usize = 400;

/// Which moments of the model's law were fitted to the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FittedMoments {
    /// None: the law does not depend on the data.
    Neither,
    /// The mean, with a constant coefficient of variation.
    Mean,
    /// The coefficient of variation, with a constant mean.
    Variation,
    /// Both.
    Both,
}

impl FittedMoments {
    /// Returns which moments the free parameters of a job can move: the dispersion the coefficient of
    /// variation, all others the mean.
    pub fn from_specification(specification: &JobSpecification) -> Self {
        let is_free =
            |parameter: &Parameter| matches!(specification.range(*parameter), Range::Free { .. });
        let dispersion = is_free(&Parameter::Dispersion);
        let others = Parameter::ALL.iter().any(|one| *one != Parameter::Dispersion && is_free(one));
        match (others, dispersion) {
            (true, true) => Self::Both,
            (true, false) => Self::Mean,
            (false, true) => Self::Variation,
            (false, false) => Self::Neither,
        }
    }
}

/// Tests by Kolmogorov's distance whether the data (m/s) come from the law of the model's velocities,
/// which are the successes among `outcomes`, given which moments of that law were fitted to the data.
/// `None` if there are no data, or no successes.
///
/// The data have to be independent, and without scatter that the model does not contain. If they are
/// rounded, distances count at the limits between rounded values only.
///
/// The distances of samples hold for an exactly known law; those of the data are compared with them
/// as if there were n_e = n m / (n + m) data, for n data and m independent realizations. A Sobol'
/// point counts as several independent realizations.
pub fn kolmogorov_test(
    data: &[f64],
    outcomes: &[Outcome],
    sampling: Sampling,
    fitted: FittedMoments,
) -> Option<KolmogorovTest> {
    test(data, &sorted(outcomes.iter().filter_map(|outcome| outcome.ok())), sampling, fitted)
}

/// Same as [`kolmogorov_test`], for a law of the same shape that has these moments.
pub fn predictive_test(
    data: &[f64],
    outcomes: &[Outcome],
    sampling: Sampling,
    fitted: FittedMoments,
    at: Moments,
) -> Option<KolmogorovTest> {
    let model = sorted(outcomes.iter().filter_map(|outcome| outcome.ok()));
    let [mean, deviation] = mean_and_deviation(&model);
    let scale = at.mean * at.coefficient_of_variation / deviation;
    let moved: Vec<f64> = model.iter().map(|v| at.mean + (v - mean) * scale).collect();
    scale.is_finite().then(|| test(data, &moved, sampling, fitted))?
}

/// Tests data against velocities of the model in ascending order.
fn test(
    data: &[f64],
    model: &[f64],
    sampling: Sampling,
    fitted: FittedMoments,
) -> Option<KolmogorovTest> {
    if data.is_empty() || model.is_empty() {
        return None;
    }
    let step = rounding(data);
    let ascending = sorted(data.iter().copied());
    let distance = match step {
        None => distance(&ascending, model),
        Some(step) => {
            let below = |t: f64| model.partition_point(|v| *v <= t) as f64 / model.len() as f64;
            distance_at_limits(&ascending, Some(step), below)
        }
    };
    let size = data.len().min(SAMPLE_MAX);
    let equivalent = equivalent_size(data.len(), model.len(), sampling);
    let expected = distance * corrected_root(equivalent) / corrected_root(size as f64);
    let law = ModelLaw { model, fitted, step };
    let p_value = law.exceedance(expected, size);
    Some(KolmogorovTest { distance, p_value })
}

/// Returns the number of data that would be as far from an exactly known law as `data` are from `model`
/// realizations of it.
pub(super) fn equivalent_size(data: usize, model: usize, sampling: Sampling) -> f64 {
    let worth = match sampling {
        Sampling::MonteCarlo => 1.0,
        Sampling::Sobol => SOBOL_WORTH,
    };
    let (n, m) = (data as f64, worth * model as f64);
    n * m / (n + m)
}

/// Returns the factor that makes distances of samples of different sizes comparable (M. A. Stephens,
/// J. R. Stat. Soc. B 32 (1970)).
fn corrected_root(size: f64) -> f64 {
    let root = size.sqrt();
    root + 0.12 + 0.11 / root
}

/// The model's law: linear between its velocities.
struct ModelLaw<'a> {
    /// Its velocities in ascending order.
    model: &'a [f64],
    fitted: FittedMoments,
    /// The step to which the data are rounded.
    step: Option<f64>,
}

impl ModelLaw<'_> {
    /// Returns the probability that samples of this size have at least this distance.
    fn exceedance(&self, distance: f64, size: usize) -> f64 {
        let mut rng = ChaCha20Rng::from_seed([0; 32]);
        let of_model = mean_and_deviation(self.model);
        let exceeding = (0..SAMPLES).filter(|_| {
            let sample = sample_of(self.model, &mut rng, size);
            let (shift, scale) = self.fit(&sample, of_model);
            let mut below = self.distribution();
            let found = distance_at_limits(&sample, self.step, |t| below((t - shift) / scale));
            found >= distance
        });
        (1 + exceeding.count()) as f64 / (SAMPLES + 1) as f64
    }

    /// Returns the shift and the scale that give the model's law the fitted moments of a sample.
    fn fit(&self, sample: &[f64], [mean, deviation]: [f64; 2]) -> (f64, f64) {
        let found = match self.step {
            None => mean_and_deviation(sample),
            Some(step) => {
                let rounded: Vec<f64> = sample.iter().map(|v| step * (v / step).round()).collect();
                mean_and_deviation(&rounded)
            }
        };
        let ratio = found[0] / mean;
        let (mean_of, scale) = match self.fitted {
            FittedMoments::Neither => (mean, 1.0),
            FittedMoments::Mean => (found[0], ratio),
            FittedMoments::Variation => (mean, found[1] / deviation / ratio),
            FittedMoments::Both => (found[0], found[1] / deviation),
        };
        if scale.is_finite() && scale > 0.0 { (mean_of - scale * mean, scale) } else { (0.0, 1.0) }
    }

    /// Returns the distribution function, to be called with arguments in ascending order.
    fn distribution(&self) -> impl FnMut(f64) -> f64 {
        let (model, last) = (self.model, self.model.len() - 1);
        let mut next = 0;
        move |at: f64| {
            while next <= last && model[next] <= at {
                next += 1;
            }
            if next == 0 {
                return 0.0;
            }
            if next > last {
                return 1.0;
            }
            let (low, high) = (model[next - 1], model[next]);
            ((next - 1) as f64 + (at - low) / (high - low)) / last as f64
        }
    }
}

/// Draws a sample, in ascending order, of the law of velocities in ascending order. Sums of exponential numbers,
/// divided by the last one, are uniform numbers in ascending order.
pub(super) fn sample_of(model: &[f64], rng: &mut ChaCha20Rng, size: usize) -> Vec<f64> {
    let mut sum = 0.0;
    let mut sums: Vec<f64> = (0..=size)
        .map(|_| {
            let uniform = ((rng.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
            sum -= libm::log(uniform);
            sum
        })
        .collect();
    sums.pop();
    sums.iter().map(|part| quantile(model, part / sum).unwrap_or(f64::NAN)).collect()
}

pub(super) fn sorted(sample: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sample: Vec<f64> = sample.collect();
    sample.sort_unstable_by(f64::total_cmp);
    sample
}

/// Returns mean and standard deviation; NaN for no values.
pub(super) fn mean_and_deviation(values: &[f64]) -> [f64; 2] {
    let count = values.len() as f64;
    let first = values.first().copied().unwrap_or(f64::NAN);
    let mean = first + values.iter().map(|value| value - first).sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    [mean, (squares / count).sqrt()]
}

/// Returns the largest difference between the distribution function of a sample in ascending order
/// and `below`, which is called with arguments in ascending order; of values that are, or will be,
/// rounded, at the limits between rounded values.
fn distance_at_limits(
    ascending: &[f64],
    step: Option<f64>,
    mut below: impl FnMut(f64) -> f64,
) -> f64 {
    let count = ascending.len() as f64;
    let (mut passed, mut largest) = (0, 0.0_f64);
    while let Some(&first) = ascending.get(passed) {
        let [low, high] = match step {
            None => [first, first],
            Some(step) => {
                let cell = (first / step).round();
                [(cell - 0.5) * step, (cell + 0.5) * step]
            }
        };
        let before = passed as f64 / count;
        largest = largest.max((below(low) - before).abs());
        passed += 1;
        while ascending.get(passed).is_some_and(|value| *value <= high) {
            passed += 1;
        }
        largest = largest.max((below(high) - passed as f64 / count).abs());
    }
    largest
}

/// Returns the largest difference of the empirical distribution functions of two samples in
/// ascending order.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let (mut i, mut j, mut largest) = (0, 0, 0.0_f64);
    while i < a.len() && j < b.len() {
        // Values that occur in both samples are passed together.
        let next = a[i].min(b[j]);
        i += a[i..].partition_point(|&value| value <= next);
        j += b[j..].partition_point(|&value| value <= next);
        largest = largest.max((i as f64 / a.len() as f64 - j as f64 / b.len() as f64).abs());
    }
    largest
}

#[cfg(test)]
mod tests;
