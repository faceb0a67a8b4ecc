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
pub(super) fn wrong_answer(worker: u64, batch: u64, index: u64, off: RealizationResult) -> Event {
    let Ok(right) = velocity(index) else { panic!("a velocity") };
    let Ok(off_by) = off.outcome else { panic!("a velocity") };
    let velocity = f64::from_bits(right.to_bits() + off_by as u64);
    let solved = vec![RealizationResult::solved(velocity, off.estimated_error)];
    Event::Answered { worker: WorkerId(worker), batch: BatchId(batch), solved, elapsed_s: 0.1 }
}

pub(super) const ONE_BIT: RealizationResult = RealizationResult::solved(1.0, 0.0);

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
fn workers_of_one_host_do_not_check_each_other() {
    let of_host = |worker, process| hello_on("node-1", worker, process, 1);
    let mut rig = rig(1, 1);
    for process in 2..=4 {
        rig.event(of_host(process, process as u32));
    }
    rig.check(answer(1, 1, 0, 1), &["store job 1 evaluation 0"]);
    // A worker of another host does, and a third host decides, not a second process of one of the two.
    let mut rig = self::rig(1, 1);
    rig.event(of_host(2, 2));
    rig.event(hello_on("node-9", 9, 9, 1));
    rig.check(wrong_answer(1, 1, 0, ONE_BIT), &["send 9: batch 2 = 0+1"]);
    rig.check(answer(9, 2, 0, 1), &[]);
    rig.check(hello_on("node-9", 10, 10, 1), &["welcome 10, lease 4"]);
    let effects = rig.event(hello_on("node-5", 5, 5, 1));
    assert_eq!(effects[1], "send 5: batch 3 = 0+1");
    let effects = rig.event(answer(5, 3, 0, 1));
    assert!(effects[0].starts_with("store ban 1: node-1 (process 1)"), "{effects:?}");
    // Both processes of the banned host are sent away, and others are refused.
    let closed = |worker: u64| {
        effects.iter().any(|it| it.starts_with(&format!("close {worker}: host node-1")))
    };
    assert_eq!([1, 2, 5, 9].map(closed), [true, true, false, false], "{effects:?}");
    let refused = rig.event(of_host(7, 7));
    assert!(refused[0].starts_with("close 7: host node-1 is banned"), "{refused:?}");
}

#[test]
fn a_ban_lasts_until_it_is_lifted() {
    let mut rig = rig(1, 3);
    rig.event(wrong_answer(1, 1, 0, ONE_BIT));
    rig.event(answer(2, 2, 0, 1));
    rig.event(answer(3, 3, 0, 1));
    rig.event(stored_event(1, RecordKey::Ban(1)));
    let unban = |host: &str| request(8, Request::Unban(host.to_owned()));
    let unknown =
        "answer 8: host `node-2` is not banned; `osteon worker list` lists those that are";
    rig.check(unban("node-2"), &[unknown]);
    let effects = rig.event(unban("node-1"));
    assert_eq!(effects.last().map(String::as_str), Some("answer 8: lifted node-1"));
    assert!(effects[0].starts_with("store ban 1: node-1"), "{effects:?}");
    rig.event(stored_event(1, RecordKey::Ban(1)));
    rig.check(
        unban("node-1"),
        &["answer 8: host `node-1` is not banned; `osteon worker list` lists those that are"],
    );
    let effects = rig.event(hello_of(9, 1, 1));
    assert_eq!(effects[0], "welcome 9, lease 4");
    // Its answers in jobs that were accepted before remain doubtful.
    let name = crate::core::worker_name::WorkerName::new("node-1", 1, 0);
    assert!(rig.state.is_doubtful(&name, &rig.state.jobs[&JobId(1)].record));
    rig.now += Duration::from_secs(1);
    let later = rig.accept(propagation(1));
    assert!(!rig.state.is_doubtful(&name, &rig.state.jobs[&later].record));
}

#[test]
fn two_that_agree_are_no_majority_of_five() {
    let mut rig = rig(1, 5);
    // Hosts 1 and 3 are broken in the same way.
    rig.check(wrong_answer(1, 1, 0, ONE_BIT), &["send 2: batch 2 = 0+1"]);
    // Two votes are lacking, of three hosts that can give them.
    rig.check(answer(2, 2, 0, 1), &["send 3: batch 3 = 0+1", "send 4: batch 4 = 0+1"]);
    rig.check(wrong_answer(3, 3, 0, ONE_BIT), &[]);
    rig.check(answer(4, 4, 0, 1), &["send 5: batch 5 = 0+1"]);
    let effects = rig.event(answer(5, 5, 0, 1));
    for (at, host) in ["node-1", "node-3"].into_iter().enumerate() {
        let banned = format!("store ban {}: {host}", at + 1);
        assert!(effects.iter().any(|effect| effect.starts_with(&banned)), "{host}: {effects:?}");
    }
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
    rig.check(wrong_answer(1, 1, 0, ONE_BIT), &["send 2: batch 2 = 0+1"]);
    rig.check(answer(2, 2, 0, 1), &["send 3: batch 3 = 0+1"]);
    let effects = rig.event(answer(3, 3, 0, 1));
    // The wrong answer filled the result: the evaluation begins again.
    assert_eq!(effects.len(), 3, "{effects:?}");
    let banned = format!("store ban 1: node-1 (process 1) {JUDGED}");
    assert!(effects[0].starts_with(&banned), "{effects:?}");
    assert!(effects[1].starts_with("close 1: host node-1 is banned"), "{effects:?}");
    assert_eq!(effects[2], "send 2: batch 4 = 0+1");
    // The worker stays banned, and its later answers are ignored.
    rig.check(answer(1, 1, 0, 1), &[]);
    let refused = rig.event(hello_of(9, 1, 1));
    assert!(refused[0].starts_with("close 9: host node-1 is banned"), "{refused:?}");
    rig.check(answer(2, 4, 0, 1), &["send 3: batch 5 = 0+1"]);
    rig.check(answer(3, 5, 0, 1), &["store job 1 evaluation 0"]);
}

