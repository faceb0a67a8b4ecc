//! An identification of many groups, for benchmarks.

use osteon_common::job::{Data, Group, JobSpecification, Sampling, Search, SearchMethod};

use crate::fake;

/// Realizations of an evaluation of each group.
pub(crate) const OF_GROUP: u64 = 1024;

/// An identification of so many groups of twenty velocities, by Newton's method.
pub(crate) fn grouped(groups: usize) -> JobSpecification {
    let group = |number: usize| {
        let mean = 3700.0 + 400.0 * (number as f64 / groups as f64);
        let velocities = (0..20).map(|k| mean * (1.0 + 0.004 * (f64::from(k) - 9.5))).collect();
        Group::new(format!("group {number}"), velocities)
    };
    let mut job = fake::identification(OF_GROUP, 60, 3);
    job.search = Search { max_evaluations: 60, ..Search::by(SearchMethod::Newton) };
    job.monte_carlo.sampling = Sampling::Sobol;
    job.data = Some(Data::from_groups((0..groups).map(group).collect()));
    job
}
