//! Workers that send heartbeats but do not answer.

use super::checks::{ONE_BIT, wrong_answer};
use super::*;
use crate::core::batch::Purpose;
use crate::core::indices::Indices;
use crate::core::job::Stage;
use crate::core::worker_name::WorkerName;

const SECOND: Duration = Duration::from_secs(1);
/// No batch is overdue before this time.
const OVERDUE: Duration = Duration::from_secs(3);

/// Returns a rig with a propagation of so many realizations and workers 1, 2, … of one thread, each
/// on a host of its own; this fraction of the batches is audited.
fn rig(realizations: u64, workers: u64, audit_fraction: f64) -> Rig {
    let mut rig = Rig::new();
    rig.state.config.audit_fraction = audit_fraction;
    rig.accept(propagation(realizations));
    for worker in 1..=workers {
        rig.event(hello_on_own_host(worker));
    }
    rig
}

/// Returns the hello event of a worker of one thread on a host of its own.
fn hello_on_own_host(worker: u64) -> Event {
    hello_on(&format!("host {worker}"), worker, worker as u32, 1)
}

fn name(worker: u64) -> WorkerName {
    WorkerName::new(&format!("host {worker}"), worker as u32, 0)
}

impl Rig {
    /// Advances the time in ticks of 100 ms, with heartbeats from every worker; returns the
    /// effects, without snapshots and heartbeats.
    fn live(&mut self, time: Duration) -> Vec<String> {
        let end = self.now + time;
        let mut effects = Vec::new();
        while self.now < end {
            self.now = (self.now + SECOND / 10).min(end);
            for worker in Vec::from_iter(self.state.workers.keys().copied()) {
                self.event(Event::Heartbeat { worker });
            }
            effects.extend(self.event(Event::Tick));
        }
        effects.retain(|effect| !effect.starts_with("publish") && !effect.starts_with("beat"));
        effects
    }

    fn waits_for(&self) -> String {
        crate::core::snapshot::job_snapshot(&self.state, JobId(1), self.now).unwrap().waiting_for
    }

    fn batch(&self, batch: u64) -> &crate::core::batch::Batch {
        &self.state.batches[&BatchId(batch)]
    }
}

#[test]
fn a_first_answer_that_is_overdue_twice_is_computed_by_a_third_worker() {
    let mut rig = rig(1, 3, 0.0);
    // An idle worker gets a duplicate at once; it does not answer either.
    assert_eq!(rig.live(SECOND / 10), ["send 2: batch 2 = 0+1"]);
    assert_eq!(rig.live(OVERDUE - SECOND / 10), [""; 0]);
    assert_eq!(rig.live(SECOND / 10), ["send 3: batch 3 = 0+1"]);
    // The next duplicate may take twice as long.
    rig.event(hello_on_own_host(4));
    assert_eq!(rig.live(2 * OVERDUE - SECOND / 10), [""; 0]);
    assert_eq!(rig.live(SECOND / 10), ["send 4: batch 4 = 0+1"]);
    let waits = "the answer of host 1 (process 1) to 1 realizations (since 9 s); 3 others compute the \
                 same";
    assert_eq!(rig.waits_for(), waits);
    let expected =
        ["revoke 1: batch 1", "revoke 2: batch 2", "revoke 3: batch 3", "store job 1 evaluation 0"];
    rig.check(answer(4, 4, 0, 1), &expected);
}

#[test]
fn an_overdue_audit_goes_to_another_worker_but_not_to_whom_it_checks() {
    let mut rig = rig(1, 2, 1.0);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    rig.event(hello_on_own_host(3));
    assert_eq!(rig.live(OVERDUE - SECOND / 10), [""; 0]);
    assert_eq!(rig.live(SECOND / 10), ["send 3: batch 3 = 0+1"]);
    assert!(matches!(rig.batch(3).purpose, Purpose::Audit { .. }));
    rig.check(answer(3, 3, 0, 1), &["revoke 2: batch 2", "store job 1 evaluation 0"]);
    // The late answer is not compared, since its evaluation is complete.
    rig.check(answer(2, 2, 0, 1), &[]);
}

