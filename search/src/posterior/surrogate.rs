//! Interpolation of the model's moments: Gaussian processes for their deviation from the closed
//! form.
//!
//! Each of ln v - ln √(c1111/ρ), ln Δ - ln δ and the means of other observables is interpolated by a Gaussian process in the features
//! of the point (C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning
//! (2006), Sec. 2.2 and 5.4), with a Matérn kernel of order 5/2, a broad linear trend and a length
//! for each feature, chosen by maximum marginal likelihood.

use osteon_common::moments::{MOMENTS, MomentVector};
use osteon_common::observables::ObservableSet;

use super::cholesky::{Cholesky, dot};
use super::features::{FEATURES, Features};

/// The deviations at a point: of ln v, of ln Δ, and of each observable that of its mean from the data's,
/// relative to that; 0 for one that was not measured.
pub(super) type Deviations = MomentVector;

/// Deviations by the rule of thumb, for use before any evaluation: v = 0.99 √(c1111/ρ),
/// Δ = 0.99 δ/√14.
pub(super) const RULE_OF_THUMB: Deviations = {
    let mut deviations = [0.0; MOMENTS];
    (deviations[0], deviations[1]) = (-0.010_05, -1.329_58);
    deviations
};

/// Variance of constant and trend in units of the process's own: practically unknown beforehand.
const TREND_VARIANCE: f64 = 100.0;
/// Shortest and longest length, in standard deviations of a feature.
const LENGTHS: [f64; 2] = [0.3, 30.0];
/// First length of every feature.
const FIRST_LENGTH: f64 = 3.0;
/// Factors by which lengths are changed, one sweep over the features after another.
const SWEEPS: [f64; 6] = [2.0, 1.6, 1.4, 1.25, 1.15, 1.1];
/// Maximum number of points from which lengths are chosen: the last ones.
const POINTS_FOR_LENGTHS_MAX: usize = 160;
/// Variance of the noise in units of the process's variance: the velocities jump by some 1e-9
/// where the solver's sampling changes, and more where a realization begins to fail.
const NOISE: f64 = 1e-10;
/// A point whose variance given those before it is smaller than this, in the same units, adds
/// nothing but rounding errors, and is left out.
const NEW_MIN: f64 = 1e-9;
/// Noise while lengths are chosen; lengths with which the points are more alike than this are not.
const NOISE_FOR_LENGTHS: f64 = 1e-8;

/// The interpolation of both deviations.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Surrogate {
    scale: Scale,
    inputs: Vec<Features>,
    outputs: Vec<Deviations>,
    processes: [Process; MOMENTS],
    /// Whether each deviation is interpolated: not those of observables that were not measured.
    interpolated: [bool; MOMENTS],
}

/// Centre and spread of each feature; the spread is infinite where a feature does not vary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    centre: Features,
    spread: Features,
}

/// The Gaussian process of one deviation.
#[derive(Debug, Clone, PartialEq)]
struct Process {
    lengths: Features,
    /// The points that are used, by their numbers.
    used: Vec<usize>,
    /// Value about which the trend is taken.
    level: f64,
    /// Variance of the process.
    variance: f64,
    factor: Cholesky,
    weights: Vec<f64>,
}

impl Scale {
    /// Returns the scale of a sample of features.
    pub(super) fn from_sample(sample: &[Features]) -> Self {
        let count = sample.len().max(1) as f64;
        let mut scale = Self { centre: [0.0; FEATURES], spread: [f64::INFINITY; FEATURES] };
        for k in 0..FEATURES {
            let mean = sample.iter().map(|one| one[k]).sum::<f64>() / count;
            let square: f64 = sample.iter().map(|one| (one[k] - mean) * (one[k] - mean)).sum();
            let spread = (square / count).sqrt();
            scale.centre[k] = mean;
            if spread > 1e-9 * (1.0 + mean.abs()) {
                scale.spread[k] = spread;
            }
        }
        scale
    }

    fn apply(&self, features: &Features) -> Features {
        std::array::from_fn(|k| (features[k] - self.centre[k]) / self.spread[k])
    }
}

impl Surrogate {
    /// Creates an interpolation without points, which predicts the rule of thumb.
    pub(super) fn new(scale: Scale, observables: ObservableSet) -> Self {
        let processes = RULE_OF_THUMB.map(Process::new);
        let mut interpolated = [true; MOMENTS];
        interpolated[2..].copy_from_slice(&observables.0);
        Self { scale, inputs: Vec::new(), outputs: Vec::new(), processes, interpolated }
    }

    /// Returns the number of points.
    pub(super) fn len(&self) -> usize {
        self.inputs.len()
    }

