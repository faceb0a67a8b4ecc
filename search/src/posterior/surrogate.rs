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
use super::exponential::{LANES, Lanes, exp_of_negative};
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
    inputs: Vec<Scaled>,
    outputs: Vec<Deviations>,
    processes: [Process; MOMENTS],
    /// Whether each deviation is interpolated: not those of observables that were not measured.
    interpolated: [bool; MOMENTS],
}

/// Centre and spread of each feature that varies. The others would add nothing to any covariance, and most
/// jobs search few parameters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scale {
    varying: Vec<Varying>,
}

/// A feature that varies, by its number.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Varying {
    feature: usize,
    centre: f64,
    spread: f64,
}

/// Features that vary, by [`Scale::apply`]: as many as the scale has, then zeros.
type Scaled = [f64; FEATURES];

/// Points, [`LANES`] at a time: for each feature that varies its values at these.
#[derive(Debug, Clone, PartialEq, Default)]
struct Points {
    count: usize,
    blocks: Vec<[Lanes; FEATURES]>,
}

/// The Gaussian process of one deviation.
#[derive(Debug, Clone, PartialEq)]
struct Process {
    /// Length of each feature that varies.
    lengths: Vec<f64>,
    /// The points that are used, by their numbers, and themselves.
    used: Vec<usize>,
    points: Points,
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
        let varying = (0..FEATURES).filter_map(|k| {
            let mean = sample.iter().map(|one| one[k]).sum::<f64>() / count;
            let square: f64 = sample.iter().map(|one| (one[k] - mean) * (one[k] - mean)).sum();
            let spread = (square / count).sqrt();
            let varies = spread > 1e-9 * (1.0 + mean.abs());
            varies.then_some(Varying { feature: k, centre: mean, spread })
        });
        Self { varying: varying.collect() }
    }

    fn apply(&self, features: &Features) -> Scaled {
        let mut scaled = [0.0; FEATURES];
        for (slot, one) in scaled.iter_mut().zip(&self.varying) {
            *slot = (features[one.feature] - one.centre) / one.spread;
        }
        scaled
    }
}

impl Surrogate {
    /// Creates an interpolation without points, which predicts the rule of thumb.
    pub(super) fn new(scale: Scale, observables: ObservableSet) -> Self {
        let processes = RULE_OF_THUMB.map(|level| Process::new(level, scale.varying.len()));
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
                process.choose_lengths(&self.inputs[from..], &values[from..]);
            }
            process.fit(&self.inputs, &values);
        }
    }

    /// Predicts the deviations at a point.
    pub(super) fn mean(&self, features: &Features) -> Deviations {
        let at = self.scale.apply(features);
        self.of_each(|process| process.mean(&at))
    }

    /// Predicts the deviations at a point at which those of ln v and ln Δ are known already.
    pub(super) fn mean_beside(&self, known: [f64; 2], features: &Features) -> Deviations {
        let mut deviations = [0.0; MOMENTS];
        deviations[..2].copy_from_slice(&known);
        if self.interpolated[2..].contains(&true) {
            let at = self.scale.apply(features);
            for k in (2..MOMENTS).filter(|&k| self.interpolated[k]) {
                deviations[k] = self.processes[k].mean(&at);
            }
        }
        deviations
    }

    /// Predicts the deviations of ln v and ln Δ alone.
    pub(super) fn mean_of_velocities(&self, features: &Features) -> [f64; 2] {
        let at = self.scale.apply(features);
        [0, 1].map(|k| self.processes[k].mean(&at))
    }

    fn of_each(&self, value: impl Fn(&Process) -> f64) -> Deviations {
        std::array::from_fn(|k| if self.interpolated[k] { value(&self.processes[k]) } else { 0.0 })
    }

    /// Returns the variances of the prediction at a point, as the processes expect them.
    pub(super) fn variances(&self, features: &Features) -> Deviations {
        let at = self.scale.apply(features);
        self.of_each(|process| process.variance_at(&at))
    }
}