#[test]
fn an_overdue_audit_that_nobody_else_may_do_is_given_up() {
    let mut rig = rig(1, 2, 1.0);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    assert_eq!(rig.live(OVERDUE - SECOND / 10), [""; 0]);
    assert_eq!(rig.live(SECOND / 10), ["revoke 2: batch 2", "store job 1 evaluation 0"]);
}

#[test]
fn audits_do_not_wait_for_workers_that_do_not_answer_each_other() {
    let mut rig = rig(100, 3, 1.0);
    // Workers 2 and 3 hold as many batches as they may, and answer none; worker 1 answers all.
    for _ in 0..100 {
        let held = rig.state.workers[&WorkerId(1)].in_flight.clone();
        for id in held {
            let Indices { first, count } = rig.state.batches[&id].assignment.indices;
            rig.event(answer_in(1e-3, 1, id.0, first, count));
        }
        let Stage::Computing(_) = rig.state.jobs[&JobId(1)].stage else {
            assert!(rig.now < 10 * SECOND, "{:?}", rig.now);
            return;
        };
        rig.live(SECOND / 10);
    }
    panic!("audits are waited for: {:?}", rig.state.batches);
}

#[test]
fn an_audit_that_two_workers_do_not_answer_is_given_up() {
    let mut rig = rig(1, 2, 1.0);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 2 = 0+1"]);
    for worker in 3..=4 {
        rig.event(hello_on_own_host(worker));
    }
    assert_eq!(rig.live(OVERDUE), ["send 3: batch 3 = 0+1"]);
    assert_eq!(rig.live(2 * OVERDUE - SECOND / 10), [""; 0]);
    let expected = ["revoke 2: batch 2", "revoke 3: batch 3", "store job 1 evaluation 0"];
    assert_eq!(rig.live(SECOND / 10), expected);
}

#[test]
fn an_overdue_vote_goes_to_a_worker_that_has_not_voted() {
    let mut rig = rig(1, 3, 1.0);
    rig.check(wrong_answer(1, 1, 0, ONE_BIT), &["send 2: batch 2 = 0+1"]);
    rig.check(answer(2, 2, 0, 1), &["send 3: batch 3 = 0+1"]);
    // Workers 1 and 2 are idle, and have voted already.
    assert_eq!(rig.live(OVERDUE), [""; 0]);
    let waits = "a third worker, which decides between two whose answers differ (since 3 s); host 3 \
                 (process 3) is asked";
    assert_eq!(rig.waits_for(), waits);
    rig.check(hello_on_own_host(4), &["welcome 4, lease 4", "send 4: batch 4 = 0+1"]);
    assert_eq!(rig.batch(4).purpose, Purpose::TieBreak);
    let effects = rig.event(answer(4, 4, 0, 1));
    assert_eq!(effects[0], "revoke 3: batch 3");
    assert!(effects[1].starts_with("store ban 1: host 1 (process 1)"), "{effects:?}");
}

#[test]
fn a_vote_of_a_worker_that_does_not_answer_is_not_waited_for_without_end() {
    let mut rig = rig(1, 3, 1.0);
    rig.check(wrong_answer(1, 1, 0, ONE_BIT), &["send 2: batch 2 = 0+1"]);
    rig.check(answer(2, 2, 0, 1), &["send 3: batch 3 = 0+1"]);
    assert_eq!(rig.live(60 * SECOND - SECOND / 10), [""; 0]);
    let effects = rig.live(SECOND / 10);
    let failed = "store job 1 end: failed integrity error: realization 0 at the point";
    assert!(effects[0].starts_with(failed), "{effects:?}");
}

/// Returns a rig in which worker 2 holds realization 0 alone.
fn with_quarantined_realization() -> Rig {
    let mut rig = rig(1, 1, 0.0);
    rig.check(end_of_stream(1), &[]);
    rig.check(hello_on_own_host(2), &["welcome 2, lease 2", "send 2: batch 2 = 0+1"]);
    assert_eq!(rig.batch(2).purpose, Purpose::Exclusive);
    rig
}

