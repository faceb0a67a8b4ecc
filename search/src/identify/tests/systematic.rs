//! Identifications whose setup is not known exactly, on a model without a solver.

use osteon_common::conclusions::{BudgetQuantity, BudgetSource};
use osteon_common::ensemble::Germs;
use osteon_common::inference::Inference;
use osteon_common::job::{PosteriorSettings, Sampling};
use osteon_common::outcome::FailureKind;
use osteon_common::parameters::Parameter;
use osteon_common::posterior::Posterior;
use osteon_common::special::standard_normal_quantile;
use osteon_common::systematic::{SystematicLaw, SystematicQuantity};

use super::*;

/// The true point, with the thickness that the job takes for the true one.
const TRUTH: Point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
/// Standard deviations of the thickness (m), and of an offset of the velocities (m/s).
const THICKNESS: f64 = 0.4e-3;
const OFFSET: f64 = 10.0;
/// Relative change of the velocity by the thickness, 1/m.
const SLOPE: f64 = 10.0;

/// The speed of the bulk wave, which grows with the thickness.
fn speeds_of_plate(realizations: &Realizations) -> Vec<RealizationResult> {
    let own = Setup::default();
    let off = realizations.point.setup(&own).layers.bone_thickness - own.layers.bone_thickness;
    let mut solved = speeds(realizations);
    for one in &mut solved {
        one.outcome = one.outcome.map(|speed| speed * (1.0 + SLOPE * off));
    }
    solved
}

/// Velocities of `count` bones, measured on plates that are this much thicker (m) than the job says, by a
/// device with this offset (m/s).
fn draw_velocities(seed: u64, count: u64, (thicker, offset): (f64, f64)) -> Vec<f64> {
    let monte_carlo = MonteCarlo { realizations: count, seed, ..MonteCarlo::default() };
    let ensemble = Ensemble::drawn(&TRUTH, monte_carlo.germs()).unwrap();
    let mut point = TRUTH;
    point.0[Parameter::BoneThickness as usize] = Setup::default().layers.bone_thickness + thicker;
    let drawn = Realizations { point, ensemble, count, observables: Default::default() };
    speeds_of_plate(&drawn).into_iter().map(|one| one.outcome.unwrap() + offset).collect()
}

fn job(velocities: Vec<f64>, systematic: Systematic) -> JobSpecification {
    let data = Data::from_velocities(velocities);
    JobSpecification {
        systematic,
        monte_carlo: MonteCarlo {
            realizations: 64,
            sampling: Sampling::Sobol,
            control_variate: true,
            ..MonteCarlo::default()
        },
        objective: Objective::ChiSquare,
        ..specification(data, SearchMethod::Newton)
    }
}

fn normal(spread: f64) -> SystematicLaw {
    SystematicLaw { spread: Some(spread), ..SystematicLaw::default() }
}

fn offset() -> Systematic {
    let mut systematic = Systematic::default();
    systematic.laws[SystematicQuantity::VelocityOffset as usize] = normal(OFFSET);
    systematic
}

fn both() -> Systematic {
    let mut systematic = offset();
    systematic.laws[SystematicQuantity::BoneThickness as usize] = normal(THICKNESS);
    systematic
}

fn found(job: &JobSpecification) -> Inference {
    let complete =
        identify(job, |realizations| Ok::<_, Infallible>(speeds_of_plate(realizations))).unwrap();
    complete.result.conclusions.inference.unwrap()
}

/// Returns the standard error of √(c1111/ρ), relative to its value.
fn error(found: &Inference) -> f64 {
    found.bulk_velocity.known.unwrap().standard_error / found.bulk_velocity.value
}

#[test]
fn what_all_data_share_does_not_shrink_with_their_number() {
    for count in [100, 4000] {
        let velocities = draw_velocities(7, count, (0.0, 0.0));
        let exact = found(&job(velocities.clone(), Systematic::default()));
        let mean = velocities.iter().sum::<f64>() / velocities.len() as f64;
        let own = error(&exact);
        let expected = libm::hypot(own, libm::hypot(SLOPE * THICKNESS, OFFSET / mean));
        let uncertain = found(&job(velocities, both()));
        let whole = error(&uncertain);
        assert!((whole / expected - 1.0).abs() < 1e-3, "{count}: {whole} instead of {expected}");
        assert_eq!(exact.budget, []);
        let budget = &uncertain.budget[0];
        assert_eq!(budget.quantity, BudgetQuantity::BulkVelocity);
        let sum: f64 = budget.contributions.iter().map(|one| one.variance_share).sum();
        assert!((sum - 1.0).abs() < 1e-12, "{sum}");
        let share = |source: BudgetSource| {
            budget.contributions.iter().find(|one| one.source == source).unwrap().variance_share
        };
        // Without a quantity the variance is less by the share of that.
        let by_thickness = share(BudgetSource::Systematic(SystematicQuantity::BoneThickness));
        let without = found(&job(draw_velocities(7, count, (0.0, 0.0)), offset()));
        let removed = 1.0 - (error(&without) / whole) * (error(&without) / whole);
        assert!((by_thickness - removed).abs() < 1e-3, "{count}: {by_thickness} {removed}");
        assert!(share(BudgetSource::Data) < 1.0);
    }
}

