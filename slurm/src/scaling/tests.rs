use super::*;

/// A controller of workers with four threads each.
struct World {
    scaling: Scaling,
    policy: ScalingPolicy,
    now: u64,
    wanted_threads: u64,
    queue: Vec<QueuedWorker>,
}

impl World {
    fn new(min: u32, max: u32, backlog: u32) -> Self {
        let idle_timeout = Duration::from_secs(100);
        let policy = ScalingPolicy { min, max, backlog, threads_per_worker: 4, idle_timeout };
        let scaling = Scaling::default();
        Self { scaling, policy, now: 0, wanted_threads: 0, queue: Vec::new() }
    }

    fn add(&mut self, id: &str, stage: QueueStage) {
        self.queue.push(QueuedWorker {
            id: id.to_owned(),
            lasting: id.ends_with('m'),
            stage,
            running_for: Duration::ZERO,
            why: format!("{stage:?}"),
        });
    }

    fn set(&mut self, id: &str, stage: QueueStage, running_for_s: u64) {
        let worker = self.queue.iter_mut().find(|worker| worker.id == id).unwrap();
        worker.stage = stage;
        worker.why = format!("{stage:?}");
        worker.running_for = Duration::from_secs(running_for_s);
    }

    /// Observes after so many seconds, with this need of threads.
    fn after(&mut self, seconds: u64, wanted_threads: u64) -> Decision {
        self.now += seconds;
        self.wanted_threads = wanted_threads;
        let seen = QueueObservation {
            now: Duration::from_secs(self.now),
            wanted_threads,
            queue: self.queue.clone(),
        };
        self.scaling.decide(&self.policy, &seen)
    }

    fn expect(&mut self, seconds: u64, wanted_threads: u64, expected: &[ScalingAction]) -> String {
        let decision = self.after(seconds, wanted_threads);
        assert_eq!(decision.actions, expected, "{}", decision.reason);
        decision.reason
    }
}

fn submit(count: u32) -> ScalingAction {
    ScalingAction::Submit { count, lasting: false }
}

fn lasting(count: u32) -> ScalingAction {
    ScalingAction::Submit { count, lasting: true }
}

fn cancel(ids: &[&str]) -> ScalingAction {
    ScalingAction::Cancel { ids: ids.iter().map(|&id| id.to_owned()).collect() }
}

#[test]
fn threads_are_wanted_where_each_has_enough_to_do() {
    for (realizations, per_thread, expected) in [
        (&[][..], 16, 0),
        (&[1], 16, 1),
        (&[16], 16, 1),
        (&[17, 2747], 16, 2 + 172),
        (&[u64::MAX, u64::MAX], 1, u64::MAX),
        (&[5], 0, 5),
    ] {
        assert_eq!(wanted_threads(realizations.iter().copied(), per_thread), expected);
    }
}

#[test]
fn as_many_are_submitted_as_work_wants_within_the_limits() {
    for ((min, max, backlog), wanted_threads, expected) in [
        ((0, 10, 10), 0, &[][..]),
        ((0, 10, 10), 1, &[submit(1)]),
        ((0, 10, 10), 9, &[submit(3)]),
        ((0, 10, 10), u64::MAX, &[submit(10)]),
        ((0, 10, 4), 40, &[submit(4)]),
        ((2, 10, 10), 0, &[lasting(2)]),
        ((2, 10, 10), 12, &[lasting(2), submit(1)]),
        ((2, 10, 1), 12, &[lasting(1)]),
        ((3, 3, 10), 400, &[lasting(3)]),
        ((0, 0, 10), 400, &[]),
    ] {
        World::new(min, max, backlog).expect(0, wanted_threads, expected);
    }
}

#[test]
fn workers_that_wait_or_run_are_counted() {
    let mut world = World::new(1, 10, 2);
    world.add("1m", QueueStage::Running);
    world.add("2", QueueStage::Running);
    world.add("3", QueueStage::Waiting);
    // Those that ended count no more.
    world.add("4", QueueStage::Ended);
    world.expect(0, 12, &[]);
    world.expect(1, 16, &[submit(1)]);
    let reason = world.expect(1, 40, &[submit(1)]);
    assert_eq!(
        reason,
        "jobs can use 40 threads: 10 workers are wanted (1 to 10), 2 run, 1 wait in Slurm's queue \
         (Waiting)"
    );
    world.add("5", QueueStage::Waiting);
    let reason = world.expect(1, 40, &[]);
    assert!(reason.ends_with("; no more may wait (--backlog)"), "{reason}");
    world.set("1m", QueueStage::Ended, 0);
    world.set("5", QueueStage::Running, 0);
    world.expect(1, 0, &[lasting(1)]);
}

