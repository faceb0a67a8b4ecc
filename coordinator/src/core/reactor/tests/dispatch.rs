//! Order of service and batch sizes.

use super::*;
use crate::core::reactor::dispatch::overdue::begin_probation;
use crate::core::reactor::dispatch::sizing::{batch_size, fleet_rate, measure_fleet};

/// Checks the batch size for worker 1, with workers of `threads` measured at `rates` realizations
/// per second, when `queued` realizations are left.
fn check_size(threads: &[u32], rates: &[Option<f64>], queued: u64, expected: u64) {
    check_size_of(threads, rates, (queued, 0), expected);
}

/// As [`check_size`], with the realizations that are left in other evaluations of the job.
fn check_size_of(threads: &[u32], rates: &[Option<f64>], queued: (u64, u64), expected: u64) {
    let mut rig = Rig::with(1, threads);
    for (worker, rate) in rig.state.workers.values_mut().zip(rates) {
        worker.rates.clear();
        worker.rates.extend(rate.map(|rate| (JobId(1), rate)));
    }
    let fleet = measure_fleet(&rig.state, JobId(1));
    let size = batch_size(&rig.state, &rig.state.workers[&WorkerId(1)], JobId(1), fleet, queued);
    assert_eq!(size, expected, "{threads:?} {rates:?} {queued:?}");
}

#[test]
fn batches_take_the_target_time_and_leave_work_for_the_others() {
    // Unknown rate: four realizations per thread.
    check_size(&[2], &[None], 10_000, 8);
    check_size(&[64], &[None], 10_000, 256);
    // Where a share is small, one per thread: they take no longer than fewer.
    check_size(&[16; 1000], &[None; 1000], 2747, 16);
    // Measured rate: 200 ms.
    check_size(&[2], &[Some(5000.0)], 10_000, 1000);
    check_size(&[1], &[Some(0.1)], 10_000, 1);
    // Slow realizations: one for each thread, so that no thread is idle.
    check_size(&[8], &[Some(8.0 / 0.3)], 10_000, 8);
    check_size(&[2], &[Some(0.1)], 10_000, 2);
    check_size(&[8, 8], &[Some(1.0), Some(1.0)], 6, 3);
    // Many workers with little work: some of them get what keeps them busy longer than the batch costs.
    let many = |queued, expected| check_size(&[16; 100], &[Some(16_000.0); 100], queued, expected);
    many(2747, 67);
    many(100, 13);
    many(1, 1);
    // With more work, a hundredth of a second and more; with much, a quarter of the share.
    many(100_000, 320);
    many(1_000_000, 2500);
    // Where other evaluations of the job wait, too, batches of one evaluation that take a fiftieth of a
    // second, of equal size.
    let among_others = |queued, expected| {
        let fleet = [Some(16_000.0); 100];
        check_size_of(&[16; 100], &fleet, (queued, 1_000_000), expected);
    };
    among_others(1024, 256);
    among_others(2747, 306);
    among_others(64, 64);
    check_size_of(&[2], &[Some(4000.0)], (2747, 2747), 79);
    // Never more than a message may hold.
    check_size(&[2], &[Some(1e12)], 10_000_000, 65_536);
    // A quarter of the share of the remaining realizations; shares are proportional to the rates.
    check_size(&[2], &[Some(5000.0)], 400, 100);
    check_size(&[2, 2], &[Some(5000.0), Some(5000.0)], 400, 50);
    check_size(&[2, 2], &[Some(7500.0), Some(2500.0)], 400, 75);
    check_size(&[2, 2], &[Some(5000.0), None], 400, 50);
    check_size(&[2, 6], &[Some(5000.0), None], 400, 25);
    // Near the end one for each thread, as long as that is within the share.
    check_size(&[8, 8], &[Some(5000.0), Some(5000.0)], 20, 8);
    check_size(&[8, 8], &[Some(5000.0), Some(5000.0)], 10, 5);
    check_size(&[8, 8], &[Some(5000.0), Some(5000.0)], 1, 1);
}

/// If there are enough workers for one batch each, all batches of an evaluation are equal: smaller ones at
/// its end would only be more. Few workers get smaller ones, so that they finish together.
#[test]
fn batches_of_an_evaluation_are_equal_if_all_are_computed_at_once() {
    for (workers, queued, expected) in
        [(100, 2747, 67), (100, 1000, 67), (100, 30, 30), (10, 2747, 69), (10, 1000, 40)]
    {
        let mut rig = Rig::with(2747, &vec![16; workers]);
        for worker in rig.state.workers.values_mut() {
            worker.rates.insert(JobId(1), 16_000.0);
        }
        let fleet = measure_fleet(&rig.state, JobId(1));
        let worker = &rig.state.workers[&WorkerId(1)];
        let size = batch_size(&rig.state, worker, JobId(1), fleet, (queued, 0));
        assert_eq!(size, expected, "{queued} for {workers}");
    }
}

