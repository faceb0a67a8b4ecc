//! Identifications from velocities and other observables, on a model without a solver.

use osteon_common::conclusions::DerivedQuantity;
use osteon_common::inference::Inference;
use osteon_common::job::{Measurements, PosteriorSettings, Sampling};
use osteon_common::observables::{Observable, PerObservable};
use osteon_common::parameters::Parameter;

use super::*;

const TRUTH: Point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);

/// The speed of the bulk wave, and a decay that grows with the stiffness across the bone.
fn observed(realizations: &Realizations) -> Vec<RealizationResult> {
    let solved = |index| {
        let bone = realizations.ensemble.bone(index).unwrap();
        let rows = bone.elasticity.rows();
        let decay = 4.6 + 8.0 * (rows[2][2] / rows[0][0] - 0.6);
        let mut solved = RealizationResult::solved((rows[0][0] / bone.density).sqrt(), 1e-5);
        if realizations.observables[Observable::Decay] {
            solved.observables[Observable::Decay] = decay;
        }
        solved
    };
    (0..realizations.count).map(solved).collect()
}

/// Data of `count` bones at the truth.
fn measured(seed: u64, count: u64) -> (Vec<f64>, Vec<f64>) {
    let monte_carlo = MonteCarlo { realizations: count, seed, ..MonteCarlo::default() };
    let ensemble = Ensemble::drawn(&TRUTH, monte_carlo.germs()).unwrap();
    let observables = PerObservable::new(|one| one == Observable::Decay);
    let drawn = observed(&Realizations { point: TRUTH, ensemble, count, observables });
    drawn.into_iter().map(|one| (one.outcome.unwrap(), one.observables[Observable::Decay])).unzip()
}

/// The specification of a job with these parameters free, far from the truth, and the rest known.
fn job(free: &[Parameter], measurements: Measurements) -> JobSpecification {
    let starts = [
        (Parameter::LongitudinalYoungModulus, [20e9, 12e9, 25e9]),
        (Parameter::TransverseYoungModulus, [12e9, 8e9, 16e9]),
        (Parameter::Dispersion, [0.15, 0.02, 0.3]),
    ];
    let mut parameters = TRUTH.0.map(Range::Fixed);
    parameters[7..].fill(Range::AS_IN_SETUP);
    for (parameter, [start, lower, upper]) in starts {
        if free.contains(&parameter) {
            parameters[parameter as usize] = Range::Free { start, lower, upper };
        }
    }
    JobSpecification {
        parameters,
        monte_carlo: MonteCarlo {
            realizations: 64,
            sampling: Sampling::Sobol,
            control_variate: true,
            ..MonteCarlo::default()
        },
        objective: Objective::ChiSquare,
        search: SearchSettings {
            cost_tolerance: 1e-4,
            ..SearchSettings::by(SearchMethod::Simplex)
        },
        ..specification(
            Data { measurements, repeatability: 0.0, decay_error: 0.0 },
            SearchMethod::Simplex,
        )
    }
}

fn with_decays((velocities, decays): (Vec<f64>, Vec<f64>)) -> Measurements {
    let observables = PerObservable::new(|one| (one == Observable::Decay).then(|| decays.clone()));
    Measurements::Velocities { velocities, subjects: None, observables }
}

fn found(job: &JobSpecification) -> CompletedJob {
    identify(job, |realizations| Ok::<_, Infallible>(observed(realizations))).unwrap()
}

fn quantity(found: &Inference, parameter: Parameter) -> DerivedQuantity {
    found.parameters.iter().find(|(name, _)| *name == parameter).unwrap().1
}

const THREE: [Parameter; 3] =
    [Parameter::LongitudinalYoungModulus, Parameter::TransverseYoungModulus, Parameter::Dispersion];

/// Returns the job with another search.
fn by(job: JobSpecification, method: SearchMethod, objective: Objective) -> JobSpecification {
    let tolerance = if objective == Objective::Moments { 1e-10 } else { 1e-4 };
    let search = SearchSettings { cost_tolerance: tolerance, ..SearchSettings::by(method) };
    JobSpecification { objective, search, ..job }
}

