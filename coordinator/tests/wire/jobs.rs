//! Identifications that use every feature of a result.

use osteon_common::job::{Data, Group, JobSpecification, Objective, Prior, Search};

use crate::fake;

/// Returns velocities around a mean (m/s), evenly distributed over a width (m/s).
fn velocities(mean: f64, width: f64, count: u32) -> Vec<f64> {
    (0..count).map(|k| mean + width * (f64::from(k) / f64::from(count - 1) - 0.5)).collect()
}

/// Returns the jobs with their names.
pub(crate) fn jobs() -> [(&'static str, JobSpecification); 4] {
    let plain = fake::identification(300, 60, 7);
    let search = Search { sensitivities: true, ..plain.search };
    let measured = Data::from_velocities(velocities(3900.0, 360.0, 40));
    let group = |name: &str, mean, width| Group::new(name.to_owned(), velocities(mean, width, 25));
    let groups = vec![group("left", 3900.0, 360.0), group("right, \"distal\"", 3800.0, 420.0)];
    let mut priors = Search::default().priors;
    priors[0] = Some(Prior { value: 1650.0, weight: 1e-3 });
    let several = JobSpecification {
        data: Some(measured.clone()),
        search: Search { starts: 3, ..search },
        ..plain.clone()
    };
    let likelihood = JobSpecification {
        data: Some(measured),
        objective: Objective::Likelihood,
        search,
        ..plain.clone()
    };
    let drawn = JobSpecification { search: Search { priors, ..search }, ..plain.clone() };
    let grouped = JobSpecification { data: Some(Data::from_groups(groups)), search, ..plain };
    [("several", several), ("likelihood", likelihood), ("drawn", drawn), ("grouped", grouped)]
}
