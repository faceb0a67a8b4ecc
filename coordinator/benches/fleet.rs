//! Cost of the coordinator's core by the number of workers: `cargo bench -p osteon-coordinator --bench
//! fleet [propagations|groups]`
//!
//! Jobs run on a simulated fleet, whose time is not that of a clock: a worker answers a batch when its
//! slots would have computed it. The core reacts to one event after another, and while it does, which
//! is measured, the others wait. So the table has what dispatch costs, without streams and store.

#![expect(clippy::print_stdout, reason = "the table")]
#![expect(clippy::unwrap_used, reason = "a benchmark that cannot go on fails")]

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, VecDeque};
use std::time::{Duration, Instant};

use osteon_common::job::JobSpecification;
use osteon_coordinator::config::{AUDIT_FRACTION, Config};
use osteon_coordinator::core::effect::{Effect, Record};
use osteon_coordinator::core::event::{Event, Hello};
use osteon_coordinator::core::ids::{ReplyId, WorkerId};
use osteon_coordinator::core::reactor::react;
use osteon_coordinator::core::state::State;

#[path = "../tests/fake/mod.rs"]
#[expect(dead_code, reason = "each benchmark uses a part of it")]
mod fake;
#[path = "../tests/fake/grouped.rs"]
mod grouped;

use grouped::{OF_GROUP, grouped};

/// Slots of each worker.
const SLOTS: u32 = 16;
/// Time between two ticks of the coordinator.
const TICK: Duration = Duration::from_millis(100);
/// Time between two heartbeats of a worker.
const HEARTBEAT: Duration = Duration::from_secs(2);
/// Time of a message on its way.
const LATENCY: Duration = Duration::from_micros(100);
/// Time until a record of groups is durable; those of propagations are so at once.
const SYNC: Duration = Duration::from_millis(4);
/// Longest simulated time of a job.
const LIMIT: Duration = Duration::from_secs(3600);

/// One row of the table.
struct Row {
    workers: u32,
    job: Job,
    /// Time of one realization.
    each: Duration,
    /// Groups are computed at the same time.
    ahead: bool,
}

/// A job to measure.
#[derive(Debug, Clone, Copy)]
enum Job {
    /// A propagation of so many realizations.
    Propagation(u64),
    /// An identification of so many groups.
    Groups(usize),
}

/// An occurrence of the simulation.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Next {
    Tick,
    Heartbeat(u64),
    /// A worker answers the batch that it holds longest.
    Answer(u64),
    /// The record that has waited longest is durable.
    Stored,
    /// A step of the completion of an evaluation beside the core is done.
    Completed,
}

/// A fleet with its coordinator.
struct Fleet {
    state: State,
    each: Duration,
    /// Time until a record is durable.
    sync: Duration,
    now: Duration,
    queue: BinaryHeap<Reverse<(Duration, u64, Next)>>,
    numbers: u64,
    /// Batches of each worker in the order they were sent, each with the time at which it ends.
    held: BTreeMap<u64, VecDeque<(Effect, Duration)>>,
    completed: VecDeque<Event>,
    /// Events that report records on their way to the store.
    storing: VecDeque<Event>,
    /// Number of evaluations that were stored, with their realizations.
    stored: (u64, u64),
    batches: u64,
    core: Duration,
    longest: Duration,
}

fn main() {
    let full = std::env::args().any(|argument| argument == "--bench");
    let fleets: &[u32] = if full { &[10, 30, 100, 300, 1000, 3000] } else { &[3, 30] };
    let chosen = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let wants = |table: &str| chosen.as_ref().is_none_or(|chosen| chosen == table);
    if wants("propagations") {
        propagations(full, fleets);
    }
    if wants("groups") {
        groups(full, fleets);
    }
}

