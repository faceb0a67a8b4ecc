//! Branches: parts of a search that are followed by themselves.

use osteon_common::job::{Measurements, PosteriorSettings};

use super::*;

/// Groups of two velocities each, whose moments differ.
fn groups(count: usize) -> Data {
    let group = |k: usize| {
        let (mean, spread) = (3800.0 + 40.0 * k as f64, 0.02 + 0.005 * k as f64);
        let velocities = vec![mean * (1.0 - spread), mean * (1.0 + spread)];
        Group::new(format!("group {k}"), velocities)
    };
    Data::from_groups((0..count).map(group).collect())
}

/// The moments of fifty velocities.
fn fifty() -> Data {
    let measurements =
        Measurements::Moments { mean: 3900.0, coefficient_of_variation: 0.03, count: Some(50) };
    Data { measurements, ..Data::from_moments(3900.0, 0.03) }
}

/// Follows a branch to its end; returns its points with their outcomes and assessments.
fn followed(mut branch: Branch) -> Vec<(Point, Outcomes, Assessment)> {
    let mut points = Vec::new();
    while let Some(point) = branch.point() {
        let outcomes = outcomes(&point);
        let assessment = branch.tell(&outcomes, None).unwrap();
        points.push((point, outcomes, assessment));
    }
    points
}

/// Every point that a search asks for while it is in a part is the next of that part's branch, to the
/// bit, whatever the method and the objective. With several starts, a branch may hold more at its
/// end, and derivatives and posterior are in none. Given the assessments of the branches, the search
/// ends with the same digest and history.
#[test]
fn branches_know_the_points_of_their_parts() {
    let check = |mut job: JobSpecification, (sets, starts): (usize, u64)| {
        job.search.starts = starts;
        if sets > 1 {
            job.data = Some(groups(sets));
        }
        assert!(job.check().is_empty(), "{:?}", job.check());
        let (plain, _) = run(&job);
        let mut search = Search::new(Arc::new(job));
        assert_eq!(search.parts(), sets as u64 * starts);
        assert!(search.branch(search.parts()).is_none());
        let all = (0..search.parts()).map(|part| followed(search.branch(part).unwrap()));
        let all: Vec<_> = all.collect();
        let mut used = vec![0; all.len()];
        while let Step::Evaluate(point) = search.ask() {
            let part = search.part() as usize;
            let known = all[part].get(used[part]).filter(|known| same_point(&known.0, &point));
            let number = search.evaluations();
            if let Some((_, outcomes, assessment)) = known {
                used[part] += 1;
                search.anticipate(assessment.clone());
                search.tell(outcomes.clone(), ERRORS);
            } else {
                search.tell(outcomes(&point), ERRORS);
            }
            let role = search.history()[number as usize].role;
            let of_all = starts > 1 && (role.varied.is_some() || role.posterior);
            assert_eq!(known.is_none(), of_all, "evaluation {number} of part {part}, {role:?}");
        }
        assert!(used.iter().all(|used| *used > 0), "{used:?}");
        if starts == 1 {
            assert_eq!(used, all.iter().map(Vec::len).collect::<Vec<_>>());
        }
        assert_eq!(search.summary(), plain.summary());
    };
    for (sets, starts) in [(1, 1), (4, 1), (1, 4), (3, 3)] {
        check(by_newton(60), (sets, starts));
        check(specification(100), (sets, starts));
        let objective = Objective::ChiSquare;
        let data = Some(fifty());
        check(JobSpecification { objective, data, ..by_newton(60) }, (sets, starts));
        let settings = PosteriorSettings { max_evaluations: 30, ..PosteriorSettings::default() };
        let data = Some(fifty());
        check(
            JobSpecification { posterior: Some(settings), data, ..by_newton(60) },
            (sets, starts),
        );
    }
}

/// Once a start is the answer, the branches of the starts after it end where the search ends them.
#[test]
fn branches_after_the_answer_are_no_longer_than_their_starts() {
    let data = Some(fifty());
    let mut job = JobSpecification { data, ..by_newton(60) };
    job.search.starts = 5;
    let mut search = Search::new(Arc::new(job));
    let before = followed(search.branch(2).unwrap()).len();
    while search.part() == 0 {
        let Step::Evaluate(point) = search.ask() else { panic!("ended") };
        search.tell(outcomes(&point), ERRORS);
    }
    let branch = followed(search.branch(2).unwrap());
    assert!(branch.len() < before, "{} and {before}", branch.len());
    while let Step::Evaluate(point) = search.ask() {
        search.tell(outcomes(&point), ERRORS);
    }
    let of_start = search.history().iter().filter(|row| row.role.start == 2);
    assert_eq!(of_start.filter(|row| row.role.varied.is_none()).count(), branch.len());
}

/// Of an assessment for another set only the moments are used, and nothing of one of other outcomes.
#[test]
fn assessments_are_used_as_far_as_they_hold() {
    let job = JobSpecification { data: Some(groups(2)), ..by_newton(60) };
    let (plain, _) = run(&job);
    let mut search = Search::new(Arc::new(job));
    let other = {
        let mut branch = search.branch(1).unwrap();
        let outcomes = outcomes(&branch.point().unwrap());
        (branch.tell(&outcomes, None).unwrap(), outcomes)
    };
    while let Step::Evaluate(point) = search.ask() {
        search.anticipate(other.0.clone());
        // The first point of both groups is the same, but the costs there are not.
        let is_first = search.evaluations() == 0;
        let told = if is_first { other.1.clone() } else { outcomes(&point) };
        search.tell(told, ERRORS);
    }
    assert_eq!(search.summary(), plain.summary());
    // So do branches: the first is given what the second has computed.
    let mut branch = search.branch(0).unwrap();
    let assessed = branch.tell(&other.1, Some(&other.0)).unwrap();
    assert_eq!(assessed.cost, plain.history()[0].cost);
    assert_ne!(assessed.cost, other.0.cost);
    let outcomes = outcomes(&branch.point().unwrap());
    let assessed = branch.tell(&outcomes, Some(&other.0)).unwrap();
    assert_eq!(assessed.cost, plain.history()[1].cost);
}
