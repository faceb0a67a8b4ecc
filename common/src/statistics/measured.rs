//! Moments of measured data and their noise.

use crate::data::{Data, Measurements, VelocitySet};
use crate::moments::Moments;

use super::central::{Central, central};
use super::moments;
use super::sum::Sum;

impl Data {
    /// Returns the moments of a set, by its number, without the instrument's own scatter: those
    /// that a model has to match. NaN if there is no such set.
    pub fn moments(&self, set: usize) -> Moments {
        let measured = match self.measurements {
            Measurements::Moments { mean, coefficient_of_variation, .. } => {
                Some(Moments { mean, coefficient_of_variation })
            }
            _ => self.velocities(set).and_then(moments),
        };
        measured.map_or(Moments::UNKNOWN, |all| without_repeatability(all, self.repeatability))
    }
}

/// Returns the moments of velocities without an instrument's own standard deviation (m/s), of which
/// the variance is subtracted; a coefficient of variation of 0 if nothing is left.
pub fn without_repeatability(measured: Moments, repeatability: f64) -> Moments {
    if repeatability == 0.0 {
        return measured;
    }
    let deviation = measured.coefficient_of_variation * measured.mean;
    // The product of sum and difference cannot overflow where the squares would.
    let left = ((deviation - repeatability) * (deviation + repeatability)).max(0.0);
    Moments { coefficient_of_variation: left.sqrt() / measured.mean, ..measured }
}

/// Returns the covariance of the logarithms of mean and coefficient of variation of a set of
/// velocities, by the delta method, or `None` if it has only one independent part, or no scatter
/// but the instrument's.
///
/// For independent velocities it is the covariance of the mean of their influences, with division
/// by N - 1. For S subjects it is that of the sums of influences over each subject, g_s, which are
/// independent however strongly the velocities of one subject are correlated (K.-Y. Liang and S. L.
/// Zeger, Biometrika 73 (1986)): S/(S - 1) Σ g_s g_sᵀ / N².
pub fn covariance_of_logarithms(set: &VelocitySet<'_>) -> Option<[[f64; 2]; 2]> {
    covariance_of_means(set, influences_on_logarithms(set)?)
}

/// Returns the influence of each velocity on the logarithms of mean and coefficient of variation; `None`
/// if there is no scatter but the instrument's.
pub(super) fn influences_on_logarithms(
    set: &VelocitySet<'_>,
) -> Option<impl Iterator<Item = [f64; 2]>> {
    let central = central(set.velocities.iter().copied()).filter(Central::scatters)?;
    let known = set.repeatability * set.repeatability;
    if central.variance() <= known {
        return None;
    }
    let moments = without_repeatability(central.moments(), set.repeatability);
    Some(set.velocities.iter().map(move |&velocity| {
        let [mean, variation] = central.influence_without(known, velocity);
        [mean / moments.mean, variation / moments.coefficient_of_variation]
    }))
}

/// Returns the covariance of the means of influences, one vector for each velocity of a set; `None` if
/// it has only one independent part.
pub(super) fn covariance_of_means<const N: usize>(
    set: &VelocitySet<'_>,
    influences: impl Iterator<Item = [f64; N]>,
) -> Option<[[f64; N]; N]> {
    let velocities = set.velocities.len() as f64;
    let Some(subjects) = set.subjects else {
        let pairs = velocities * (velocities - 1.0);
        return Some(products(influences).map(|row| row.map(|sum| sum / pairs)));
    };
    let parts = set.independent_count();
    if parts < 2 {
        return None;
    }
    let mut sums = vec![[Sum::default(); N]; parts];
    for (influence, &subject) in influences.zip(subjects) {
        for (sum, part) in sums[subject as usize].iter_mut().zip(influence) {
            sum.add(part);
        }
    }
    let all = products(sums.iter().map(|sums| sums.map(|sum| sum.total())));
    let count = parts as f64;
    let factor = count / (count - 1.0) / (velocities * velocities);
    Some(all.map(|row| row.map(|sum| sum * factor)))
}

/// Returns the sum of the outer products of vectors with themselves.
fn products<const N: usize>(vectors: impl Iterator<Item = [f64; N]>) -> [[f64; N]; N] {
    let mut sums = [[Sum::default(); N]; N];
    for vector in vectors {
        for (row, one) in sums.iter_mut().zip(vector) {
            row.iter_mut().zip(vector).for_each(|(sum, other)| sum.add(one * other));
        }
    }
    sums.map(|row| row.map(Sum::total))
}

