//! The search of one job, followed for a page: its figures, made again when there is another evaluation.

use std::sync::Arc;

use osteon_common::job::JobSpecification;
use osteon_common::outcome::FailureCounts;
use osteon_common::results::{DataSummary, Evaluation};
use osteon_report::{LiveFigure, SearchCourse, failure_figure, search_figures};
use serde_json::{Value, json};
use tokio::task::spawn_blocking;
use tonic::Status;

use crate::access::limiter::Caller;
use crate::core::effect::{Answer, SearchRows};
use crate::core::event::Request;
use crate::core::ids::JobId;
use crate::live::json;
use crate::live::source::PageSource;
use crate::service::fetching;
use crate::service::no_answer::unexpected_status;
use crate::store::job_output::ReadRequest;

/// Maximum number of rows that are read at a time: what the core copies for one update.
const ROWS_MAX: usize = 2048;
/// Maximum number of such readings for one update; a longer history comes with the next ones.
const READINGS_MAX: usize = 8;
/// Maximum number of groups that are named.
const GROUPS_MAX: usize = 200;

pub(crate) struct FollowedSearch {
    job: JobId,
    /// The group that is wanted; the one that the search is at, if none is.
    wanted: Option<usize>,
    seen: Option<SeenRows>,
    /// The job has ended, and everything of it was seen.
    is_over: bool,
    /// Figures, as they were last made.
    figures: Value,
    /// There is something that they do not show.
    is_stale: bool,
}

/// The rows of a search that its page has read so far, reduced to what its figures need.
struct SeenRows {
    specification: Arc<JobSpecification>,
    /// The set of data whose search is shown.
    set: usize,
    course: SearchCourse,
    /// Number of rows, of all sets.
    count: u64,
    last: Option<Evaluation>,
    /// Failures of the last evaluation of the search.
    failures: FailureCounts,
}

impl FollowedSearch {
    pub(crate) fn new(job: JobId, wanted: Option<usize>) -> Self {
        Self { job, wanted, seen: None, is_over: false, figures: Value::Null, is_stale: false }
    }

    /// Returns whether it follows this group of this job.
    pub(crate) fn is_of(&self, job: JobId, wanted: Option<usize>) -> bool {
        (self.job, self.wanted) == (job, wanted)
    }

    /// Returns the figures as of now. A search that was begun again, after the ban of a worker, is read
    /// again.
    ///
    /// # Errors
    /// When the coordinator or its store does not answer.
    pub(crate) async fn figures(
        &mut self,
        source: &PageSource,
        caller: Caller,
    ) -> Result<&Value, Status> {
        for _ in 0..READINGS_MAX {
            if self.is_over || !self.read(source, caller.clone()).await? {
                break;
            }
        }
        if std::mem::take(&mut self.is_stale) {
            self.draw();
        }
        Ok(&self.figures)
    }

    /// Reads what is new; returns whether there may be more.
    async fn read(&mut self, source: &PageSource, caller: Caller) -> Result<bool, Status> {
        let seen = self.seen.as_ref();
        // The last row is read once more: if it has changed, the search was begun again.
        let from = seen.map_or(0, |seen| seen.count.saturating_sub(1));
        let request = Request::Follow { job: self.job, from, limit: ROWS_MAX };
        let (is_other_set, is_full) = match source.ask(request).await? {
            Answer::Followed(SearchRows { specification, rows }) => {
                let last = seen.and_then(|seen| seen.last.as_ref());
                let overlap = usize::from(last.is_some());
                if last.is_some_and(|last| !rows.first().is_some_and(|row| is_same(row, last))) {
                    self.seen = None;
                    return Ok(true);
                }
                let new = rows.get(overlap..).unwrap_or_default();
                (self.add(specification, new), rows.len() == ROWS_MAX)
            }
            Answer::Ended { .. } => {
                let _permit = source.permit_reading(caller).await?;
                let job = self.job;
                let record = fetching::read(&source.store, |to| ReadRequest::Job(job, to)).await?;
                let summary = fetching::read(&source.store, |to| ReadRequest::Summary(job, to));
                let rows = summary.await?.history;
                self.is_over = true;
                self.seen = None;
                (self.add(record.specification, &rows), false)
            }
            _ => return Err(unexpected_status()),
        };
        if is_other_set {
            self.summarize().await;
        }
        Ok(is_full)
    }

    /// Adds rows; returns whether another set of data is shown now.
    fn add(&mut self, specification: Arc<JobSpecification>, rows: &[Evaluation]) -> bool {
        let mut is_new = self.seen.is_none();
        self.is_stale |= is_new || !rows.is_empty();
        let begin = |specification: Arc<JobSpecification>, set: usize| SeenRows {
            course: SearchCourse::for_job(&specification, set),
            specification,
            set,
            count: 0,
            last: None,
            failures: FailureCounts::default(),
        };
        let first = self.wanted.unwrap_or(0);
        let seen = self.seen.get_or_insert_with(|| begin(specification, first));
        for row in rows {
            let set = row.role.group as usize;
            if set != seen.set && self.wanted.is_none() {
                let count = seen.count;
                *seen = SeenRows { count, ..begin(Arc::clone(&seen.specification), set) };
                is_new = true;
            }
            if set == seen.set {
                seen.course.add(row);
                seen.failures = row.failures;
            }
            seen.count += 1;
            seen.last = Some(*row);
        }
        is_new
    }

    /// Adds the moments of the data, which may take a fraction of a second.
    async fn summarize(&mut self) {
        let Some(seen) = &mut self.seen else { return };
        let (specification, set) = (Arc::clone(&seen.specification), seen.set);
        let summary = spawn_blocking(move || {
            let data = specification.data.as_ref()?;
            (set < data.sets()).then(|| DataSummary::from_data(data, set))
        });
        // Without them the figures have no level and band of the data.
        if let Ok(Some(summary)) = summary.await {
            seen.course.set_data(&summary);
        }
    }

    fn draw(&mut self) {
        let Some(seen) = &self.seen else { return };
        let realizations = seen.specification.monte_carlo.realizations;
        let mut figures: Vec<LiveFigure> = search_figures(&seen.course);
        figures.extend(failure_figure(&seen.failures, realizations));
        let groups = seen.specification.data.as_ref().map(|data| data.groups()).unwrap_or_default();
        let names: Vec<&str> = groups.iter().take(GROUPS_MAX).map(|it| it.name.as_str()).collect();
        let failed = seen.failures.iter().map(|(kind, count)| (kind.name(), count));
        self.figures = json!({
            "job": self.job.to_string(),
            "group": (!names.is_empty()).then_some(seen.set),
            "groups": names,
            "evaluations": seen.course.count(),
            "failed": json::counts(failed),
            "figures": json::figures(&figures),
        });
    }
}

/// Returns whether two rows are of the same evaluation, to the bit.
fn is_same(row: &Evaluation, last: &Evaluation) -> bool {
    let bits = |row: &Evaluation| {
        let moments =
            row.moments.map(|it| [it.mean, it.coefficient_of_variation].map(f64::to_bits));
        (row.number, row.point.bits(), row.cost.map(f64::to_bits), moments)
    };
    bits(row) == bits(last)
}

#[cfg(test)]
mod tests;
