//! Large evaluations, which are completed beside the core.

use super::*;
use crate::core::completion::Completion;
use crate::core::worker_name::WorkerName;

/// Returns a rig whose job has been answered as a whole by worker 1, and what is to be completed.
fn rig(specification: JobSpecification) -> (Rig, Completion) {
    let mut rig = Rig::new();
    rig.state.config.audit_fraction = 0.0;
    rig.state.config.completed_aside_min = 4;
    rig.accept(specification);
    rig.event(hello(1, 4));
    let effects = react(&mut rig.state, answer(1, 1, 0, 4), rig.now);
    let completion = effects.into_iter().find_map(|effect| match effect {
        Effect::Complete(completion) => Some(completion),
        _ => None,
    });
    (rig, completion.unwrap())
}

fn done(completion: Completion) -> Event {
    Event::Completed(completion.run())
}

#[test]
fn what_is_completed_aside_is_stored_and_ends_as_ever() {
    let (mut aside, completion) = rig(propagation(4));
    aside.check(done(completion.clone()), &["store job 1 evaluation 0"]);
    let ended = aside.event(stored(1, RecordKey::Evaluation(0)));
    assert_eq!(ended, ["store job 1 end: converged "]);
    // The same is not taken twice.
    aside.check(done(completion), &[]);
    let mut plain = Rig::with(4, &[4]);
    plain.event(answer(1, 1, 0, 4));
    plain.event(stored(1, RecordKey::Evaluation(0)));
    let digest = |rig: &Rig| rig.state.jobs[&JobId(1)].search.summary();
    assert_eq!(digest(&aside), digest(&plain));
}

#[test]
fn a_search_goes_on_with_what_was_completed_aside() {
    let (mut rig, completion) = rig(identification(4));
    rig.check(done(completion), &["store job 1 evaluation 0"]);
    rig.check(stored(1, RecordKey::Evaluation(0)), &["send 1: batch 2 = 0+4"]);
}

#[test]
fn small_evaluations_are_completed_at_once() {
    let mut rig = Rig::with(3, &[4]);
    rig.state.config.completed_aside_min = 4;
    rig.check(answer(1, 1, 0, 3), &["store job 1 evaluation 0"]);
}

#[test]
fn answers_of_a_worker_that_is_banned_meanwhile_do_not_count() {
    let (mut rig, completion) = rig(propagation(4));
    let worker = WorkerName::new("node", 42, 0);
    bans::ban(&mut Turn::new(&mut rig.state, rig.now), &worker, JobId(1), "lies".to_owned());
    rig.check(done(completion), &[]);
    let evaluation = rig.state.jobs[&JobId(1)].evaluation().unwrap();
    assert_eq!((evaluation.filled(), evaluation.queued()), (0, 4));
}

#[test]
fn a_job_that_is_cancelled_meanwhile_ends_at_once() {
    let (mut rig, completion) = rig(propagation(4));
    let ended = rig.event(request(1, Request::Cancel(JobId(1))));
    assert_eq!(ended, ["store job 1 end: cancelled "]);
    rig.check(done(completion), &[]);
}

#[test]
fn a_stop_waits_for_what_is_being_completed() {
    let (mut rig, completion) = rig(propagation(4));
    assert!(!rig.event(Event::Drain).contains(&"stop".to_owned()));
    rig.check(done(completion), &["store job 1 evaluation 0"]);
}
