//! Coordinator, workers and store of each schedule in one thread under a simulated clock. One seed decides order,
//! delays, losses, stalls, answers that are late, missing, repeated, malformed or contradictory, a
//! node whose workers are lost over everything they get, refusals, damage and long outages of the
//! store, cancellations, speculative evaluations, pauses, clean stops and restarts of the
//! coordinator. Whatever happens, the output of every job must be what a plain loop computes; if
//! the job was cancelled, or failed because of a contradiction, what the loop has found by then.
//!
//! `OSTEON_SIMULATION_SEED=N` runs one seed, to examine a failure.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;
mod world;

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::{panic, thread};

use world::World;

/// Number of schedules in one test run.
const SCHEDULES: u64 = 3000;

#[test]
fn every_schedule_leaves_what_a_plain_loop_computes() {
    let one = std::env::var("OSTEON_SIMULATION_SEED").ok();
    let seeds = match one.and_then(|text| text.parse().ok()) {
        Some(seed) => seed..seed + 1,
        None => 0..SCHEDULES,
    };
    let seen = run_all(seeds.clone());
    // A simulation in which nothing goes wrong would test nothing.
    if seeds.end - seeds.start == SCHEDULES {
        let world::Counts { lost, revoked, closed, late, restarts, refusals, checked, .. } = seen;
        let world::Counts { ahead, dropped, ignored, .. } = seen;
        for (name, count) in [
            ("workers lost", lost),
            ("batches revoked", revoked),
            ("streams closed", closed),
            ("late answers", late),
            ("restarts", restarts),
            ("refusals of the store", refusals),
            ("batches computed again to compare", checked),
            ("batches that are never answered", ignored),
            ("points computed ahead of their search", ahead),
            ("points computed ahead that no search asked for", dropped),
        ] {
            assert!(count > SCHEDULES / 4, "{name}: {count}");
        }
        let world::Counts { stops, cancelled, outages, banned, pruned, lies, .. } = seen;
        let world::Counts { bad_deaths, pauses, damaged, prepared, .. } = seen;
        for (name, count) in [
            ("clean stops", stops),
            ("jobs cancelled", cancelled),
            ("outages of the store", outages),
            ("wrong answers", lies),
            ("workers banned", banned),
            ("jobs forgotten", pruned),
            ("deaths on a bad node", bad_deaths),
            ("pauses of the coordinator", pauses),
            ("damaged evaluations", damaged),
            ("evaluations complete before their search asked for them", prepared),
        ] {
            assert!(count > SCHEDULES / 20, "{name}: {count}");
        }
        let world::Counts { exposed, replaced, confirmed, remembered, repaired, .. } = seen;
        let rechecked = seen.rechecked;
        for (name, count) in [
            ("jobs failed over contradicting answers", exposed),
            ("stored evaluations replaced by others", replaced),
            ("stored evaluations computed again and the same", confirmed),
            ("restarts with banned workers", remembered),
            ("jobs that ended right although somebody lied", repaired),
            ("ended jobs computed again after a ban", rechecked),
        ] {
            assert!(count > SCHEDULES / 200, "{name}: {count}");
        }
        println!("{seen:?}");
    }
}

/// Runs a schedule for each seed, on every processor: no schedule knows of another.
fn run_all(seeds: Range<u64>) -> world::Counts {
    let (next, failed) = (AtomicU64::new(seeds.start), AtomicBool::new(false));
    let run_some = || {
        let mut seen = world::Counts::default();
        while !failed.load(Ordering::Relaxed) {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds.end {
                break;
            }
            match panic::catch_unwind(|| World::run(seed)) {
                Ok(counts) => seen.add(&counts),
                Err(cause) => {
                    failed.store(true, Ordering::Relaxed);
                    eprintln!("failed with OSTEON_SIMULATION_SEED={seed}");
                    panic::resume_unwind(cause);
                }
            }
        }
        seen
    };
    let mut seen = world::Counts::default();
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        let running: Vec<_> = (0..threads).map(|_| scope.spawn(run_some)).collect();
        for thread in running {
            match thread.join() {
                Ok(counts) => seen.add(&counts),
                Err(cause) => panic::resume_unwind(cause),
            }
        }
    });
    seen
}
