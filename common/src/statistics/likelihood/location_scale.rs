//! How precisely velocities determine the moments of the model's law by their likelihood.
//!
//! The law of the best point is shifted and widened until the data are most likely: f becomes
//! h((z - a)/e^b)/(σ e^b) with z = (x - v)/σ. With the scores s_j, the derivatives of ln f(x_j) by
//! (a, b), and H, minus the derivative of their sum, the errors of the maximum have the covariance
//! H⁻¹ (Σ s_j s_jᵀ/(1 - h_j)) H⁻¹ with the leverages h_j (P. J. Huber, Proc. Fifth Berkeley Symp. 1
//! (1967)). A velocity far from all others has a small score, and hardly enters.

use super::Law;
use crate::data::VelocitySet;
use crate::job::MonteCarlo;
use crate::outcome::Outcome;
use crate::parameters::Point;
use crate::statistics::sum::Sum;

/// Maximum number of steps; from the best point of a search two or three suffice.
const STEPS_MAX: usize = 40;
/// Largest step of a and of b.
const STEP_MAX: f64 = 0.3;
/// A step this small ends the fit.
const CONVERGED: f64 = 1e-7;
/// Half the difference of a or b by which the derivatives of scores are computed.
const DIFFERENCE: f64 = 1e-3;

/// Largest leverage of a velocity, or a subject, that is corrected for.
const LEVERAGE_MAX: f64 = 0.5;

/// The moments of a law by which velocities are most likely, compared with the model's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LikelihoodFit {
    /// Differences of (ln v, ln Δ) from the model's.
    pub residual: [f64; 2],
    /// Covariance of (ln v, ln Δ).
    pub covariance: [[f64; 2]; 2],
}

/// Fits mean and coefficient of variation of the law of the model's velocities to measured ones, by
/// their likelihood. Velocities of one subject are not independent. `None` if the model has no law,
/// for fewer than two velocities or subjects, and if no maximum is found.
pub fn likelihood_fit(
    monte_carlo: &MonteCarlo,
    point: &Point,
    outcomes: &[Outcome],
    set: &VelocitySet<'_>,
) -> Option<LikelihoodFit> {
    let law = Law::from_outcomes(monte_carlo, point, outcomes)?;
    if set.independent_count() < 2 {
        return None;
    }
    let fit = LocationScale { law: &law, set };
    let at = fit.maximum()?;
    let bread = inverse(fit.curvature(at))?;
    let meat = fit.products(at, Some(inverse(fit.products(at, None))?));
    let spread = law.deviation / law.mean;
    let shift = libm::log1p(at[0] * spread);
    // ln v = shift, up to a constant, and ln Δ = b - shift.
    let slope = spread / (1.0 + at[0] * spread);
    let change = product([[slope, 0.0], [-slope, 1.0]], bread);
    let covariance = product(product(change, meat), transposed(change));
    let residual = [shift, at[1] - shift];
    covariance
        .as_flattened()
        .iter()
        .all(|entry| entry.is_finite())
        .then_some(LikelihoodFit { residual, covariance })
}

/// The likelihood of velocities as a function of (a, b).
struct LocationScale<'a> {
    law: &'a Law<'a>,
    set: &'a VelocitySet<'a>,
}

