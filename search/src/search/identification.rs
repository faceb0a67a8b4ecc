//! The searches of an identification, for one set of data after another.

use osteon_common::job::{Data, Group, JobSpecification};
use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::Point;
use osteon_common::results::{Evaluation, GroupEnding, Status};
use osteon_common::statistics::PointStatistics;

use super::dataset_search::DatasetSearch;
use super::ending::Ending;

/// State of an identification.
#[derive(Debug, Clone)]
pub(super) struct IdentificationSearch {
    /// Endings of the searches for the earlier sets.
    ended: Vec<GroupEnding>,
    /// The search for the current set; the last one when all have ended.
    present: DatasetSearch,
}

impl IdentificationSearch {
    /// Creates the identification of a specification that has data.
    pub(super) fn new(specification: &JobSpecification) -> Self {
        let present = DatasetSearch::new(specification, 0);
        let mut identification = Self { ended: Vec::new(), present };
        identification.begin_next(specification);
        identification
    }

    /// Returns the next point, unless all searches have ended.
    pub(super) fn point(&self) -> Option<Point> {
        self.present.point()
    }

    /// Returns at most `most` points of the current set that the search may ask for after the
    /// pending one, the most probable first.
    pub(super) fn candidates(&self, most: usize) -> Vec<Point> {
        self.present.candidates(most)
    }

    /// Returns the cost of the pending point, given its moments.
    pub(super) fn cost(
        &self,
        specification: &JobSpecification,
        statistics: &PointStatistics,
        point: &Point,
        outcomes: &Outcomes,
    ) -> f64 {
        self.present.cost(specification, statistics, point, outcomes)
    }

    /// Takes the moments and the outcomes of the pending point, with its cost in the row. Returns
    /// the completed row.
    pub(super) fn tell(
        &mut self,
        specification: &JobSpecification,
        row: Evaluation,
        statistics: PointStatistics,
        outcomes: Outcomes,
    ) -> Evaluation {
        let row = self.present.tell(specification, row, statistics, outcomes);
        self.begin_next(specification);
        row
    }

    /// Returns the search for the current set.
    pub(super) fn present(&self) -> &DatasetSearch {
        &self.present
    }

    /// Returns the best evaluation of the current set.
    pub(super) fn best(&self) -> Option<&Evaluation> {
        self.present.best()
    }

    /// Returns the number of the best evaluation of set number `set`.
    pub(super) fn best_of(&self, set: usize) -> Option<u64> {
        match self.ended.get(set) {
            Some(ending) => ending.best,
            None if set == self.ended.len() => self.best().map(|row| row.number),
            None => None,
        }
    }

    /// Returns the outcomes of the best evaluation of the current set.
    pub(super) fn best_outcomes(&self) -> Option<&Outcomes> {
        self.present.best_outcomes()
    }

    /// Returns the endings of the searches that have ended.
    pub(super) fn endings(&self) -> Vec<GroupEnding> {
        let last = self.present.ending().cloned();
        self.ended.iter().cloned().chain(last).collect()
    }

    /// Returns how all searches together ended.
    pub(super) fn ending(&self, specification: &JobSpecification) -> Ending {
        let endings = self.endings();
        match (&specification.data, endings.as_slice()) {
            (Some(data), endings) if data.is_grouped() => {
                let (unsearched, searched): (Vec<_>, Vec<_>) = data
                    .groups()
                    .iter()
                    .zip(endings)
                    .partition(|(group, _)| group.no_variation().is_some());
                combined_ending(&searched, &unsearched)
            }
            (_, [GroupEnding { status, reason, .. }]) => {
                Ending::from_search(*status, reason.clone())
            }
            // Not reached: called only once all searches have ended.
            _ => Ending::from_search(Status::Cancelled, None),
        }
    }

    /// Moves on to the next set whose search has something to evaluate.
    fn begin_next(&mut self, specification: &JobSpecification) {
        let sets = specification.data.as_ref().map_or(1, Data::sets);
        while let Some(ending) = self.present.ending() {
            let next = self.ended.len() + 1;
            if next >= sets {
                return;
            }
            self.ended.push(ending.clone());
            self.present = DatasetSearch::new(specification, next);
        }
    }
}

/// Combines the endings of the groups' searches. Groups that could not be searched are mentioned,
/// but do not influence the status.
fn combined_ending(
    groups: &[(&Group, &GroupEnding)],
    unsearched: &[(&Group, &GroupEnding)],
) -> Ending {
    for (status, what) in [
        (Status::Failed, "failed"),
        (Status::MaxEvaluations, "did not converge"),
        (Status::NotMatched, "did not match the data"),
    ] {
        let of_status: Vec<_> =
            groups.iter().filter(|(_, ending)| ending.status == status).collect();
        if let Some((Group { name, .. }, first)) = of_status.first() {
            let why = first.reason.as_ref().map_or_else(
                || ", which reached its limit of evaluations".to_owned(),
                |reason| format!(": {reason}"),
            );
            let (count, all) = (of_status.len(), groups.len() + unsearched.len());
            let reason = format!(
                "the searches for {count} of {all} groups {what}; the first is {name:?}{why}"
            );
            return Ending::from_search(status, Some(reason));
        }
    }
    let reason = unsearched.first().map(|(Group { name, .. }, first)| {
        let (count, all) = (unsearched.len(), groups.len() + unsearched.len());
        let why = first.reason.as_deref().unwrap_or_default();
        format!("no search was made for {count} of {all} groups; the first is {name:?}: {why}")
    });
    Ending::from_search(Status::Converged, reason)
}
