//! One row of the table.

use std::process;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Error, Result, ensure};
use osteon_common::job::JobSpecification;
use tokio::time::timeout;

use crate::arguments::{Disturbance, Row};
use crate::job::{Client, Job};
use crate::process::{CoordinatorProcess, processor_s};
use crate::worker::{Behaviour, Fleet};

/// Longest wait for a fleet to attach.
const ATTACH_LIMIT: Duration = Duration::from_secs(120);
/// Time that a job may take beyond ten times its realizations'.
const JOB_LIMIT: Duration = Duration::from_secs(300);

/// Names of the columns.
pub(crate) const HEADER: &str = "\
| workers | half way | job | each | ideal | measured | of ideal | realizations/s | batches | coordinator's CPU | per realization | its memory | fleet's CPU | computed again | digest |
|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|";

/// The measurements of one row: times, work and memory of a fleet and its coordinator for one job.
#[derive(Debug)]
pub(crate) struct Measured {
    row: Row,
    /// Time of the realizations alone.
    ideal: Duration,
    took: Duration,
    batches: u64,
    /// Answered realizations, with all repetitions.
    answered: u64,
    /// Realizations that the result consists of.
    realizations: u64,
    points: u64,
    coordinator_s: f64,
    fleet_s: f64,
    memory_bytes: u64,
    pub(crate) digest: String,
}

/// Runs the job of a row on a new coordinator with a new fleet.
///
/// # Errors
/// If the fleet or the job takes too long, or if the job or a process fails.
pub(crate) async fn measure(row: &Row) -> Result<Measured> {
    let coordinator = CoordinatorProcess::start()?;
    let fleet = Fleet::start(coordinator.url().parse()?, row.workers, row.slots, row.each);
    let attached = timeout(ATTACH_LIMIT, fleet.wait_for_attachments()).await;
    attached.with_context(|| {
        format!("only {} workers attach: {}", fleet.progress().welcomes, fleet.last_loss())
    })?;
    let client = Client::new(coordinator.url()).await?;
    let mut bench = Bench { row: *row, coordinator, fleet, client };
    let (_, warm_up) = bench.run(&row.job.warm_up(), None).await?;
    bench.client.fetch(&warm_up).await?;
    let processor_before = (bench.coordinator.processor_s()?, processor_s(process::id())?);
    let before = bench.fleet.progress();
    let (took, id) = bench.run(&row.job.specification(), row.disturbance).await?;
    // A fetch computes the inference from the data, which is another measurement.
    let processor = (bench.coordinator.processor_s()?, processor_s(process::id())?);
    let (answered, memory_bytes) = (bench.fleet.progress(), bench.coordinator.memory_bytes()?);
    let left = bench.client.fetch(&id).await?;
    Ok(Measured {
        row: *row,
        ideal: row.ideal(left.realizations, left.points),
        took,
        batches: answered.batches - before.batches,
        answered: answered.realizations - before.realizations,
        realizations: left.realizations,
        points: left.points,
        coordinator_s: processor.0 - processor_before.0,
        fleet_s: processor.1 - processor_before.1,
        memory_bytes,
        digest: left.digest,
    })
}

/// A coordinator with a fleet and a client.
struct Bench {
    row: Row,
    coordinator: CoordinatorProcess,
    fleet: Fleet,
    client: Client,
}

impl Bench {
    /// Runs a job; returns the time from its submission to the message that it has ended, and its
    /// identifier.
    async fn run(
        &mut self,
        job: &JobSpecification,
        disturbance: Option<Disturbance>,
    ) -> Result<(Duration, String)> {
        let limit = 10
            * self.row.ideal(self.row.job.expected_realizations(), self.row.job.chain_max())
            + JOB_LIMIT;
        let half =
            self.fleet.progress().realizations + self.row.job.expected_realizations().div_ceil(2);
        let Self { coordinator, fleet, client, .. } = self;
        let begun = Instant::now();
        let id = client.submit(job).await?;
        let again = disturbance == Some(Disturbance::Restart);
        let mut disturbed = disturbance.is_none();
        let run = async {
            tokio::select! {
                watched = client.watch(&id, again) => watched.map(|()| begun.elapsed()),
                error = disturb(coordinator, fleet, disturbance, half, &mut disturbed) => Err(error),
            }
        };
        let took = timeout(limit, run).await;
        let took = took.with_context(|| format!("the job takes longer than {limit:.0?}"))??;
        ensure!(disturbed, "the job ended before {half} realizations were answered");
        Ok((took, id))
    }
}

/// Waits for half of the job, and disturbs it. Completes only if that fails.
async fn disturb(
    coordinator: &mut CoordinatorProcess,
    fleet: &Fleet,
    disturbance: Option<Disturbance>,
    half: u64,
    done: &mut bool,
) -> Error {
    if let Some(disturbance) = disturbance {
        fleet.wait_for_answers(half).await;
        *done = true;
        match disturbance {
            Disturbance::Workers(count, behaviour) => fleet.order(count, behaviour),
            Disturbance::Restart => {
                if let Err(error) = tokio::task::block_in_place(|| coordinator.restart()) {
                    return error;
                }
            }
        }
    }
    std::future::pending().await
}

impl Row {
    /// Returns the time that so many realizations of `points` points take on all slots, or, if workers are
    /// lost half way, the second half on those that remain.
    pub(crate) fn ideal(&self, realizations: u64, points: u64) -> Duration {
        let share = match self.disturbance {
            Some(Disturbance::Workers(lost, _)) => {
                let remaining = f64::from(self.workers - lost) / f64::from(self.workers);
                0.5 + 0.5 / remaining
            }
            Some(Disturbance::Restart) | None => 1.0,
        };
        let slots = f64::from(self.workers) * f64::from(self.slots);
        let chain = self.job.in_a_chain(points) as f64;
        self.each.mul_f64((share * realizations as f64 / slots).max(chain))
    }
}

impl Measured {
    /// Returns it as a row of the table.
    pub(crate) fn row(&self) -> String {
        let half_way = match self.row.disturbance {
            None => "–".to_owned(),
            Some(Disturbance::Restart) => "coordinator killed".to_owned(),
            Some(Disturbance::Workers(count, Behaviour::Vanish)) => format!("{count} vanish"),
            Some(Disturbance::Workers(count, Behaviour::Silent)) => format!("{count} silent"),
            Some(Disturbance::Workers(count, _)) => format!("{count} mute"),
        };
        let job = match self.row.job {
            Job::Propagation(realizations) => format!("{realizations}"),
            Job::Groups(groups) => format!("{groups} groups, {} points", self.points),
            Job::Search { realizations, .. } => {
                format!("{} points of {realizations}", self.points)
            }
        };
        let took = self.took.as_secs_f64();
        let realizations = self.realizations as f64;
        format!(
            "| {} | {half_way} | {job} | {:?} | {:.4} s | {took:.4} s | {:.3} | {:.0} | {} \
             | {:.2} s | {:.2} µs | {:.0} MB | {:.2} s | {:.2} % | {:.12} |",
            self.row.workers,
            self.row.each,
            self.ideal.as_secs_f64(),
            self.ideal.as_secs_f64() / took,
            realizations / took,
            self.batches,
            self.coordinator_s,
            1e6 * self.coordinator_s / realizations,
            self.memory_bytes as f64 / 1e6,
            self.fleet_s,
            100.0 * (self.answered as f64 / realizations - 1.0),
            self.digest,
        )
    }
}
