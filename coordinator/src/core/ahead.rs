//! Evaluations that a job's search will ask for later: those of its other groups and starts.
//!
//! Each part of the search that it has not come to yet may have a branch (`osteon_search::Branch`),
//! whose points are evaluated like any other. Their outcomes wait here until the search asks for these
//! points, in its own order, and are stored as its evaluations only then. So results, store and digest
//! are the same as without branches.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::{Point, PointBits};
use osteon_common::results::EstimatedError;
use osteon_search::{Assessment, Branch, same_point};

use crate::core::evaluation::PendingEvaluation;
use crate::core::worker_name::WorkerName;

/// What a job computes before its search asks for it.
#[derive(Debug, Default)]
pub(crate) struct Ahead {
    /// Branches under way, in the order of their parts.
    pub(crate) branches: Vec<FollowedBranch>,
    /// Number of the first part that has had no branch yet.
    pub(crate) next_part: u64,
    /// Complete evaluations, by their points.
    prepared: BTreeMap<PointBits, PreparedEvaluation>,
}

/// A branch, and the evaluation of its pending point.
#[derive(Debug)]
pub(crate) struct FollowedBranch {
    /// Number of the part of the search.
    pub(crate) part: u64,
    pub(crate) branch: Branch,
    /// `None` while another evaluation of the job is at the same point, and while there is no room for
    /// more realizations.
    pub(crate) evaluation: Option<PendingEvaluation>,
}

/// A complete evaluation that the search has not asked for yet.
#[derive(Debug, Clone)]
pub(crate) struct PreparedEvaluation {
    /// The part of the search that will ask for it; `None` if several will.
    pub(crate) part: Option<u64>,
    pub(crate) outcomes: Outcomes,
    pub(crate) estimated_error: Option<EstimatedError>,
    /// All workers whose answers are in it.
    pub(crate) workers: BTreeSet<WorkerName>,
    /// Its moments and cost in that part.
    pub(crate) assessment: Option<Assessment>,
    /// The evaluation, while its results are not in the store, and the time when it was complete.
    pub(crate) unsaved: Option<(Box<PendingEvaluation>, Duration)>,
}

impl Ahead {
    /// Returns the evaluations under way.
    pub(crate) fn evaluations(&self) -> impl Iterator<Item = &PendingEvaluation> {
        self.branches.iter().filter_map(|followed| followed.evaluation.as_ref())
    }

    pub(crate) fn evaluations_mut(&mut self) -> impl Iterator<Item = &mut PendingEvaluation> {
        self.branches.iter_mut().filter_map(|followed| followed.evaluation.as_mut())
    }

    /// Returns whether any realization waits to be sent.
    pub(crate) fn has_queue(&self) -> bool {
        self.evaluations().any(|evaluation| !evaluation.queue.is_empty())
    }

    /// Returns the number of evaluations, under way or complete.
    pub(crate) fn count(&self) -> usize {
        self.evaluations().count() + self.prepared.len()
    }

    /// Returns whether a point is evaluated, or has been.
    pub(crate) fn has(&self, point: &Point) -> bool {
        self.prepared_evaluation(point).is_some()
            || self.evaluations().any(|it| same_point(&it.point, point))
    }

    /// Returns the complete evaluation of a point.
    pub(crate) fn prepared_evaluation(&self, point: &Point) -> Option<&PreparedEvaluation> {
        self.prepared.get(&point.bits())
    }

    /// Takes the complete evaluations that have waited since `before` and are not in the store.
    pub(crate) fn take_unsaved(&mut self, before: Duration) -> Vec<PendingEvaluation> {
        let is_old = |(_, complete): &mut (Box<PendingEvaluation>, Duration)| *complete <= before;
        let prepared = self.prepared.values_mut();
        prepared.filter_map(|prepared| prepared.unsaved.take_if(is_old)).map(|it| *it.0).collect()
    }

    /// Returns the complete evaluations.
    pub(crate) fn prepared_evaluations(&self) -> impl Iterator<Item = &PreparedEvaluation> {
        self.prepared.values()
    }

    /// Keeps the complete evaluation of a point.
    pub(crate) fn prepare(&mut self, point: &Point, prepared: PreparedEvaluation) {
        self.prepared.insert(point.bits(), prepared);
    }

    /// Passes the evaluation of a part's branch to the branch, and keeps it for the search, if it is
    /// complete; returns whether it is.
    pub(crate) fn pass_to_branch(&mut self, part: u64, now: Duration) -> bool {
        let followed = self.branches.iter_mut().find(|followed| followed.part == part);
        let Some(FollowedBranch { branch, evaluation, .. }) = followed else {
            return false;
        };
        let Some(complete) = evaluation.take_if(|evaluation| evaluation.is_settled()) else {
            return false;
        };
        let Some((outcomes, estimated_error)) = complete.complete(branch.observables()) else {
            return false;
        };
        let assessment = branch.tell(&outcomes, None);
        let (point, part) = (complete.point, Some(part));
        let workers = complete.workers.iter().cloned().collect();
        let unsaved = (!complete.unsaved.is_empty()).then(|| (Box::new(complete), now));
        let prepared =
            PreparedEvaluation { part, outcomes, estimated_error, workers, assessment, unsaved };
        self.prepare(&point, prepared);
        true
    }

    /// Passes the complete evaluation of a point, if there is one, to a branch that asks for it; returns
    /// whether there is. It stays for further parts if it was not computed for this one.
    pub(crate) fn tell_prepared(&mut self, branch: usize, point: &Point) -> bool {
        let Some(prepared) = self.prepared.get_mut(&point.bits()) else {
            return false;
        };
        let Some(FollowedBranch { part, branch, .. }) = self.branches.get_mut(branch) else {
            return false;
        };
        if prepared.part != Some(*part) {
            prepared.part = None;
        }
        let assessment = branch.tell(&prepared.outcomes, prepared.assessment.as_ref());
        prepared.assessment = prepared.assessment.take().or(assessment);
        true
    }

    /// Takes the complete evaluation of a point that the search asks for in part number `part`. It stays
    /// if it was not computed for this part alone.
    pub(crate) fn take_prepared(&mut self, point: &Point, part: u64) -> Option<PreparedEvaluation> {
        let prepared = self.prepared.get_mut(&point.bits())?;
        if prepared.part == Some(part) {
            return self.prepared.remove(&point.bits());
        }
        prepared.part = None;
        Some(PreparedEvaluation { unsaved: None, ..prepared.clone() })
    }

    /// Drops the complete evaluations that belong only to parts before `part`.
    pub(crate) fn drop_before(&mut self, part: u64) {
        self.prepared.retain(|_, prepared| prepared.part.is_none_or(|of| of >= part));
    }

    /// Drops all branches, and the complete evaluations with answers of a banned host.
    pub(crate) fn forget(&mut self, host: &str) {
        self.branches.clear();
        self.next_part = 0;
        self.prepared.retain(|_, prepared| !WorkerName::any_of(&prepared.workers, host));
    }
}
