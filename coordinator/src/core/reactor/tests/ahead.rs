//! Groups and starts that are computed at the same time.

use osteon_common::job::{Group, SearchMethod};
use osteon_common::parameters::Point;

use super::*;
use crate::core::batch::Purpose;
use crate::store::EvaluationRecord;

/// A search for groups whose moments differ.
fn grouped_search(groups: u32, realizations: u64) -> JobSpecification {
    let group = |k: u32| {
        let mean = 3800.0 + 50.0 * f64::from(k);
        Group::new(format!("group {k}"), vec![0.97 * mean, 1.03 * mean])
    };
    let mut job = identification(realizations);
    job.search = Search { max_evaluations: 20, ..Search::by(SearchMethod::Newton) };
    job.data = Some(Data::from_groups((0..groups).map(group).collect()));
    job
}

/// A search from several starts.
fn search_from_starts(starts: u64, realizations: u64) -> JobSpecification {
    let mut job = identification(realizations);
    job.parameters[1] = Range::Free { start: 15e9, lower: 12e9, upper: 25e9 };
    job.search = Search { starts, max_evaluations: 12, ..Search::default() };
    job
}

/// Returns an answer that depends on the point as that of a bone.
fn bone(effect: &Effect) -> Option<Event> {
    let Effect::Send { worker, batch, work } = effect else { return None };
    let point: Point = work.evaluation.point;
    let solved = (work.first..work.first + u64::from(work.count)).map(|index| {
        let mean = 3900.0 * (point.0[1] / 17.717e9).sqrt();
        let deviate = [-1.0, 1.0, -0.5, 0.5][index as usize % 4];
        let velocity = mean * (1.0 + 0.3 * point.dispersion() * deviate);
        RealizationResult::solved(velocity, 0.0)
    });
    let (worker, batch, solved) = (*worker, *batch, solved.collect());
    Some(Event::Answered { worker, batch, solved, elapsed_s: 0.1 })
}

/// The evaluations that a job stored, how it ended, and its digest.
#[derive(Debug, PartialEq)]
struct Left {
    evaluations: Vec<EvaluationRecord>,
    ending: String,
    digest: String,
}

/// Runs a job to its end on so many workers, each of which answers in turn. Returns what it left, the
/// number of events, and the number of evaluations that were stored together with others.
fn run(job: JobSpecification, ahead: bool, workers: u32) -> (Left, u64, usize) {
    let mut rig = Rig::new();
    rig.state.config.ahead = ahead;
    rig.state.config.audit_fraction = 0.3;
    let mut effects = Vec::new();
    let mut react_to = |rig: &mut Rig, event| {
        effects.extend(react(&mut rig.state, event, rig.now));
        sanity_check(&rig.state).unwrap_or_else(|insane| panic!("{insane}"));
        std::mem::take(&mut effects)
    };
    let mut agenda = std::collections::VecDeque::new();
    agenda.extend(react_to(&mut rig, submit(0, "", job)));
    for worker in 1..=workers {
        let hello = hello_on(&format!("host {worker}"), worker.into(), worker, 2);
        agenda.extend(react_to(&mut rig, hello));
    }
    let (mut evaluations, mut together, mut events) = (Vec::new(), 0, 0);
    while let Some(effect) = agenda.pop_front() {
        events += 1;
        assert!(events < 100_000, "the job does not end");
        let event = match &effect {
            Effect::Send { .. } => bone(&effect),
            Effect::Store(record) => {
                match record {
                    Record::Evaluation { record, .. } => evaluations.push(record.clone()),
                    Record::Evaluations(records) => {
                        together += records.len();
                        evaluations.extend(records.iter().cloned());
                    }
                    Record::End { end, summary } => {
                        for record in &mut evaluations {
                            // Which worker answered what depends on the order of the answers.
                            record.workers.clear();
                        }
                        let ending = format!("{:?}", end.ending);
                        let digest = summary.digest.clone();
                        return (Left { evaluations, ending, digest }, events, together);
                    }
                    _ => {}
                }
                let (job, key) = record.key();
                Some(Event::Stored { job, key })
            }
            _ => None,
        };
        if let Some(event) = event {
            agenda.extend(react_to(&mut rig, event));
        }
    }
    panic!("the job does not end");
}

