//! Confidence intervals of the moments of measured velocities.

use rand_chacha::ChaCha20Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::CONFIDENCE;
use super::few::{FewIntervals, intervals_of_data, intervals_of_velocities};
use crate::data::{Data, Measurements};
use crate::inference::PARTS_MIN;
use crate::job::VelocitySet;
use crate::moments::{ConfidenceInterval, MomentIntervals, Moments};
use crate::quantile::quantile;
use crate::special::{normal_probability, standard_normal_quantile};
use crate::statistics::{Sum, moments, without_repeatability};

/// Number of bootstrap resamples.
const RESAMPLES: usize = 2000;
/// Largest number of subjects that are resampled, which takes a fraction of a
/// second; for more, the normal approximation of their moments gives the same result.
const RESAMPLED_MAX: usize = 5_000;

/// Returns confidence intervals: of independent velocities by the χ² law of their variance and
/// Student's law of their mean (`few.rs`); of subjects by the bootstrap, bias-corrected and accelerated
/// (B. Efron, J. Am. Stat. Assoc. 82 (1987)), which draws the velocities of one subject together.
///
/// `None` for fewer than five velocities, or subjects, and without scatter beyond the instrument's.
/// The resamples are the same for the same number of subjects, and do not depend on the seed of a
/// job.
pub fn moment_intervals(set: &VelocitySet<'_>) -> Option<MomentIntervals> {
    let parts = set.independent_count();
    if (parts as u64) < PARTS_MIN {
        return None;
    }
    let measured = moments(set.velocities)?;
    let found = without_repeatability(measured, set.repeatability);
    if found.coefficient_of_variation.is_nan() || found.coefficient_of_variation <= 0.0 {
        return None;
    }
    let Some(subjects) = set.subjects else {
        return intervals_of_velocities(set).map(with_level);
    };
    let influences = Influences::new(set, measured, found);
    if parts > RESAMPLED_MAX {
        return Some(influences.normal(found, set.velocities.len()));
    }
    let [means, variations] =
        resampled_subjects(&subject_sums(set.velocities, subjects, measured.mean), measured);
    let variations = matched(&means, variations, set.repeatability);
    Some(MomentIntervals {
        mean: accelerated(means, found.mean, &influences.mean)?,
        coefficient_of_variation: accelerated(
            variations,
            found.coefficient_of_variation,
            &influences.coefficient_of_variation,
        )?,
        level: CONFIDENCE,
    })
}

/// Returns confidence intervals of moments whose number of velocities is given, those of a normal
/// law; `None` for fewer than five.
pub fn intervals_of_moments(data: &Data) -> Option<MomentIntervals> {
    let Measurements::Moments { count: Some(PARTS_MIN..), .. } = data.measurements else {
        return None;
    };
    intervals_of_data(data, 0).map(with_level)
}

fn with_level(found: FewIntervals) -> MomentIntervals {
    let FewIntervals { mean, coefficient_of_variation } = found;
    MomentIntervals { mean, coefficient_of_variation, level: CONFIDENCE }
}

/// Influence of each velocity, or of all velocities of each subject, on the moments, multiplied by
/// the number of velocities.
struct Influences {
    mean: Vec<f64>,
    coefficient_of_variation: Vec<f64>,
}

impl Influences {
    /// Computes them for the moments of the velocities, `measured`, and those without the
    /// instrument's scatter, `found`.
    fn new(set: &VelocitySet<'_>, measured: Moments, found: Moments) -> Self {
        let Moments { mean, coefficient_of_variation: variation } = found;
        let [all, left] = [measured.coefficient_of_variation, variation]
            .map(|variation| (variation * mean) * (variation * mean));
        let of_variation = |velocity: f64| {
            let deviation = velocity - mean;
            let relative = 0.5 * (deviation * deviation / all - 1.0) * (all / left);
            variation * (relative - deviation / mean)
        };
        let velocities = || set.velocities.iter().copied();
        Self {
            mean: by_part(set, velocities().map(|velocity| velocity - mean)),
            coefficient_of_variation: by_part(set, velocities().map(of_variation)),
        }
    }

    /// Returns intervals by the normal approximation of the moments.
    fn normal(&self, at: Moments, velocities: usize) -> MomentIntervals {
        let n = velocities as f64;
        let interval = |value: f64, influences: &[f64]| {
            let squares = sum(influences.iter().map(|influence| influence * influence));
            let half = standard_normal_quantile(0.5 * (1.0 + CONFIDENCE)) * squares.sqrt() / n;
            ConfidenceInterval { low: value - half, high: value + half }
        };
        MomentIntervals {
            mean: interval(at.mean, &self.mean),
            coefficient_of_variation: interval(
                at.coefficient_of_variation,
                &self.coefficient_of_variation,
            ),
            level: CONFIDENCE,
        }
    }
}

