//! Batches of lost workers.

use osteon_common::case::Case;
use osteon_common::realization::Ensemble;
use osteon_files::case_file;
use osteon_files::document::Format;

use super::*;
use crate::core::batch::Assignment;

#[test]
fn the_batches_of_a_lost_worker_are_retried_in_halves() {
    let mut rig = Rig::with(64, &[2]);
    rig.check(end_of_stream(1), &[]);
    // The worker held 0+8 and 8+8; every half becomes a batch of its own, whoever gets it.
    rig.check(
        hello(2, 2),
        &["welcome 2, lease 2", "send 2: batch 3 = 8+4", "send 2: batch 4 = 12+4"],
    );
    rig.check(answer(2, 3, 8, 4), &["send 2: batch 5 = 0+4"]);
    rig.check(answer(2, 4, 12, 4), &["send 2: batch 6 = 4+4"]);
    rig.check(answer(2, 5, 0, 4), &["send 2: batch 7 = 16+8"]);
}

/// Returns a rig with job 1, of one realization, and job 2, of so many that there is always work.
fn deadly() -> Rig {
    let mut rig = Rig::new();
    rig.state.config.audit_fraction = 0.0;
    rig.accept(propagation(1));
    rig.accept(propagation(1_000_000));
    rig
}

/// Answers the batches that a worker holds, and their successors, a few times; never those of job
/// 1.
fn work(rig: &mut Rig, worker: u64) -> Vec<String> {
    let mut effects = Vec::new();
    for _ in 0..4 {
        for (batch, Assignment { indices, .. }) in batches_held(rig, worker, JobId(2)) {
            effects.extend(rig.event(answer(worker, batch, indices.first, indices.count)));
        }
    }
    effects
}

/// Returns the batches that a worker holds of a job.
fn batches_held(rig: &Rig, worker: u64, job: JobId) -> Vec<(u64, Assignment)> {
    let of_worker = rig.state.batches.iter().filter(|(_, it)| it.worker == WorkerId(worker));
    let batches = of_worker.map(|(id, batch)| (id.0, batch.assignment));
    batches.filter(|(_, assignment)| assignment.job == job).collect()
}

/// Attaches a new process on a host, which answers other work, and is lost as soon as it holds
/// realization 0 of job 1 and nothing else.
fn die(rig: &mut Rig, host: &str, worker: u64) {
    rig.event(hello_on(host, worker, worker as u32, 1));
    work(rig, worker);
    assert_eq!(batches_held(rig, worker, JobId(1)).len(), 1, "{worker}");
    assert_eq!(rig.event(end_of_stream(worker)), [""; 0]);
}

/// Advances the time with heartbeats from every worker, and returns the effects on job 1.
fn wait(rig: &mut Rig, time: Duration) -> Vec<String> {
    let workers: Vec<u64> = rig.state.workers.keys().map(|worker| worker.0).collect();
    for worker in workers {
        rig.heartbeat(worker);
    }
    let mut effects = rig.pass(time);
    effects.retain(|effect| effect.starts_with("store job 1 "));
    effects
}

const EXPIRY: Duration = Duration::from_secs(10);

/// Loses workers on these hosts over realization 0, the first together with other batches.
fn check_deaths(hosts: &[&str], expected: Option<&str>) {
    let mut rig = deadly();
    for (worker, host) in (1..).zip(hosts) {
        die(&mut rig, host, worker);
    }
    // Until then they may come back.
    assert_eq!(wait(&mut rig, EXPIRY - Duration::from_millis(1)), [""; 0]);
    let effects = wait(&mut rig, Duration::from_millis(1));
    let reason = effects.first().and_then(|it| it.strip_prefix("store job 1 end: failed "));
    let start = reason.map(|reason| reason.split_once(';').unwrap().0);
    assert_eq!(start, expected, "{hosts:?}");
}