#[test]
fn an_overdue_quarantined_realization_goes_alone_to_another_worker() {
    let mut rig = with_quarantined_realization();
    rig.check(hello_on_own_host(3), &["welcome 3, lease 3"]);
    assert_eq!(rig.live(OVERDUE - SECOND / 10), [""; 0]);
    assert_eq!(rig.live(SECOND / 10), ["send 3: batch 3 = 0+1"]);
    assert_eq!(rig.batch(3).purpose, Purpose::Exclusive);
    // A worker that holds it gets no other work.
    rig.event(submit(1, "", propagation(8)));
    rig.check(stored_event(2, RecordKey::Job), &["answer 1: job 2"]);
    let effects = rig.event(answer(3, 3, 0, 1));
    assert_eq!(effects[..2], ["revoke 2: batch 2", "store job 1 evaluation 0"]);
}

#[test]
fn a_busy_worker_is_not_refilled_until_it_may_have_an_overdue_quarantined_realization() {
    let mut rig = with_quarantined_realization();
    rig.event(submit(1, "", propagation(1000)));
    rig.event(stored_event(2, RecordKey::Job));
    let expected = ["welcome 3, lease 3", "send 3: batch 3 = 0+4", "send 3: batch 4 = 4+4"];
    rig.check(hello_on_own_host(3), &expected);
    assert_eq!(rig.live(OVERDUE - SECOND / 10), [""; 0]);
    assert_eq!(rig.live(SECOND / 10), [""; 0]);
    rig.check(answer(3, 3, 0, 4), &[]);
    rig.check(answer(3, 4, 4, 4), &["send 3: batch 5 = 0+1"]);
    assert_eq!(rig.batch(5).purpose, Purpose::Exclusive);
}

#[test]
fn a_crash_over_a_duplicate_of_a_quarantined_realization_counts() {
    let mut rig = with_quarantined_realization();
    rig.event(hello_on_own_host(3));
    rig.live(OVERDUE);
    rig.check(end_of_stream(3), &[]);
    let evaluation = rig.state.jobs[&JobId(1)].evaluation().unwrap();
    assert!(evaluation.crashes[&0].include_host("host 3"), "{:?}", evaluation.crashes);
    assert!(evaluation.quarantine.is_empty());
}

/// Returns a rig in which worker 2 holds realization 0 alone and is silent, and worker 3 is the only
/// other one, on a host that lost three workers in a row.
fn with_a_silent_worker_and_a_failing_host() -> Rig {
    let mut rig = with_quarantined_realization();
    for process in 100..103 {
        rig.state.count_loss(&WorkerName::new("host 3", process, 0), rig.now);
    }
    rig.check(hello_on_own_host(3), &["welcome 3, lease 3"]);
    rig
}

/// The time after which a silent worker loses its lease.
const LEASE: Duration = Duration::from_secs(10);

#[test]
fn an_overdue_quarantined_realization_goes_to_a_failing_host_after_the_time_of_a_lease() {
    let mut rig = with_a_silent_worker_and_a_failing_host();
    assert_eq!(rig.live(LEASE - SECOND / 10), [""; 0]);
    assert_eq!(rig.live(SECOND / 10), ["send 3: batch 3 = 0+1"]);
    rig.check(answer(3, 3, 0, 1), &["revoke 2: batch 2", "store job 1 evaluation 0"]);
}

#[test]
fn a_failing_host_does_not_make_a_realization_poison_while_a_silent_worker_holds_it() {
    let mut rig = with_a_silent_worker_and_a_failing_host();
    let begun = rig.now;
    let mut sent = Vec::new();
    for process in 4.. {
        let Some(effect) = rig.live(SECOND).pop() else {
            if rig.now < begun + 590 * SECOND {
                continue;
            }
            break;
        };
        assert!(effect.starts_with("send "), "{effect}");
        sent.push((rig.now - begun).as_secs());
        let lost = rig.batch(rig.state.next_batch - 1).worker;
        rig.event(end_of_stream(lost.0));
        rig.event(hello_on("host 3", process, process as u32, 1));
    }
    assert_eq!(sent, [10, 30, 70, 150, 310]);
    let effects = rig.live(11 * SECOND);
    assert!(effects[0].starts_with("close 2: this worker has not answered"), "{effects:?}");
    assert!(!effects.iter().any(|effect| effect.starts_with("store")), "{effects:?}");
}

