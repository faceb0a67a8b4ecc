//! Compares a job in one call with its search, driven step by step.

use std::convert::Infallible;

use osteon_common::case::Setup;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{
    Data, Group, JobKind, MonteCarlo, Objective, Range, Search as SearchSettings, SearchMethod,
};
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::results::{EstimatedError, Status};
use osteon_common::systematic::Systematic;

mod observables;
mod pooling;
mod systematic;

use super::*;

/// Only e_L and the dispersion are free.
fn specification(data: Data, method: SearchMethod) -> JobSpecification {
    let mut parameters =
        Range::of_bone([1598.8, 0.0, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.0].map(Range::Fixed));
    parameters[1] = Range::Free { start: 15e9, lower: 12e9, upper: 25e9 };
    parameters[6] = Range::Free { start: 0.12, lower: 0.02, upper: 0.3 };
    JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(data),
        parameters,
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo { realizations: 50, ..MonteCarlo::default() },
        objective: Objective::default(),
        search: SearchSettings { max_evaluations: 60, ..SearchSettings::by(method) },
        posterior: None,
    }
}

const MOMENTS: Data = Data::from_moments(3900.0, 0.03);

/// Uses the speed of the bulk wave instead of the solver's velocity.
fn speeds(realizations: &Realizations) -> Vec<RealizationResult> {
    let speed = |index| {
        let bone = realizations.ensemble.bone(index).unwrap();
        (bone.elasticity.rows()[0][0] / bone.density).sqrt()
    };
    (0..realizations.count).map(|index| RealizationResult::solved(speed(index), 1e-5)).collect()
}

fn identified(specification: &JobSpecification) -> CompletedJob {
    identify(specification, |realizations| Ok::<_, Infallible>(speeds(realizations))).unwrap()
}

#[test]
fn the_result_is_that_of_the_search() {
    for method in [SearchMethod::Simplex, SearchMethod::Newton] {
        let specification = specification(MOMENTS, method);
        let errors = Some(EstimatedError { median: 1e-5, largest: 1e-5 });
        let mut search = Search::new(Arc::new(specification.clone()));
        let ending = loop {
            match search.ask() {
                Step::Evaluate(point) => {
                    let MonteCarlo { realizations: count, .. } = specification.monte_carlo;
                    let germs = specification.monte_carlo.germs();
                    let ensemble = Ensemble::drawn(&point, germs).unwrap();
                    let observables = ObservableSet::NONE;
                    let solved = speeds(&Realizations { point, ensemble, count, observables });
                    search.tell(solved.iter().map(|one| one.outcome).collect(), errors);
                }
                Step::Done(ending) => break ending,
            }
        };
        let found = identified(&specification);
        assert_eq!(found.result, search.result(&ending, &Program::current(None)));
        assert_eq!(found.history, search.history());
        assert_eq!(found.result.best.unwrap().estimated_error, errors);
    }
}

#[test]
fn groups_are_found_as_each_of_them_alone() {
    let velocities =
        [3800.0, 3900.0, 4000.0].map(|mean| vec![0.97 * mean, 1.01 * mean, 1.02 * mean]);
    let name = |k: usize| format!("group {k}");
    let groups = velocities.iter().enumerate();
    let groups = groups.map(|(k, velocities)| Group::new(name(k), velocities.clone()));
    let together =
        identified(&specification(Data::from_groups(groups.collect()), SearchMethod::Newton))
            .result;
    assert_eq!((together.status, together.groups.len()), (Status::Converged, 3));
    assert_eq!(together.best, None);
    for (k, (group, velocities)) in together.groups.iter().zip(velocities).enumerate() {
        let alone =
            identified(&specification(Data::from_velocities(velocities), SearchMethod::Newton));
        let (best, alone) = (group.best.as_ref().unwrap(), alone.result.best.unwrap());
        assert_eq!(group.name, name(k));
        assert_eq!(
            (best.point, best.cost, &best.outcomes),
            (alone.point, alone.cost, &alone.outcomes)
        );
    }
}

#[test]
fn a_propagation_is_one_evaluation() {
    let specification = JobSpecification {
        kind: JobKind::Propagation,
        data: None,
        ..specification(MOMENTS, SearchMethod::Simplex)
    };
    let CompletedJob { result, history } = identified(&specification);
    assert_eq!((result.status, history.len()), (Status::Converged, 1));
    assert_eq!(result.best.unwrap().point, specification.start());
}

/// Returns the error after `change` to the realizations of evaluation 2.
fn refused(
    change: impl Fn(Vec<RealizationResult>) -> Result<Vec<RealizationResult>, &'static str>,
) -> String {
    let mut number = 0;
    let evaluate = |realizations: &Realizations| {
        number += 1;
        if number == 3 { change(speeds(realizations)) } else { Ok(speeds(realizations)) }
    };
    identify(&specification(MOMENTS, SearchMethod::Simplex), evaluate).unwrap_err().to_string()
}

#[test]
fn what_no_worker_answers_is_refused() {
    let few = refused(|solved| Ok(solved[1..].to_vec()));
    assert_eq!(few, "evaluation 2 has 49 outcomes; it must have 50, one of each realization");
    for wrong in [
        RealizationResult::solved(f64::NAN, 0.0),
        RealizationResult::solved(-1.0, 0.0),
        RealizationResult::solved(3900.0, -1e-5),
        RealizationResult {
            estimated_error: 1e-5,
            ..RealizationResult::failed(FailureKind::NoArrival)
        },
    ] {
        let text = refused(|mut solved| {
            solved[7] = wrong;
            Ok(solved)
        });
        assert!(text.starts_with("realization 7 of evaluation 2 is RealizationResult"), "{text}");
    }
    let failed = refused(|_| Err("no machine is left"));
    assert!(failed.starts_with("the realizations of evaluation 2 at [1598.8, "), "{failed}");
    assert!(failed.ends_with("were not computed: no machine is left"), "{failed}");
}

#[test]
fn a_specification_that_breaks_rules_is_refused() {
    let mut specification = specification(MOMENTS, SearchMethod::Simplex);
    specification.monte_carlo.realizations = 0;
    let refused = identify(&specification, |_| -> Result<_, Infallible> { panic!("was asked") });
    let text = refused.unwrap_err().to_string();
    assert!(text.contains("monte_carlo.realizations: is 0"), "{text}");
}