impl Points {
    fn push(&mut self, point: &Scaled) {
        let lane = self.count % LANES;
        if lane == 0 {
            self.blocks.push([[0.0; LANES]; FEATURES]);
        }
        if let Some(block) = self.blocks.last_mut() {
            block.iter_mut().zip(point).for_each(|(lanes, x)| lanes[lane] = *x);
        }
        self.count += 1;
    }
}

impl Process {
    /// Creates a process of so many features.
    fn new(level: f64, features: usize) -> Self {
        Self {
            lengths: vec![FIRST_LENGTH; features],
            used: Vec::new(),
            points: Points::default(),
            level,
            variance: 1e-4,
            factor: Cholesky::default(),
            weights: Vec::new(),
        }
    }

    /// Covariances of a point with those of a block, in units of the variance.
    fn kernel(&self, block: &[Lanes; FEATURES], at: &Scaled) -> Lanes {
        let (mut square, mut trend) = ([0.0; LANES], [1.0; LANES]);
        for ((a, b), length) in block.iter().zip(at).zip(&self.lengths) {
            for lane in 0..LANES {
                let step = (a[lane] - b) / length;
                square[lane] += step * step;
                trend[lane] += a[lane] * b;
            }
        }
        let distance = square.map(|square: f64| (5.0 * square).sqrt());
        let decay = exp_of_negative(distance.map(|distance| -distance));
        std::array::from_fn(|lane| {
            let distance = distance[lane];
            (1.0 + distance + distance * distance / 3.0) * decay[lane]
                + TREND_VARIANCE * trend[lane]
        })
    }

    /// Conditions the process on all points that are not practically known from others.
    fn fit(&mut self, inputs: &[Scaled], values: &[f64]) {
        self.clear();
        for (k, input) in inputs.iter().enumerate() {
            let row = self.row(input, NOISE);
            if self.factor.push(&row, NEW_MIN) {
                self.add(k, input);
            }
        }
        let values: Vec<f64> = self.used.iter().map(|k| values[*k]).collect();
        if !values.is_empty() {
            self.condition(&values);
        }
    }

    /// Forgets the points.
    fn clear(&mut self) {
        self.factor = Cholesky::default();
        self.used.clear();
        self.points = Points::default();
    }

    fn add(&mut self, number: usize, input: &Scaled) {
        self.used.push(number);
        self.points.push(input);
    }

    /// Returns the covariances of a point with those used, and its variance.
    fn row(&self, at: &Scaled, noise: f64) -> Vec<f64> {
        let kernels = self.points.blocks.iter().flat_map(|block| self.kernel(block, at));
        let mut row: Vec<f64> = kernels.take(self.points.count).collect();
        let trend = at[..self.lengths.len()].iter().fold(1.0, |trend, x| trend + x * x);
        row.push(1.0 + TREND_VARIANCE * trend + noise);
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
    fn choose_lengths(&mut self, inputs: &[Scaled], values: &[f64]) {
        let mut best = self.misfit(inputs, values);
        for factor in SWEEPS {
            for k in 0..self.lengths.len() {
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
    fn misfit(&mut self, inputs: &[Scaled], values: &[f64]) -> f64 {
        self.clear();
        for (k, input) in inputs.iter().enumerate() {
            let row = self.row(input, NOISE_FOR_LENGTHS);
            if !self.factor.push(&row, 0.0) {
                return f64::INFINITY;
            }
            self.add(k, input);
        }
        self.condition(values);
        0.5 * values.len() as f64 * libm::log(self.variance) + self.factor.half_log_determinant()
    }

    fn mean(&self, at: &Scaled) -> f64 {
        let mut sum = 0.0;
        for (block, weights) in self.points.blocks.iter().zip(self.weights.chunks(LANES)) {
            let kernel = self.kernel(block, at);
            // One after another: the order of a sum is part of its result.
            for (weight, kernel) in weights.iter().zip(kernel) {
                sum += weight * kernel;
            }
        }
        self.level + sum
    }

    fn variance_at(&self, at: &Scaled) -> f64 {
        let row = self.row(at, 0.0);
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
