//! Identifications of groups that are pooled, on a model without a solver.

use osteon_common::conclusions::{BudgetQuantity, ErrorScale, QuantityErrors};
use osteon_common::job::Sampling;
use osteon_common::parameters::Parameter;
use osteon_common::systematic::{SystematicLaw, SystematicQuantity};

use super::*;

/// Velocities of each group.
const VELOCITIES: u64 = 40;
/// Standard deviation of an offset of all velocities (m/s).
const OFFSET: f64 = 10.0;

/// Three groups of velocities of the same bone, and one with too few for an interval.
fn job(pooled: bool) -> JobSpecification {
    let truth = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
    let group = |number: u64, count| {
        let drawn = MonteCarlo { realizations: count, seed: 7 + number, ..MonteCarlo::default() };
        let ensemble = Ensemble::drawn(&truth, drawn.germs()).unwrap();
        let drawn = Realizations { point: truth, ensemble, count, observables: Default::default() };
        Group {
            name: format!("P{number}"),
            velocities: speeds(&drawn).into_iter().map(|one| one.outcome.unwrap()).collect(),
            subjects: None,
            observables: Default::default(),
            known: Default::default(),
        }
    };
    let mut groups: Vec<Group> = (0..3).map(|number| group(number, VELOCITIES)).collect();
    groups.push(group(3, 3));
    let mut systematic = Systematic::default();
    systematic.laws[SystematicQuantity::VelocityOffset as usize] =
        SystematicLaw { spread: Some(OFFSET), ..SystematicLaw::default() };
    JobSpecification {
        systematic,
        groups: GroupSettings { pooled },
        monte_carlo: MonteCarlo {
            realizations: 64,
            sampling: Sampling::Sobol,
            ..MonteCarlo::default()
        },
        objective: Objective::ChiSquare,
        ..specification(Data::from_groups(groups), SearchMethod::Newton)
    }
}

#[test]
fn pooling_changes_nothing_that_was_found_of_each_group() {
    let [alone, pooled] = [false, true].map(|pooled| identified(&job(pooled)));
    assert_eq!(alone.result.digest, pooled.result.digest);
    assert_eq!(alone.history, pooled.history);
    assert!(pooled.result.pooled && !alone.result.pooled);
    for (one, mut other) in alone.result.groups.into_iter().zip(pooled.result.groups) {
        let found = other.conclusions.inference.as_mut();
        found.into_iter().for_each(|found| found.errors.clear());
        assert_eq!(one, other);
    }
}

#[test]
fn errors_tell_a_groups_own_from_those_of_all() {
    let found = identified(&job(true)).result.groups;
    let inferences = found.iter().map(|group| group.conclusions.inference.as_ref().unwrap());
    let counts: Vec<usize> = inferences.clone().map(|found| found.errors.len()).collect();
    // √(c1111/ρ), e_L and the dispersion.
    assert_eq!(counts, [3, 3, 3, 0]);
    for found in inferences.take(3) {
        let errors = &found.errors[0];
        assert_eq!(errors.quantity, BudgetQuantity::BulkVelocity);
        assert_eq!((errors.scale, errors.freedom), (ErrorScale::Logarithm, VELOCITIES - 1));
        let relative =
            found.bulk_velocity.known.unwrap().standard_error / found.bulk_velocity.value;
        let all = square_sum(errors).sqrt();
        // The variance of the mean is unbiased in the one, and that of the set in the other.
        assert!((all / relative - 1.0).abs() < 0.03, "{all} {relative}");
        let (source, moved) = errors.systematic[0];
        assert_eq!(source, SystematicQuantity::VelocityOffset);
        assert!((moved * found.bulk_velocity.value / OFFSET - 1.0).abs() < 0.1, "{moved}");
        let parameters: Vec<_> = found.errors[1..].iter().map(|errors| errors.quantity).collect();
        let free = [Parameter::LongitudinalYoungModulus, Parameter::Dispersion];
        assert_eq!(parameters, free.map(BudgetQuantity::Parameter));
        // The dispersion of few velocities is too small on average.
        let dispersion = &found.errors[2];
        assert!(dispersion.estimate > libm::log(found.dispersion.value), "{dispersion:?}");
    }
}

fn square_sum(errors: &QuantityErrors) -> f64 {
    let shared =
        errors.systematic.iter().map(|(_, moved)| *moved).chain(errors.sampling.iter().copied());
    errors.data.mul_add(errors.data, shared.map(|moved| moved * moved).sum::<f64>())
}
