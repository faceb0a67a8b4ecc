//! Warnings about groups of the data that cannot be searched.

use std::path::Path;

use osteon_common::job::Data;
use osteon_common::visible;
use osteon_files::job_file::JobWithWarnings;

use crate::progress::say;

/// Maximum number of groups that are listed individually.
const LISTED_MAX: usize = 10;

/// Prints on stderr which groups of the job in the file `job` are not searched, and why.
pub(crate) fn warn(job: &Path, noted: &JobWithWarnings) {
    let groups = noted.specification.data.as_ref().map_or(&[][..], Data::groups);
    let unsearched: Vec<_> =
        groups.iter().filter_map(|group| Some((group, group.no_variation()?))).collect();
    if unsearched.is_empty() {
        return;
    }
    let file = visible::path(noted.velocities_file.as_deref().unwrap_or(job));
    for (group, why) in unsearched.iter().take(LISTED_MAX) {
        let (name, count) = (&group.name, group.velocities.len());
        let velocities = if count == 1 { "velocity" } else { "velocities" };
        say(&format!(
            "warning: {file}: group {name:?} ({count} {velocities}) is not searched: {why}"
        ));
    }
    if unsearched.len() > LISTED_MAX {
        let more = unsearched.len() - LISTED_MAX;
        say(&format!("warning: {file}: {more} more groups are not searched either (not listed)"));
    }
}
