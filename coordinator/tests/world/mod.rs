//! The simulated environment of a coordinator.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::time::Duration;

use osteon_common::parameters::Point;
use osteon_coordinator::config::Config;
use osteon_coordinator::core::completion::{Completed, Completion};
use osteon_coordinator::core::effect::{Effect, Record};
use osteon_coordinator::core::event::{Event, Hello, Request};
use osteon_coordinator::core::ids::{BatchId, JobId, ReplyId, WorkerId};
use osteon_coordinator::core::policy::BATCHES_IN_FLIGHT_MAX;
use osteon_coordinator::core::reactor::{Restored, react};
use osteon_coordinator::core::sanity::sanity_check;
use osteon_coordinator::core::state::State;
use osteon_coordinator::store::memory::MemoryStore;
use osteon_coordinator::store::{EndRecord, Store};
use osteon_proto::batch::Work;

use self::clients::Client;
use crate::fake;

mod check;
mod clients;
mod counts;
mod disk;
mod faults;
mod liars;
mod workers;

pub(crate) use counts::Counts;

const TICK: Duration = Duration::from_millis(100);
/// Maximum simulated time of a schedule.
const HOUR: Duration = Duration::from_secs(3600);
/// Maximum simulated time of a schedule without a bad node: the longest outage of the store, and a
/// few minutes. It is less than the time after which a worker that does not answer loses its lease.
const MINUTES: Duration = Duration::from_secs(300);
/// Upper limit for the workers lost over a quarantined realization: a third loss rightly fails the
/// job.
const LOST_ALONE_MAX: u32 = 2;
/// Same for those on the bad node, of ten losses of any kind.
const LOST_BAD_MAX: u32 = 6;

/// A scheduled event.
enum Occurrence {
    Tick,
    /// A client submits its job, and repeats that until the job is accepted.
    Submit(usize),
    /// A worker attaches.
    Arrive,
    /// A process attaches again.
    Return(u32),
    /// The coordinator pauses.
    Pause,
    /// A worker no longer waits for the coordinator.
    GiveUp(WorkerId),
    /// A worker attaches that is lost over everything it gets.
    ArriveBad,
    /// A process attaches that sends heartbeats, and never answers one in so many batches.
    ArriveSilent(u32, u64),
    /// A worker's message arrives.
    Message(WorkerId, Event),
    /// A worker answers a settled batch again, and differently.
    Lie(WorkerId, BatchId, Work),
    /// A worker's stream breaks.
    Break(WorkerId),
    /// A record reaches the disk, or fails to.
    Write(Record),
    Complete(Completion),
    Completed(Completed),
    /// An evaluation is read.
    Read(JobId, u64),
    /// Ended jobs are deleted.
    Forget(Option<ReplyId>, Vec<JobId>),
    /// An ended job is made an unfinished one.
    Reopen(ReplyId, JobId),
    /// A client requests the deletion of ended jobs.
    Prune,
    /// A report of the store arrives.
    Report(Event),
    /// The coordinator is killed and starts again.
    Restart,
    /// The coordinator is requested to stop, and is started again when it has.
    Drain,
    /// A client cancels its job, and repeats that until it has ended.
    Cancel(usize),
}

#[derive(Default)]
struct Worker {
    process: u32,
    /// It computes and sends nothing, but its stream stays open.
    stalled: bool,
    /// It is lost over everything it gets.
    bad: bool,
    /// It never answers one in this many of its batches; 0: it answers all.
    ignores_every: u64,
    heard: Duration,
    holds: BTreeMap<BatchId, Work>,
}

pub(crate) struct World {
    random: u64,
    now: Duration,
    agenda: BTreeMap<(Duration, u64), Occurrence>,
    state: State,
    config: Config,
    store: MemoryStore,
    clients: Vec<Client>,
    submissions: BTreeMap<ReplyId, usize>,
    cancellations: BTreeMap<ReplyId, usize>,
    /// Maximum simulated time.
    most: Duration,
    /// Period in which the store refuses everything.
    outage: Range<Duration>,
    /// Number of hosts that all processes share; 0: each process has a host of its own.
    hosts: u32,
    /// Hosts whose processes return wrong answers now and then, some only when they answer a second time.
    liars: BTreeSet<u32>,
    /// Hosts that gave wrong answers, with the seeds of the jobs.
    lies: BTreeSet<(u32, u64)>,
    /// Banned hosts.
    banned: BTreeSet<u32>,
    /// Seed, point and indices of batches that were answered in this run of the coordinator.
    answered_batches: BTreeSet<(u64, u64, u64, u32)>,
    /// Seed of each job.
    seeds: BTreeMap<JobId, u64>,
    /// Number of durable evaluations of the job with each seed.
    durable: BTreeMap<u64, u64>,
    /// That number when each point of a seed was sent first.
    first_sent: BTreeMap<(u64, u64), u64>,
    /// Evaluations that were found damaged in the store.
    damaged: BTreeSet<(JobId, u64)>,
    /// Jobs that ended before a worker with wrong answers in them was found out.
    deceived: BTreeSet<JobId>,
    /// The last decision on the end of each job.
    ends: BTreeMap<JobId, EndRecord>,
    processes: u32,
    workers: BTreeMap<WorkerId, Worker>,
    lost_alone: BTreeMap<(u64, u64), u32>,
    lost_bad: BTreeMap<(u64, u64), u32>,
    number: u64,
    counts: Counts,
}

