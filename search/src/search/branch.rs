//! Parts of a search that can be computed before the search comes to them.
//!
//! The searches for different sets of data do not depend on each other, and those from different
//! starts hardly do. A [`Branch`] follows one of them by itself. What it computes only tells which
//! points the search will ask for: the search asks for each of them in its own order, and is given the
//! outcomes then, so its path and its bits are those of a search without branches.

use std::sync::Arc;

use osteon_common::job::{Data, JobSpecification};
use osteon_common::observables::ObservableSet;
use osteon_common::outcome::FailureCounts;
use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::Point;
use osteon_common::results::{Evaluation, EvaluationRole};
use osteon_common::statistics::PointStatistics;

use super::dataset_search::DatasetSearch;
use super::{Assessment, Search, SearchPlan};

/// A part of a search, followed by itself: the search for one set of data, or, if there are several
/// starts, from one of them. With several starts it holds no derivatives and no posterior, which
/// depend on all of them.
#[derive(Debug, Clone)]
pub struct Branch {
    specification: Arc<JobSpecification>,
    search: DatasetSearch,
    /// Number of points whose outcomes it was given.
    evaluations: u64,
}

impl Search {
    /// Returns the number of parts: one for each start of each set of data. A propagation has one.
    pub fn parts(&self) -> u64 {
        match &self.plan {
            SearchPlan::Identification(_) => {
                let sets = self.specification.data.as_ref().map_or(1, Data::sets);
                sets as u64 * self.starts()
            }
            SearchPlan::Propagation { .. } => 1,
        }
    }

    /// Returns the number of the part that the pending point belongs to, from 0.
    pub fn part(&self) -> u64 {
        match &self.plan {
            SearchPlan::Identification(identification) => {
                let present = identification.present();
                let start = u64::from(present.start()).min(self.starts() - 1);
                u64::from(present.set()) * self.starts() + start
            }
            SearchPlan::Propagation { .. } => 0,
        }
    }

    /// Returns a branch for part number `part`; `None` if there is no such part, or if the job has no
    /// search.
    pub fn branch(&self, part: u64) -> Option<Branch> {
        let SearchPlan::Identification(identification) = &self.plan else {
            return None;
        };
        if part >= self.parts() {
            return None;
        }
        let set = usize::try_from(part / self.starts()).ok()?;
        let start = u32::try_from(part % self.starts()).ok()?;
        let specification = Arc::clone(&self.specification);
        let search = if self.starts() > 1 {
            // If an earlier start is yet to become the answer, the search will end this one sooner.
            let tolerance = match identification.present() {
                present if present.set() as usize == set => present.tolerance(&specification),
                _ => specification.search.cost_tolerance,
            };
            DatasetSearch::of_one_start(&specification, set, start, tolerance)
        } else {
            DatasetSearch::new(&specification, set)
        };
        Some(Branch { specification, search, evaluations: 0 })
    }

    /// Saves computing the assessment of these outcomes, or a part of it, again when they are passed to
    /// [`Search::tell`] next. It is ignored if they are not.
    pub fn anticipate(&mut self, assessment: Assessment) {
        self.assessment = Some(assessment);
    }

    /// Returns the number of starts for each set of data.
    fn starts(&self) -> u64 {
        self.specification.search.starts.max(1)
    }
}

impl Branch {
    /// Returns the next point, unless it has ended.
    pub fn point(&self) -> Option<Point> {
        self.search.point()
    }

    /// Returns the observables that are needed of each realization.
    pub fn observables(&self) -> ObservableSet {
        self.specification.observables()
    }

    /// Takes the outcomes, in index order, of the pending point, and what another part has computed from
    /// these very outcomes, if it is known. Returns their assessment, for [`Search::anticipate`]; `None`
    /// if the branch has ended.
    pub fn tell(&mut self, outcomes: &Outcomes, known: Option<&Assessment>) -> Option<Assessment> {
        let point = self.point()?;
        let Self { specification, search, evaluations } = self;
        let known = known.filter(|known| known.is_of(outcomes));
        let statistics = known.map_or_else(
            || PointStatistics::new(&specification.monte_carlo, &point, outcomes),
            |known| known.statistics,
        );
        let cost = search.cost(specification, &statistics, &point, outcomes);
        let row = Evaluation {
            number: *evaluations,
            role: EvaluationRole::default(),
            point,
            moments: statistics.moments,
            observables: statistics.observables,
            cost: Some(cost),
            failures: FailureCounts::from_outcomes(outcomes),
            estimated_error: None,
        };
        let set = search.set();
        let told = outcomes.clone();
        search.tell(specification, row, statistics, told.clone());
        *evaluations += 1;
        Some(Assessment { set, outcomes: told, statistics, cost: Some(cost) })
    }
}