/// The shares of 95 % intervals that contain the truth, and the scatter of the errors in standard errors,
/// by every search: of three moments that are solved for three parameters, and of a compromise of three
/// for two.
#[test]
fn intervals_contain_the_truth_as_often_as_they_say() {
    const REPETITIONS: u64 = 40;
    use {Objective::*, SearchMethod::*};
    let check = |count: u64, free: &[Parameter], (method, objective)| {
        let mut held = vec![0; free.len()];
        let mut squares = vec![0.0; free.len()];
        for seed in 1..=REPETITIONS {
            let job = by(job(free, with_decays(measured(seed, count))), method, objective);
            let inference = found(&job).result.conclusions.inference.unwrap();
            assert!(inference.matched && inference.undetermined.is_empty(), "{inference:?}");
            for (k, &parameter) in free.iter().enumerate() {
                let DerivedQuantity { value, known } = quantity(&inference, parameter);
                let known = known.unwrap();
                let [lower, upper] = known.interval;
                let truth = TRUTH.get(parameter);
                held[k] += u64::from((lower..=upper).contains(&truth));
                let deviation = (value - truth) / known.standard_error;
                squares[k] += deviation * deviation;
            }
        }
        // Of 40 intervals that hold with a probability of 95 %, fewer than 34 hold with one of 0.3 %.
        let spread = squares.iter().map(|square| (square / REPETITIONS as f64).sqrt());
        let spread: Vec<f64> = spread.collect();
        let what = format!("{count} by {method:?} and {objective:?}: {held:?}, {spread:?}");
        assert!(held.iter().all(|held| *held >= 34), "{what}");
        // The errors of a dispersion from few bones are skewed, which the intervals allow for.
        assert!(count < 30 || spread.iter().all(|one| (0.75..1.35).contains(one)), "{what}");
    };
    for search in [
        (Simplex, ChiSquare),
        (Simplex, Moments),
        (Simplex, Likelihood),
        (Newton, ChiSquare),
        (Newton, Moments),
    ] {
        check(60, &THREE, search);
        check(60, &[THREE[0], THREE[2]], search);
    }
    check(15, &THREE, (Simplex, ChiSquare));
}

/// The shares of 95 % intervals of the posterior that contain the truth, which is drawn from the prior.
#[test]
fn posteriors_contain_the_truth_as_often_as_they_say() {
    const REPETITIONS: u64 = 8;
    let mut held = [0; 3];
    for seed in 1..=REPETITIONS {
        let mut job = by(
            job(&THREE, with_decays(measured(seed, 60))),
            SearchMethod::Posterior,
            Objective::ChiSquare,
        );
        job.posterior = Some(PosteriorSettings::default());
        let result = found(&job).result;
        let found = result.conclusions.posterior.unwrap();
        assert!(found.converged, "{seed}: {:?}", found.reason);
        for (k, summary) in found.parameters.iter().enumerate() {
            let [lower, .., upper] = summary.quantiles;
            held[k] += u64::from((lower..=upper).contains(&TRUTH.get(found.free[k])));
        }
    }
    // Of 8 intervals that hold with a probability of 95 %, fewer than 5 hold with one of 0.04 %.
    assert!(held.iter().all(|held| *held >= 5), "{held:?}");
}