#[test]
fn each_worker_holds_two_batches_and_no_more() {
    let mut rig = Rig::with(1000, &[]);
    rig.check(
        hello(1, 2),
        &["welcome 1, lease 1", "send 1: batch 1 = 0+8", "send 1: batch 2 = 8+8"],
    );
    rig.check(
        hello(2, 1),
        &["welcome 2, lease 2", "send 2: batch 3 = 16+4", "send 2: batch 4 = 20+4"],
    );
    // 8 in 0.04 s are 200 per second, 40 in 200 ms.
    rig.check(answer_in(0.04, 1, 1, 0, 8), &["send 1: batch 5 = 24+40"]);
}

/// The first answer of a job tells the rate of all, although nothing else has changed.
#[test]
fn the_rate_of_the_fleet_is_measured_when_the_first_worker_answers() {
    let mut rig = Rig::with(100_000, &[2, 2]);
    let unknown = fleet_rate(&mut rig.state, JobId(1));
    assert_eq!((unknown.total, unknown.per_slot), (4.0, 1.0));
    assert_eq!(fleet_rate(&mut rig.state, JobId(1)).total, 4.0);
    // 8 realizations in 40 ms, by two threads.
    rig.event(answer_in(0.04, 1, 1, 0, 8));
    let known = fleet_rate(&mut rig.state, JobId(1));
    assert_eq!((known.total, known.per_slot), (400.0, 100.0));
}

/// While sixteen or more workers are attached, each holds one batch until its speed at the job is known. The
/// rig checks after every event that the order of service is right, so also when the sixteenth comes or goes.
#[test]
fn each_of_many_workers_is_tried_with_one_batch() {
    let mut rig = Rig::with(100_000, &[1; 15]);
    let held =
        |rig: &Rig, worker| rig.state.workers.get(&WorkerId(worker)).unwrap().in_flight.len();
    assert_eq!(held(&rig, 15), 2);
    rig.event(hello(16, 1));
    assert_eq!(held(&rig, 16), 1);
    rig.event(answer_in(0.004, 1, 1, 0, 4));
    assert_eq!(held(&rig, 1), 2);
    rig.event(hello(17, 1));
    assert_eq!(held(&rig, 17), 1);
    rig.event(end_of_stream(2));
    rig.event(end_of_stream(3));
    // Fifteen remain, and what the others held is sent again.
    assert_eq!([16, 17].map(|worker| held(&rig, worker)), [2; 2]);
}

/// If there are enough workers for one batch of an evaluation each, none gets a second one that an idle worker
/// would soon compute.
#[test]
fn a_worker_gets_no_second_batch_if_there_are_enough_workers() {
    let mut rig = Rig::new();
    for worker in 1..=320 {
        rig.event(hello(worker, 2));
    }
    rig.event(submit(1, "", propagation(20_000)));
    rig.event(stored_event(1, RecordKey::Job));
    let mut sent = Vec::new();
    for batch in 1..=8 {
        sent.extend(rig.event(answer_in(0.004, batch, batch, 8 * (batch - 1), 8)));
    }
    // Only the eight that have answered.
    assert_eq!(sent.len(), 8, "{sent:?}");
    let in_flight = rig.state.workers.values().map(|worker| worker.in_flight.len());
    assert_eq!(in_flight.collect::<Vec<_>>(), [1; 320]);
    let queued = rig.state.jobs[&JobId(1)].evaluation().unwrap().queued();
    assert!(queued > 10_000, "{queued}");
    let sent = rig.event(answer_in(0.004, 9, 9, 64, 8));
    assert!(sent.len() == 1 && sent[0].starts_with("send 9: "), "{sent:?}");
}

/// Workers on probation get their realization to prove themselves although the others wait for each other.
#[test]
fn a_worker_on_probation_is_tried_although_there_are_enough_workers() {
    let mut rig = Rig::new();
    rig.state.config.audit_fraction = 0.0;
    for worker in 1..=320 {
        rig.event(hello_of(worker, u32::try_from(worker).unwrap(), 2));
    }
    let name = rig.state.workers[&WorkerId(320)].name.clone();
    let now = rig.now;
    begin_probation(&mut rig.state, &name, now, now);
    // It rests before it is tried.
    rig.now += Duration::from_secs(4);
    rig.event(submit(1, "", propagation(20_000)));
    rig.event(stored_event(1, RecordKey::Job));
    for batch in 1..=8 {
        rig.event(answer_in(0.004, batch, batch, 8 * (batch - 1), 8));
    }
    let held = |worker| rig.state.workers[&WorkerId(worker)].in_flight.len();
    let others: Vec<usize> = (1..320).map(held).collect();
    assert_eq!(others, [1; 319]);
    assert_eq!(held(320), 1);
}

