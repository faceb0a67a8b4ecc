//! Location and scale of velocities that a few wrong ones do not change, and the velocities that
//! lie far from the others.

use crate::moments::Outlier;
use crate::quantile::quantile;

/// Standard deviation of a normal law in median absolute deviations.
const OF_ABSOLUTE_DEVIATION: f64 = 1.4826;
/// Interquartile range of a normal law in standard deviations.
const OF_QUARTILES: f64 = 1.349;
/// Smallest number of velocities among which some are called outlying.
const COUNT_MIN: usize = 5;
/// Distance from the median, in robust standard deviations, beyond which a velocity among many is
/// outlying.
const OUTLYING: f64 = 6.0;
/// The scale of few velocities is uncertain, so the distance is longer for them, by this divided by
/// the square of their number. With it less than one of a hundred samples of a normal law has an
/// outlying velocity, of whatever size it is; without it, one of twelve with five velocities.
const OUTLYING_OF_FEW: f64 = 50.0;

/// Median and robust standard deviation of velocities, m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustScale {
    /// The median.
    pub median: f64,
    /// The larger of 1.4826 times the median absolute deviation from it and the interquartile range
    /// divided by 1.349: among coarsely rounded velocities either may be near 0. Above 0.
    pub deviation: f64,
    /// Distance from the median, in these deviations, beyond which a velocity is outlying.
    pub outlying_from: f64,
}

impl RobustScale {
    /// Returns those of velocities (m/s); `None` for fewer than five, and if both scales are 0.
    pub fn from_velocities(velocities: &[f64]) -> Option<Self> {
        if velocities.len() < COUNT_MIN {
            return None;
        }
        let mut ascending = velocities.to_vec();
        ascending.sort_unstable_by(f64::total_cmp);
        let median = quantile(&ascending, 0.5)?;
        let range = quantile(&ascending, 0.75)? - quantile(&ascending, 0.25)?;
        // In place, since a million velocities take 8 MB.
        let mut distances = ascending;
        distances.iter_mut().for_each(|one| *one = (*one - median).abs());
        distances.sort_unstable_by(f64::total_cmp);
        let half = quantile(&distances, 0.5)?;
        let deviation = (OF_ABSOLUTE_DEVIATION * half).max(range / OF_QUARTILES);
        let count = velocities.len() as f64;
        let outlying_from = OUTLYING * (1.0 + OUTLYING_OF_FEW / (count * count));
        (deviation > 0.0).then_some(Self { median, deviation, outlying_from })
    }

    /// Returns by how many robust standard deviations a velocity lies above the median.
    pub fn deviations(&self, velocity: f64) -> f64 {
        (velocity - self.median) / self.deviation
    }

    /// Returns whether a velocity is outlying.
    pub fn is_outlying(&self, velocity: f64) -> bool {
        self.deviations(velocity).abs() > self.outlying_from
    }
}

/// Returns the velocities (m/s) that are farther from the median than 6 robust standard deviations,
/// and than 6 + 300/n² for n of them; none for fewer than five.
pub fn outliers(velocities: &[f64]) -> Vec<Outlier> {
    let Some(scale) = RobustScale::from_velocities(velocities) else { return Vec::new() };
    let outlying =
        velocities.iter().enumerate().filter(|(_, velocity)| scale.is_outlying(**velocity));
    outlying
        .map(|(index, &velocity)| Outlier {
            index: index as u64,
            velocity,
            deviations: scale.deviations(velocity),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::Germs;
    use crate::special::standard_normal_quantile;

    fn found(velocities: &[f64]) -> Vec<u64> {
        outliers(velocities).iter().map(|outlier| outlier.index).collect()
    }

    #[test]
    fn velocities_far_from_the_median_are_outlying() {
        // The median is 3902, and the median absolute deviation 2.
        let clean = [3900.0, 3904.0, 3901.0, 3903.0, 3902.0, 3899.0, 3905.0];
        assert_eq!(found(&clean), [0; 0]);
        let mut wrong = clean.to_vec();
        wrong[2] = 7800.0;
        let [outlier] = outliers(&wrong)[..] else { panic!("{wrong:?}") };
        assert_eq!((outlier.index, outlier.velocity), (2, 7800.0));
        assert!((outlier.deviations - 3897.0 / (1.4826 * 2.0)).abs() < 1e-9, "{outlier:?}");
        wrong[5] = 390.0;
        assert_eq!(found(&wrong), [2, 5]);
        assert!(outliers(&wrong)[1].deviations < 0.0);
        // Fewer than five show no scale.
        assert_eq!(found(&[3900.0, 3904.0, 3901.0, 7800.0]), [0; 0]);
    }

    #[test]
    fn equal_velocities_have_the_scale_of_their_quartiles_or_none() {
        let mut velocities = vec![3900.0; 7];
        velocities.extend([3890.0, 3880.0, 3870.0, 3860.0, 7800.0]);
        assert_eq!(RobustScale::from_velocities(&velocities).unwrap().deviation, 12.5 / 1.349);
        assert_eq!(found(&velocities), [11]);
        velocities[7..11].fill(3900.0);
        assert_eq!(RobustScale::from_velocities(&velocities), None);
        assert_eq!(found(&velocities), [0; 0]);
    }

    #[test]
    fn few_samples_of_a_normal_law_have_an_outlier() {
        for (count, samples) in [(5, 1000), (8, 1000), (20, 500), (100, 200)] {
            let outlying = (0..samples).filter(|sample| {
                let germs = (0..).flat_map(|index| *Germs::draw(*sample, index).values());
                let normal = germs.take(count).map(|u| 3900.0 + 60.0 * standard_normal_quantile(u));
                !outliers(&normal.collect::<Vec<f64>>()).is_empty()
            });
            let share = outlying.count() as f64 / samples as f64;
            assert!(share < 0.02, "{share} of {count}");
        }
    }
}