#[cfg(test)]
mod tests {
    use super::*;

    const VELOCITIES: [f64; 6] = [3900.0, 3925.0, 3890.0, 3960.0, 3911.0, 3904.0];

    fn close(found: [[f64; 2]; 2], expected: [[f64; 2]; 2], tolerance: f64) {
        for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((found / expected - 1.0).abs() < tolerance, "{found}, expected {expected}");
        }
    }

    #[test]
    fn the_instruments_scatter_is_no_part_of_the_moments() {
        for (repeatability, expected) in
            [(0.0, 0.05), (120.0, 0.04), (160.0, 0.03), (200.0, 0.0), (300.0, 0.0)]
        {
            let data = Data { repeatability, ..Data::from_moments(4000.0, 0.05) };
            let Moments { mean, coefficient_of_variation } = data.moments(0);
            assert_eq!(mean, 4000.0);
            assert!((coefficient_of_variation - expected).abs() < 1e-15, "{repeatability}");
        }
        let data = Data { repeatability: 80.0, ..Data::from_velocities(vec![3900.0, 4100.0]) };
        assert!((data.moments(0).coefficient_of_variation - 0.015).abs() < 1e-15);
    }

    #[test]
    fn subjects_with_one_velocity_each_are_independent_velocities() {
        let alone = VelocitySet::independent(&VELOCITIES);
        let subjects = VelocitySet { subjects: Some(&[0, 1, 2, 3, 4, 5]), ..alone };
        let expected = covariance_of_logarithms(&alone).unwrap();
        close(covariance_of_logarithms(&subjects).unwrap(), expected, 1e-13);
    }

    /// With each velocity k times, variances are those of the velocities themselves, whose N - 1 is
    /// the number of subjects less one.
    #[test]
    fn copies_of_velocities_add_nothing() {
        let repeated: Vec<f64> = VELOCITIES.iter().flat_map(|&velocity| [velocity; 8]).collect();
        let subjects: Vec<u32> = (0..6).flat_map(|subject| [subject; 8]).collect();
        let copies =
            VelocitySet { subjects: Some(&subjects), ..VelocitySet::independent(&repeated) };
        let expected = covariance_of_logarithms(&VelocitySet::independent(&VELOCITIES)).unwrap();
        close(covariance_of_logarithms(&copies).unwrap(), expected, 1e-12);
    }

    /// Compares with differences of the logarithms by the weight of each velocity.
    #[test]
    fn influences_are_those_of_the_corrected_moments() {
        let repeatability = 15.0;
        let logarithms = |weighted: usize, more: f64| {
            let weights = (0..6).map(|k| if k == weighted { 1.0 + more } else { 1.0 });
            let all: Vec<(f64, f64)> = VELOCITIES.into_iter().zip(weights).collect();
            let total: f64 = all.iter().map(|(_, weight)| weight).sum();
            let mean = all.iter().map(|(v, weight)| v * weight).sum::<f64>() / total;
            let squares = all.iter().map(|(v, weight)| (v - mean) * (v - mean) * weight);
            let variance = squares.sum::<f64>() / total - repeatability * repeatability;
            [libm::log(mean), 0.5 * libm::log(variance) - libm::log(mean)]
        };
        let step = 1e-5;
        let influences = (0..6).map(|k| {
            let [above, below] = [step, -step].map(|more| logarithms(k, more));
            [0, 1].map(|axis| 6.0 * (above[axis] - below[axis]) / (2.0 * step))
        });
        let expected = products(influences).map(|row| row.map(|sum| sum / 30.0));
        let set = VelocitySet { repeatability, ..VelocitySet::independent(&VELOCITIES) };
        close(covariance_of_logarithms(&set).unwrap(), expected, 1e-6);
    }

    #[test]
    fn too_few_parts_have_no_covariance() {
        let set = VelocitySet::independent(&VELOCITIES);
        let one = VelocitySet { subjects: Some(&[0; 6]), ..set };
        let noisy = VelocitySet { repeatability: 30.0, ..set };
        for set in [one, noisy, VelocitySet::independent(&[3900.0; 3])] {
            assert_eq!(covariance_of_logarithms(&set), None, "{set:?}");
        }
    }
}
