//! Cost of the coordinator's core by the number of workers: `cargo bench -p osteon-coordinator --bench
//! fleet`
//!
//! Jobs run on a simulated fleet, whose time is not that of a clock: a worker answers a batch when its
//! slots would have computed it. The core reacts to one event after another, and while it does, which
//! is measured, the others wait. So the table has what dispatch costs, without streams and store.

#![expect(clippy::print_stdout, reason = "the table")]
#![expect(clippy::unwrap_used, reason = "a benchmark that cannot go on fails")]

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, VecDeque};
use std::time::{Duration, Instant};

use osteon_coordinator::config::Config;
use osteon_coordinator::core::effect::Effect;
use osteon_coordinator::core::event::{Event, Hello};
use osteon_coordinator::core::ids::WorkerId;
use osteon_coordinator::core::reactor::react;
use osteon_coordinator::core::state::State;

#[path = "../tests/fake/mod.rs"]
#[expect(dead_code, reason = "each benchmark uses a part of it")]
mod fake;

/// Slots of each worker.
const SLOTS: u32 = 16;
/// Time between two ticks of the coordinator.
const TICK: Duration = Duration::from_millis(100);
/// Time between two heartbeats of a worker.
const HEARTBEAT: Duration = Duration::from_secs(2);
/// Time of a message on its way.
const LATENCY: Duration = Duration::from_micros(100);
/// Longest simulated time of a job.
const LIMIT: Duration = Duration::from_secs(3600);

/// One row of the table.
struct Row {
    workers: u32,
    realizations: u64,
    /// Time of one realization.
    each: Duration,
}

/// An occurrence of the simulation.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Next {
    Tick,
    Heartbeat(u64),
    /// A worker answers the batch that it holds longest.
    Answer(u64),
}

/// A fleet with its coordinator.
struct Fleet {
    state: State,
    each: Duration,
    now: Duration,
    queue: BinaryHeap<Reverse<(Duration, u64, Next)>>,
    numbers: u64,
    /// Batches of each worker in the order they were sent, each with the time at which it ends.
    held: BTreeMap<u64, VecDeque<(Effect, Duration)>>,
    batches: u64,
    core: Duration,
    longest: Duration,
}

fn main() {
    let full = std::env::args().any(|argument| argument == "--bench");
    println!(
        "| workers | realizations | each | ideal | job | of ideal | batches | core per batch | per realization | longest event |"
    );
    println!("|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    let fleets: &[u32] = if full { &[10, 30, 100, 300, 1000, 3000] } else { &[3, 30] };
    let jobs: &[(u64, u64)] = if full {
        &[(1_000_000, 1000), (1_000_000, 20_000), (2747, 1000)]
    } else {
        &[(2747, 1000)]
    };
    for &(realizations, each) in jobs {
        for &workers in fleets {
            let row = Row { workers, realizations, each: Duration::from_micros(each) };
            println!("{}", measured(&row));
        }
    }
}

fn measured(row: &Row) -> String {
    let mut fleet = Fleet::new(row);
    // The first job measures the rates of the workers, as most jobs of a search find them.
    let _ = fleet.run(row.realizations.min(100_000), 1);
    fleet.core = Duration::ZERO;
    (fleet.batches, fleet.longest) = (0, Duration::ZERO);
    let took = fleet.run(row.realizations, 2);
    let ideal =
        row.each.mul_f64(row.realizations as f64 / f64::from(row.workers * SLOTS)).max(row.each);
    let micros = |time: Duration| time.as_secs_f64() * 1e6;
    format!(
        "| {} | {} | {:?} | {:.4} s | {:.4} s | {:.3} | {} | {:.1} µs | {:.3} µs | {:.2} ms |",
        row.workers,
        row.realizations,
        row.each,
        ideal.as_secs_f64(),
        took.as_secs_f64(),
        ideal.as_secs_f64() / took.as_secs_f64(),
        fleet.batches,
        micros(fleet.core) / fleet.batches as f64,
        micros(fleet.core) / row.realizations as f64,
        fleet.longest.as_secs_f64() * 1e3,
    )
}

impl Fleet {
    fn new(row: &Row) -> Self {
        let config = Config { audit_fraction: 0.0, ..Config::default() };
        let mut fleet = Self {
            state: State::new(config, Duration::ZERO),
            each: row.each,
            now: Duration::ZERO,
            queue: BinaryHeap::new(),
            numbers: 0,
            held: BTreeMap::new(),
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
    fn run(&mut self, realizations: u64, seed: u64) -> Duration {
        let begun = self.now;
        let request = fake::submission(&fake::propagation(realizations, seed), "");
        self.react(Event::Requested {
            reply_id: osteon_coordinator::core::ids::ReplyId(seed),
            request,
        });
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
                Effect::Store(record) => {
                    let (job, key) = record.key();
                    self.react(Event::Stored { job, key });
                }
                _ => {}
            }
        }
    }
}
