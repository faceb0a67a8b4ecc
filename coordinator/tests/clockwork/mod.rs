//! A coordinator and its workers in virtual time: realizations, messages and the store take fixed
//! times. What is measured is a function of the schedule alone.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::outcome::RealizationResult;
use osteon_common::results::JobResult;
use osteon_coordinator::config::Config;
use osteon_coordinator::core::completion::{Completed, Completion};
use osteon_coordinator::core::effect::{Effect, Record};
use osteon_coordinator::core::event::{Event, Hello, Request};
use osteon_coordinator::core::ids::{BatchId, JobId, ReplyId, WorkerId};
use osteon_coordinator::core::reactor::react;
use osteon_coordinator::core::sanity::sanity_check;
use osteon_coordinator::core::state::State;
use osteon_coordinator::store::job_output;
use osteon_coordinator::store::memory::MemoryStore;
use osteon_coordinator::store::{BanRecord, EndRecord, Store as _};
use osteon_proto::batch::Work;

use crate::fake;

/// Average time of one realization on one thread.
const REALIZATION: Duration = Duration::from_millis(10);
/// Time of a message, one way.
const MESSAGE: Duration = Duration::from_micros(200);
/// Time until a record is durable.
const RECORD: Duration = Duration::from_millis(2);
const TICK: Duration = Duration::from_millis(100);
/// Maximum duration of a run.
const DAY: Duration = Duration::from_secs(86_400);

enum Occurrence {
    Tick,
    /// An event reaches the coordinator.
    Event(Event),
    /// A batch reaches a worker.
    Batch(WorkerId, BatchId, Work),
    /// The revocation of a batch reaches a worker.
    Revoked(WorkerId, BatchId),
    /// A thread of a worker finishes a realization of a batch.
    Realized(WorkerId, BatchId),
    /// A process of a host is started, or started again.
    Start(String, Machines),
    Complete(Completion),
    Completed(Completed),
    Write(Record),
}

/// Distribution of the times of realizations.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Times {
    /// All equal.
    Equal,
    /// BetweenPieces 0.5 and 1.5 times the average, always the same for the same realization.
    Spread,
}

/// A worker: batches begin in the order of their arrival. The remaining realizations of a revoked
/// batch are dropped; those that have begun run to their end.
struct Worker {
    idle_threads: u32,
    /// Number of realizations of each batch that have not begun.
    queue: VecDeque<(BatchId, u32)>,
    batches: BTreeMap<BatchId, Held>,
    /// It never answers one in this many of the batches; `None`: it answers all.
    ignores_every: Option<u64>,
    /// How it computes wrongly.
    fault: Option<Fault>,
    /// Number of realizations that it has answered.
    answered: u64,
}

/// Some machines of one kind, each with a host name of its own.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Machines {
    pub(crate) hosts: u32,
    /// Number of worker processes on each of them, of one thread.
    pub(crate) processes: u32,
    /// How they compute wrongly.
    pub(crate) fault: Option<Fault>,
    /// Their processes end and are started again after this long.
    pub(crate) restart: Option<Duration>,
}

/// How a machine computes wrongly: always by the same amount, so that machines with the same fault agree.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Fault {
    /// Every realization.
    Always,
    /// Every realization after this number of right ones, of each process.
    After(u64),
    /// Realizations whose index is a multiple of this number.
    Every(u64),
    /// Every realization, differently on each host.
    EachItsOwn,
}

impl Fault {
    /// Changes an answer to realizations from `first` on, given by a process that answered so many before.
    fn befall(self, host: &str, before: u64, first: u64, solved: &mut [RealizationResult]) {
        for (count, one) in (0..).zip(solved) {
            let is_wrong = match self {
                Self::Always | Self::EachItsOwn => true,
                Self::After(right) => before + count >= right,
                Self::Every(n) => (first + count).is_multiple_of(n),
            };
            let factor = match self {
                Self::EachItsOwn => 1e-7 * (1.0 + host.len() as f64),
                _ => 1e-7,
            };
            if let Ok(velocity) = &mut one.outcome
                && is_wrong
            {
                *velocity *= 1.0 + factor;
            }
        }
    }
}

struct Held {
    work: Work,
    begun: Duration,
    realized: u32,
}

