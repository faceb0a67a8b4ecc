//! Warnings before anything is computed: unusual values, and data that are out of reach within the
//! bounds.

use osteon_common::job::JobSpecification;
use osteon_common::warnings::Warning;
use osteon_local::reach::out_of_reach;

use crate::progress::say;

/// Prints all warnings about a job that is about to be submitted.
pub(crate) async fn say_of_job(specification: &JobSpecification, warnings: &[Warning]) {
    say_all(warnings);
    let specification = specification.clone();
    // Runs on another thread: it takes some milliseconds, in which a signal must still be handled.
    let lines = tokio::task::spawn_blocking(move || out_of_reach(&specification)).await;
    for line in lines.unwrap_or_default() {
        say(&format!("warning: {line}"));
    }
}

/// Prints warnings about unusual values.
pub(crate) fn say_all(warnings: &[Warning]) {
    for warning in warnings {
        say(&format!("warning: {warning}"));
    }
}