impl World {
    /// Runs one schedule to its end and checks the results.
    pub(crate) fn run(seed: u64) -> Counts {
        let mut world = Self::new(seed);
        while !world.done() {
            let Some(((at, _), happening)) = world.agenda.pop_first() else {
                panic!("nothing will ever happen again");
            };
            assert!(at < world.most, "still not done: {:?}", world.state);
            world.now = at;
            world.happen(happening);
        }
        world.check_results();
        if world.most == MINUTES {
            world.counts.longest = world.now;
        }
        world.counts
    }

    fn new(seed: u64) -> Self {
        let mut random = fake::mix(seed);
        let mut draw = |below: u64| {
            random = fake::mix(random);
            random % below
        };
        let config = some_config(seed, &mut draw);
        let clients = clients::some(seed, &mut draw);
        let (workers, restarts) = (1 + draw(4), draw(3));
        let restarts: Vec<u64> = (0..restarts).map(|_| draw(3000)).collect();
        // Long enough that clients and many programs have given up.
        let outage = (draw(8) == 0).then(|| (draw(1000), 10_000 + draw(60_000)));
        let outage = outage.map_or(Duration::ZERO..Duration::ZERO, |(from, length)| {
            Duration::from_millis(from)..Duration::from_millis(from + length)
        });
        let liars = liars::some(&mut draw);
        let hosts = if draw(3) == 0 { liars.len() as u32 + 1 + draw(3) as u32 } else { 0 };
        let prune = (draw(3) == 0).then(|| draw(4000));
        let mut world = Self {
            random,
            now: Duration::ZERO,
            agenda: BTreeMap::new(),
            state: State::new(config, Duration::ZERO),
            config,
            store: MemoryStore::new(),
            clients,
            submissions: BTreeMap::new(),
            cancellations: BTreeMap::new(),
            counts: Counts { outages: u64::from(!outage.is_empty()), ..Counts::default() },
            most: MINUTES,
            outage,
            hosts,
            liars,
            lies: BTreeSet::new(),
            banned: BTreeSet::new(),
            answered_batches: BTreeSet::new(),
            seeds: BTreeMap::new(),
            durable: BTreeMap::new(),
            first_sent: BTreeMap::new(),
            damaged: BTreeSet::new(),
            deceived: BTreeSet::new(),
            ends: BTreeMap::new(),
            processes: 0,
            workers: BTreeMap::new(),
            lost_alone: BTreeMap::new(),
            lost_bad: BTreeMap::new(),
            number: 1,
        };
        world.agenda.insert((TICK, 0), Occurrence::Tick);
        for client in 0..world.clients.len() {
            world.within(500, Occurrence::Submit(client));
            if world.clients[client].cancels {
                world.within(3000, Occurrence::Cancel(client));
            }
        }
        for _ in 0..workers {
            world.within(500, Occurrence::Arrive);
        }
        restarts.into_iter().for_each(|at| world.after(at, Occurrence::Restart));
        world.plan_faults();
        if let Some(at) = prune {
            world.after(at, Occurrence::Prune);
        }
        world
    }

    fn draw(&mut self, below: u64) -> u64 {
        self.random = fake::mix(self.random);
        self.random % below
    }

    fn number(&mut self) -> u64 {
        self.number += 1;
        self.number
    }

    fn after(&mut self, ms: u64, happening: Occurrence) {
        let number = self.number();
        self.agenda.insert((self.now + Duration::from_millis(ms), number), happening);
    }

    fn within(&mut self, ms: u64, happening: Occurrence) {
        let ms = 1 + self.draw(ms);
        self.after(ms, happening);
    }

    fn done(&self) -> bool {
        let heard = |client: &Client| client.pruned || client.job.is_some();
        if !self.state.is_idle() || !self.clients.iter().all(heard) {
            return false;
        }
        let jobs = self.store.clone().jobs().unwrap();
        let on_its_way = |happening: &Occurrence| matches!(happening, Occurrence::Forget(..));
        let doubts = self.store.clone().doubts().unwrap();
        doubts.iter().all(|doubt| doubt.digest.is_some())
            && jobs.iter().all(|job| job.end.is_some())
            && !self.agenda.values().any(on_its_way)
    }

