//! Realizations of the random elasticity: single ones against an independent computation in
//! arbitrary precision, many of them against the law.

use std::collections::BTreeMap;

use osteon_common::elasticity::Elasticity;
use osteon_common::ensemble::{ElasticityLaw, Germs};
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;

type Matrix = [[f64; 6]; 6];

const IDENTITY: Matrix = {
    let mut rows = [[0.0; 6]; 6];
    let mut i = 0;
    while i < 6 {
        rows[i][i] = 1.0;
        i += 1;
    }
    rows
};

fn point(dispersion: f64) -> Point {
    Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion])
}

#[test]
fn bones_agree_with_40_digits() {
    let mut expected: BTreeMap<(String, u64, u64), Matrix> = BTreeMap::new();
    let lines = include_str!("data/realizations.csv").lines();
    for line in lines.filter(|line| !line.starts_with('#')) {
        let fields: Vec<&str> = line.split(',').collect();
        let key = (fields[0].to_owned(), fields[1].parse().unwrap(), fields[2].parse().unwrap());
        let row = &mut expected.entry(key).or_default()[fields[3].parse::<usize>().unwrap()];
        for (entry, field) in row.iter_mut().zip(&fields[4..]) {
            *entry = field.parse().unwrap();
        }
    }
    assert_eq!(expected.len(), 5);
    for ((dispersion, seed, index), matrix) in expected {
        let ensemble = Ensemble::new(&point(dispersion.parse().unwrap()), seed).unwrap();
        let bone = ensemble.bone(index).unwrap();
        assert_eq!(bone.density, 1598.8);
        for i in 0..6 {
            for j in 0..6 {
                let (c, e) = (bone.elasticity.rows()[i][j], matrix[i][j]);
                let scale = (matrix[i][i] * matrix[j][j]).sqrt();
                assert!(
                    (c - e).abs() < 4e-15 * scale,
                    "δ {dispersion}, seed {seed}, index {index}, entry ({i},{j}): {c}, expected {e}"
                );
            }
        }
    }
}

/// Mean and standard error of the mean of one quantity, accumulated.
#[derive(Clone, Copy, Default)]
struct Sample {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Sample {
    fn add(&mut self, value: f64) {
        self.count += 1.0;
        self.sum += value;
        self.squares += value * value;
    }

    fn mean(&self) -> f64 {
        self.sum / self.count
    }

    fn error(&self) -> f64 {
        let mean = self.mean();
        ((self.squares / self.count - mean * mean) / self.count).sqrt()
    }

