//! Groups of data, several starts, and the derivatives at the end.

use osteon_common::job::{Measurements, PosteriorSettings};
use osteon_common::known_quantities::KnownQuantities;

use super::*;

#[test]
fn derivatives_are_measured_beside_the_best_point() {
    let (search, _) = run(&specification(400));
    let best = search.best().unwrap();
    let (searched, beside) = search.history().split_at(search.history().len() - 2);
    assert!(searched.iter().all(|row| row.role.varied.is_none()));
    for (row, parameter) in
        beside.iter().zip([Parameter::LongitudinalYoungModulus, Parameter::Dispersion])
    {
        assert_eq!(row.role.varied, Some(parameter));
        let place = parameter as usize;
        let edge = [13e9, 0.28][usize::from(parameter == Parameter::Dispersion)];
        let step = (row.point.0[place] - best.point.0[place]) / edge;
        assert!((step - 1e-4).abs() < 1e-9, "{parameter:?}: {step}");
        let others = (0..7).filter(|other| *other != place);
        assert!(others.into_iter().all(|k| row.point.0[k] == best.point.0[k]));
    }
    // At an upper bound the step goes downwards.
    let mut bounded = specification(400);
    bounded.parameters[1] = Range::Free { start: 15e9, lower: 12e9, upper: 16e9 };
    let (search, _) = run(&bounded);
    let (best, row) = (search.best().unwrap(), &search.history()[search.history().len() - 2]);
    assert!((best.point.0[1] / 16e9 - 1.0).abs() < 1e-6);
    assert!(row.point.0[1] < best.point.0[1]);
}

#[test]
fn derivatives_need_the_same_realizations() {
    let mut specification = specification(400);
    specification.monte_carlo.max_failed_fraction = 0.5;
    let mut search = Search::new(Arc::new(specification));
    let mut told = 0;
    while let Step::Evaluate(point) = search.ask() {
        let mut outcomes: Vec<_> = outcomes(&point).to_vec();
        // One fails everywhere, another one only in the last evaluation.
        outcomes[0] = Err(FailureKind::NoArrival);
        let rows = search.history();
        if rows.last().is_some_and(|row| row.role.varied.is_some()) {
            outcomes[1] = Err(FailureKind::NoArrival);
        }
        search.tell(outcomes.into(), ERRORS);
        told += 1;
    }
    let [.., first, last] = search.history() else { panic!("{told} evaluations") };
    assert!(first.role.varied.is_some() && first.moments.is_some());
    assert!(last.role.varied.is_some() && last.moments.is_none());
}

#[test]
fn without_derivatives_the_search_ends_with_the_method() {
    let mut specification = specification(400);
    specification.search.sensitivities = false;
    let (search, _) = run(&specification);
    assert_eq!(
        search.result(&ending(&search), &Program::current(None)).evaluations,
        search.history().len() as u64
    );
}

/// Three parameters are free and two moments are given: among the points that approximately match
/// them, the result is the one that the priors select, whatever the start.
#[test]
fn priors_choose_among_the_points_that_match() {
    let mut specification = specification(1000);
    for (parameter, start, lower, upper) in [(0, 1700.0, 1500.0, 2000.0), (1, 20e9, 12e9, 25e9)] {
        specification.parameters[parameter] = Range::Free { start, lower, upper };
    }
    let of_density = |point: &Point| point.density() / 1598.8;
    let told = |point: &Point| -> Outcomes {
        let outcomes = outcomes(point);
        outcomes.iter().map(|outcome| outcome.map(|v| v / of_density(point))).collect()
    };
    let found = |specification: &JobSpecification| {
        let mut search = Search::new(Arc::new(specification.clone()));
        while let Step::Evaluate(point) = search.ask() {
            search.tell(told(&point), ERRORS);
        }
        assert_eq!(ending(&search).status, Status::Converged);
        *search.best().unwrap()
    };
    for value in [1550.0, 1650.0, 1750.0] {
        specification.search.priors[0] = Some(Prior { value, weight: 1e-3 });
        for start in [1520.0, 1900.0] {
            specification.parameters[0] = Range::Free { start, lower: 1500.0, upper: 2000.0 };
            let best = found(&specification);
            assert!((best.point.density() - value).abs() < 2.0, "{best:?}, prior {value}");
            let moments = best.moments.unwrap();
            assert!((moments.mean / 3900.0 - 1.0).abs() < 1e-3, "{best:?}");
        }
    }
    // If a prior contradicts the data, the cost includes both.
    specification.search.priors[6] = Some(Prior { value: 0.2, weight: 0.5 });
    let best = found(&specification);
    let penalty = specification.penalty(&best.point);
    let Moments { mean, coefficient_of_variation } = best.moments.unwrap();
    let data = Moments { mean: 3900.0, coefficient_of_variation: 0.03 };
    let misfit = statistics::cost(data, Moments { mean, coefficient_of_variation });
    assert!((best.cost.unwrap() - misfit - penalty).abs() < 1e-15);
    assert!(penalty > 1e-3 && misfit > 1e-3, "{misfit} {penalty}");
    assert!((0.125..0.195).contains(&best.point.dispersion()), "{best:?}");
}

