//! The command line, and the rows of the table that it asks for.

use std::time::Duration;

use anyhow::{Context as _, Result, ensure};
use clap::Parser;
use osteon_common::limits::{GROUPS_MAX, REALIZATIONS_MAX};

use crate::job::Job;
use crate::worker::Behaviour;

/// Shortest and longest time of a realization.
const EACH: (Duration, Duration) = (Duration::from_micros(1), Duration::from_secs(10));
/// Longest time of the realizations of a job alone.
const IDEAL_MAX: Duration = Duration::from_secs(3600);

/// Measures jobs on fleets of simulated workers at a real coordinator: one row for each fleet.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask bench fleet", max_term_width = 80)]
pub(crate) struct FleetArguments {
    /// Numbers of workers, 1 to 4096 each, one fleet after the other
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "10,30,100,300,1000",
          value_parser = clap::value_parser!(u32).range(1..=4096))]
    workers: Vec<u32>,
    /// Slots of each worker
    #[arg(long, value_name = "N", default_value_t = 16,
          value_parser = clap::value_parser!(u32).range(1..=4096))]
    slots: u32,
    /// Times of a realization, 1us to 10s each, with the unit us, ms or s
    #[arg(long, value_name = "TIME,…", value_delimiter = ',', default_value = "1ms",
          value_parser = time)]
    each: Vec<Duration>,
    /// Realizations of the job, a propagation, or of each evaluation with --search
    #[arg(long, value_name = "N", default_value_t = 1_000_000,
          value_parser = clap::value_parser!(u64).range(1..=REALIZATIONS_MAX))]
    realizations: u64,
    /// The job is an identification of K groups instead (N = 1024, Sobol' points, Newton's method)
    #[arg(long, value_name = "K", conflicts_with = "realizations", value_parser = groups)]
    groups: Option<usize>,
    /// The job is an identification by a simplex with at most E evaluations of --realizations each instead
    #[arg(long, value_name = "E", conflicts_with = "groups",
          value_parser = clap::value_parser!(u64).range(1..=10_000))]
    search: Option<u64>,
    /// Also a fleet of which this share vanishes when half of the realizations are answered
    #[arg(long, value_name = "SHARE", value_parser = share)]
    kill: Option<f64>,
    /// Also a fleet of which this share then sends heartbeats, but no answer any more
    #[arg(long, value_name = "SHARE", value_parser = share)]
    silent: Option<f64>,
    /// Also a fleet of which this share then sends and reads nothing any more
    #[arg(long, value_name = "SHARE", value_parser = share)]
    mute: Option<f64>,
    /// Also a fleet whose coordinator is then killed, and started again
    #[arg(long)]
    restart: bool,
    /// Set by cargo
    #[arg(long, hide = true)]
    bench: bool,
}

/// One fleet and its job.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Row {
    pub(crate) workers: u32,
    pub(crate) slots: u32,
    /// Time of one realization.
    pub(crate) each: Duration,
    pub(crate) job: Job,
    pub(crate) disturbance: Option<Disturbance>,
}

/// A fault that the benchmark injects as soon as half of the realizations are answered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Disturbance {
    /// This number of workers behaves like this from then on.
    Workers(u32, Behaviour),
    /// The coordinator is killed, and started again.
    Restart,
}

impl FleetArguments {
    /// Returns all rows of the table.
    ///
    /// # Errors
    /// If a share is that of no worker or of all, or if a job would take hours.
    pub(crate) fn rows(&self) -> Result<Vec<Row>> {
        let realizations = self.realizations;
        let job = match (self.groups, self.search) {
            (Some(groups), _) => Job::Groups(groups),
            (None, Some(evaluations)) => Job::Search { evaluations, realizations },
            (None, None) => Job::Propagation(realizations),
        };
        let mut rows = Vec::new();
        for &each in &self.each {
            for &workers in &self.workers {
                let row = Row { workers, slots: self.slots, each, job, disturbance: None };
                let alone = row.ideal(job.expected_realizations(), job.chain_max());
                ensure!(
                    alone <= IDEAL_MAX,
                    "--each: {each:?} on --workers {workers} takes {alone:.0?}, and at most \
                     {IDEAL_MAX:?} is allowed: take more workers, or shorter or fewer realizations"
                );
                rows.push(row);
                for disturbance in self.disturbances(workers)? {
                    rows.push(Row { disturbance: Some(disturbance), ..row });
                }
            }
        }
        Ok(rows)
    }

    fn disturbances(&self, workers: u32) -> Result<Vec<Disturbance>> {
        let kinds = [
            ("--kill", self.kill, Behaviour::Vanish),
            ("--silent", self.silent, Behaviour::Silent),
            ("--mute", self.mute, Behaviour::Mute),
        ];
        let mut disturbances = Vec::new();
        for (option, share, behaviour) in kinds {
            let Some(share) = share else { continue };
            let concerned = (share * f64::from(workers)).round() as u32;
            ensure!(
                (1..workers).contains(&concerned),
                "{option} {share}: that is {concerned} of {workers} workers; at least one must be \
                 concerned, and at least one must remain"
            );
            disturbances.push(Disturbance::Workers(concerned, behaviour));
        }
        if self.restart {
            disturbances.push(Disturbance::Restart);
        }
        Ok(disturbances)
    }
}

fn time(text: &str) -> Result<Duration> {
    let forms = "write a number with the unit us, ms or s, e.g. 1ms";
    let units = [("us", 1e-6), ("ms", 1e-3), ("s", 1.0)];
    let found = units.iter().find_map(|(unit, size)| Some((text.strip_suffix(unit)?, size)));
    let (number, size) = found.context(forms)?;
    let seconds = number.parse::<f64>().ok().context(forms)? * size;
    let time = Duration::try_from_secs_f64(seconds).ok().context(forms)?;
    ensure!((EACH.0..=EACH.1).contains(&time), "it must be 1us to 10s");
    Ok(time)
}

fn share(text: &str) -> Result<f64> {
    let share: f64 = text.parse().context("write a number between 0 and 1")?;
    ensure!(share > 0.0 && share < 1.0, "it must be above 0 and below 1");
    Ok(share)
}

fn groups(text: &str) -> Result<usize> {
    let groups = text.parse().context("write the number of groups")?;
    ensure!((1..=GROUPS_MAX).contains(&groups), "it must be 1 to {GROUPS_MAX}");
    Ok(groups)
}