    /// Adds a point with the deviations found there.
    pub(super) fn add(&mut self, features: &Features, found: Deviations) {
        self.inputs.push(self.scale.apply(features));
        self.outputs.push(found);
    }

    /// Uses all points added; chooses the lengths anew if asked to.
    pub(super) fn fit(&mut self, choose_lengths: bool) {
        let interpolated = self.interpolated;
        let processes = self.processes.iter_mut().enumerate();
        for (k, process) in processes.filter(|(k, _)| interpolated[*k]) {
            let values: Vec<f64> = self.outputs.iter().map(|output| output[k]).collect();
            if choose_lengths {
                let from = values.len().saturating_sub(POINTS_FOR_LENGTHS_MAX);
                process.choose_lengths(&self.inputs[from..], &values[from..], &self.scale);
            }
            process.fit(&self.inputs, &values);
        }
    }

    /// Predicts the deviations at a point.
    pub(super) fn mean(&self, features: &Features) -> Deviations {
        let at = self.scale.apply(features);
        self.of_each(|process| process.mean(&self.inputs, &at))
    }

    /// Predicts the deviations of ln v and ln Δ alone.
    pub(super) fn mean_of_velocities(&self, features: &Features) -> [f64; 2] {
        let at = self.scale.apply(features);
        [0, 1].map(|k| self.processes[k].mean(&self.inputs, &at))
    }

    fn of_each(&self, value: impl Fn(&Process) -> f64) -> Deviations {
        std::array::from_fn(|k| if self.interpolated[k] { value(&self.processes[k]) } else { 0.0 })
    }

    /// Returns the variances of the prediction at a point, as the processes expect them.
    pub(super) fn variances(&self, features: &Features) -> Deviations {
        let at = self.scale.apply(features);
        self.of_each(|process| process.variance_at(&self.inputs, &at))
    }
}

impl Process {
    fn new(level: f64) -> Self {
        Self {
            lengths: [FIRST_LENGTH; FEATURES],
            used: Vec::new(),
            level,
            variance: 1e-4,
            factor: Cholesky::default(),
            weights: Vec::new(),
        }
    }

    /// Covariance of two points in units of the variance.
    fn kernel(&self, a: &Features, b: &Features) -> f64 {
        let (mut square, mut trend) = (0.0, 1.0);
        for k in 0..FEATURES {
            let step = (a[k] - b[k]) / self.lengths[k];
            square += step * step;
            trend += a[k] * b[k];
        }
        let distance = (5.0 * square).sqrt();
        (1.0 + distance + distance * distance / 3.0) * libm::exp(-distance) + TREND_VARIANCE * trend
    }

    /// Conditions the process on all points that are not practically known from others.
    fn fit(&mut self, inputs: &[Features], values: &[f64]) {
        self.factor = Cholesky::default();
        self.used.clear();
        for (k, input) in inputs.iter().enumerate() {
            let row = self.row(inputs, input, NOISE);
            if self.factor.push(&row, NEW_MIN) {
                self.used.push(k);
            }
        }
        let values: Vec<f64> = self.used.iter().map(|k| values[*k]).collect();
        if !values.is_empty() {
            self.condition(&values);
        }
    }

    /// Returns the covariances of a point with those used, and its variance.
    fn row(&self, inputs: &[Features], at: &Features, noise: f64) -> Vec<f64> {
        let mut row: Vec<f64> = self.used.iter().map(|k| self.kernel(&inputs[*k], at)).collect();
        row.push(self.kernel(at, at) + noise);
        row
    }

    /// Computes level, variance and weights from the values at the points used.
    fn condition(&mut self, values: &[f64]) {
        self.level = values.iter().sum::<f64>() / values.len() as f64;
        let rests: Vec<f64> = values.iter().map(|value| value - self.level).collect();
        let white = self.factor.solve_lower(&rests);
        self.variance = (dot(&white, &white) / values.len() as f64).max(1e-24);
        self.weights = self.factor.solve(&rests);
    }

    /// Chooses the lengths by coordinate search for the largest marginal likelihood.
    fn choose_lengths(&mut self, inputs: &[Features], values: &[f64], scale: &Scale) {
        let mut best = self.misfit(inputs, values);
        for factor in SWEEPS {
            for k in (0..FEATURES).filter(|&k| scale.spread[k].is_finite()) {
                let before = self.lengths[k];
                for length in [before * factor, before / factor] {
                    self.lengths[k] = length.clamp(LENGTHS[0], LENGTHS[1]);
                    let found = self.misfit(inputs, values);
                    if found < best {
                        best = found;
                        break;
                    }
                    self.lengths[k] = before;
                }
            }
        }
    }