#[test]
fn what_was_computed_ahead_and_not_answered_is_overdue_when_it_is_asked_for() {
    let mut rig = Rig::new();
    rig.state.config.audit_fraction = 0.0;
    rig.state.config.speculation = true;
    rig.accept(identification(1));
    for worker in 1..=2 {
        rig.event(hello_on_own_host(worker));
    }
    // Worker 2 holds a speculative batch, and does not answer; nor does worker 1, which gets a
    // duplicate in a moment.
    assert_eq!(rig.batch(2).purpose, Purpose::Speculative);
    assert_eq!(rig.event(answer(1, 1, 0, 1))[0], "store job 1 evaluation 0");
    rig.event(stored_event(1, RecordKey::Evaluation(0)));
    rig.live(SECOND / 10);
    rig.event(hello_on_own_host(3));
    let holders = |rig: &Rig| -> Vec<u64> {
        let others = &rig.batch(2).duplicates;
        others.iter().map(|id| rig.state.batches[id].worker.0).collect()
    };
    assert_eq!(holders(&rig), [1]);
    rig.live(OVERDUE - SECOND / 10);
    assert_eq!(holders(&rig), [1]);
    rig.live(SECOND / 10);
    assert_eq!(holders(&rig), [1, 3]);
}

#[test]
fn another_host_is_preferred_and_who_holds_one_gets_no_second() {
    let mut rig = rig(1, 1, 0.0);
    // Another process of the same host, and one of another host.
    rig.event(hello_on("host 1", 2, 2, 1));
    rig.event(hello_on("host 3", 3, 3, 1));
    assert_eq!(rig.live(SECOND / 10), ["send 2: batch 2 = 0+1"]);
    // The first process once more, and another one of its host.
    rig.event(hello_on("host 1", 4, 1, 1));
    rig.event(hello_on("host 1", 5, 5, 1));
    assert_eq!(rig.live(OVERDUE), ["send 3: batch 3 = 0+1"]);
    assert_eq!(rig.live(2 * OVERDUE), ["send 5: batch 4 = 0+1"]);
    assert_eq!(rig.live(10 * OVERDUE), [""; 0]);
}

#[test]
fn where_other_work_waits_a_job_has_one_copy_out_at_a_time() {
    let mut rig = rig(2, 1, 0.0);
    // Worker 1 holds both realizations of job 1, and does not answer.
    rig.event(submit(1, "", propagation(100_000)));
    rig.event(stored_event(2, RecordKey::Job));
    let expected = ["welcome 2, lease 2", "send 2: batch 3 = 0+4", "send 2: batch 4 = 4+4"];
    rig.check(hello_on_own_host(2), &expected);
    assert_eq!(rig.live(OVERDUE), [""; 0]);
    rig.check(answer_in(1e-3, 2, 3, 0, 4), &["send 2: batch 5 = 0+1"]);
    // The other batch waits for the result of this duplicate.
    let effects = rig.event(answer_in(1e-3, 2, 4, 4, 4));
    assert!(effects[0].starts_with("send 2: batch 6 = 8+"), "{effects:?}");
    let effects = rig.event(answer_in(1e-3, 2, 5, 0, 1));
    assert_eq!(effects[..2], ["revoke 1: batch 1", "send 2: batch 7 = 1+1"]);
}

#[test]
fn what_takes_long_everywhere_is_not_overdue() {
    let mut rig = rig(4, 2, 0.0);
    let all = |rig: &Rig| rig.state.batches.len();
    // Each holds two batches of one realization, and their duration is unknown.
    assert_eq!((rig.live(30 * SECOND), all(&rig)), (vec![], 4));
    rig.check(answer_in(30.0, 1, 1, 0, 1), &[]);
    // Now it is known.
    assert_eq!((rig.live(90 * SECOND - SECOND / 10), all(&rig)), (vec![], 3));
    // Four times the duration of one, and then only batches that could have been computed by then.
    assert_eq!(rig.live(SECOND / 10), ["send 1: batch 5 = 2+1"]);
    assert_eq!(rig.live(110 * SECOND), [""; 0]);
}

