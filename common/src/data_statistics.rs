//! Statistics of measured velocities: how precisely they determine their moments, and whether they
//! can come from the model's law.

mod intervals;

use crate::job::{Data, Sampling};
use crate::limits;
use crate::moments::KolmogorovTest;
use crate::outcome::Outcome;
use crate::results::DataSummary;
use crate::robust::outliers;

pub use self::intervals::{CONFIDENCE, moment_intervals};

/// Number of independent draws to which a Sobol' point is equivalent for a distribution function,
/// on the safe side. Measured at the paper's optimum by the scatter of the fractions of velocities
/// below their 7, 30, 50 and 90 % quantiles over 40 scrambles: 14 to 52 at the dispersion 0.1 and 8
/// to 16 at 0.3 for 64 points, 33 to 78 and 14 to 22 for 256, 39 to 98 and 19 to 44 for 1024.
const SOBOL_WORTH: f64 = 10.0;
/// Terms of Kolmogorov's series; the next one is smaller than rounding errors.
const SERIES_TERMS: usize = 12;

impl DataSummary {
    /// Summarizes set number `set` of the data. Resamples velocities, which takes up to a fraction
    /// of a second.
    pub fn from_data(data: &Data, set: usize) -> Self {
        let given = data.set(set);
        let outliers = given.map(|given| outliers(given.velocities)).unwrap_or_default();
        Self {
            moments: data.moments(set),
            count: given.map(|given| given.velocities.len() as u64),
            intervals: given.as_ref().and_then(moment_intervals),
            outlier_count: outliers.len() as u64,
            outliers: outliers.into_iter().take(limits::OUTLIERS_LISTED_MAX).collect(),
        }
    }
}

/// Tests by Kolmogorov and Smirnov whether the data come from the law of the model's velocities,
/// which are the successes among `outcomes` (N. V. Smirnov, Ann. Math. Stat. 19 (1948)). Uses the
/// limit law at √n_e + 0.12 + 0.11/√n_e times the distance (M. A. Stephens, J. R. Stat. Soc. B 32
/// (1970)). `None` if there are no data, or no successes.
///
/// The data have to be independent, and without scatter that the model does not contain.
///
/// n_e = n m / (n + m) for n data and m independent realizations; a Sobol' point counts as several
/// independent realizations.
pub fn kolmogorov_test(
    data: &[f64],
    outcomes: &[Outcome],
    sampling: Sampling,
) -> Option<KolmogorovTest> {
    let model = sorted(outcomes.iter().filter_map(|outcome| outcome.ok()));
    if data.is_empty() || model.is_empty() {
        return None;
    }
    let worth = match sampling {
        Sampling::MonteCarlo => 1.0,
        Sampling::Sobol => SOBOL_WORTH,
    };
    let (n, m) = (data.len() as f64, worth * model.len() as f64);
    let distance = distance(&sorted(data.iter().copied()), &model);
    let root = (n * m / (n + m)).sqrt();
    Some(KolmogorovTest { distance, p_value: exceeded((root + 0.12 + 0.11 / root) * distance) })
}

