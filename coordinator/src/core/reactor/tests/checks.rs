//! Comparison of answers: audits, disputes, bans.

use super::*;
use crate::core::batch::Purpose;
use crate::core::indices::Indices;
use crate::core::job::Stage;

/// Returns a rig with a propagation of so many realizations and workers 1, 2, … of one thread, each
/// on a host of its own; every batch is audited.
fn rig(realizations: u64, workers: u32) -> Rig {
    let mut rig = Rig::new();
    rig.state.config.audit_fraction = 1.0;
    rig.accept(propagation(realizations));
    for worker in 1..=workers {
        rig.event(hello_of(worker.into(), worker, 1));
    }
    rig
}

/// Returns an answer of one realization that differs by `off` from the right one.
pub(super) fn wrong(worker: u64, batch: u64, index: u64, off: RealizationResult) -> Event {
    let Ok(right) = velocity(index) else { panic!("a velocity") };
    let Ok(off_by) = off.outcome else { panic!("a velocity") };
    let outcome = Ok(f64::from_bits(right.to_bits() + off_by as u64));
    let solved =
        vec![RealizationResult { outcome, estimated_error: off.estimated_error, decay: 0.0 }];
    Event::Answered { worker: WorkerId(worker), batch: BatchId(batch), solved, elapsed_s: 0.1 }
}

pub(super) const ONE_BIT: RealizationResult =
    RealizationResult { outcome: Ok(1.0), estimated_error: 0.0, decay: 0.0 };

#[test]
fn an_audited_batch_is_computed_by_another_worker() {
    let mut rig = rig(1, 2);
    // Worker 1 has the only realization; worker 2 gets its audit when it is answered.
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    rig.check(answer(2, 2, 0, 1), &["store job 1 evaluation 0"]);
}

/// When nothing else is left to send, an audit is computed in parts, if there are several workers to share it.
#[test]
fn a_last_audit_is_computed_in_parts_by_several_workers() {
    for (workers, in_parts) in [(8, true), (2, false)] {
        let mut rig = rig(200, workers);
        for worker in rig.state.workers.values_mut() {
            worker.rates.insert(JobId(1), 1e5);
        }
        let (mut filled, mut audits) = (Vec::new(), Vec::new());
        while let Some((&BatchId(id), batch)) = rig.state.batches.first_key_value() {
            let (Indices { first, count }, worker) = (batch.assignment.indices, batch.worker.0);
            match batch.purpose {
                Purpose::Audit { .. } => audits.push((first, count)),
                _ => filled.push((first, count)),
            }
            rig.event(answer_in(count as f64 / 1e5, worker, id, first, count));
        }
        assert_eq!(audits.len() > filled.len(), in_parts, "{filled:?} {audits:?}");
        // Each realization is audited once.
        audits.sort_unstable();
        let ends = audits.iter().map(|(first, count)| first + count);
        let begins = audits.iter().skip(1).map(|(first, _)| *first);
        assert!(ends.eq(begins.chain([200])), "{audits:?}");
        assert!(matches!(rig.state.jobs[&JobId(1)].stage, Stage::StoringEvaluation { .. }));
    }
}

#[test]
fn one_worker_alone_is_believed() {
    let mut rig = rig(1, 1);
    rig.check(answer(1, 1, 0, 1), &["store job 1 evaluation 0"]);
    // A worker that has attached twice does not audit itself.
    let mut rig = self::rig(1, 1);
    rig.event(hello_of(2, 1, 1));
    rig.check(answer(1, 1, 0, 1), &["store job 1 evaluation 0"]);
}

#[test]
fn two_containers_may_have_host_and_process_in_common() {
    let of_instance = |worker, instance| {
        let Event::Hello { worker, mut hello } = hello_of(worker, 1, 1) else { panic!("no hello") };
        hello.instance = instance;
        Event::Hello { worker, hello }
    };
    let mut rig = rig(1, 0);
    rig.event(of_instance(1, 5));
    // The same process once more, and a process of another container.
    rig.event(of_instance(2, 5));
    rig.check(of_instance(3, 6), &["welcome 3, lease 3"]);
    rig.check(answer(1, 1, 0, 1), &["send 3: batch 2 = 0+1"]);
    rig.check(answer(3, 2, 0, 1), &["store job 1 evaluation 0"]);
}

#[test]
fn a_lost_auditor_is_replaced_and_audits_without_anybody_are_given_up() {
    let mut rig = rig(1, 3);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    rig.check(end_of_stream(2), &["send 3: batch 3 = 0+1"]);
    rig.check(end_of_stream(3), &[]);
    rig.check_after(Duration::from_millis(100), &["store job 1 evaluation 0"]);
}

#[test]
fn an_audit_that_three_workers_did_not_survive_is_given_up() {
    let mut rig = rig(1, 4);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    rig.check(end_of_stream(2), &["send 3: batch 3 = 0+1"]);
    rig.check(end_of_stream(3), &["send 4: batch 4 = 0+1"]);
    rig.check(end_of_stream(4), &[]);
    rig.event(hello_of(5, 5, 1));
    rig.check_after(Duration::from_millis(100), &["store job 1 evaluation 0"]);
}

const JUDGED: &str = "answered realization 0 of job 1 with 3900.0000000000005 m/s (bits \
                      40ae780000000001, estimated error 0.0), while ";