impl LocationScale<'_> {
    /// Returns where it is largest, from the law as it is. Where Newton's steps lead uphill they are
    /// taken, and otherwise those with the products of the scores in place of the curvature.
    fn maximum(&self) -> Option<[f64; 2]> {
        let mut at = [0.0; 2];
        for _ in 0..STEPS_MAX {
            let curvature = self.curvature(at);
            let upwards = is_positive(curvature).then_some(curvature);
            let inverse = inverse(upwards.unwrap_or_else(|| self.products(at, None)))?;
            let score = self.score(at);
            let step = [0, 1].map(|k| inverse[k][0] * score[0] + inverse[k][1] * score[1]);
            let longest = step[0].abs().max(step[1].abs());
            let shortened = (STEP_MAX / longest).min(1.0);
            at = [0, 1].map(|k| at[k] + shortened * step[k]);
            if longest <= CONVERGED {
                return is_positive(self.curvature(at)).then_some(at);
            }
            if longest.is_nan() {
                return None;
            }
        }
        None
    }

    /// Returns the scores of each velocity.
    fn scores(&self, [shift, width]: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
        let narrowing = libm::exp(-width);
        self.set.velocities.iter().map(move |&velocity| {
            let score = (self.law.score(velocity) - shift) * narrowing;
            let parts = self.law.parts(score);
            let slope = (parts.kernels.1 + parts.floor.1) / parts.density();
            [-slope * narrowing, -1.0 - score * slope]
        })
    }

    fn score(&self, at: [f64; 2]) -> [f64; 2] {
        let mut sums = [Sum::default(); 2];
        for scores in self.scores(at) {
            sums.iter_mut().zip(scores).for_each(|(sum, score)| sum.add(score));
        }
        sums.map(|sum| sum.total())
    }

    /// Returns minus the second derivatives.
    fn curvature(&self, at: [f64; 2]) -> [[f64; 2]; 2] {
        let along = |axis: usize| {
            let moved = |by: f64| {
                let mut moved = at;
                moved[axis] += by;
                self.score(moved)
            };
            let (above, below) = (moved(DIFFERENCE), moved(-DIFFERENCE));
            [0, 1].map(|k| (below[k] - above[k]) / (2.0 * DIFFERENCE))
        };
        let [[a, b], [c, d]] = [along(0), along(1)];
        let both = 0.5 * (b + c);
        [[a, both], [both, d]]
    }

    /// Returns the sum of the products of the scores, summed over each subject. The maximum lies near
    /// the velocities that it is computed from, so this is too small; given the inverse M of the plain
    /// sum, each product is divided by 1 - h with the leverage h = sᵀ M s, at most [`LEVERAGE_MAX`]
    /// (as HC2 of J. G. MacKinnon and H. White, J. Econometrics 29 (1985)).
    fn products(&self, at: [f64; 2], inverse: Option<[[f64; 2]; 2]>) -> [[f64; 2]; 2] {
        let mut parts = vec![[Sum::default(); 2]; self.set.independent_count()];
        for (index, scores) in self.scores(at).enumerate() {
            let part = self.set.subjects.map_or(index, |subjects| subjects[index] as usize);
            parts[part].iter_mut().zip(scores).for_each(|(sum, score)| sum.add(score));
        }
        let mut sums = [Sum::default(); 3];
        for part in parts {
            let [a, b] = part.map(Sum::total);
            let leverage = inverse.map_or(0.0, |inverse| {
                let [[aa, ab], [_, bb]] = inverse;
                (aa * a * a + 2.0 * ab * a * b + bb * b * b).clamp(0.0, LEVERAGE_MAX)
            });
            let all = [a * a, a * b, b * b].map(|product| product / (1.0 - leverage));
            sums.iter_mut().zip(all).for_each(|(sum, one)| sum.add(one));
        }
        let [a, both, b] = sums.map(Sum::total);
        [[a, both], [both, b]]
    }
}

fn is_positive([[a, b], [c, d]]: [[f64; 2]; 2]) -> bool {
    a > 0.0 && a * d - b * c > 0.0
}

fn inverse([[a, b], [c, d]]: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let determinant = a * d - b * c;
    let inverse = [[d, -b], [-c, a]].map(|row| row.map(|entry| entry / determinant));
    inverse.as_flattened().iter().all(|entry| entry.is_finite()).then_some(inverse)
}

fn product(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    a.map(|row| [0, 1].map(|k| row[0] * b[0][k] + row[1] * b[1][k]))
}

fn transposed([[a, b], [c, d]]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    [[a, c], [b, d]]
}

#[cfg(test)]
mod tests {
    use super::super::tests::{OPTIMUM, drawn, outcomes, quantiles};
    use super::*;
    use crate::statistics::{covariance_of_logarithms, moments};