#[test]
fn a_third_worker_decides_against_the_second() {
    let mut rig = rig(1, 3);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    rig.check(wrong_answer(2, 2, 0, ONE_BIT), &["send 3: batch 3 = 0+1"]);
    let effects = rig.event(answer(3, 3, 0, 1));
    assert_eq!(effects.len(), 3, "{effects:?}");
    let banned = format!("store ban 1: node-2 (process 2) {JUDGED}");
    assert!(effects[0].starts_with(&banned), "{effects:?}");
    assert!(effects[1].starts_with("close 2: host node-2 is banned"), "{effects:?}");
    // Its answer filled no result: nothing is computed again.
    assert_eq!(effects[2], "store job 1 evaluation 0");
}

#[test]
fn an_estimated_error_is_an_answer_too() {
    let mut rig = rig(1, 3);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    let off = RealizationResult::solved(0.0, 1e-9);
    rig.check(wrong_answer(2, 2, 0, off), &["send 3: batch 3 = 0+1"]);
    let effects = rig.event(answer(3, 3, 0, 1));
    assert!(effects[0].starts_with("store ban 1: node-2 (process 2)"), "{effects:?}");
}

#[test]
fn of_two_workers_none_is_believed() {
    let mut rig = rig(1, 2);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    rig.check(wrong_answer(2, 2, 0, ONE_BIT), &[]);
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
    for part in [
        "by node-1 (process 1) and 3900.0000000000005 m/s",
        "hosts node-1, node-2 give no majority",
    ] {
        assert!(reason.contains(part), "{reason}");
    }
}

#[test]
fn a_third_worker_that_comes_in_time_decides() {
    let mut rig = rig(1, 2);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    rig.check(wrong_answer(2, 2, 0, ONE_BIT), &[]);
    // Another stay of one of the two processes does not count as a third worker.
    rig.check(hello_of(3, 2, 1), &["welcome 3, lease 3"]);
    rig.check(hello_of(4, 4, 1), &["welcome 4, lease 4", "send 4: batch 3 = 0+1"]);
    let effects = rig.event(answer(4, 3, 0, 1));
    let closed = effects.iter().filter(|effect| effect.contains("host node-2 is banned"));
    assert_eq!(closed.count(), 2, "{effects:?}");
}

#[test]
fn a_copy_that_answers_differently_is_judged() {
    let mut rig = rig(2, 3);
    rig.state.config.audit_fraction = 0.0;
    // Worker 1 has both, the others get duplicates.
    let copies = ["send 2: batch 3 = 0+1", "send 3: batch 4 = 1+1"];
    rig.check_after(Duration::from_millis(100), &copies);
    // Nobody else has answered anything, so worker 2 gets the other one, too.
    let effects = ["revoke 1: batch 1", "send 2: batch 5 = 1+1"];
    rig.check(wrong_answer(2, 3, 0, ONE_BIT), &effects);
    // The answer of worker 1 had been sent already.
    rig.check(answer(1, 1, 0, 1), &["send 3: batch 6 = 0+1"]);
    let effects = rig.event(answer(3, 6, 0, 1));
    assert!(effects[0].starts_with("store ban 1: node-2 (process 2)"), "{effects:?}");
}

#[test]
fn who_contradicts_itself_needs_no_judge() {
    // The host is banned; if it is the only one, the job fails.
    for alone in [false, true] {
        let mut rig = rig(8, 1);
        rig.check(answer(1, 1, 0, 2), &["send 1: batch 3 = 4+1"]);
        rig.check(answer(1, 1, 0, 2), &[]);
        if !alone {
            rig.event(hello_of(2, 2, 1));
        }
        let effects = rig.event(answer(1, 1, 1, 2));
        let expected = match alone {
            false => "store ban 1: node-1 (process 1) answered realization 0 as 3900 m/s",
            true => "store job 1 end: failed integrity error: realization 0 at the point",
        };
        assert!(effects[0].starts_with(expected), "{effects:?}");
        let closed = effects.iter().any(|it| it.starts_with("close 1: host node-1 is banned"));
        assert_eq!(closed, !alone, "{effects:?}");
    }
}
