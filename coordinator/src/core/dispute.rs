//! Disputes: answers to the same indices that differ. An answer is accepted when two different
//! workers agree on it bit for bit.

use std::time::Duration;

use osteon_common::outcome::{RealizationResult, encode};

use crate::core::crashes::Crashes;
use crate::core::ids::BatchId;
use crate::core::indices::Indices;
use crate::core::worker_name::WorkerName;

/// An undecided dispute: different answers to the same indices.
#[derive(Debug, Clone, PartialEq)]
pub struct Dispute {
    /// The disputed indices.
    pub indices: Indices,
    /// One vote for each worker, in the order they arrived; no two are the same.
    votes: Vec<Vote>,
    /// Time when the dispute began.
    pub since: Duration,
    /// Batch of the worker that casts the deciding vote, and its duplicates.
    pub tie_breakers: Vec<BatchId>,
    /// Workers that were lost over it.
    pub(crate) crashes: Crashes,
}

/// Vote of one worker.
#[derive(Debug, Clone, PartialEq)]
pub struct Vote {
    /// The worker.
    pub by: WorkerName,
    /// Its answer, in index order.
    pub solved: Vec<RealizationResult>,
}

/// An index at which the answers of two workers differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Contradiction {
    /// The index.
    pub index: u64,
    /// The two workers and their answers; the answer that arrived first comes first.
    pub answers: [(WorkerName, RealizationResult); 2],
}

/// A decided dispute.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct VoteResult {
    /// The two workers that agree.
    pub(crate) agreeing: [WorkerName; 2],
    /// Each of the other workers, with the first index at which it differs from those two.
    pub(crate) outvoted: Vec<Contradiction>,
}

impl Dispute {
    /// Returns a dispute between two workers whose answers differ.
    pub(crate) fn new(indices: Indices, votes: [Vote; 2], since: Duration) -> Self {
        Self {
            indices,
            votes: votes.into(),
            since,
            tie_breakers: Vec::new(),
            crashes: Crashes::default(),
        }
    }

    /// Returns whether `name` is one of the workers that have voted.
    pub(crate) fn has_vote_of(&self, name: &WorkerName) -> bool {
        self.votes.iter().any(|vote| vote.by == *name)
    }

    /// Returns the first difference between the first two votes.
    pub(crate) fn contradiction(&self) -> Option<Contradiction> {
        let [first, second, ..] = self.votes.as_slice() else { return None };
        self.difference(first, second)
    }

    /// Adds the vote of another worker. The dispute is decided as soon as two votes agree.
    pub(crate) fn vote(&mut self, vote: Vote) -> Option<VoteResult> {
        let agrees = |other: &&Vote| same_bits(&other.solved, &vote.solved);
        let Some(second) = self.votes.iter().find(agrees) else {
            self.votes.push(vote);
            return None;
        };
        let agreeing = [second.by.clone(), vote.by.clone()];
        let others = self.votes.iter().filter(|other| !agrees(other));
        let outvoted = others.filter_map(|other| self.difference(&vote, other)).collect();
        Some(VoteResult { agreeing, outvoted })
    }

    /// Removes the vote of a banned worker, and returns whether anything is left to decide.
    pub(crate) fn forget(&mut self, name: &WorkerName) -> bool {
        self.votes.retain(|vote| vote.by != *name);
        self.votes.len() > 1
    }

    fn difference(&self, a: &Vote, b: &Vote) -> Option<Contradiction> {
        let at = (0..a.solved.len()).find(|&i| !same(a.solved[i], b.solved[i]))?;
        let index = self.indices.first + at as u64;
        let answers = [(a.by.clone(), a.solved[at]), (b.by.clone(), b.solved[at])];
        Some(Contradiction { index, answers })
    }
}

/// Returns whether two answers agree bit for bit, estimated errors and decays included.
pub(crate) fn same(a: RealizationResult, b: RealizationResult) -> bool {
    let bits = |solved: RealizationResult| {
        let (code, velocity) = encode(solved.outcome);
        (code, velocity.to_bits(), solved.estimated_error.to_bits(), solved.decay.to_bits())
    };
    bits(a) == bits(b)
}

fn same_bits(a: &[RealizationResult], b: &[RealizationResult]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(*a, *b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vote(process: u32, velocity: f64) -> Vote {
        let right = RealizationResult { outcome: Ok(1.0), estimated_error: 0.0, decay: 0.0 };
        let solved = vec![
            right,
            RealizationResult { outcome: Ok(velocity), estimated_error: 0.0, decay: 0.0 },
        ];
        Vote { by: WorkerName::new("node", process, 0), solved }
    }

    /// Checks the workers that are found wrong once the answers of workers 1, 2, … are in.
    fn check(velocities: &[f64], expected: Option<&[u32]>) {
        let indices = Indices { first: 10, count: 2 };
        let votes = [vote(1, velocities[0]), vote(2, velocities[1])];
        let mut dispute = Dispute::new(indices, votes, Duration::ZERO);
        let mut result = None;
        for (process, velocity) in (3..).zip(&velocities[2..]) {
            assert_eq!(result, None);
            result = dispute.vote(vote(process, *velocity));
        }
        let outvoted = result.map(|result| {
            let worker = |worker: &Contradiction| {
                assert_eq!(worker.index, 11);
                worker.answers[1].0.process()
            };
            result.outvoted.iter().map(worker).collect::<Vec<_>>()
        });
        assert_eq!(outvoted.as_deref(), expected, "{velocities:?}");
    }

    #[test]
    fn two_that_agree_are_believed() {
        check(&[5.0, 6.0], None);
        check(&[5.0, 6.0, 5.0], Some(&[2]));
        check(&[5.0, 6.0, 6.0], Some(&[1]));
        check(&[5.0, 6.0, 7.0], None);
        check(&[5.0, 6.0, 7.0, 6.0], Some(&[1, 3]));
        check(&[0.0, -0.0, 0.0], Some(&[2]));
    }
}