    fn happen(&mut self, happening: Occurrence) {
        match happening {
            Occurrence::Tick => self.tick(),
            Occurrence::Submit(client) => self.submit(client),
            Occurrence::Arrive => self.arrive(),
            Occurrence::ArriveBad => self.arrive_bad(),
            Occurrence::ArriveSilent(process, ignores_every) => {
                self.arrive_silent(process, ignores_every)
            }
            Occurrence::Return(process) => self.attach(process),
            Occurrence::Pause => self.pause(),
            Occurrence::GiveUp(worker) => self.give_up(worker),
            Occurrence::Message(worker, event) => {
                if self.workers.get(&worker).is_some_and(|worker| !worker.stalled) {
                    self.message(worker, event);
                }
            }
            Occurrence::Break(worker) => {
                let bad = self.workers.get(&worker).map(|worker| worker.bad);
                if bad.is_none() {
                } else if self.may_die(worker) {
                    self.counts.bad_deaths += u64::from(bad == Some(true));
                    self.remove_lost(worker);
                    self.react(Event::StreamEnded { worker });
                } else {
                    self.answer_all(worker);
                }
            }
            Occurrence::Write(record) => self.write(&record),
            Occurrence::Complete(completion) => self.complete(completion),
            Occurrence::Completed(completed) => self.react(Event::Completed(completed)),
            Occurrence::Report(event) => self.react(event),
            Occurrence::Restart => {
                self.counts.restarts += 1;
                self.restart();
            }
            Occurrence::Drain => self.react(Event::Drain),
            Occurrence::Lie(worker, batch, work) => self.lie(worker, batch, &work),
            Occurrence::Cancel(client) => self.cancel(client),
            Occurrence::Read(job, number) => self.read(job, number),
            Occurrence::Forget(reply_id, jobs) => self.forget(reply_id, jobs),
            Occurrence::Reopen(reply_id, job) => self.reopen(reply_id, job),
            Occurrence::Prune => self.prune(),
        }
    }

    fn tick(&mut self) {
        self.after(TICK.as_millis() as u64, Occurrence::Tick);
        let workers: Vec<WorkerId> = self.workers.keys().copied().collect();
        for worker in workers {
            let silent = self.now - self.workers[&worker].heard > self.config.expiry;
            let known = self.workers.get_mut(&worker).unwrap();
            if !known.stalled {
                known.heard = self.now;
                self.react(Event::Heartbeat { worker });
            } else if silent && !self.may_die(worker) {
                // It revives at the last moment.
                let known = self.workers.get_mut(&worker).unwrap();
                known.stalled = false;
                known.heard = self.now;
                self.react(Event::Heartbeat { worker });
                self.answer_all(worker);
            }
        }
        self.recheck();
        self.react(Event::Tick);
    }

    fn submit(&mut self, client: usize) {
        if self.clients[client].job.is_none() {
            let reply_id = ReplyId(self.number());
            self.submissions.insert(reply_id, client);
            let Client { specification, request_id, .. } = &self.clients[client];
            let mut request = fake::submission(specification, request_id);
            if let Request::Submit { client: name, priority, .. } = &mut request {
                *name = format!("client {}", client % 2);
                *priority = client as u32;
            }
            // A client repeats its request until the job is accepted.
            self.react(Event::Requested { reply_id, request });
            self.within(2000, Occurrence::Submit(client));
        }
    }

    fn arrive(&mut self) {
        let process = self.process();
        self.attach(process);
    }

    /// Restarts the coordinator after it has stopped by itself.
    fn stopped(&mut self) {
        self.counts.stops += 1;
        assert!(self.workers.is_empty(), "it stopped with workers attached");
        // Only records that the store has refused may be left, and parts, which nothing waits for.
        let unstored = |happening: &Occurrence| matches!(happening, Occurrence::Write(record) if !matches!(record, Record::Part(_)));
        let left = self.agenda.values().any(unstored);
        assert!(!left || self.counts.refusals > 0, "it stopped with a record on its way");
        self.restart();
    }

    fn cancel(&mut self, client: usize) {
        if !self.clients[client].wants_end {
            return;
        }
        if let Some(job) = self.clients[client].job {
            let reply_id = ReplyId(self.number());
            self.cancellations.insert(reply_id, client);
            self.react(Event::Requested { reply_id, request: Request::Cancel(job) });
        }
        self.within(2000, Occurrence::Cancel(client));
    }