/// Returns a rig with a job of so many realizations of 1 ms: worker 1 never answers, all others
/// answer at once, until worker 1 is on probation.
fn with_silent_worker() -> Rig {
    let mut rig = rig(1, 0, 0.0);
    rig.event(request(1, Request::Cancel(JobId(1))));
    for worker in 1..=2 {
        rig.event(hello_on_own_host(worker));
    }
    for _ in 0..100 {
        if rig.state.probation.has(&name(1)) {
            assert!(rig.now >= OVERDUE && rig.now < 3 * OVERDUE, "{:?}", rig.now);
            return rig;
        }
        one_job(&mut rig);
    }
    panic!("worker 1 is not found out");
}

/// Runs a job of four realizations in which worker 1 does not answer; returns the maximum number of
/// batches that worker 1 held at a time, and of realizations in one of them.
fn one_job(rig: &mut Rig) -> (usize, u64) {
    let job = rig.accept(propagation(4));
    let mut most = (0, 0);
    for _ in 0..100 {
        let held = &rig.state.workers[&WorkerId(1)].in_flight;
        let sizes = held.iter().map(|id| rig.state.batches[id].assignment.indices.count);
        most = (held.len().max(most.0), sizes.max().unwrap_or(0).max(most.1));
        let of_others = rig.state.batches.iter().filter(|(_, it)| it.worker != WorkerId(1));
        let next = of_others.map(|(id, it)| (id.0, it.worker.0, it.assignment.indices)).next();
        if let Some((batch, worker, indices)) = next {
            let Indices { first, count } = indices;
            rig.event(answer_in(1e-3 * count as f64, worker, batch, first, count));
        } else if matches!(rig.state.jobs[&job].stage, Stage::Computing(_)) {
            rig.live(SECOND / 10);
        } else {
            break;
        }
    }
    assert!(!matches!(rig.state.jobs[&job].stage, Stage::Computing(_)), "{job} does not end");
    rig.event(stored_event(job.0, RecordKey::Evaluation(0)));
    rig.event(stored_event(job.0, RecordKey::End));
    most
}

#[test]
fn who_does_not_answer_gets_one_realization_at_a_time_and_less_and_less_often() {
    let mut rig = with_silent_worker();
    let begun = rig.now;
    let mut tried = Vec::new();
    while rig.now < begun + 100 * SECOND {
        let at = rig.now;
        match one_job(&mut rig) {
            (0, 0) => {}
            (1, 1) => tried.push((at - begun).as_secs()),
            other => panic!("{other:?}"),
        }
        rig.live(SECOND / 10);
    }
    assert_eq!(tried, [3, 9, 21, 45, 93]);
    let waiting = |rig: &mut Rig| {
        rig.accept(propagation(4));
        let job = JobId(rig.state.next_job - 1);
        crate::core::snapshot::job_snapshot(&rig.state, job, rig.now).unwrap().waiting_for
    };
    // While it gets no work, no job waits for it.
    assert_eq!(waiting(&mut rig), "");
    rig.live(60 * SECOND);
    let says = "host 1 (process 1) does not answer its batches";
    assert!(waiting(&mut rig).contains(says), "{}", waiting(&mut rig));
}

#[test]
fn one_answer_ends_a_probation() {
    let mut rig = with_silent_worker();
    rig.live(OVERDUE);
    rig.accept(propagation(4));
    let held = rig.state.workers[&WorkerId(1)].in_flight.clone();
    assert_eq!(held.len(), 1);
    let Indices { first, count } = rig.state.batches[&held[0]].assignment.indices;
    rig.event(answer(1, held[0].0, first, count));
    assert!(!rig.state.probation.has(&name(1)));
    rig.accept(propagation(1000));
    assert_eq!(rig.state.workers[&WorkerId(1)].in_flight.len(), 2);
}