#[test]
fn those_that_wait_for_nothing_are_cancelled_after_the_idle_timeout() {
    let mut world = World::new(0, 10, 10);
    for id in ["1", "2", "3"] {
        world.add(id, QueueStage::Waiting);
    }
    world.set("1", QueueStage::Running, 0);
    world.expect(0, 12, &[]);
    world.expect(1, 0, &[]);
    // New work begins the time again.
    world.expect(99, 12, &[]);
    world.expect(1, 4, &[]);
    world.expect(99, 4, &[]);
    world.expect(1, 4, &[cancel(&["2", "3"])]);
    // What this program cancels is no failure.
    world.set("2", QueueStage::Cancelled, 0);
    world.set("3", QueueStage::Cancelled, 0);
    world.expect(1, 12, &[submit(2)]);
    // The running one ends by itself.
    world.expect(1000, 0, &[]);
}

#[test]
fn one_of_several_that_wait_stays_if_it_has_work() {
    let mut world = World::new(0, 10, 10);
    for id in ["1", "2", "3m"] {
        world.add(id, QueueStage::Waiting);
    }
    world.expect(0, 4, &[]);
    world.expect(100, 4, &[cancel(&["2"])]);
}

#[test]
fn failed_allocations_are_tried_again_more_and_more_rarely() {
    let mut world = World::new(0, 10, 10);
    world.expect(0, 16, &[submit(4)]);
    for id in ["1", "2", "3", "4"] {
        world.add(id, QueueStage::Failed);
    }
    // All four failed for one reason, which is one failure.
    let reason = world.expect(5, 16, &[]);
    let expected = "; 1 allocations failed, the last one (job 4: Failed): trying again in 30 s";
    assert!(reason.ends_with(expected), "{reason}");
    world.expect(29, 16, &[]);
    // One shows whether it works again.
    world.expect(1, 16, &[submit(1)]);
    world.add("5", QueueStage::Running);
    world.expect(1, 16, &[submit(1)]);
    world.set("5", QueueStage::Failed, 0);
    let reason = world.expect(1, 16, &[]);
    assert!(
        reason
            .ends_with("2 allocations failed, the last one (job 5: Failed): trying again in 60 s"),
        "{reason}"
    );
    world.expect(59, 16, &[]);
    world.expect(1, 16, &[submit(1)]);
    // A worker that has run for a while was sound.
    world.add("6", QueueStage::Running);
    world.set("6", QueueStage::Running, 60);
    world.expect(1, 16, &[submit(3)]);
    // And so was one that ended as intended.
    world.set("6", QueueStage::Failed, 61);
    world.expect(1, 16, &[]);
    world.add("7", QueueStage::Ended);
    world.expect(1, 16, &[submit(4)]);
}

#[test]
fn the_wait_after_failures_has_a_bound() {
    let mut world = World::new(0, 1, 1);
    for _ in 0..100 {
        world.scaling.refused(Duration::from_secs(world.now), "sbatch failed: no such account");
    }
    let reason = world.expect(0, 1, &[]);
    assert!(reason.contains("(sbatch failed: no such account)"), "{reason}");
    world.expect(3599, 1, &[]);
    world.expect(1, 1, &[submit(1)]);
}

#[test]
fn workers_that_others_cancel_are_not_forced_upon_them() {
    let mut world = World::new(0, 10, 10);
    world.add("1", QueueStage::Waiting);
    world.expect(0, 4, &[]);
    world.set("1", QueueStage::Cancelled, 0);
    let reason = world.expect(1, 4, &[]);
    assert!(reason.contains("(job 1: Cancelled)"), "{reason}");
}

#[test]
fn what_ended_before_the_start_does_not_matter() {
    let mut world = World::new(0, 10, 10);
    world.add("1", QueueStage::Failed);
    world.expect(0, 4, &[submit(1)]);
    world.expect(1, 8, &[submit(2)]);
}

#[test]
fn nothing_is_kept_of_workers_that_slurm_has_forgotten() {
    let mut world = World::new(0, 10, 10);
    for turn in 0..50 {
        world.queue.clear();
        world.add(&format!("{turn}"), QueueStage::Ended);
        world.after(1, 4);
    }
    assert_eq!(world.scaling.settled.len(), 1);
}
