//! The query of a request: what a page shows.

use crate::core::event::JobChoice;
use crate::core::ids::JobId;

/// Number of jobs in a page unless it asks for another.
const ROWS: usize = 25;
/// Maximum number of jobs in a page.
const ROWS_MAX: usize = 100;

/// The choices of a page: which jobs it lists, and which job and group it shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shown {
    /// Which jobs are listed.
    pub(crate) which: JobChoice,
    /// Last job of the page before.
    pub(crate) before: Option<JobId>,
    /// Number of jobs in the list.
    pub(crate) rows: usize,
    /// The job that is shown in detail.
    pub(crate) job: Option<JobId>,
    /// The group of its data; the one that its search is at, if none is given.
    pub(crate) group: Option<usize>,
}

impl Default for Shown {
    fn default() -> Self {
        Self { which: JobChoice::All, before: None, rows: ROWS, job: None, group: None }
    }
}

impl Shown {
    /// Reads a query.
    ///
    /// # Errors
    /// What is wrong with it, for people.
    pub(crate) fn parse(query: &str) -> Result<Self, String> {
        let mut shown = Self::default();
        for pair in query.split('&').filter(|pair| !pair.is_empty()) {
            let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
            let describe_fault = |allowed: &str| format!("{key} is {value:?}; {allowed}");
            let job = || {
                JobId::parse(value)
                    .map(Some)
                    .ok_or_else(|| describe_fault("it must be the number of a job"))
            };
            match key {
                "show" => {
                    let named = JOB_CHOICES.iter().find(|(name, _)| *name == value);
                    let names = "it must be all, running, waiting or ended";
                    shown.which = named.ok_or_else(|| describe_fault(names))?.1;
                }
                "before" => shown.before = job()?,
                "job" => shown.job = job()?,
                "rows" => {
                    let rows = value.parse().ok().filter(|rows| (1..=ROWS_MAX).contains(rows));
                    shown.rows = rows.ok_or_else(|| describe_fault("it must be from 1 to 100"))?;
                }
                "group" => {
                    let set = value
                        .parse()
                        .map_err(|_| describe_fault("it must be the number of a group"));
                    shown.group = Some(set?);
                }
                _ => {
                    return Err(format!(
                        "there is no parameter {key:?}; there are show, before, rows, job and group"
                    ));
                }
            }
        }
        Ok(shown)
    }
}

/// The choices of jobs, with their names.
const JOB_CHOICES: [(&str, JobChoice); 4] = [
    ("all", JobChoice::All),
    ("running", JobChoice::Running),
    ("waiting", JobChoice::Waiting),
    ("ended", JobChoice::Ended),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_query_is_read_or_its_fault_is_named() {
        let shown = Shown::parse("show=ended&before=7&rows=3&job=9&group=1").unwrap();
        let (before, job) = (Some(JobId(7)), Some(JobId(9)));
        let expected = Shown { which: JobChoice::Ended, before, rows: 3, job, group: Some(1) };
        assert_eq!(shown, expected);
        assert_eq!(Shown::parse(""), Ok(Shown::default()));
        for (query, part) in [
            ("show=some", "all, running, waiting or ended"),
            ("job=x", "number of a job"),
            ("before=", "number of a job"),
            ("rows=101", "from 1 to 100"),
            ("rows=0", "from 1 to 100"),
            ("group=-1", "number of a group"),
            ("pages=2", "there is no parameter"),
        ] {
            let error = Shown::parse(query).unwrap_err();
            assert!(error.contains(part), "{query}: {error}");
        }
    }
}
