//! Large evaluations, which are completed beside the core.

use osteon_common::job::{Measurements, PosteriorSettings, SearchMethod};

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

/// Returns the events that report the two steps of a completion.
fn steps(completion: Completion) -> [Event; 2] {
    let mut gathered = None;
    let completed = completion.run(|outcomes| gathered = Some(outcomes));
    [Event::Gathered(gathered.unwrap()), Event::Completed(completed)]
}

#[test]
fn what_is_completed_aside_is_stored_and_ends_as_ever() {
    let mut plain = Rig::with(4, &[4]);
    plain.event(answer(1, 1, 0, 4));
    plain.event(stored_event(1, RecordKey::Evaluation(0)));
    let digest = |rig: &Rig| rig.state.jobs[&JobId(1)].search.summary();
    for durable_first in [false, true] {
        let (mut aside, completion) = rig(propagation(4));
        let [gathered, completed] = steps(completion);
        aside.check(gathered.clone(), &["store job 1 evaluation 0"]);
        let durable = stored_event(1, RecordKey::Evaluation(0));
        let (one, other) =
            if durable_first { (durable, completed.clone()) } else { (completed.clone(), durable) };
        aside.check(one, &[]);
        assert_eq!(aside.event(other), ["store job 1 end: converged "], "{durable_first}");
        // The same is not taken twice.
        aside.check(gathered, &[]);
        aside.check(completed, &[]);
        assert_eq!(digest(&aside), digest(&plain), "{durable_first}");
    }
}

#[test]
fn a_search_goes_on_with_what_was_completed_aside() {
    for durable_first in [false, true] {
        let (mut rig, completion) = rig(identification(4));
        let [gathered, completed] = steps(completion);
        rig.check(gathered, &["store job 1 evaluation 0"]);
        let durable = stored_event(1, RecordKey::Evaluation(0));
        let (one, other) = if durable_first { (durable, completed) } else { (completed, durable) };
        rig.check(one, &[]);
        rig.check(other, &["send 1: batch 2 = 0+4"]);
    }
}

#[test]
fn what_the_store_refuses_while_the_search_takes_it_in_is_written_again() {
    let (mut rig, completion) = rig(propagation(4));
    let [gathered, completed] = steps(completion);
    rig.event(gathered);
    let key = RecordKey::Evaluation(0);
    rig.event(Event::StoreFailed { job: JobId(1), key, error: "full".to_owned() });
    rig.check(completed, &[]);
    rig.now += rig.state.config.store_retry;
    assert!(rig.event(Event::Tick).contains(&"store job 1 evaluation 0".to_owned()));
    assert_eq!(rig.event(stored_event(1, key)), ["store job 1 end: converged "]);
}

#[test]
fn a_job_is_computed_again_if_a_worker_is_banned_after_the_evaluation_is_durable() {
    let (mut rig, completion) = rig(propagation(4));
    let [gathered, completed] = steps(completion);
    rig.event(gathered);
    rig.event(stored_event(1, RecordKey::Evaluation(0)));
    let worker = WorkerName::new("node", 42, 0);
    bans::ban(&mut Turn::new(&mut rig.state, rig.now), &worker, JobId(1), "lies".to_owned());
    let after = rig.event(completed);
    assert!(!after.iter().any(|effect| effect.contains("end")), "{after:?}");
    assert_eq!(rig.state.jobs[&JobId(1)].search.evaluations(), 0);
}

#[test]
fn a_posterior_is_drawn_beside_the_core() {
    let mut rig = Rig::new();
    rig.state.config.audit_fraction = 0.0;
    let mut job = identification(4);
    let (mean, coefficient_of_variation) = (3901.5, 2.9e-4);
    let measurements = Measurements::Moments { mean, coefficient_of_variation, count: Some(1000) };
    job.data = Some(Data { measurements, repeatability: 0.0, decay_error: 0.0 });
    job.search = Search::by(SearchMethod::Posterior);
    job.posterior = Some(PosteriorSettings::default());
    rig.accept(job);
    rig.event(hello(1, 4));
    // The first batch has 32 points, and only after the last of them points are drawn.
    for number in 0..31 {
        let stored = format!("store job 1 evaluation {number}");
        rig.check(answer(1, number + 1, 0, 4), &[&stored]);
        let next = format!("send 1: batch {} = 0+4", number + 2);
        rig.check(stored_event(1, RecordKey::Evaluation(number)), &[&next]);
    }
    rig.check(answer(1, 32, 0, 4), &["complete an evaluation of job 1"]);
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
    for step in steps(completion) {
        rig.check(step, &[]);
    }
    let evaluation = rig.state.jobs[&JobId(1)].evaluation().unwrap();
    assert_eq!((evaluation.filled(), evaluation.queued()), (0, 4));
}

#[test]
fn a_job_that_is_cancelled_meanwhile_ends_at_once() {
    let (mut rig, completion) = rig(propagation(4));
    let ended = rig.event(request(1, Request::Cancel(JobId(1))));
    assert_eq!(ended, ["store job 1 end: cancelled "]);
    for step in steps(completion) {
        rig.check(step, &[]);
    }
}

#[test]
fn a_job_that_is_cancelled_while_its_search_is_told_ends_after_that() {
    let (mut rig, completion) = rig(identification(4));
    let [gathered, completed] = steps(completion);
    rig.event(gathered);
    rig.check(stored_event(1, RecordKey::Evaluation(0)), &[]);
    rig.check(request(1, Request::Cancel(JobId(1))), &[]);
    assert_eq!(rig.event(completed), ["store job 1 end: cancelled "]);
}

#[test]
fn a_stop_waits_for_what_is_being_completed() {
    let (mut rig, completion) = rig(propagation(4));
    let [gathered, completed] = steps(completion);
    assert!(!rig.event(Event::Drain).contains(&"stop".to_owned()));
    rig.check(gathered, &["store job 1 evaluation 0"]);
    rig.check(stored_event(1, RecordKey::Evaluation(0)), &[]);
    rig.check(completed, &["store job 1 end: converged "]);
}
