//! Gain and cost of speculation, in virtual time.

#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test that cannot go on fails")]
#![expect(clippy::print_stdout, reason = "what is measured stands in docs/searches.md")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod clockwork;
#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;

use std::slice;
use std::time::Duration;

use clockwork::{Clockwork, Times};
use osteon_common::job::JobSpecification;
use osteon_coordinator::config::Config;

/// Returns the times at which some jobs ended, on a coordinator with or without speculation; every
/// result must equal that of a plain loop, to the bit.
fn run(
    speculation: bool,
    threads: &[u32],
    times: Times,
    jobs: &[JobSpecification],
) -> Vec<Duration> {
    let config = Config { speculation, ..Config::default() };
    let ended = Clockwork::with_config(threads, times, config).run(jobs);
    for (job, ended) in jobs.iter().zip(&ended) {
        // Compared as text: an unknown standard error is NaN, which is not equal to itself.
        assert_eq!(format!("{:?}", ended.result), format!("{:?}", fake::plain_run(job)));
    }
    ended.into_iter().map(|ended| ended.at).collect()
}

/// Returns the ratio of a search's time without speculation to that with it, over workers of these
/// numbers of threads.
fn gain(threads: &[u32], times: Times, realizations: u64, evaluations: u64) -> f64 {
    let job = fake::identification(realizations, evaluations, 3);
    let [without, with] = [false, true].map(|speculation| {
        run(speculation, threads, times, slice::from_ref(&job))[0].as_secs_f64()
    });
    println!("{threads:?}, {times:?}, {realizations} realizations: {without:.3} s, {with:.3} s");
    without / with
}

#[test]
fn a_search_that_leaves_three_quarters_of_the_threads_idle_takes_much_less_time() {
    for times in [Times::Equal, Times::Spread] {
        for (threads, realizations) in [(&[1; 8][..], 2), (&[2; 4], 2), (&[8; 4], 8), (&[1; 16], 4)]
        {
            let gain = gain(threads, times, realizations, 150);
            assert!(gain >= 1.4, "{gain:.3} with {threads:?} and {times:?}");
        }
    }
}

#[test]
fn a_search_that_keeps_all_threads_busy_takes_no_more_time() {
    for times in [Times::Equal, Times::Spread] {
        for (threads, realizations, evaluations) in [
            (&[1; 2][..], 2, 150),
            (&[1; 4], 4, 150),
            (&[1; 4], 12, 150),
            (&[1; 4], 40, 150),
            (&[4; 4], 40, 150),
            (&[1; 4], 400, 30),
            (&[8, 1, 1], 100, 60),
        ] {
            let gain = gain(threads, times, realizations, evaluations);
            assert!(gain >= 1.0 / 1.05, "{gain:.3} with {threads:?} and {times:?}");
        }
    }
}

#[test]
fn jobs_of_others_take_no_more_time() {
    let small = fake::identification(2, 150, 3);
    let large = fake::propagation(3000, 5);
    let another = fake::identification(2, 150, 7);
    for times in [Times::Equal, Times::Spread] {
        for (threads, others) in [(&[1; 4][..], &large), (&[4; 2], &large), (&[1; 4], &another)] {
            let [without, with] = [false, true].map(|speculation| {
                run(speculation, threads, times, &[small.clone(), others.clone()])
            });
            println!("{threads:?}, {times:?}: {without:?}, {with:?}");
            for (without, with) in without.iter().zip(with) {
                assert!(with <= without.mul_f64(1.05), "{with:?} and not {without:?}");
            }
        }
    }
}