#[test]
fn a_third_worker_decides_against_the_first() {
    let mut rig = rig(1, 3);
    rig.check(wrong(1, 1, 0, ONE_BIT), &["send 2: batch 2 = 0+1"]);
    rig.check(answer(2, 2, 0, 1), &["send 3: batch 3 = 0+1"]);
    let effects = rig.event(answer(3, 3, 0, 1));
    // The wrong answer filled the result: the evaluation begins again.
    assert_eq!(effects.len(), 3, "{effects:?}");
    let banned = format!("store ban 1: node (process 1) {JUDGED}");
    assert!(effects[0].starts_with(&banned), "{effects:?}");
    assert!(effects[1].starts_with("close 1: this worker is banned"), "{effects:?}");
    assert_eq!(effects[2], "send 2: batch 4 = 0+1");
    // The worker stays banned, and its later answers are ignored.
    rig.check(answer(1, 1, 0, 1), &[]);
    let refused = rig.event(hello_of(9, 1, 1));
    assert!(refused[0].starts_with("close 9: this worker is banned"), "{refused:?}");
    rig.check(answer(2, 4, 0, 1), &["send 3: batch 5 = 0+1"]);
    rig.check(answer(3, 5, 0, 1), &["store job 1 evaluation 0"]);
}

#[test]
fn a_third_worker_decides_against_the_second() {
    let mut rig = rig(1, 3);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    rig.check(wrong(2, 2, 0, ONE_BIT), &["send 3: batch 3 = 0+1"]);
    let effects = rig.event(answer(3, 3, 0, 1));
    assert_eq!(effects.len(), 3, "{effects:?}");
    let banned = format!("store ban 1: node (process 2) {JUDGED}");
    assert!(effects[0].starts_with(&banned), "{effects:?}");
    assert!(effects[1].starts_with("close 2: this worker is banned"), "{effects:?}");
    // Its answer filled no result: nothing is computed again.
    assert_eq!(effects[2], "store job 1 evaluation 0");
}

#[test]
fn an_estimated_error_is_an_answer_too() {
    let mut rig = rig(1, 3);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    let off = RealizationResult { outcome: Ok(0.0), estimated_error: 1e-9, decay: 0.0 };
    rig.check(wrong(2, 2, 0, off), &["send 3: batch 3 = 0+1"]);
    let effects = rig.event(answer(3, 3, 0, 1));
    assert!(effects[0].starts_with("store ban 1: node (process 2)"), "{effects:?}");
}

#[test]
fn of_two_workers_none_is_believed() {
    let mut rig = rig(1, 2);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    rig.check(wrong(2, 2, 0, ONE_BIT), &[]);
    for worker in [1, 2] {
        rig.heartbeat(worker);
    }
    rig.check_after(Duration::from_secs(10), &[]);
    let snapshot = crate::core::snapshot::job_snapshot(&rig.state, JobId(1), rig.now).unwrap();
    let waits = "a third worker, which decides between two whose answers differ (since 10 s)";
    assert_eq!(snapshot.waiting_for, waits);
    for worker in [1, 2] {
        rig.heartbeat(worker);
    }
    rig.now += Duration::from_millis(1);
    let mut effects = rig.event(Event::Tick);
    effects.retain(|effect| effect.starts_with("store"));
    assert_eq!(effects.len(), 1, "{effects:?}");
    let reason = &effects[0];
    let expected = "store job 1 end: failed integrity error: realization 0 at the point";
    assert!(reason.starts_with(expected), "{reason}");
    for part in ["by node (process 1) and 3900.0000000000005 m/s", "attach three workers"] {
        assert!(reason.contains(part), "{reason}");
    }
}

#[test]
fn a_third_worker_that_comes_in_time_decides() {
    let mut rig = rig(1, 2);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    rig.check(wrong(2, 2, 0, ONE_BIT), &[]);
    // Another stay of one of the two processes does not count as a third worker.
    rig.check(hello_of(3, 2, 1), &["welcome 3, lease 3"]);
    rig.check(hello_of(4, 4, 1), &["welcome 4, lease 4", "send 4: batch 3 = 0+1"]);
    let effects = rig.event(answer(4, 3, 0, 1));
    let closed = effects.iter().filter(|effect| effect.contains("this worker is banned"));
    assert_eq!(closed.count(), 2, "{effects:?}");
}

#[test]
fn a_copy_that_answers_differently_is_judged() {
    let mut rig = rig(2, 3);
    rig.state.config.audit_fraction = 0.0;
    // Worker 1 has both, the others get duplicates.
    let copies = ["send 2: batch 3 = 0+1", "send 3: batch 4 = 1+1"];
    rig.check_after(Duration::from_millis(100), &copies);
    rig.check(wrong(2, 3, 0, ONE_BIT), &["revoke 1: batch 1"]);
    // The answer of worker 1 had been sent already.
    rig.check(answer(1, 1, 0, 1), &["send 3: batch 5 = 0+1"]);
    let effects = rig.event(answer(3, 5, 0, 1));
    assert!(effects[0].starts_with("store ban 1: node (process 2)"), "{effects:?}");
}

#[test]
fn who_contradicts_itself_needs_no_judge() {
    let mut rig = rig(8, 1);
    rig.check(answer(1, 1, 0, 2), &["send 1: batch 3 = 4+1"]);
    rig.check(answer(1, 1, 0, 2), &[]);
    let effects = rig.event(answer(1, 1, 1, 2));
    let banned = "store ban 1: node (process 1) answered realization 0 as 3900 m/s";
    assert!(effects[0].starts_with(banned), "{effects:?}");
    assert!(effects[3].starts_with("close 1: this worker is banned"), "{effects:?}");
}