    fn fit(velocities: &[f64]) -> LikelihoodFit {
        let model = outcomes(&quantiles(2000));
        let set = VelocitySet::independent(velocities);
        likelihood_fit(&MonteCarlo::default(), &OPTIMUM, &model, &set).unwrap()
    }

    fn errors(fit: &LikelihoodFit) -> [f64; 2] {
        [0, 1].map(|k| fit.covariance[k][k].sqrt())
    }

    #[test]
    fn clean_data_have_the_errors_of_their_moments() {
        let data = drawn(3, 2000);
        let found = fit(&data);
        let (model, measured) = (moments(&quantiles(2000)).unwrap(), moments(&data).unwrap());
        let expected = [
            libm::log(measured.mean / model.mean),
            libm::log(measured.coefficient_of_variation / model.coefficient_of_variation),
        ];
        let by_moments = covariance_of_logarithms(&VelocitySet::independent(&data)).unwrap();
        for (k, error) in errors(&found).into_iter().enumerate() {
            let of_moments = by_moments[k][k].sqrt();
            assert!((error / of_moments - 1.0).abs() < 0.15, "{k}: {error} {of_moments}");
            assert!(
                (found.residual[k] - expected[k]).abs() < 0.3 * error,
                "{found:?} {expected:?}"
            );
        }
    }

    #[test]
    fn a_wrong_velocity_hardly_changes_errors_and_residuals() {
        for (count, most) in [(2747, 0.05), (100, 0.25)] {
            let mut data = drawn(5, count);
            let clean = fit(&data);
            data[count / 2] *= 2.0;
            let wrong = fit(&data);
            for (k, error) in errors(&clean).into_iter().enumerate() {
                assert!((errors(&wrong)[k] / error - 1.0).abs() < most, "{clean:?} {wrong:?}");
                let moved = (wrong.residual[k] - clean.residual[k]).abs();
                assert!(moved < 2.0 * most * error, "{clean:?} {wrong:?}");
            }
            let by_moments = covariance_of_logarithms(&VelocitySet::independent(&data)).unwrap();
            assert!(by_moments[1][1] > 4.0 * wrong.covariance[1][1], "{by_moments:?} {wrong:?}");
        }
    }

    /// The law of 50 velocities is that of the model, so that both residuals are errors.
    #[test]
    fn intervals_hold_the_truth_as_often_as_they_say() {
        // Student's law with 49 degrees of freedom.
        let quantile = 2.0096;
        let mut held = [0; 2];
        for seed in 0..400 {
            let found = fit(&drawn(1000 + seed, 50));
            for (k, error) in errors(&found).into_iter().enumerate() {
                held[k] += u32::from(found.residual[k].abs() <= quantile * error);
            }
        }
        // 92 to 98 %.
        assert!(held.iter().all(|held| (368..=392).contains(held)), "{held:?} of 400");
    }

    /// Each velocity eight times is one velocity of a subject with eight.
    #[test]
    fn copies_of_velocities_add_nothing() {
        let data = drawn(6, 60);
        let copies: Vec<f64> = data.iter().flat_map(|&velocity| [velocity; 8]).collect();
        let subjects: Vec<u32> = (0..60).flat_map(|subject| [subject; 8]).collect();
        let set = VelocitySet { subjects: Some(&subjects), ..VelocitySet::independent(&copies) };
        let model = outcomes(&quantiles(2000));
        let found = likelihood_fit(&MonteCarlo::default(), &OPTIMUM, &model, &set).unwrap();
        for (one, other) in errors(&found).into_iter().zip(errors(&fit(&data))) {
            assert!((one / other - 1.0).abs() < 1e-6, "{one} {other}");
        }
        let one = VelocitySet { subjects: Some(&[0; 480]), ..set };
        assert_eq!(likelihood_fit(&MonteCarlo::default(), &OPTIMUM, &model, &one), None);
    }
}