    /// Returns minus the logarithm of the marginal likelihood, with the variance chosen best.
    fn misfit(&mut self, inputs: &[Features], values: &[f64]) -> f64 {
        self.factor = Cholesky::default();
        self.used.clear();
        for (k, input) in inputs.iter().enumerate() {
            let row = self.row(inputs, input, NOISE_FOR_LENGTHS);
            if !self.factor.push(&row, 0.0) {
                return f64::INFINITY;
            }
            self.used.push(k);
        }
        self.condition(values);
        0.5 * values.len() as f64 * libm::log(self.variance) + self.factor.half_log_determinant()
    }

    fn mean(&self, inputs: &[Features], at: &Features) -> f64 {
        let used = self.used.iter().zip(&self.weights);
        let products = used.map(|(k, weight)| weight * self.kernel(&inputs[*k], at));
        self.level + products.sum::<f64>()
    }

    fn variance_at(&self, inputs: &[Features], at: &Features) -> f64 {
        let row = self.row(inputs, at, 0.0);
        let Some((own, others)) = row.split_last() else { return 0.0 };
        let known = self.factor.solve_lower(others);
        self.variance * (own - dot(&known, &known)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use osteon_common::ensemble::Germs;
    use osteon_common::observables::{Observable, PerObservable};

    use super::*;

    fn sample(count: u64, seed: u64) -> Vec<Features> {
        (0..count).map(|i| std::array::from_fn(|k| Germs::draw(seed, i).values()[k])).collect()
    }

    const DECAY: usize = 2 + Observable::Decay as usize;

    fn with_decay() -> ObservableSet {
        PerObservable::new(|one| one == Observable::Decay)
    }

    /// A smooth function of two features.
    fn deviations(x: &Features) -> Deviations {
        let variation = -1.33 + 0.02 * x[1] * x[1] + 0.1 * x[0];
        let decay = 0.02 * libm::sin(x[0] + x[1]);
        let mut deviations = [0.0; MOMENTS];
        deviations[0] = 0.01 * libm::sin(2.0 * x[0]) * (1.0 + x[1]);
        (deviations[1], deviations[DECAY]) = (variation, decay);
        deviations
    }

    #[test]
    fn smooth_functions_are_interpolated() {
        let inputs = sample(80, 3);
        let mut surrogate = Surrogate::new(Scale::from_sample(&inputs), with_decay());
        inputs.iter().for_each(|x| surrogate.add(x, deviations(x)));
        surrogate.fit(true);
        for x in sample(50, 4) {
            for (found, expected) in surrogate.mean(&x).iter().zip(deviations(&x)) {
                assert!((found - expected).abs() < 2e-3, "{found} {expected}");
            }
        }
    }

    /// The errors at other points are, in the mean, as large as expected within a factor of three.
    #[test]
    fn expected_errors_are_those_found() {
        let inputs = sample(60, 3);
        let mut surrogate = Surrogate::new(Scale::from_sample(&inputs), with_decay());
        inputs.iter().for_each(|x| surrogate.add(x, deviations(x)));
        surrogate.fit(true);
        let mut sums = [[0.0; 2]; MOMENTS];
        for x in sample(200, 4) {
            let (found, expected) = (surrogate.mean(&x), deviations(&x));
            for (k, variance) in surrogate.variances(&x).into_iter().enumerate() {
                sums[k][0] += (found[k] - expected[k]) * (found[k] - expected[k]);
                sums[k][1] += variance;
            }
        }
        for [found, expected] in [sums[0], sums[1], sums[DECAY]] {
            let ratio = (found / expected).sqrt();
            assert!((0.33..3.0).contains(&ratio), "{ratio}");
        }
        let at_points = inputs.iter().map(|x| surrogate.variances(x)[0]);
        assert!(at_points.fold(0.0, f64::max) < 1e-4 * sums[0][1] / 200.0);
    }

    #[test]
    fn points_are_interpolated() {
        let inputs = sample(30, 5);
        let mut surrogate = Surrogate::new(Scale::from_sample(&inputs), with_decay());
        assert_eq!(surrogate.mean(&inputs[0]), RULE_OF_THUMB);
        inputs.iter().for_each(|x| surrogate.add(x, deviations(x)));
        surrogate.fit(true);
        for x in &inputs {
            for (found, expected) in surrogate.mean(x).iter().zip(deviations(x)) {
                assert!((found - expected).abs() < 1e-6, "{found} {expected}");
            }
        }
    }
}