#[test]
fn what_is_left_does_not_depend_on_what_is_computed_at_the_same_time() {
    for job in
        [grouped_search(5, 8), search_from_starts(4, 8), grouped_search(1, 8), propagation(8)]
    {
        let several = job.search.starts > 1 || job.data.as_ref().is_some_and(|it| it.sets() > 1);
        let (plain, _, together) = run(job.clone(), false, 3);
        assert_eq!(together, 0);
        for workers in [1, 3, 10] {
            let (left, _, together) = run(job.clone(), true, workers);
            assert_eq!(left, plain, "{workers} workers");
            assert_eq!(together > 0, several, "{together} of {}", left.evaluations.len());
        }
    }
}

#[test]
fn other_groups_follow_the_first_and_share_its_start() {
    let mut rig = Rig::new();
    rig.state.config.audit_fraction = 0.0;
    rig.accept(grouped_search(3, 2));
    // All groups begin at one point, so the second worker waits for the first.
    rig.check(
        hello(1, 1),
        &["welcome 1, lease 1", "send 1: batch 1 = 0+1", "send 1: batch 2 = 1+1"],
    );
    rig.check(hello(2, 1), &["welcome 2, lease 2"]);
    rig.event(answer(1, 1, 0, 1));
    let effects = rig.event(answer(1, 2, 1, 1));
    // Its outcomes tell where the other groups go on, while they are stored.
    assert_eq!(effects[0], "store job 1 evaluation 0");
    assert_eq!(effects.len(), 3, "{effects:?}");
    // The points beside the start, too, are those of all groups: the third waits for the second.
    let branches = &rig.state.jobs[&JobId(1)].ahead.branches;
    let parts: Vec<_> = branches.iter().map(|it| (it.part, it.evaluation.is_some())).collect();
    assert_eq!(parts, [(1, true), (2, false)]);
    assert!(rig.state.batches.values().all(|batch| batch.purpose == Purpose::Fill));
    assert!(rig.state.batches.values().all(|batch| batch.charged > Duration::ZERO));
}

#[test]
fn what_the_search_asks_for_comes_first() {
    let mut rig = Rig::new();
    rig.state.config.audit_fraction = 0.0;
    rig.accept(search_from_starts(3, 4));
    rig.event(hello(1, 1));
    rig.event(hello(2, 1));
    let of_search = rig.state.jobs[&JobId(1)].evaluation().unwrap();
    assert_eq!(of_search.queued(), 0);
    // No part begins before its realizations are needed; one is kept ready.
    let ahead = &rig.state.jobs[&JobId(1)].ahead;
    assert!(ahead.has_queue());
    assert_eq!(ahead.branches.len(), 1);
}

#[test]
fn a_cancelled_job_leaves_nothing_of_its_other_parts() {
    let mut rig = Rig::new();
    rig.accept(search_from_starts(3, 1));
    rig.event(hello(1, 1));
    assert_eq!(rig.state.batches.len(), 2);
    let expected = ["store job 1 end: cancelled ", "revoke 1: batch 1", "revoke 1: batch 2"];
    rig.check(request(1, Request::Cancel(JobId(1))), &expected);
    assert_eq!(rig.state.jobs[&JobId(1)].ahead.count(), 0);
}

#[test]
fn other_parts_take_no_memory_from_other_jobs() {
    let mut rig = Rig::new();
    rig.state.config.active_realizations_max = 5;
    rig.accept(search_from_starts(4, 2));
    rig.event(hello(1, 8));
    assert_eq!(rig.state.jobs[&JobId(1)].ahead.count(), 1);
    rig.event(submit(1, "", propagation(2)));
    rig.event(stored_event(2, RecordKey::Job));
    assert_eq!(rig.state.jobs[&JobId(1)].ahead.count(), 0);
    assert_eq!(rig.state.active.len(), 2);
}
