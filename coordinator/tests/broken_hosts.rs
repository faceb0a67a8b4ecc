//! Machines that compute wrongly, in virtual time: no result may contain a wrong value unless most hosts
//! agree on it, and no sound host may be banned. Where no honest outcome exists, the job fails and says which
//! hosts disagree.

#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test that cannot go on fails")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod clockwork;
#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;

use std::collections::BTreeSet;
use std::time::Duration;

use clockwork::{Clockwork, Fault, Machines};
use osteon_common::results::{JobFailure, Status};

const REALIZATION: Duration = Duration::from_millis(1);
const REALIZATIONS: u64 = 2747;

/// What became of some jobs.
#[derive(Debug, Default)]
struct Outcome {
    /// Jobs that converged with a wrong value, when they ended, and when those were computed again that a host
    /// contributed to which was banned later.
    wrong: u64,
    wrong_at_last: u64,
    /// Jobs that failed because the hosts contradict each other.
    refused: u64,
    banned: BTreeSet<String>,
    /// Realizations computed beyond those of the jobs, by their number.
    overhead: f64,
}

/// Runs so many jobs on `sound` machines of one process each and on others.
fn run(jobs: u64, sound: u32, broken: &[Machines]) -> Outcome {
    let machines = Machines { hosts: sound, processes: 1, fault: None, restart: None };
    let mut clockwork = Clockwork::of_machines(&[&[machines], broken].concat(), REALIZATION);
    let mut outcome = Outcome::default();
    let mut right = Vec::new();
    for seed in 1..=jobs {
        let job = fake::propagation(REALIZATIONS, seed);
        right.push(fake::plain_run(&job).digest);
        let found = clockwork.run_one(&job).result;
        let is_wrong = found.digest != right[right.len() - 1];
        match found.status {
            Status::Converged => outcome.wrong += u64::from(is_wrong),
            _ => {
                assert_eq!(found.failure, Some(JobFailure::IntegrityError), "{:?}", found.reason);
                let reason = found.reason.unwrap();
                assert!(reason.contains("0-") && reason.contains("1-"), "{reason}");
                outcome.refused += 1;
            }
        }
    }
    outcome.overhead = clockwork.computed as f64 / (jobs * REALIZATIONS) as f64 - 1.0;
    for (ended, right) in clockwork.recheck().into_iter().zip(right) {
        let is_wrong = ended.result.status == Status::Converged && ended.result.digest != right;
        outcome.wrong_at_last += u64::from(is_wrong);
    }
    outcome.banned = clockwork.banned;
    outcome
}

fn broken(hosts: u32, processes: u32, fault: Fault, restart_s: Option<u64>) -> Machines {
    let restart = restart_s.map(Duration::from_secs);
    Machines { hosts, processes, fault: Some(fault), restart }
}

const FAULTS: [Fault; 5] =
    [Fault::Always, Fault::After(200), Fault::After(1111), Fault::Every(5), Fault::Every(50)];

/// A broken host beside sound ones, with this many processes.
#[test]
fn a_broken_host_is_in_no_result() {
    for (sound, processes) in [(1, 2), (2, 2), (2, 4), (5, 2), (8, 8), (5, 1), (9, 1)] {
        for fault in FAULTS {
            // Restarts at other intervals have been tried with all faults, and differ in nothing.
            let others =
                [Some(2), Some(10)].map(|at| at.filter(|_| matches!(fault, Fault::After(200))));
            let restarts: BTreeSet<Option<u64>> =
                [None, Some(1)].into_iter().chain(others).collect();
            for restart_s in restarts {
                let machines = broken(1, processes, fault, restart_s);
                let outcome = run(20, sound, &[machines]);
                println!("{sound} + {processes}, {fault:?}, restart {restart_s:?}: {outcome:?}");
                // What shows at one index in fifty is found by audits of some thousand realizations. The jobs
                // that ended before are computed again, if the majority knows which host it was.
                let is_rare = matches!(fault, Fault::Every(50));
                assert!(is_rare || outcome.wrong == 0, "{machines:?}: {outcome:?}");
                let is_unknown = is_rare && outcome.banned.is_empty();
                assert!(outcome.wrong_at_last == 0 || is_unknown, "{machines:?}: {outcome:?}");
                let only = outcome.banned.iter().all(|host| host == "1-");
                assert!(only, "{machines:?}: {outcome:?}");
                // With two hosts nobody can tell which one is wrong, unless one contradicts itself.
                let changes = matches!(fault, Fault::After(_));
                let is_known = sound > 1 || changes || outcome.banned.is_empty();
                assert!(is_known, "{machines:?}: {outcome:?}");
            }
        }
    }
}

/// Hosts that are broken in the same way, or each in its own.
#[test]
fn broken_hosts_are_outvoted_as_long_as_they_are_the_minority() {
    for (sound, hosts) in [(3, 2), (5, 2), (9, 2), (5, 4)] {
        for fault in [Fault::Always, Fault::After(300), Fault::Every(5), Fault::EachItsOwn] {
            let outcome = run(20, sound, &[broken(hosts, 1, fault, None)]);
            println!("{sound} + {hosts} hosts, {fault:?}: {outcome:?}");
            assert_eq!((outcome.wrong, outcome.wrong_at_last), (0, 0), "{fault:?}: {outcome:?}");
            assert!(outcome.banned.iter().all(|host| host.starts_with('1')), "{outcome:?}");
        }
    }
    // As many as sound ones: no answer has a majority, and nobody is banned.
    for hosts in [1, 2, 3] {
        let outcome = run(3, hosts, &[broken(hosts, 1, Fault::Always, None)]);
        assert_eq!(
            (outcome.wrong, outcome.refused, outcome.banned.len()),
            (0, 3, 0),
            "{outcome:?}"
        );
    }
}

/// Machines that break within the last answer of their stay: what they answered before was right, and they are
/// started again before they answer anything else.
#[test]
fn a_host_that_breaks_within_the_last_answer_of_a_stay_is_in_no_result() {
    let mut outcomes = Outcome::default();
    for right in (20..100).step_by(2) {
        let stay = Some(Duration::from_millis(100));
        let fault = Some(Fault::After(right));
        let machines = Machines { hosts: 1, processes: 2, fault, restart: stay };
        let outcome = run(3, 5, &[machines]);
        assert!(outcome.banned.iter().all(|host| host == "1-"), "{machines:?}: {outcome:?}");
        outcomes.wrong += outcome.wrong;
        outcomes.wrong_at_last += outcome.wrong_at_last;
    }
    assert_eq!((outcomes.wrong, outcomes.wrong_at_last), (0, 0));
}

/// What proofs and audits cost where nothing is wrong.
#[test]
fn checks_cost_a_hundredth() {
    for (hosts, jobs, most) in [(2, 20, 0.011), (9, 20, 0.011), (9, 1, 0.06), (30, 20, 0.012)] {
        let outcome = run(jobs, hosts, &[]);
        println!("{hosts} hosts, {jobs} jobs: {outcome:?}");
        assert_eq!((outcome.wrong, outcome.refused, outcome.banned.len()), (0, 0, 0));
        assert!(outcome.overhead < most, "{outcome:?}");
    }
}