#[test]
fn slow_realizations_keep_every_thread_of_a_worker_busy() {
    let mut rig = Rig::with(1000, &[8]);
    // 32 on 8 threads, 0.3 s each.
    rig.now += Duration::from_millis(1200);
    rig.check(answer_in(1.2, 1, 1, 0, 32), &["send 1: batch 3 = 64+8"]);
    rig.check(answer_in(1.2, 1, 2, 32, 32), &["send 1: batch 4 = 72+8"]);
    rig.now += Duration::from_millis(300);
    rig.check(answer_in(0.3, 1, 3, 64, 8), &["send 1: batch 5 = 80+8"]);
}

#[test]
fn an_unbelievable_time_is_replaced_by_the_time_waited() {
    for elapsed_s in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300] {
        let mut rig = Rig::with(1000, &[2]);
        rig.now += Duration::from_millis(80);
        rig.check(answer_in(elapsed_s, 1, 1, 0, 8), &["send 1: batch 3 = 16+20"]);
    }
}

#[test]
fn jobs_are_served_in_turn() {
    let mut rig = Rig::new();
    for _ in 0..2 {
        rig.accept(propagation(100));
    }
    rig.event(hello(1, 1));
    let jobs = |rig: &Rig| -> Vec<u64> {
        rig.state.batches.values().map(|batch| batch.assignment.job.0).collect()
    };
    assert_eq!(jobs(&rig), [1, 2]);
    rig.check(answer(1, 1, 0, 4), &["send 1: batch 3 = 4+8"]);
    assert_eq!(jobs(&rig), [2, 1]);
    rig.check(answer(1, 2, 0, 4), &["send 1: batch 4 = 4+8"]);
    assert_eq!(jobs(&rig), [1, 2]);
}

/// Worker 1 holds both halves of a small job, worker 2 is idle.
fn with_idle_worker() -> Rig {
    let mut rig = Rig::with(2, &[1]);
    rig.check(hello(2, 1), &["welcome 2, lease 2"]);
    rig.check_after(Duration::from_millis(99), &[]);
    rig
}

#[test]
fn an_idle_worker_gets_a_copy_of_the_slowest_batch() {
    let mut rig = with_idle_worker();
    rig.check_after(Duration::from_millis(1), &["send 2: batch 3 = 0+1"]);
    rig.check_after(Duration::from_millis(1), &[]);
    // The duplicate is faster: the original is revoked, and the next slowest batch duplicated.
    rig.check(answer(2, 3, 0, 1), &["revoke 1: batch 1", "send 2: batch 4 = 1+1"]);
    // The original answers all the same: the answers agree, and nothing happens.
    rig.check(answer(1, 1, 0, 1), &[]);
    // The other original is faster than its duplicate.
    rig.check(answer(1, 2, 1, 1), &["revoke 2: batch 4", "store job 1 evaluation 0"]);
    rig.check(answer(2, 4, 1, 1), &[]);
}

#[test]
fn a_sign_of_life_hands_out_nothing() {
    let mut rig = with_idle_worker();
    rig.now += Duration::from_millis(1);
    // With thousands of workers heartbeats are frequent; a duplicate is due, but waits for the next
    // tick.
    for worker in [1, 2] {
        rig.heartbeat(worker);
    }
    rig.check_after(Duration::ZERO, &["send 2: batch 3 = 0+1"]);
}

#[test]
fn a_copy_outlives_its_original_and_the_other_way_round() {
    let mut rig = with_idle_worker();
    rig.check_after(Duration::from_millis(1), &["send 2: batch 3 = 0+1"]);
    // Only the batch without a duplicate is queued again; it was alone in its batch, so it waits
    // for a worker that holds nothing else.
    rig.check(end_of_stream(1), &[]);
    rig.check(answer(2, 3, 0, 1), &["send 2: batch 4 = 1+1"]);
    rig.check(answer(2, 4, 1, 1), &["store job 1 evaluation 0"]);

    let mut rig = with_idle_worker();
    rig.check_after(Duration::from_millis(1), &["send 2: batch 3 = 0+1"]);
    rig.check(end_of_stream(2), &[]);
    rig.check(answer(1, 1, 0, 1), &[]);
    rig.check(answer(1, 2, 1, 1), &["store job 1 evaluation 0"]);
}
