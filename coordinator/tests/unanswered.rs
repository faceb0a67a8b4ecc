//! Delay caused by workers that send heartbeats and do not answer, in virtual time. Every result
//! must equal that of a plain loop, to the bit.

#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test that cannot go on fails")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod clockwork;
#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;

use std::time::Duration;

use clockwork::{Clockwork, Times};
use osteon_common::job::JobSpecification;
use osteon_coordinator::config::Config;

const REALIZATION: Duration = Duration::from_millis(1);
/// Time after which a missing answer is overdue, where other workers can give it.
const OVERDUE: Duration = Duration::from_secs(3);
/// Additional time until the other workers have given it.
const SOON: Duration = Duration::from_millis(500);

/// Duration and other measurements of a job.
#[derive(Debug)]
struct Run {
    time: Duration,
    ignored: u64,
}

/// Runs a job over `sound` workers of two threads; before them attach so many faulty ones that do
/// not answer one in `n` of their batches.
fn run(
    sound: usize,
    (faulty, n): (usize, u64),
    audit_fraction: f64,
    job: &JobSpecification,
) -> Run {
    let config = Config { audit_fraction, ..Config::default() };
    let mut clockwork =
        Clockwork::with(&vec![2; faulty + sound], Times::Equal, REALIZATION, config);
    for worker in 1..=faulty as u64 {
        clockwork.swallow(worker, n);
    }
    let ended = clockwork.run(std::slice::from_ref(job));
    // Compared as text: an unknown standard error is NaN, which is not equal to itself.
    assert_eq!(format!("{:?}", ended[0].result), format!("{:?}", fake::plain_run(job)));
    Run { time: ended[0].at, ignored: clockwork.ignored }
}

fn jobs() -> [JobSpecification; 3] {
    [
        fake::identification(4, 150, 3),
        fake::identification(400, 60, 3),
        fake::propagation(20_000, 5),
    ]
}

#[test]
fn workers_that_never_answer_cost_seconds() {
    for job in jobs() {
        for sound in [1, 2, 4] {
            for audit_fraction in [0.0, 0.01, 1.0] {
                let undisturbed = run(sound, (0, 1), audit_fraction, &job);
                for faulty in [1, 4] {
                    let disturbed = run(sound, (faulty, 1), audit_fraction, &job);
                    println!(
                        "{faulty} of {sound} more, audits {audit_fraction}: {undisturbed:?}, \
                         {disturbed:?}"
                    );
                    assert!(disturbed.ignored >= 2 * faulty as u64, "{disturbed:?}");
                    // Each faulty worker misses three, and then one now and then.
                    let delay = disturbed.time.saturating_sub(undisturbed.time);
                    assert!(delay < 8 * (OVERDUE + SOON), "{delay:?}");
                }
            }
        }
    }
}

/// As where a network file system hangs on most nodes of a cluster.
#[test]
fn many_workers_that_never_answer_do_not_keep_a_sound_one_from_its_work() {
    // 1.5 s on one worker of two threads.
    let job = fake::propagation(3000, 5);
    let undisturbed = run(1, (0, 1), 0.01, &job);
    for faulty in [1, 5, 50, 100] {
        let disturbed = run(1, (faulty, 1), 0.01, &job);
        println!("{faulty} beside one: {undisturbed:?}, {disturbed:?}");
        assert!(disturbed.time < 4 * undisturbed.time, "{faulty}: {disturbed:?}");
    }
    let long = fake::propagation(60_000, 5);
    let undisturbed = run(1, (0, 1), 0.01, &long);
    for faulty in [1, 50] {
        let disturbed = run(1, (faulty, 1), 0.01, &long);
        println!("{faulty} beside one: {undisturbed:?}, {disturbed:?}");
        let delay = disturbed.time.saturating_sub(undisturbed.time);
        assert!(delay < Duration::from_secs(10), "{faulty}: {delay:?}");
    }
}

#[test]
fn each_batch_that_is_not_answered_costs_seconds() {
    for job in jobs() {
        for sound in [1, 2, 4] {
            for audit_fraction in [0.0, 0.3] {
                let undisturbed = run(sound, (0, 1), audit_fraction, &job);
                let disturbed = run(sound, (sound, 7), audit_fraction, &job);
                println!("{sound} sound, audits {audit_fraction}: {undisturbed:?}, {disturbed:?}");
                assert!(disturbed.ignored > 0, "{disturbed:?}");
                let delay = disturbed.time.saturating_sub(undisturbed.time);
                let bound = (OVERDUE + SOON) * disturbed.ignored as u32;
                assert!(delay < bound, "{delay:?} and not {bound:?}");
            }
        }
    }
}

/// Returns the number of batches that a job of realizations of this length takes on four workers,
/// and its time.
fn slow(realization: Duration, job: &JobSpecification) -> (u64, Duration) {
    let mut clockwork = Clockwork::with(&[2; 4], Times::Spread, realization, Config::default());
    let ended = clockwork.run(std::slice::from_ref(job));
    assert_eq!(format!("{:?}", ended[0].result), format!("{:?}", fake::plain_run(job)));
    (clockwork.sent, ended[0].at)
}

#[test]
fn realizations_that_are_slow_everywhere_are_not_computed_many_times() {
    for job in [fake::identification(40, 10, 3), fake::propagation(400, 5), fake::propagation(3, 5)]
    {
        // Where nothing is ever overdue, only idle workers get duplicates.
        let (usual, _) = slow(Duration::from_millis(100), &job);
        for seconds in [1, 5, 30] {
            let (sent, time) = slow(Duration::from_secs(seconds), &job);
            println!("{seconds} s: {sent} batches in {time:?}, usually {usual}");
            assert!(sent as f64 <= 1.5 * usual as f64 + 8.0, "{sent} and not {usual}");
        }
    }
}