/// The end of a job.
pub(crate) struct Ended {
    /// Time since all jobs were submitted.
    pub(crate) at: Duration,
    pub(crate) result: JobResult,
}

pub(crate) struct Clockwork {
    times: Times,
    realization: Duration,
    now: Duration,
    number: u64,
    agenda: BTreeMap<(Duration, u64), Occurrence>,
    state: State,
    store: MemoryStore,
    workers: BTreeMap<WorkerId, Worker>,
    unfinished: BTreeSet<JobId>,
    ends: BTreeMap<JobId, (Duration, EndRecord)>,
    /// Number of batches that were sent.
    pub(crate) sent: u64,
    /// Number of batches that were never answered.
    pub(crate) ignored: u64,
    /// Number of realizations that were answered.
    pub(crate) computed: u64,
    processes: u32,
    /// The host of each worker.
    hosts: BTreeMap<WorkerId, String>,
    /// Hosts that were banned.
    pub(crate) banned: BTreeSet<String>,
    jobs: u64,
}

impl Clockwork {
    /// Returns workers with these numbers of threads.
    pub(crate) fn new(threads: &[u32], times: Times) -> Self {
        Self::with_config(threads, times, Config::default())
    }

    /// The same with other settings of the coordinator.
    pub(crate) fn with_config(threads: &[u32], times: Times, config: Config) -> Self {
        Self::with(threads, times, REALIZATION, config)
    }

    /// Returns workers with these numbers of threads, whose realizations take this long on average.
    pub(crate) fn with(
        threads: &[u32],
        times: Times,
        realization: Duration,
        config: Config,
    ) -> Self {
        let mut clockwork = Self {
            times,
            realization,
            now: Duration::ZERO,
            number: 0,
            agenda: BTreeMap::new(),
            state: State::new(config, Duration::ZERO),
            store: MemoryStore::new(),
            workers: BTreeMap::new(),
            unfinished: BTreeSet::new(),
            ends: BTreeMap::new(),
            sent: 0,
            ignored: 0,
            computed: 0,
            processes: 0,
            hosts: BTreeMap::new(),
            banned: BTreeSet::new(),
            jobs: 0,
        };
        for (process, &threads) in (1..).zip(threads) {
            let worker = WorkerId(process.into());
            let idle = Worker {
                idle_threads: threads,
                queue: VecDeque::new(),
                batches: BTreeMap::new(),
                ignores_every: None,
                fault: None,
                answered: 0,
            };
            clockwork.workers.insert(worker, idle);
            let hello = Hello { slots: threads, ..fake::hello(process) };
            clockwork.react(Event::Hello { worker, hello });
        }
        clockwork.after(TICK, Occurrence::Tick);
        clockwork
    }

    /// Returns machines that are there from the beginning.
    pub(crate) fn of_machines(machines: &[Machines], realization: Duration) -> Self {
        let mut clockwork = Self::with(&[], Times::Equal, realization, Config::default());
        for (kind, machines) in machines.iter().enumerate() {
            for host in 0..machines.hosts {
                let name = format!("{kind}{}", "-".repeat(host as usize + 1));
                for _ in 0..machines.processes {
                    clockwork.start(name.clone(), *machines);
                }
            }
        }
        clockwork
    }

    fn start(&mut self, host: String, machines: Machines) {
        self.processes += 1;
        let (process, fault) = (self.processes, machines.fault);
        let worker = WorkerId(process.into());
        let idle = Worker {
            idle_threads: 1,
            queue: VecDeque::new(),
            batches: BTreeMap::new(),
            ignores_every: None,
            fault,
            answered: 0,
        };
        self.workers.insert(worker, idle);
        self.hosts.insert(worker, host.clone());
        let hello = Hello { slots: 1, host: host.clone(), ..fake::hello(process) };
        self.react(Event::Hello { worker, hello });
        if let Some(after) = machines.restart {
            self.after(after, Occurrence::Start(host, machines));
        }
    }

    /// Starts a process of a host in place of its oldest one.
    fn start_again(&mut self, host: String, machines: Machines) {
        let of_host = |id: &&WorkerId| self.hosts.get(id) == Some(&host);
        if let Some(worker) = self.workers.keys().find(of_host).copied() {
            self.workers.remove(&worker);
            self.react(Event::StreamEnded { worker });
        }
        self.start(host, machines);
    }