    fn check(&self, expected: f64, what: &str) {
        let deviation = (self.mean() - expected) / self.error();
        assert!(
            deviation.abs() < 4.5,
            "{what}: {} ± {}, expected {expected}",
            self.mean(),
            self.error()
        );
    }
}

/// E[G] = I, E‖G - I‖²/6 = δ², and each entry's variance: δ²/7 off the diagonal, 2δ²/7 on it.
#[test]
fn the_normalized_matrix_has_the_moments_of_its_law() {
    const DRAWS: u64 = 6000;
    let seed = 20;
    let unit = Elasticity::new(IDENTITY).unwrap();
    for dispersion in [1e-4, 0.05, 0.1029, 0.3, 0.33, 0.6, 0.79] {
        let law = ElasticityLaw::new(&unit, dispersion).unwrap();
        let mut distance = Sample::default();
        let mut means = [[Sample::default(); 6]; 6];
        let mut variances = [[Sample::default(); 6]; 6];
        for index in 0..DRAWS {
            let g = law.realize(&Germs::draw(seed, index)).unwrap();
            let mut square = 0.0;
            for i in 0..6 {
                for j in 0..6 {
                    let deviation = (g.rows()[i][j] - IDENTITY[i][j]) / dispersion;
                    means[i][j].add(deviation);
                    variances[i][j].add(deviation * deviation);
                    square += deviation * deviation;
                }
            }
            distance.add(square / 6.0);
        }
        let name = |what: &str| format!("seed {seed}, δ {dispersion}, {what}");
        distance.check(1.0, &name("‖G - I‖²/6δ²"));
        for i in 0..6 {
            for j in 0..=i {
                let variance = if i == j { 2.0 / 7.0 } else { 1.0 / 7.0 };
                means[i][j].check(0.0, &name(&format!("E[G - I]({i},{j})/δ")));
                variances[i][j].check(variance, &name(&format!("Var G({i},{j})/δ²")));
            }
        }
    }
}

#[test]
fn the_mean_of_the_elasticity_is_the_mean_model() {
    let seed = 3;
    for dispersion in [0.1029, 0.3, 0.7] {
        let point = point(dispersion);
        let mean = point.constants().elasticity().unwrap();
        let ensemble = Ensemble::new(&point, seed).unwrap();
        let mut samples = [[Sample::default(); 6]; 6];
        for index in 0..4000 {
            let c = ensemble.bone(index).unwrap().elasticity;
            for (i, row) in samples.iter_mut().enumerate() {
                for (j, sample) in row.iter_mut().enumerate() {
                    sample.add(c.rows()[i][j]);
                    assert_eq!(c.rows()[i][j].to_bits(), c.rows()[j][i].to_bits());
                }
            }
        }
        for (i, row) in samples.iter().enumerate() {
            for (j, sample) in row.iter().enumerate().take(i + 1) {
                sample
                    .check(mean.rows()[i][j], &format!("seed {seed}, δ {dispersion}, C({i},{j})"));
            }
        }
    }
}

/// c_1111 is its mean times (L_G)11², a gamma variable of shape α₁ = 7/(2δ²) over its shape: its
/// coefficient of variation is 1/√α₁ and its skewness 2/√α₁.
#[test]
fn the_longitudinal_stiffness_is_gamma_distributed() {
    let seed = 8;
    for dispersion in [0.1029, 0.3, 0.7] {
        let point = point(dispersion);
        let mean = point.constants().elasticity().unwrap().component(0, 0, 0, 0);
        let ensemble = Ensemble::new(&point, seed).unwrap();
        let root = dispersion * (2.0_f64 / 7.0).sqrt();
        let mut moments = [Sample::default(); 3];
        for index in 0..20_000 {
            let c = ensemble.bone(index).unwrap().elasticity.component(0, 0, 0, 0);
            let deviation = (c / mean - 1.0) / root;
            moments[0].add(deviation);
            moments[1].add(deviation * deviation);
            moments[2].add(deviation * deviation * deviation);
        }
        for (sample, expected) in moments.iter().zip([0.0, 1.0, 2.0 * root]) {
            sample.check(expected, &format!("seed {seed}, δ {dispersion}, c_1111"));
        }
    }
}

/// The entries along one line of the dispersion, across each shape at which a branch of the gamma
/// quantile changes: no second difference exceeds what curvature and rounding explain.
#[test]
fn a_realization_is_a_continuous_function_of_the_dispersion() {
    let seed = 4;
    let step = 1e-8;
    let at = |dispersion: f64, germs: &Germs| {
        let mean = point(dispersion).constants().elasticity().unwrap();
        ElasticityLaw::new(&mean, dispersion).unwrap().realize(germs).unwrap()
    };
    // Shapes 64 and 16 for the six diagonal entries, and places without a branch.
    let branches = (0..6).flat_map(|j| [64.0, 16.0].map(|a| (3.5 / (a + 0.5 * j as f64)).sqrt()));
    for dispersion in branches.chain([0.02, 0.1029, 0.3, 0.79]) {
        for index in 0..20 {
            let germs = Germs::draw(seed, index);
            let [low, middle, high] =
                [-step, 0.0, step].map(|offset| at(dispersion + offset, &germs));
            for i in 0..6 {
                for j in 0..6 {
                    let [a, b, c] = [low, middle, high].map(|matrix| matrix.rows()[i][j]);
                    let scale = (middle.rows()[i][i] * middle.rows()[j][j]).sqrt();
                    let second = (a - 2.0 * b + c).abs() / scale;
                    assert!(second < 4e-14, "δ {dispersion}, index {index}, ({i},{j}): {second:e}");
                }
            }
        }
    }
}

#[test]
fn realizations_stay_positive_definite_up_to_the_largest_dispersion() {
    let seed = 5;
    let unit = Elasticity::new(IDENTITY).unwrap();
    let law = ElasticityLaw::new(&unit, 0.7977).unwrap();
    for index in 0..50_000 {
        let drawn = law.realize(&Germs::draw(seed, index));
        assert!(drawn.is_ok(), "seed {seed}, index {index}: {drawn:?}");
    }
}