/// Groups with these mean velocities; all have the dispersion of the start.
fn grouped(means: &[f64]) -> JobSpecification {
    let group =
        |(k, mean): (usize, &f64)| Group::new(format!("group {k}"), vec![0.97 * mean, 1.03 * mean]);
    let groups = means.iter().enumerate().map(group).collect();
    JobSpecification { data: Some(Data::from_groups(groups)), ..by_newton(60) }
}

/// Every point of a group has the values that are known of it: of the searches from all starts, of the
/// derivatives and of the posterior. The path is that of a job without them.
#[test]
fn what_is_known_of_a_group_is_in_all_its_points() {
    let means = [3800.0, 3900.0];
    let mut unknown = grouped(&means);
    unknown.search.starts = 2;
    let posterior = PosteriorSettings { max_evaluations: 50, ..PosteriorSettings::default() };
    unknown.posterior = Some(posterior);
    let values = |set: usize| {
        let thickness = Some(3e-3 + 1e-3 * set as f64);
        [None, None, None, thickness, None, Some(1480.0)]
    };
    let mut known = unknown.clone();
    if let Some(Measurements::Groups(groups)) =
        known.data.as_mut().map(|data| &mut data.measurements)
    {
        for (set, group) in groups.iter_mut().enumerate() {
            group.known = KnownQuantities::new(values(set));
        }
    }
    assert!(known.check().is_empty(), "{:?}", known.check());
    let given: Vec<Parameter> = known.parameters_given().skip(7).collect();
    assert_eq!(given, [Parameter::BoneThickness, Parameter::CouplingSoundSpeed]);
    let (with, _) = run(&known);
    let (without, _) = run(&unknown);
    assert_eq!(with.history().len(), without.history().len());
    assert!(with.history().iter().any(|row| row.role.posterior));
    assert!(with.history().iter().any(|row| row.role.start == 1));
    for (row, other) in with.history().iter().zip(without.history()) {
        let values = values(row.role.group as usize);
        assert_eq!(row.point.0[7..], values.map(|value| value.unwrap_or(0.0)));
        assert_eq!(row.point.0[..7], other.point.0[..7]);
    }
}

#[test]
fn each_group_is_identified_by_itself() {
    let means = [3800.0, 3900.0, 4000.0];
    let (search, told) = run(&grouped(&means));
    assert_eq!(ending(&search), Ending::from_search(Status::Converged, None));
    let summary = search.summary();
    assert_eq!((summary.best, summary.groups.len()), (None, 3));
    for (k, (group, mean)) in summary.groups.iter().zip(means).enumerate() {
        let row = &summary.history[usize::try_from(group.best.unwrap()).unwrap()];
        assert_eq!(
            row.role,
            EvaluationRole { group: u32::try_from(k).unwrap(), ..EvaluationRole::default() }
        );
        assert!((row.point.0[1] / (17.7e9 * mean / 3900.0) - 1.0).abs() < 1e-5, "{row:?}");
    }
    // All begin at the start of the job.
    let firsts = (0..3).map(|k| summary.history.iter().find(|row| row.role.group == k).unwrap());
    assert!(firsts.into_iter().all(|row| row.point == told[0].0));
    assert_eq!(search.result(&ending(&search), &Program::current(None)).best, None);
}

#[test]
fn a_group_that_fails_leaves_the_others_what_they_have() {
    // A velocity twice as fast as at any point of the box.
    let (search, _) = run(&grouped(&[3800.0, 9000.0, 4000.0]));
    let summary = search.summary();
    assert_eq!(ending(&search).status, Status::NotMatched);
    let reasons = summary.groups.iter().map(|group| group.reason.is_some());
    assert!(reasons.eq([false, true, false]), "{:?}", summary.groups);

    let mut few = grouped(&[3800.0, 3850.0]);
    few.search.max_evaluations = 2;
    let (search, _) = run(&few);
    let Ending { status, reason, .. } = ending(&search);
    assert_eq!(status, Status::MaxEvaluations);
    let reason = reason.unwrap();
    assert!(reason.starts_with("the searches for 2 of 2 groups did not converge"), "{reason}");
}

#[test]
fn several_starts_give_several_answers() {
    let mut specification = by_newton(60);
    specification.parameters[0] = Range::Free { start: 1600.0, lower: 1500.0, upper: 2000.0 };
    specification.search.starts = 4;
    let (search, _) = run(&specification);
    let starts = (0..4).map(|start| {
        let rows = search.history().iter();
        let mut rows = rows.filter(|row| row.role.start == start && row.role.varied.is_none());
        let first = *rows.next().unwrap();
        (first, rows.next_back().map_or(first, |last| *last))
    });
    let starts: Vec<(Evaluation, Evaluation)> = starts.collect();
    for (k, (first, last)) in starts.iter().enumerate() {
        assert!(last.cost.unwrap() <= 1e-12, "{last:?}");
        let another = starts.iter().skip(k + 1).all(|(other, _)| other.point != first.point);
        assert!(another, "start {k} twice");
    }
    // The first one matches the data, so it is the result.
    assert_eq!(search.best().unwrap().number, starts[0].1.number);
    let again = run(&specification).0;
    assert_eq!(search.summary(), again.summary());
}

