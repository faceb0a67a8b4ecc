//! Velocities as users have them.

use osteon_common::job::{Data, Measurements};
use osteon_common::observables::ObservedColumns;
use osteon_common::parameters::Point;
use osteon_common::realization::PointError;

use super::calibration::{PosteriorCalibration, Scenario};
use crate::generator::Generator;
use crate::identify::velocities;

/// Realizations drawn for each velocity: some fail.
const DRAWN_EACH: f64 = 1.5;
/// Seeds of data, beyond those of models: their germs have to differ.
const DATA_SEEDS: u64 = 500_000_000;
/// Velocities of each subject.
const SERIES: usize = 4;
/// Range of the share of the variance that lies within subjects, uniform in its logarithm: from a
/// device that repeats to 5 % of the scatter between people, to subjects that hardly differ.
const WITHIN: (f64, f64) = (0.002, 0.8);
/// Step of rounded velocities, m/s.
const STEP: f64 = 10.0;
/// Probability of an outlier, which is half or twice the velocity.
const OUTLIERS: f64 = 0.01;
/// Degrees of freedom of the law with heavy tails, times 1/2.
const HALF_FREEDOM: usize = 3;

/// Returns the data of parameter set `number`; `None` if too many realizations fail.
pub(super) fn simulate_data(
    study: &PosteriorCalibration,
    truth: &Point,
    number: u64,
) -> Result<Option<Data>, PointError> {
    // One realization more for each subject's mean.
    let subjects = study.velocities.div_ceil(SERIES as u64);
    let count = match study.scenario {
        Scenario::Subjects => study.velocities + subjects,
        _ => study.velocities,
    };
    let seed = study.seed + DATA_SEEDS + number;
    let realizations = (DRAWN_EACH * count as f64).ceil() as u64;
    let mut velocities = velocities(truth, realizations, seed, study.isa)?;
    if (velocities.len() as u64) < count {
        return Ok(None);
    }
    velocities.truncate(count as usize);
    let mut generator = Generator::for_index(!study.seed, number);
    Ok(Some(change_data(study, velocities, subjects as usize, &mut generator)))
}

fn change_data(
    study: &PosteriorCalibration,
    velocities: Vec<f64>,
    subjects: usize,
    generator: &mut Generator,
) -> Data {
    let mean = velocities.iter().sum::<f64>() / velocities.len() as f64;
    let change_all = |change: &mut dyn FnMut(f64) -> f64| {
        Data::from_velocities(velocities.iter().map(|&velocity| change(velocity)).collect())
    };
    match study.scenario {
        Scenario::Independent => Data::from_velocities(velocities),
        Scenario::Subjects => in_series(&velocities, subjects.min(velocities.len()), generator),
        Scenario::Rounded => change_all(&mut |velocity| (velocity / STEP).round() * STEP),
        Scenario::Outliers => change_all(&mut |velocity| match generator.uniform() / OUTLIERS {
            below if below < 0.5 => 0.5 * velocity,
            below if below < 1.0 => 2.0 * velocity,
            _ => velocity,
        }),
        Scenario::HeavyTails => {
            change_all(&mut |velocity| mean + student_scale(generator) * (velocity - mean))
        }
    }
}

/// Returns series of velocities around the first realizations, with a random share of the variance
/// between the series.
fn in_series(velocities: &[f64], count: usize, generator: &mut Generator) -> Data {
    let (of_subjects, others) = velocities.split_at(count);
    let mean = velocities.iter().sum::<f64>() / velocities.len() as f64;
    let within = libm::exp(generator.between(libm::log(WITHIN.0), libm::log(WITHIN.1)));
    let (shared, own) = ((1.0 - within).sqrt(), within.sqrt());
    let one = |(k, velocity): (usize, &f64)| {
        let subject = k / SERIES;
        let of_subject = of_subjects.get(subject).unwrap_or(&mean);
        (mean + shared * (of_subject - mean) + own * (velocity - mean), subject as u32)
    };
    let (velocities, subjects) = others.iter().enumerate().map(one).unzip();
    let observables = ObservedColumns::default();
    let measurements =
        Measurements::Velocities { velocities, subjects: Some(subjects), observables };
    Data { measurements, repeatability: 0.0, decay_error: 0.0 }
}

/// Returns the random factor that makes a normal number one of Student's law, with the variance 1.
fn student_scale(generator: &mut Generator) -> f64 {
    let halves: f64 = (0..HALF_FREEDOM).map(|_| -libm::log(1.0 - generator.uniform())).sum();
    ((HALF_FREEDOM - 1) as f64 / halves).sqrt()
}

#[cfg(test)]
mod tests {
    use osteon_solver::Isa;

    use super::*;
    use crate::draws::OPTIMUM;

    fn data(scenario: Scenario) -> Data {
        let study = PosteriorCalibration {
            scenario,
            velocities: 400,
            first: 0,
            repetitions: 1,
            seed: 3,
            isa: Isa::fastest(),
        };
        simulate_data(&study, &OPTIMUM, 0).unwrap().unwrap()
    }

    #[test]
    fn every_scenario_keeps_mean_and_variation() {
        let plain = data(Scenario::Independent).moments(0);
        for scenario in [Scenario::Subjects, Scenario::Rounded, Scenario::HeavyTails] {
            let found = data(scenario).moments(0);
            let name = scenario.name();
            assert!((found.mean / plain.mean - 1.0).abs() < 0.005, "{name}: {found:?}");
            let ratio = found.coefficient_of_variation / plain.coefficient_of_variation;
            assert!((0.75..1.3).contains(&ratio), "{name}: {found:?}");
        }
        let outliers = data(Scenario::Outliers);
        let far = |v: &&f64| !(3000.0..5000.0).contains(*v);
        let far = outliers.velocities(0).unwrap().iter().filter(far).count();
        assert!((1..15).contains(&far), "{far}");
        let rounded = data(Scenario::Rounded);
        assert!(rounded.velocities(0).unwrap().iter().all(|v| v % STEP == 0.0));
        assert_eq!(data(Scenario::Subjects).subjects(0).unwrap().last(), Some(&99));
    }
}
