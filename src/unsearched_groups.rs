//! Tells of groups of the data for which no search can be made.

use std::path::Path;

use osteon_common::job::{Data, JobSpecification};
use osteon_common::job_file;

use crate::progress::say;

/// Most groups that are told of one by one.
const TOLD_MAX: usize = 10;

/// Says on stderr which groups of the job in the file `job` are not searched, and why.
pub(crate) fn warn(job: &Path, specification: &JobSpecification) {
    let groups = specification.data.as_ref().map_or(&[][..], Data::groups);
    let unsearched: Vec<_> =
        groups.iter().filter_map(|group| Some((group, group.no_variation()?))).collect();
    if unsearched.is_empty() {
        return;
    }
    // The velocities were read from it a moment ago.
    let file = job_file::velocities_file(job).ok().flatten();
    let file = file.unwrap_or_else(|| job.to_owned());
    let file = file.display();
    for (group, why) in unsearched.iter().take(TOLD_MAX) {
        let (name, count) = (&group.name, group.velocities.len());
        let velocities = if count == 1 { "velocity" } else { "velocities" };
        say(&format!(
            "warning: {file}: group {name:?} ({count} {velocities}) is not searched: {why}"
        ));
    }
    if unsearched.len() > TOLD_MAX {
        let more = unsearched.len() - TOLD_MAX;
        say(&format!("warning: {file}: nor are {more} more groups, not listed here"));
    }
}