#[test]
fn a_realization_that_was_alone_on_three_lost_workers_fails_its_job() {
    check_deaths(&["a", "b", "c"], None);
    let expected = "3 workers (b, c, d) were lost while they computed only realization 0";
    check_deaths(&["a", "b", "c", "d"], Some(expected));
    // With one host only, three processes that had answered something are enough.
    let expected = "3 workers (a) were lost while they computed only realization 0";
    check_deaths(&["a"; 4], Some(expected));
}

/// Worker 5 computes the realization that others were lost over.
fn worker_5_finishes_the_evaluation(rig: &mut Rig) {
    work(rig, 5);
    let batch = batches_held(rig, 5, JobId(1))[0].0;
    let effects = rig.event(answer(5, batch, 0, 1));
    assert_eq!(effects[0], "store job 1 evaluation 0", "{effects:?}");
}

#[test]
fn while_another_host_is_there_it_is_tried() {
    let mut rig = deadly();
    for worker in 1..=4 {
        die(&mut rig, "a", worker);
    }
    rig.event(hello_on("b", 5, 5, 1));
    assert_eq!(wait(&mut rig, EXPIRY), [""; 0]);
    worker_5_finishes_the_evaluation(&mut rig);
}

#[test]
fn who_comes_back_in_time_did_not_die() {
    let mut rig = deadly();
    for (worker, host) in [(1, "a"), (2, "b"), (3, "c"), (4, "d")] {
        die(&mut rig, host, worker);
    }
    assert_eq!(wait(&mut rig, EXPIRY - Duration::from_millis(1)), [""; 0]);
    // The process of worker 3 comes back.
    rig.event(hello_on("c", 5, 3, 1));
    for _ in 0..5 {
        assert_eq!(wait(&mut rig, Duration::from_secs(5)), [""; 0]);
    }
    // The answer of a returned worker counts like any other.
    worker_5_finishes_the_evaluation(&mut rig);
}

#[test]
fn pauses_of_the_coordinator_are_no_deaths() {
    let mut rig = deadly();
    for (worker, host) in [(1, "a"), (2, "b"), (3, "c"), (4, "d")] {
        die(&mut rig, host, worker);
        // Its stream broke because the coordinator did not run; it has come back by now.
        rig.now += 2 * EXPIRY;
        assert_eq!(rig.event(Event::Tick), ["publish 1", "publish 2"]);
        rig.event(hello_on(host, 10 + worker, worker as u32, 1));
        assert_eq!(rig.state.workers.len(), 1);
        rig.event(Event::WorkerDrains { worker: WorkerId(10 + worker) });
        rig.event(end_of_stream(10 + worker));
    }
    for _ in 0..5 {
        assert_eq!(wait(&mut rig, EXPIRY), [""; 0]);
    }
}

#[test]
fn a_host_whose_workers_come_back_is_in_order() {
    let mut rig = deadly();
    for worker in 1..9 {
        // The same process attaches again each time; the other worker is a new process each time.
        rig.event(hello_on("a", worker, 1, 1));
        rig.event(hello_on("b", 10 + worker, worker as u32, 1));
        rig.event(end_of_stream(worker));
        rig.event(end_of_stream(10 + worker));
        assert!(!rig.state.is_failing("a"), "{worker}");
        assert_eq!(rig.state.is_failing("b"), worker >= 3, "{worker}");
    }
}

/// Attaches a sound worker on `host`; on `bad` one process after another starts, answers something
/// if it `works`, and is lost.
fn check_bad_node(host: &str, bad: &str, works: bool) {
    let mut rig = deadly();
    rig.event(hello_on(bad, 1, 1, 1));
    rig.event(hello_on(host, 2, 2, 1));
    rig.event(end_of_stream(1));
    for worker in 3..60 {
        rig.event(hello_on(bad, worker, worker as u32, 1));
        if works {
            work(&mut rig, worker);
        }
        assert_eq!(wait(&mut rig, Duration::from_millis(300)), [""; 0], "{worker}");
        rig.event(end_of_stream(worker));
        assert_eq!(wait(&mut rig, Duration::from_millis(300)), [""; 0], "{worker}");
        if worker % 5 == 0 {
            work(&mut rig, 2);
        }
        if let Some((batch, _)) = batches_held(&rig, 2, JobId(1)).first() {
            let effects = rig.event(answer(2, *batch, 0, 1));
            assert_eq!(effects[0], "store job 1 evaluation 0", "{effects:?}");
            return;
        }
    }
    panic!("the sound worker never got it");
}