    /// Runs a job to its end.
    pub(crate) fn run_one(&mut self, specification: &JobSpecification) -> Ended {
        self.jobs += 1;
        let job = JobId(self.jobs);
        self.unfinished.insert(job);
        let request = fake::submission(specification, "");
        self.react(Event::Requested { reply_id: ReplyId(job.0), request });
        self.finish();
        self.end(job)
    }

    /// Computes the ended jobs again that a banned host contributed to; returns all jobs as they are then.
    pub(crate) fn recheck(&mut self) -> Vec<Ended> {
        let doubts = self.store.doubts().unwrap();
        for job in doubts.iter().filter(|doubt| doubt.digest.is_none()).map(|doubt| doubt.job) {
            self.unfinished.insert(job);
            let request = Request::Recheck(job);
            self.react(Event::Requested { reply_id: ReplyId(job.0), request });
        }
        self.finish();
        (1..=self.jobs).map(|job| self.end(JobId(job))).collect()
    }

    fn end(&mut self, job: JobId) -> Ended {
        let (at, end) = self.ends[&job].clone();
        Ended { at, result: job_output::read(&mut self.store, &end).unwrap().result }
    }

    /// Makes a worker that sends heartbeats never answer one in `n` of the batches.
    pub(crate) fn swallow(&mut self, worker: u64, n: u64) {
        self.workers.get_mut(&WorkerId(worker)).unwrap().ignores_every = Some(n);
    }

    /// Runs jobs to their ends, each for a client of its own.
    pub(crate) fn run(&mut self, specifications: &[JobSpecification]) -> Vec<Ended> {
        for (number, specification) in (1..).zip(specifications) {
            self.unfinished.insert(JobId(number));
            let mut request = fake::submission(specification, "");
            if let Request::Submit { client, .. } = &mut request {
                *client = format!("client {number}");
            }
            self.react(Event::Requested { reply_id: ReplyId(number), request });
        }
        self.finish();
        let mut ended = Vec::new();
        for (at, end) in std::mem::take(&mut self.ends).into_values() {
            let result = job_output::read(&mut self.store, &end).unwrap().result;
            ended.push(Ended { at, result });
        }
        ended
    }

    fn finish(&mut self) {
        while !self.unfinished.is_empty() {
            let ((at, _), happening) = self.agenda.pop_first().expect("something is to happen");
            assert!(at < DAY, "still not done: {:?}", self.state);
            self.now = at;
            self.happen(happening);
        }
    }

    fn after(&mut self, time: Duration, happening: Occurrence) {
        self.number += 1;
        self.agenda.insert((self.now + time, self.number), happening);
    }

    fn happen(&mut self, happening: Occurrence) {
        match happening {
            Occurrence::Tick => {
                self.after(TICK, Occurrence::Tick);
                let workers: Vec<WorkerId> = self.workers.keys().copied().collect();
                for worker in workers {
                    self.react(Event::Heartbeat { worker });
                }
                self.react(Event::Tick);
            }
            Occurrence::Event(event) => self.react(event),
            Occurrence::Batch(worker, batch, work) => {
                self.sent += 1;
                let Some(known) = self.workers.get_mut(&worker) else {
                    return;
                };
                if known.ignores_every.is_some_and(|n| self.sent.is_multiple_of(n)) {
                    self.ignored += 1;
                    return;
                }
                known.queue.push_back((batch, work.count));
                known.batches.insert(batch, Held { work, begun: Duration::MAX, realized: 0 });
                self.begin(worker);
            }
            Occurrence::Revoked(worker, batch) => {
                if let Some(known) = self.workers.get_mut(&worker) {
                    known.queue.retain(|(queued, _)| *queued != batch);
                    known.batches.remove(&batch);
                }
            }
            Occurrence::Realized(worker, batch) => {
                if let Some(known) = self.workers.get_mut(&worker) {
                    known.idle_threads += 1;
                    self.realized(worker, batch);
                    self.begin(worker);
                }
            }
            Occurrence::Start(host, machines) => self.start_again(host, machines),
            Occurrence::Complete(completion) => self.complete(completion),
            Occurrence::Completed(completed) => self.react(Event::Completed(completed)),
            Occurrence::Write(record) => {
                let event = fake::written(&mut self.store, &record);
                if let Record::Ban(BanRecord { number, worker, .. }) = &record {
                    self.banned.insert(worker.host().to_owned());
                    let doubts = self.store.doubts().unwrap().into_iter();
                    let jobs = doubts.filter(|it| it.ban == *number).map(|it| it.job).collect();
                    self.react(Event::Doubted { ban: *number, jobs });
                }
                if let Record::End { end, .. } = record {
                    self.unfinished.remove(&end.job);
                    self.ends.insert(end.job, (self.now, end));
                }
                self.react(event);
            }
        }
    }