#[test]
fn a_late_answer_does_not_end_a_probation() {
    let mut rig = with_silent_worker();
    let (late, about) = *rig.state.workers[&WorkerId(1)].settled.back().unwrap();
    let Indices { first, count } = about.indices;
    rig.event(answer(1, late.0, first, count));
    assert!(rig.state.probation.has(&name(1)));
}

#[test]
fn who_does_not_answer_checks_nothing() {
    let mut rig = with_silent_worker();
    rig.state.config.audit_fraction = 1.0;
    rig.live(OVERDUE);
    rig.accept(propagation(1));
    let id = rig.state.workers[&WorkerId(2)].in_flight[0];
    let effects = rig.event(answer(2, id.0, 0, 1));
    assert!(effects[0].starts_with("store job "), "{effects:?}");
}

#[test]
fn a_quarantined_realization_does_not_wait_for_who_does_not_answer() {
    let mut rig = with_silent_worker();
    rig.accept(propagation(1));
    rig.event(hello_on_own_host(3));
    rig.check(end_of_stream(2), &[&format!("send 3: batch {} = 0+1", rig.state.next_batch)]);
}

#[test]
fn who_is_on_probation_is_tried_with_what_is_overdue_where_nobody_else_is() {
    let mut rig = rig(1, 1, 0.0);
    rig.state.probation.miss(&name(2), rig.now, rig.now);
    rig.event(hello_on_own_host(2));
    assert_eq!(rig.live(OVERDUE - SECOND / 10), [""; 0]);
    assert_eq!(rig.live(SECOND / 10), ["send 2: batch 2 = 0+1"]);
    rig.check(answer(2, 2, 0, 1), &["revoke 1: batch 1", "store job 1 evaluation 0"]);
    assert!(!rig.state.probation.has(&name(2)));
}

#[test]
fn a_probation_is_remembered_for_the_worker_and_its_host() {
    let mut rig = with_silent_worker();
    rig.event(end_of_stream(1));
    for (worker, host, process, on_probation) in
        [(11, "host 1", 1, true), (12, "host 1", 12, true), (13, "host 13", 13, false)]
    {
        rig.event(hello_on(host, worker, process, 1));
        let name = &rig.state.workers[&WorkerId(worker)].name;
        assert_eq!(rig.state.probation.has(name), on_probation, "{name}");
    }
    // The other process of its host gets work at once.
    rig.accept(propagation(1000));
    let held = |worker| rig.state.workers[&WorkerId(worker)].in_flight.len();
    assert_eq!([11, 12, 13].map(held), [0, 1, 2]);
}

#[test]
fn without_another_worker_the_lease_ends_after_ten_minutes_and_the_next_begins_on_probation() {
    let mut rig = rig(8, 1, 0.0);
    rig.live(6 * SECOND);
    let waits = "the answer of host 1 (process 1) to 2 realizations (since 6 s); nothing of this job is \
                 answered yet";
    assert_eq!(rig.waits_for(), waits);
    let effects = rig.live(600 * SECOND);
    let closed = "close 1: this worker has not answered any of its batches for 600.1s";
    assert!(effects[0].starts_with(closed) && effects.len() == 1, "{effects:?}");
    rig.check(hello_on_own_host(1), &["welcome 1, lease 2", "send 1: batch 3 = 2+1"]);
    rig.event(hello_on_own_host(2));
    let held = |worker| rig.state.workers[&WorkerId(worker)].in_flight.len();
    assert_eq!([1, 2].map(held), [1, 2]);
}

#[test]
fn a_batch_that_is_passed_over_is_overdue_though_its_worker_answers_others() {
    let mut rig = rig(100_000, 2, 0.0);
    let passed_over = rig.state.workers[&WorkerId(1)].in_flight[0];
    for _ in 0..32 {
        for worker in 1..=2 {
            let held = &rig.state.workers[&WorkerId(worker)].in_flight;
            let id = *held.iter().find(|id| **id != passed_over).unwrap();
            let Indices { first, count } = rig.state.batches[&id].assignment.indices;
            rig.event(answer_in(0.05 * count as f64, worker, id.0, first, count));
        }
        rig.live(SECOND / 10);
    }
    assert_eq!(rig.batch(passed_over.0).duplicates.len(), 1);
}