#[test]
fn one_bad_node_fails_no_job_while_a_sound_worker_is_there() {
    for (host, bad) in [("sound", "bad"), ("node", "node")] {
        for works in [false, true] {
            check_bad_node(host, bad, works);
        }
    }
}

#[test]
fn a_bad_node_alone_is_given_up_in_the_end() {
    let mut rig = Rig::with(1, &[]);
    let mut process = 0;
    let reason = loop {
        process += 1;
        let worker = u64::from(process);
        rig.event(hello_on("bad", worker, process, 1));
        let effects = [wait(&mut rig, Duration::from_secs(1)), rig.event(end_of_stream(worker))];
        if process == 5 {
            let waits = crate::core::snapshot::job_snapshot(&rig.state, JobId(1), rig.now)
                .unwrap()
                .waiting_for;
            let expected = "a reliable worker for 1 realizations over which others were lost; \
                            the last 3 workers of bad were lost with their batches";
            assert_eq!(waits, expected);
        }
        let ended = effects.concat().into_iter().find(|it| it.starts_with("store job 1 end"));
        if let Some(reason) = ended {
            break reason;
        }
    };
    assert!(reason.contains("10 workers (bad) were lost while they computed only"), "{reason}");
    // Ten losses in a row take longer than a few seconds.
    assert!(rig.now > 5 * EXPIRY, "{:?}", rig.now);
    // The case file is complete, and has the realization to the bit.
    let (_, text) = reason.split_once('\n').unwrap();
    let Case { setup, bone } = case_file::parse(text, Format::Toml).unwrap();
    let specification = propagation(1);
    let ensemble = Ensemble::new(&specification.start(), specification.monte_carlo.seed).unwrap();
    assert_eq!((setup, bone), (specification.setup, ensemble.bone(0).unwrap().into()));
}

#[test]
fn a_worker_that_announced_its_end_is_no_sign_against_its_realizations() {
    let mut rig = Rig::with(1, &[]);
    for worker in 1..10 {
        rig.event(hello(worker, 1));
        rig.check(Event::WorkerDrains { worker: WorkerId(worker) }, &[]);
        rig.check(end_of_stream(worker), &[]);
    }
    rig.event(hello(10, 1));
    rig.check(answer(10, 10, 0, 1), &["store job 1 evaluation 0"]);
}

#[test]
fn a_quarantined_realization_is_not_starved_by_the_queue_of_another_job() {
    let mut rig = Rig::new();
    rig.accept(propagation(1));
    rig.accept(propagation(1000));
    for worker in 1..4 {
        rig.event(hello(worker, 1));
    }
    // Worker 1 is lost, and with it realization 0 of job 1 and the first four of job 2. Worker 2
    // gets no further batch, worker 3 does.
    rig.check(end_of_stream(1), &[]);
    rig.check(answer(2, 3, 4, 4), &[]);
    rig.check(answer(3, 5, 12, 4), &["send 3: batch 7 = 0+2"]);
    rig.check(answer(2, 4, 8, 4), &["send 2: batch 8 = 0+1"]);
    rig.check(
        answer(2, 8, 0, 1),
        &["store job 1 evaluation 0", "send 2: batch 9 = 2+2", "send 2: batch 10 = 20+8"],
    );
}

#[test]
fn a_quarantined_realization_is_never_duplicated() {
    let mut rig = Rig::with(1, &[1]);
    rig.event(end_of_stream(1));
    rig.check(hello(2, 1), &["welcome 2, lease 2", "send 2: batch 2 = 0+1"]);
    rig.check(hello(3, 1), &["welcome 3, lease 3"]);
    rig.check_after(Duration::from_secs(1), &[]);
}