    /// Begins waiting realizations on idle threads.
    fn begin(&mut self, worker: WorkerId) {
        let known = self.workers.get_mut(&worker).unwrap();
        let mut begun = Vec::new();
        while known.idle_threads > 0
            && let Some((batch, left)) = known.queue.front_mut()
        {
            known.idle_threads -= 1;
            *left -= 1;
            let held = known.batches.get_mut(batch).unwrap();
            held.begun = held.begun.min(self.now);
            begun.push((*batch, time(self.times, self.realization, &held.work, *left)));
            if *left == 0 {
                known.queue.pop_front();
            }
        }
        for (batch, time) in begun {
            self.after(time, Occurrence::Realized(worker, batch));
        }
    }

    fn realized(&mut self, worker: WorkerId, batch: BatchId) {
        let known = self.workers.get_mut(&worker).unwrap();
        let Some(held) = known.batches.get_mut(&batch) else {
            return;
        };
        held.realized += 1;
        if held.realized == held.work.count {
            let elapsed_s = (self.now - held.begun).as_secs_f64();
            let mut solved = fake::solved(&held.work);
            if let Some(fault) = known.fault {
                fault.befall(&self.hosts[&worker], known.answered, held.work.first, &mut solved);
            }
            known.answered += solved.len() as u64;
            self.computed += solved.len() as u64;
            known.batches.remove(&batch);
            let answer = Event::Answered { worker, batch, solved, elapsed_s };
            self.after(MESSAGE, Occurrence::Event(answer));
        }
    }

    fn complete(&mut self, completion: Completion) {
        let mut gathered = None;
        let completed = completion.run(|outcomes| gathered = Some(outcomes));
        self.react(Event::Gathered(gathered.unwrap()));
        self.after(RECORD, Occurrence::Completed(completed));
    }

    fn react(&mut self, event: Event) {
        let effects = react(&mut self.state, event, self.now);
        sanity_check(&self.state).unwrap();
        for effect in effects {
            match effect {
                Effect::Send { worker, batch, work } => {
                    self.after(MESSAGE, Occurrence::Batch(worker, batch, work));
                }
                Effect::Revoke { worker, batch } => {
                    self.after(MESSAGE, Occurrence::Revoked(worker, batch));
                }
                Effect::Complete(completion) => {
                    self.after(RECORD, Occurrence::Complete(completion))
                }
                Effect::Store(record) => self.after(RECORD, Occurrence::Write(record)),
                Effect::Close { worker, reason } => {
                    let host = self.hosts.get(&worker);
                    assert!(host.is_some(), "{worker} is closed: {reason}");
                    self.workers.remove(&worker);
                }
                Effect::Read { job, number } => {
                    let event = fake::read(&mut self.store, job, number);
                    self.after(RECORD, Occurrence::Event(event));
                }
                Effect::Reopen { reply_id, job } => {
                    let outcome = Ok(self.store.reopen_job(job).unwrap());
                    self.react(Event::Reopened { reply_id, job, outcome });
                }
                _ => {}
            }
        }
    }
}

/// Returns the time of the realization of a batch that has `left` realizations after it.
fn time(times: Times, realization: Duration, work: &Work, left: u32) -> Duration {
    let index = work.first + u64::from(work.count - 1 - left);
    let noise =
        work.evaluation.point.0.iter().fold(index, |mixed, x| fake::mix(mixed ^ x.to_bits()));
    match times {
        Times::Equal => realization,
        Times::Spread => realization / 2 + realization * (noise % 1024) as u32 / 1024,
    }
}