    /// Kills the coordinator: records on their way to the disk may or may not have reached it.
    fn restart(&mut self) {
        let agenda = std::mem::take(&mut self.agenda);
        for (at, happening) in agenda {
            match happening {
                Occurrence::Write(record) => {
                    if self.draw(2) == 0 {
                        self.written(&record);
                    }
                }
                Occurrence::Forget(_, jobs) => {
                    if self.draw(2) == 0 {
                        self.forget_now(&jobs);
                    }
                }
                Occurrence::Message(..)
                | Occurrence::Lie(..)
                | Occurrence::Break(_)
                | Occurrence::GiveUp(_)
                | Occurrence::Read(..)
                | Occurrence::Reopen(..)
                | Occurrence::Report(_) => {}
                stays => {
                    self.agenda.insert(at, stays);
                }
            }
        }
        for gone in std::mem::take(&mut self.workers).values() {
            self.replace(gone);
        }
        self.answered_batches.clear();
        self.submissions.clear();
        self.cancellations.clear();
        let banned = self.store.bans().unwrap();
        self.counts.remembered += u64::from(!banned.is_empty());
        self.banned = banned.iter().map(|it| self.host_of(it.worker.process())).collect();
        let restored = Restored::load(&mut self.store).unwrap();
        let (state, effects) = State::restore(self.config, restored, self.now);
        self.state = state;
        sanity_check(&self.state).unwrap();
        self.apply(effects);
    }

    /// The record may be durable before the search has taken in the evaluation, and later.
    fn complete(&mut self, completion: Completion) {
        let mut gathered = None;
        let completed = completion.run(|outcomes| gathered = Some(outcomes));
        self.react(Event::Gathered(gathered.unwrap()));
        self.within(40, Occurrence::Completed(completed));
    }

    fn react(&mut self, event: Event) {
        let before = event.clone();
        let effects = react(&mut self.state, event, self.now);
        if let Err(insane) = sanity_check(&self.state) {
            panic!("{insane} after {before:?}\n{:#?}", self.state);
        }
        self.apply(effects);
    }

    fn apply(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            match effect {
                Effect::Welcome { worker, .. } | Effect::Heartbeat { worker } => {
                    assert!(self.workers.contains_key(&worker));
                }
                Effect::Send { worker, batch, work } => self.sent(worker, batch, work),
                Effect::Revoke { worker, batch } => {
                    self.counts.revoked += 1;
                    let known = self.workers.get_mut(&worker).unwrap();
                    // An answer that waits for the proof of its worker may be revoked.
                    known.holds.remove(&batch);
                }
                Effect::Close { worker, .. } => {
                    self.counts.closed += 1;
                    self.remove_lost(worker);
                }
                Effect::Store(record) => {
                    self.look_at(&record);
                    self.within(20, Occurrence::Write(record));
                }
                Effect::Complete(completion) => self.within(20, Occurrence::Complete(completion)),
                Effect::Read { job, number } => self.within(10, Occurrence::Read(job, number)),
                Effect::Prune { reply_id, jobs } => {
                    self.within(20, Occurrence::Forget(reply_id, jobs))
                }
                Effect::Reopen { reply_id, job } => {
                    self.within(20, Occurrence::Reopen(reply_id, job));
                }
                Effect::Answer { reply_id, answer } => self.answered(reply_id, &answer),
                Effect::Publish { .. } | Effect::Note(_) | Effect::Drain { .. } => {}
                Effect::ReportStoreFailure { .. } => panic!("nobody lacks patience"),
                Effect::Stop => self.stopped(),
            }
        }
    }
}

/// Returns seed, point and indices of a batch.
fn key(work: &Work) -> (u64, u64, u64, u32) {
    (work.evaluation.germs.seed, point_key(&work.evaluation.point), work.first, work.count)
}

fn point_key(point: &Point) -> u64 {
    point.0.iter().fold(0, |key, x| fake::mix(key ^ x.to_bits()))
}

/// Returns the settings of a coordinator whose times are short.
fn some_config(seed: u64, draw: &mut impl FnMut(u64) -> u64) -> Config {
    Config {
        heartbeat: Duration::from_millis(200),
        expiry: Duration::from_secs(1),
        active_jobs_max: 1 + draw(2) as usize,
        batch_target: Duration::from_millis(10 + draw(200)),
        store_retry: Duration::from_millis(300),
        audit_fraction: [0.0, 0.01, 0.3, 1.0][draw(4) as usize],
        ahead: draw(4) > 0,
        completed_aside_min: [1, 20, u64::MAX][(seed % 3) as usize],
        speculation: draw(3) > 0,
        ..Config::default()
    }
}