/// Of 200 studies, each with a thickness and an offset of its own, the intervals hold the truth; those of a job
/// that takes the setup for exact hold it in far fewer.
#[test]
fn intervals_hold_truths_of_other_setups() {
    const STUDIES: u64 = 200;
    let truth = Setup::default().structure.bulk_velocity(&TRUTH).unwrap().logarithm;
    let truth = libm::exp(truth);
    let mut held = [0, 0];
    for study in 0..STUDIES {
        let [thicker, offset, ..] = Germs::draw(99, study).values().map(standard_normal_quantile);
        let setup = (THICKNESS * thicker, OFFSET * offset);
        let velocities = draw_velocities(1000 + study, 200, setup);
        for (held, systematic) in held.iter_mut().zip([both(), Systematic::default()]) {
            let found = found(&job(velocities.clone(), systematic));
            let [low, high] = found.bulk_velocity.known.unwrap().interval;
            *held += u64::from((low..=high).contains(&truth));
        }
    }
    let shares = held.map(|held| held as f64 / STUDIES as f64);
    assert!((0.92..=0.98).contains(&shares[0]) && shares[1] < 0.7, "{shares:?}");
}

/// Returns the job with the default posterior.
fn with_posterior(job: JobSpecification) -> JobSpecification {
    JobSpecification { posterior: Some(PosteriorSettings::default()), ..job }
}

fn posterior(job: &JobSpecification) -> Posterior {
    let complete =
        identify(job, |realizations| Ok::<_, Infallible>(speeds_of_plate(realizations))).unwrap();
    complete.result.conclusions.posterior.unwrap()
}

/// With few velocities and with so many that the setup's error is ten times theirs, the posterior is as wide as the
/// interval of the linear theory, and about the same value: with two free parameters they tell the same.
#[test]
fn a_posterior_is_as_wide_as_the_interval() {
    for count in [100, 4000] {
        let velocities = draw_velocities(7, count, (0.0, 0.0));
        let exact = posterior(&with_posterior(job(velocities.clone(), Systematic::default())));
        let job = with_posterior(job(velocities, both()));
        let (whole, expected) = (posterior(&job), found(&job));
        assert!(whole.converged && exact.converged, "{count}: {:?}", whole.reason);
        let ratio = |found: &Posterior| {
            let known = expected.bulk_velocity.known.unwrap();
            found.bulk_velocity.standard_deviation / known.standard_error
        };
        let off = (whole.bulk_velocity.mean - expected.bulk_velocity.value)
            / whole.bulk_velocity.standard_deviation;
        assert!(off.abs() < 0.1, "{count}: {off}");
        assert!((ratio(&whole) - 1.0).abs() < 0.05, "{count}: {}", ratio(&whole));
        assert!(ratio(&exact) < 0.6, "{count}: {}", ratio(&exact));
        assert_eq!(whole.predictive_p_value, None);
    }
}

#[test]
fn an_effect_that_is_not_measured_leaves_no_posterior() {
    let own = Setup::default();
    let job = with_posterior(job(draw_velocities(7, 100, (0.0, 0.0)), both()));
    let complete = identify(&job, |realizations| {
        let setup = realizations.point.setup(&own);
        let mut solved = speeds_of_plate(realizations);
        if setup.layers.bone_thickness != own.layers.bone_thickness {
            solved.fill(RealizationResult::failed(FailureKind::NoArrival));
        }
        Ok::<_, Infallible>(solved)
    });
    let result = complete.unwrap().result;
    assert!(result.conclusions.posterior.is_none());
    let reason = result.reason.unwrap();
    assert!(reason.contains("too many realizations fail with a setup that is shifted"), "{reason}");
}