/// Without decays three parameters are not determined, and no interval is stated.
#[test]
fn decays_determine_a_third_parameter() {
    let data = measured(7, 200);
    let alone = Data::from_velocities(data.0.clone()).measurements;
    let [with, without] = [with_decays(data), alone].map(|data| found(&job(&THREE, data)).result);
    let error = |result: &JobResult| {
        let point = result.best.as_ref().unwrap().point;
        let modulus = Parameter::TransverseYoungModulus;
        (point.get(modulus) / TRUTH.get(modulus) - 1.0).abs()
    };
    assert!(error(&with) < 0.02 && error(&without) > 0.05, "{} {}", error(&with), error(&without));
    let determined = |result: &JobResult| {
        let found = result.conclusions.inference.as_ref().unwrap();
        (found.fixed.len(), found.parameters.iter().all(|(_, found)| found.known.is_some()))
    };
    assert_eq!((determined(&with), determined(&without)), ((3, true), (2, false)));
    let best = with.best.unwrap();
    let decay = |found: PerObservable<_>| found[Observable::Decay];
    let (model, data) = (decay(best.observables), decay(with.data.unwrap().observables));
    let (model, data) = (model.unwrap(), data.unwrap());
    assert!((model.mean - data.mean).abs() < 0.01 * data.standard_error);
    assert!(without.best.unwrap().observables.which().is_empty());
    assert!(without.data.unwrap().observables.which().is_empty());
    // Profiles come from a closed form that knows nothing of decays.
    assert!(with.conclusions.profiles.is_empty() && !without.conclusions.profiles.is_empty());
    let sensitivities = with.conclusions.inference.unwrap().sensitivities;
    assert!(sensitivities.iter().all(|one| one.observables[Observable::Decay].is_some()));
}

#[test]
fn a_decay_enters_path_and_digest() {
    let (velocities, mut decays) = measured(3, 40);
    let first = found(&job(&THREE, with_decays((velocities.clone(), decays.clone())))).result;
    let again = found(&job(&THREE, with_decays((velocities.clone(), decays.clone())))).result;
    assert_eq!(first, again);
    decays.iter_mut().for_each(|decay| *decay *= 1.02);
    let other = found(&job(&THREE, with_decays((velocities, decays)))).result;
    assert_ne!(first.digest, other.digest);
    let job = job(&THREE, with_decays(measured(3, 40)));
    let one_bit = |realizations: &Realizations| {
        let mut solved = observed(realizations);
        let decay = &mut solved[5].observables[Observable::Decay];
        *decay = decay.next_up();
        Ok::<_, Infallible>(solved)
    };
    assert_ne!(identify(&job, one_bit).unwrap().result.digest, first.digest);
    let none = |realizations: &Realizations| {
        let mut solved = observed(realizations);
        solved[5].observables[Observable::Decay] = 0.0;
        Ok::<_, Infallible>(solved)
    };
    let refused = identify(&job, none).unwrap_err();
    assert!(matches!(refused, IdentifyError::Unsound { number: 0, index: 5, .. }), "{refused}");
}

#[test]
fn decays_that_tell_nothing_are_refused() {
    let usable = job(&THREE, with_decays(measured(1, 10)));
    assert!(usable.check().is_empty());
    let check = |change: &dyn Fn(&mut JobSpecification), expected: &str| {
        let mut job = usable.clone();
        change(&mut job);
        let violations = job.check().to_string();
        assert!(violations.contains(expected), "{violations}");
    };
    let data = |change: &'static dyn Fn(&mut Vec<f64>, &mut Vec<f64>)| {
        move |job: &mut JobSpecification| {
            let (mut velocities, mut decays) = measured(1, 10);
            change(&mut velocities, &mut decays);
            job.data.as_mut().unwrap().measurements = with_decays((velocities, decays));
        }
    };
    check(&data(&|_, decays| decays.truncate(9)), "data.decays: has 9 decays");
    check(&data(&|_, decays| decays[3] = 462.0), "data.decays[3]: is 462.0");
    check(&data(&|_, decays| decays[3] = f64::NAN), "data.decays[3]");
    check(&data(&|_, decays| decays.iter_mut().for_each(|d| *d = -*d)), "it must be above 0");
    check(&data(&|_, decays| decays.fill(4.6)), "do not scatter by themselves");
    check(
        &data(&|velocities, decays| {
            decays.iter_mut().zip(velocities).for_each(|(d, v)| *d = *v * 1e-3);
        }),
        "follow from the velocities",
    );
    check(
        &data(&|velocities, decays| {
            velocities.pop();
            decays.pop();
        }),
        "there are 9 velocities; with decays at least 10 are needed",
    );
}