/// Once the first start is the answer, the others are only more sets of parameters that fit: they end
/// where both moments are within a tenth of a standard error of the data.
#[test]
fn further_starts_end_within_a_tenth_of_a_standard_error() {
    for objective in [Objective::Moments, Objective::ChiSquare] {
        let last_costs = |count: Option<u64>| -> (Vec<f64>, u64) {
            let mut specification = by_newton(60);
            let measurements =
                Measurements::Moments { mean: 3900.0, coefficient_of_variation: 0.03, count };
            specification.data = Some(Data { measurements, repeatability: 0.0, decay_error: 0.0 });
            specification.objective = objective;
            specification.parameters[0] =
                Range::Free { start: 1600.0, lower: 1500.0, upper: 2000.0 };
            specification.search.starts = 6;
            let (search, _) = run(&specification);
            let last = |start| {
                let mut rows = search.history().iter().rev();
                rows.find(|row| row.role.start == start && row.role.varied.is_none()).unwrap()
            };
            ((0..6).map(|start| last(start).cost.unwrap()).collect(), search.evaluations())
        };
        let (costs, evaluations) = last_costs(Some(100));
        assert!(costs[0] <= 1e-12, "{objective:?}: {costs:?}");
        let limit = if objective == Objective::ChiSquare { 1e-2 } else { 1e-2 * 9e-6 };
        assert!(costs[1..].iter().all(|&cost| cost <= limit), "{objective:?}: {costs:?}");
        assert!(costs[1..].iter().any(|&cost| cost > 1e-12), "{objective:?}: {costs:?}");
        // Without their number, nothing is known of the errors of the data.
        if objective == Objective::Moments {
            let (costs, more) = last_costs(None);
            assert!(costs.iter().all(|&cost| cost <= 1e-12), "{costs:?}");
            assert!(more > evaluations, "{more}, {evaluations}");
        }
    }
}

#[test]
fn more_starts_go_on_after_those_of_another_job() {
    let started_at = |first_start, starts: u32| -> Vec<Point> {
        let mut specification = by_newton(60);
        specification.search.first_start = first_start;
        specification.search.starts = starts.into();
        let (search, _) = run(&specification);
        let first = |start| search.history().iter().find(|row| row.role.start == start);
        (0..starts).map(|start| first(start).unwrap().point).collect()
    };
    let all = started_at(0, 4);
    assert_eq!(started_at(2, 2), all[2..]);
}

/// A job with these groups, some of which have nothing to match.
fn job_of(groups: &[(&str, &[f64])]) -> JobSpecification {
    let group =
        |(name, velocities): &(&str, &[f64])| Group::new((*name).to_owned(), velocities.to_vec());
    let data = Some(Data::from_groups(groups.iter().map(group).collect()));
    JobSpecification { data, ..specification(400) }
}

#[test]
fn a_group_that_cannot_be_searched_takes_nothing_from_the_others() {
    let (left, right): (&[f64], &[f64]) = (&[3850.0, 3900.0, 3990.0], &[3800.0, 3900.0, 3950.0]);
    let whole = job_of(&[("left", left), ("right", right)]);
    let (known, _) = run(&whole);
    let known = known.result(&ending(&known), &Program::current(None));
    let one: &[f64] = &[3900.0];
    let same: &[f64] = &[3950.0, 3950.0, 3950.0];
    for (place, unsearched, expected) in [
        (0, one, "only one velocity: a coefficient of variation needs at least two different ones"),
        (1, one, "only one velocity: "),
        (2, one, "only one velocity: "),
        (1, same, "all 3 velocities are 3950.0 m/s: a coefficient of variation needs"),
    ] {
        let mut groups = vec![("left", left), ("right", right)];
        groups.insert(place, ("lonely", unsearched));
        let specification = job_of(&groups);
        let (search, _) = run(&specification);
        let summary = search.summary();
        let found = search.result(&ending(&search), &Program::current(None));
        assert_eq!((&found.digest, found.evaluations), (&known.digest, known.evaluations));
        assert_eq!(specification.evaluations_max(), whole.evaluations_max());
        // Each evaluation is for the group whose number it has.
        let place = u32::try_from(place).unwrap();
        assert!(search.history().iter().all(|row| row.role.group != place));
        assert_eq!(summary.groups.len(), 3);
        let GroupEnding { status, reason, best } = &summary.groups[place as usize];
        assert_eq!((*status, *best), (Status::Failed, None));
        assert!(reason.as_ref().unwrap().starts_with(expected), "{reason:?}");
        // The other groups have the ending of the job.
        assert_eq!(found.status, known.status);
        let told = "no search was made for 1 of 3 groups; the first is \"lonely\": ";
        let reason = found.reason.unwrap();
        assert!(reason.contains(told) && reason.contains(expected), "{reason}");
    }
}