/// Returns the sums of values, one of each velocity, over each subject; the values themselves if
/// the velocities are independent.
fn by_part(set: &VelocitySet<'_>, values: impl Iterator<Item = f64>) -> Vec<f64> {
    let Some(subjects) = set.subjects else { return values.collect() };
    let mut sums = vec![Sum::default(); set.independent_count()];
    for (value, &subject) in values.zip(subjects) {
        sums[subject as usize].add(value);
    }
    sums.into_iter().map(Sum::total).collect()
}

/// Number of a subject's velocities, and the sums of their deviations from the mean of all and of
/// the squares of these.
#[derive(Clone, Copy, Default)]
struct SubjectSums {
    count: u64,
    deviations: Sum,
    squares: Sum,
}

/// Returns the sums of each subject.
fn subject_sums(velocities: &[f64], subjects: &[u32], mean: f64) -> Vec<SubjectSums> {
    let mut sums = Vec::new();
    for (&velocity, &subject) in velocities.iter().zip(subjects) {
        let at = subject as usize;
        if sums.len() <= at {
            sums.resize(at + 1, SubjectSums::default());
        }
        let deviation = velocity - mean;
        sums[at].count += 1;
        sums[at].deviations.add(deviation);
        sums[at].squares.add(deviation * deviation);
    }
    sums
}

/// Returns the means and coefficients of variation of resamples of subjects.
fn resampled_subjects(subjects: &[SubjectSums], all: Moments) -> [Vec<f64>; 2] {
    let mut rng = ChaCha20Rng::from_seed([0; 32]);
    let mut found = [Vec::with_capacity(RESAMPLES), Vec::with_capacity(RESAMPLES)];
    for _ in 0..RESAMPLES {
        let mut count = 0;
        let mut sums = [Sum::default(); 2];
        for _ in 0..subjects.len() {
            let drawn = &subjects[draw(&mut rng, subjects.len())];
            count += drawn.count;
            sums[0].add(drawn.deviations.total());
            sums[1].add(drawn.squares.total());
        }
        let [shift, square] = sums.map(|sum| sum.total() / count as f64);
        let mean = all.mean + shift;
        found[0].push(mean);
        // Deviations are small compared to the mean, so that this difference cancels little.
        found[1].push((square - shift * shift).max(0.0).sqrt() / mean);
    }
    found
}

/// Returns coefficients of variation without the instrument's scatter.
fn matched(means: &[f64], variations: Vec<f64>, repeatability: f64) -> Vec<f64> {
    let of = |(coefficient_of_variation, &mean)| {
        without_repeatability(Moments { mean, coefficient_of_variation }, repeatability)
            .coefficient_of_variation
    };
    variations.into_iter().zip(means).map(of).collect()
}

/// Returns a random index below `count`.
fn draw(rng: &mut ChaCha20Rng, count: usize) -> usize {
    // The high half of a product of 64 bits with n: uniform to one part in 2⁶⁴/n.
    ((u128::from(rng.next_u64()) * count as u128) >> 64) as usize
}

/// Returns the interval of resampled values around the value `found` for the sample.
fn accelerated(mut values: Vec<f64>, found: f64, influences: &[f64]) -> Option<ConfidenceInterval> {
    values.sort_unstable_by(f64::total_cmp);
    let count = values.len() as f64;
    let below = values.partition_point(|&value| value < found) as f64;
    // Kept half a resample away from both ends, where the normal law has no quantile.
    let bias = standard_normal_quantile((below.clamp(0.5, count - 0.5)) / count);
    let squares = sum(influences.iter().map(|influence| influence * influence));
    let cubes = sum(influences.iter().map(|i| i * i * i));
    // At most a sixth, and `shifted` at most 5.3: the denominator below stays above 0.
    let acceleration = cubes / (6.0 * squares * squares.sqrt());
    let end = |probability: f64| {
        let shifted = bias + standard_normal_quantile(probability);
        let level = normal_probability(bias + shifted / (1.0 - acceleration * shifted));
        quantile(&values, level)
    };
    let tail = 0.5 * (1.0 - CONFIDENCE);
    Some(ConfidenceInterval { low: end(tail)?, high: end(1.0 - tail)? })
}

fn sum(values: impl Iterator<Item = f64>) -> f64 {
    let mut sum = Sum::default();
    values.for_each(|value| sum.add(value));
    sum.total()
}

#[cfg(test)]
mod tests;
