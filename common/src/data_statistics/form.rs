//! Skewness and tails of measured velocities against those of the model's law.
//!
//! Both are ratios of L-moments (J. R. M. Hosking, J. R. Stat. Soc. B 52 (1990)), which single velocities move
//! less than third and fourth powers. They see tails, which move Kolmogorov's distance little, and do not depend
//! on mean and scatter, so that it does not matter which of these were fitted.

use rand_chacha::ChaCha20Rng;
use rand_chacha::rand_core::SeedableRng;

use super::kolmogorov::{SAMPLE_MAX, SAMPLES, equivalent_size, sample_of, sorted};
use super::lattice::rounding;
use crate::job::Sampling;
use crate::moments::{FormTest, FormTests};
use crate::outcome::Outcome;

/// Fewest velocities of which they say anything.
const VELOCITIES_MIN: usize = 8;

/// Tests whether L-skewness and L-kurtosis of measured velocities (m/s) can be those of the law of the model's velocities,
/// which are the successes among `outcomes`. `None` if either are fewer than eight, or all the same.
///
/// As for Kolmogorov's test the data have to be independent, are compared with samples of the model's law, and
/// count as fewer where the law is known by few realizations.
pub fn form_tests(
    velocities: &[f64],
    outcomes: &[Outcome],
    sampling: Sampling,
) -> Option<FormTests> {
    let model = sorted(outcomes.iter().filter_map(|outcome| outcome.ok()));
    if velocities.len() < VELOCITIES_MIN || model.len() < VELOCITIES_MIN {
        return None;
    }
    let data = sorted(velocities.iter().copied());
    let (of_data, of_model) = (form(&data)?, form(&model)?);
    let size = velocities.len().min(SAMPLE_MAX);
    let scale = (equivalent_size(velocities.len(), model.len(), sampling) / size as f64).sqrt();
    let step = rounding(velocities);
    let mut rng = ChaCha20Rng::from_seed([0; 32]);
    let samples: Vec<[f64; 2]> = (0..SAMPLES)
        .filter_map(|_| {
            let mut sample = sample_of(&model, &mut rng, size);
            if let Some(step) = step {
                sample.iter_mut().for_each(|v| *v = step * (*v / step).round());
            }
            form(&sample)
        })
        .collect();
    let test = |which: usize| {
        let (data, model) = (of_data[which], of_model[which]);
        let expected = model + (data - model) * scale;
        let above = samples.iter().filter(|sample| sample[which] >= expected).count();
        let below = samples.iter().filter(|sample| sample[which] <= expected).count();
        let p_value = 2.0 * (1 + above.min(below)) as f64 / (SAMPLES + 1) as f64;
        FormTest { data, model, p_value: p_value.min(1.0) }
    };
    Some(FormTests { skewness: test(0), kurtosis: test(1) })
}

/// Returns L-skewness and L-kurtosis of values in ascending order; `None` if all are the same.
fn form(ascending: &[f64]) -> Option<[f64; 2]> {
    let count = ascending.len() as f64;
    let first = ascending.first()?;
    // Means of the values, each times the share of triples, … of smaller ones.
    let mut means = [0.0; 4];
    for (place, value) in ascending.iter().enumerate() {
        let mut part = (value - first) / count;
        for (order, mean) in means.iter_mut().enumerate() {
            *mean += part;
            part *= (place as f64 - order as f64) / (count - 1.0 - order as f64);
        }
    }
    let [b0, b1, b2, b3] = means;
    let scale = 2.0 * b1 - b0;
    let found = [6.0 * b2 - 6.0 * b1 + b0, 20.0 * b3 - 30.0 * b2 + 12.0 * b1 - b0];
    (scale > 0.0).then(|| found.map(|moment| moment / scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::Germs;
    use crate::special::standard_normal_quantile;

    /// Draws `count` values of a normal law, each of which is then changed.
    fn drawn(seed: u64, count: usize, change: impl Fn(f64) -> f64) -> Vec<f64> {
        let germs = (0..).flat_map(|index| *Germs::draw(seed, index).values());
        germs.take(count).map(|u| 3900.0 + 120.0 * change(standard_normal_quantile(u))).collect()
    }

    fn tests(data: &[f64], model: &[f64]) -> FormTests {
        let outcomes: Vec<Outcome> = model.iter().map(|v| Ok(*v)).collect();
        form_tests(data, &outcomes, Sampling::MonteCarlo).unwrap()
    }

    fn check_form(quantile: fn(f64) -> f64, expected: [f64; 2]) {
        let values: Vec<f64> = (0..100_000).map(|k| quantile((f64::from(k) + 0.5) / 1e5)).collect();
        let found = form(&values).unwrap();
        let off = [0, 1].map(|which| (found[which] - expected[which]).abs());
        assert!(off[0] < 1e-4 && off[1] < 1e-4, "{found:?} {expected:?}");
    }

    #[test]
    fn the_numbers_are_those_of_uniform_exponential_and_normal_laws() {
        check_form(|u| u, [0.0, 0.0]);
        check_form(|u| -libm::log(1.0 - u), [1.0 / 3.0, 1.0 / 6.0]);
        check_form(standard_normal_quantile, [0.0, 0.1226]);
        assert_eq!(form(&[1.0; 9]), None);
    }

    /// Checks the fractions of p-values below 0.5, 0.1 and 0.05 to three standard deviations.
    fn check_p_values(size: usize, realizations: usize, change: fn(f64) -> f64) {
        let of = |seed: u64| {
            tests(&drawn(2 * seed, size, change), &drawn(2 * seed + 1, realizations, change))
        };
        let found: Vec<FormTests> = (0..300).map(of).collect();
        let p_values: [fn(&FormTests) -> f64; 2] =
            [|one| one.skewness.p_value, |one| one.kurtosis.p_value];
        for limit in [0.5, 0.1, 0.05_f64] {
            for p in p_values {
                let share = found.iter().filter(|one| p(one) < limit).count() as f64 / 300.0;
                let tolerance = 3.0 * (limit * (1.0 - limit) / 300.0).sqrt();
                assert!((share - limit).abs() < tolerance, "{size}: {share} below {limit}");
            }
        }
    }

    #[test]
    fn p_values_are_uniform_under_one_law() {
        check_p_values(20, 1000, |z| z);
        check_p_values(100, 1000, |z| z);
        // Of a skewed law, and of more velocities than the samples have.
        check_p_values(1000, 3000, |z| z + 0.1 * z * z);
        check_p_values(300, 3000, |z| z + 0.1 * z * z);
        check_p_values(300, 30000, |z| z + 0.1 * z * z);
        check_p_values(1000, 3000, |z| z);
    }

    #[test]
    fn other_forms_are_seen() {
        let model = drawn(1, 2000, |z| z);
        let skewed = tests(&drawn(2, 300, |z| z + 0.2 * z * z), &model);
        assert!(skewed.skewness.p_value < 0.01, "{skewed:?}");
        let heavy = tests(&drawn(3, 300, |z| z * (1.0 + 0.15 * z * z)), &model).kurtosis;
        assert!(heavy.p_value < 0.01 && heavy.data > heavy.model, "{heavy:?}");
    }

    #[test]
    fn few_or_equal_velocities_are_not_tested() {
        let model: Vec<Outcome> = drawn(1, 20, |z| z).into_iter().map(Ok).collect();
        for data in [&[3900.0, 3950.0][..], &[3900.0; 20]] {
            assert_eq!(form_tests(data, &model, Sampling::Sobol), None);
        }
    }
}
