//! Figures of a job that runs, for a page that is served and changes.

use osteon_common::outcome::FailureCounts;

use crate::chart::STYLE;
use crate::course::SearchCourse;
use crate::figures::Figure;
use crate::figures::convergence::course_figures;
use crate::figures::failures::{FailedRealizations, failures_by_kind};
use crate::page;

/// Style sheets of figures, and of a page.
pub const STYLES: [&str; 2] = [STYLE, page::PAGE_STYLE];
/// Script that shows values under the pointer: `showValues` prepares one figure.
pub const SCRIPT: &str = page::SCRIPT;

/// A figure of a page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LiveFigure {
    /// Its name, unique among those of a job.
    pub name: String,
    /// Its title.
    pub title: String,
    /// The figure, as an element of SVG whose colours come from [`STYLES`].
    pub svg: String,
    /// Sentences on how to read it.
    pub reading: String,
}

impl From<Figure> for LiveFigure {
    fn from(Figure { chart, reading }: Figure) -> Self {
        let svg = chart.svg();
        Self { name: chart.name, title: chart.title, svg, reading }
    }
}

/// Returns the figures of a search: cost, both moments, and parameters; none before its second
/// evaluation.
pub fn search_figures(course: &SearchCourse) -> Vec<LiveFigure> {
    course_figures(course).into_iter().map(LiveFigure::from).collect()
}

/// Returns the figure of the failures in an evaluation; `None` if no realization failed.
pub fn failure_figure(failures: &FailureCounts, realizations: u64) -> Option<LiveFigure> {
    let kinds: Vec<_> = failures.iter().collect();
    let suffix = " in the last evaluation".to_owned();
    let all = FailedRealizations { kinds, realizations, prefix: String::new(), suffix };
    (failures.total() > 0).then(|| failures_by_kind(&all).into())
}

#[cfg(test)]
mod tests;