fn sorted(sample: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sample: Vec<f64> = sample.collect();
    sample.sort_unstable_by(f64::total_cmp);
    sample
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

/// Returns the probability that Kolmogorov's limit law exceeds `x`, by whichever of the two forms
/// of the series converges faster.
fn exceeded(x: f64) -> f64 {
    use std::f64::consts::PI;
    if x <= 0.0 {
        return 1.0;
    }
    if x < 1.0 {
        let term = |k: usize| {
            let odd = (2 * k + 1) as f64;
            libm::exp(-odd * odd * PI * PI / (8.0 * x * x))
        };
        let sum: f64 = (0..SERIES_TERMS).map(term).sum();
        return (1.0 - (2.0 * PI).sqrt() / x * sum).clamp(0.0, 1.0);
    }
    let term = |k: usize| {
        let j = (k + 1) as f64;
        let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        sign * libm::exp(-2.0 * j * j * x * x)
    };
    (2.0 * (0..SERIES_TERMS).map(term).sum::<f64>()).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::Germs;
    use crate::job::MonteCarlo;
    use crate::outcome::FailureKind;
    use crate::parameters::Point;
    use crate::realization::Ensemble;
    use crate::special::standard_normal_quantile;

    /// Draws `count` values of a normal law with mean 3900 and coefficient of variation 0.03.
    fn normal(seed: u64, count: usize) -> Vec<f64> {
        let germs = (0..).flat_map(|index| *Germs::draw(seed, index).values());
        germs.take(count).map(|u| 3900.0 * (1.0 + 0.03 * standard_normal_quantile(u))).collect()
    }

    #[test]
    fn distances_of_small_samples() {
        for (a, b, expected) in [
            (&[1.0, 2.0][..], &[1.0, 2.0][..], 0.0),
            (&[1.0, 2.0], &[3.0, 4.0], 1.0),
            (&[1.0, 3.0], &[2.0, 4.0], 0.5),
            (&[1.0, 1.0, 1.0], &[1.0], 0.0),
            (&[1.0, 2.0, 3.0, 4.0], &[3.5], 0.75),
        ] {
            assert_eq!(distance(a, b), expected, "{a:?} {b:?}");
            assert_eq!(distance(b, a), expected, "{b:?} {a:?}");
        }
        let test = |data: &[f64], model: &[Outcome]| {
            kolmogorov_test(data, model, Sampling::MonteCarlo).map(|test| test.distance)
        };
        assert_eq!(test(&[], &[Ok(1.0)]), None);
        assert_eq!(test(&[1.0], &[Err(FailureKind::NoArrival)]), None);
        let model = [Ok(1.0), Err(FailureKind::NoArrival), Ok(3.0)];
        assert_eq!(test(&[2.0, 4.0], &model), Some(0.5));
    }

    /// Compares with values of the limit law from tables (N. V. Smirnov 1948).
    #[test]
    fn the_limit_law_is_that_of_the_tables() {
        for (x, expected) in [
            (0.5, 0.963945),
            (0.828, 0.499_33),
            (1.0, 0.270000),
            (1.36, 0.049_49),
            (1.63, 0.009_85),
            (2.0, 0.000671),
        ] {
            assert!((exceeded(x) - expected).abs() < 1e-4, "{x}: {}", exceeded(x));
        }
        assert_eq!((exceeded(0.0), exceeded(-1.0)), (1.0, 1.0));
        assert!((exceeded(1.0 - 1e-12) - exceeded(1.0)).abs() < 1e-10);
    }

    /// Checks the fractions of p-values below 0.5, 0.1 and 0.05, which have standard deviations of
    /// 0.016, 0.009 and 0.007.
    fn check_p_values(of: impl Fn(u64) -> f64) {
        let p: Vec<f64> = (0..1000).map(of).collect();
        for (limit, tolerance) in [(0.5, 0.06), (0.1, 0.03), (0.05, 0.022)] {
            let share = p.iter().filter(|&&p| p < limit).count() as f64 / 1000.0;
            assert!((share - limit).abs() < tolerance, "{share} below {limit}");
        }
    }

    #[test]
    fn p_values_are_uniform_under_one_law_and_small_under_two() {
        let p = |seed: u64, sizes: (usize, usize), shift: f64| {
            let model: Vec<Outcome> =
                normal(2 * seed, sizes.1).iter().map(|v| Ok(v + shift)).collect();
            let data = normal(2 * seed + 1, sizes.0);
            kolmogorov_test(&data, &model, Sampling::MonteCarlo).unwrap().p_value
        };
        for sizes in [(300, 400), (30, 2747), (100, 1000)] {
            check_p_values(|seed| p(seed, sizes, 0.0));
        }
        assert!(p(1, (300, 400), 60.0) < 1e-4, "{}", p(1, (300, 400), 60.0));
    }

    /// The velocities are the speed of 21 germs plus 5 % of other scatter; there are as many data
    /// as points.
    #[test]
    fn p_values_are_uniform_against_sobol_points() {
        let point = Point([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
        let velocities = |monte_carlo: MonteCarlo| -> Vec<f64> {
            let ensemble = Ensemble::drawn(&point, monte_carlo.germs()).unwrap();
            let speed = |index| {
                let rows = *ensemble.bone(index).unwrap().elasticity.rows();
                (rows[0][0] / 1598.8).sqrt() + 5e-9 * (rows[1][1] - rows[2][2])
            };
            (0..monte_carlo.realizations).map(speed).collect()
        };
        let plain = MonteCarlo { realizations: 256, ..MonteCarlo::default() };
        check_p_values(|seed| {
            let data = velocities(MonteCarlo { seed: 2 * seed, ..plain });
            let sobol = MonteCarlo { seed: 2 * seed + 1, sampling: Sampling::Sobol, ..plain };
            let model: Vec<Outcome> = velocities(sobol).into_iter().map(Ok).collect();
            kolmogorov_test(&data, &model, Sampling::Sobol).unwrap().p_value
        });
    }
}