/// Prints what single evaluations cost.
fn propagations(full: bool, fleets: &[u32]) {
    println!(
        "| workers | realizations | each | ideal | job | of ideal | batches | core per batch | per realization | longest event |"
    );
    println!("|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    let jobs: &[(u64, u64)] = if full {
        &[(1_000_000, 1000), (1_000_000, 20_000), (2747, 1000)]
    } else {
        &[(2747, 1000)]
    };
    for &(realizations, each) in jobs {
        for &workers in fleets {
            let job = Job::Propagation(realizations);
            let each = Duration::from_micros(each);
            println!("{}", measured(&Row { workers, job, each, ahead: true }));
        }
    }
}

/// Prints what the searches for many groups cost, at the same time and one after the other.
fn groups(full: bool, fleets: &[u32]) {
    println!(
        "| workers | groups | at once | evaluations | each | ideal | job | of ideal | batches | core per batch | per realization | longest event |"
    );
    println!("|--:|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    let groups = if full { 1000 } else { 20 };
    for &workers in fleets {
        for ahead in [true, false] {
            let each = Duration::from_millis(1);
            println!("{}", measured(&Row { workers, job: Job::Groups(groups), each, ahead }));
        }
    }
}

fn measured(row: &Row) -> String {
    let mut fleet = Fleet::new(row);
    let warm_up = match row.job {
        Job::Propagation(realizations) => realizations.min(100_000),
        Job::Groups(_) => OF_GROUP,
    };
    // The first job measures the rates of the workers, as most jobs of a search find them.
    let _ = fleet.run(&fake::propagation(warm_up, 1));
    fleet.core = Duration::ZERO;
    (fleet.batches, fleet.longest, fleet.stored) = (0, Duration::ZERO, (0, 0));
    let took = match row.job {
        Job::Propagation(realizations) => fleet.run(&fake::propagation(realizations, 2)),
        Job::Groups(groups) => fleet.run(&grouped(groups)),
    };
    let (evaluations, realizations) = fleet.stored;
    let ideal =
        row.each.mul_f64(realizations as f64 / f64::from(row.workers * SLOTS)).max(row.each);
    let micros = |time: Duration| time.as_secs_f64() * 1e6;
    let job = match row.job {
        Job::Propagation(realizations) => format!("{realizations}"),
        Job::Groups(groups) => {
            let at_once = if row.ahead { "yes" } else { "no" };
            format!("{groups} | {at_once} | {evaluations}")
        }
    };
    format!(
        "| {} | {job} | {:?} | {:.4} s | {:.4} s | {:.3} | {} | {:.1} µs | {:.3} µs | {:.2} ms |",
        row.workers,
        row.each,
        ideal.as_secs_f64(),
        took.as_secs_f64(),
        ideal.as_secs_f64() / took.as_secs_f64(),
        fleet.batches,
        micros(fleet.core) / fleet.batches as f64,
        micros(fleet.core) / realizations as f64,
        fleet.longest.as_secs_f64() * 1e3,
    )
}

impl Fleet {
    fn new(row: &Row) -> Self {
        let (audit_fraction, sync) = match row.job {
            Job::Propagation(_) => (0.0, Duration::ZERO),
            Job::Groups(_) => (AUDIT_FRACTION, SYNC),
        };
        let config = Config { audit_fraction, ahead: row.ahead, ..Config::default() };
        let mut fleet = Self {
            state: State::new(config, Duration::ZERO),
            each: row.each,
            sync,
            now: Duration::ZERO,
            queue: BinaryHeap::new(),
            numbers: 0,
            held: BTreeMap::new(),
            completed: VecDeque::new(),
            storing: VecDeque::new(),
            stored: (0, 0),
            batches: 0,
            core: Duration::ZERO,
            longest: Duration::ZERO,
        };
        for process in 1..=row.workers {
            let hello = Hello { slots: SLOTS, ..fake::hello(process) };
            fleet.react(Event::Hello { worker: WorkerId(process.into()), hello });
            fleet.schedule(HEARTBEAT, Next::Heartbeat(process.into()));
        }
        fleet.schedule(TICK, Next::Tick);
        fleet
    }

    /// Runs a job to its end; returns the simulated time.
    fn run(&mut self, job: &JobSpecification) -> Duration {
        let begun = self.now;
        let request = fake::submission(job, "");
        self.react(Event::Requested { reply_id: ReplyId(1), request });
        while !self.state.is_idle() {
            let Reverse((at, _, next)) = self.queue.pop().unwrap();
            // An event that comes while the core is busy waits.
            self.now = self.now.max(at);
            assert!(self.now - begun < LIMIT, "the job does not end");
            match next {
                Next::Tick => {
                    self.schedule(TICK, Next::Tick);
                    self.react(Event::Tick);
                }
                Next::Heartbeat(worker) => {
                    self.schedule(HEARTBEAT, Next::Heartbeat(worker));
                    self.react(Event::Heartbeat { worker: WorkerId(worker) });
                }
                Next::Answer(worker) => self.answer(worker),
                Next::Completed => {
                    let completed = self.completed.pop_front().unwrap();
                    self.react(completed);
                }
                Next::Stored => {
                    let stored = self.storing.pop_front().unwrap();
                    self.react(stored);
                }
            }
        }
        self.now - begun
    }

    fn schedule(&mut self, after: Duration, next: Next) {
        self.numbers += 1;
        self.queue.push(Reverse((self.now + after, self.numbers, next)));
    }

    fn answer(&mut self, worker: u64) {
        // A revoked batch is not answered.
        let Some((Effect::Send { batch, work, worker, .. }, _)) =
            self.held.get_mut(&worker).and_then(VecDeque::pop_front)
        else {
            return;
        };
        let elapsed_s = self.time_of(work.count.into()).as_secs_f64();
        self.react(Event::Answered { worker, batch, solved: fake::solved(&work), elapsed_s });
    }

    /// Time that a worker takes for this many realizations.
    fn time_of(&self, count: u64) -> Duration {
        self.each.mul_f64((count as f64 / f64::from(SLOTS)).max(1.0))
    }

    fn react(&mut self, event: Event) {
        let begun = Instant::now();
        let effects = react(&mut self.state, event, self.now);
        let took = begun.elapsed();
        self.core += took;
        self.longest = self.longest.max(took);
        self.now += took;
        for effect in effects {
            match effect {
                Effect::Send { worker, ref work, .. } => {
                    self.batches += 1;
                    let takes = self.time_of(work.count.into());
                    let held = self.held.entry(worker.0).or_default();
                    let free = held.back().map_or(Duration::ZERO, |(_, until)| *until);
                    let until = free.max(self.now + LATENCY) + takes;
                    held.push_back((effect, until));
                    self.schedule(until + LATENCY - self.now, Next::Answer(worker.0));
                }
                Effect::Complete(completion) => {
                    // It runs on another thread.
                    let begun = Instant::now();
                    let mut gathered = None;
                    let completed = completion.run(|outcomes| {
                        gathered = Some((begun.elapsed(), outcomes));
                    });
                    let (took, outcomes) = gathered.unwrap();
                    self.completed.push_back(Event::Gathered(outcomes));
                    self.schedule(took, Next::Completed);
                    self.completed.push_back(Event::Completed(completed));
                    self.schedule(begun.elapsed(), Next::Completed);
                }
                Effect::Store(record) => {
                    let (job, key) = record.key();
                    self.storing.push_back(Event::Stored { job, key });
                    self.schedule(self.sync, Next::Stored);
                    let records = match &record {
                        Record::Evaluation { record, .. } => std::slice::from_ref(record),
                        Record::Evaluations(records) => records,
                        _ => &[],
                    };
                    self.stored.0 += records.len() as u64;
                    self.stored.1 += records.iter().map(|it| it.outcomes.len() as u64).sum::<u64>();
                }
                _ => {}
            }
        }
    }
}
