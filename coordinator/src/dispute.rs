//! Answers that differ, and whom to believe: two different workers that agree to the bit.

use std::time::Duration;

use osteon_common::outcome::{Solved, encode};

use crate::crashes::Crashes;
use crate::ids::BatchId;
use crate::indices::Indices;
use crate::worker_name::WorkerName;

/// Different answers to the same indices, undecided.
#[derive(Debug, Clone, PartialEq)]
pub struct Dispute {
    /// What it is about.
    pub indices: Indices,
    /// One for each worker, in the order they came; no two are the same.
    votes: Vec<Vote>,
    /// Since when.
    pub since: Duration,
    /// Batch of the worker that is to decide, and its copies.
    pub tie_breakers: Vec<BatchId>,
    /// Workers that were lost over it.
    pub(crate) crashes: Crashes,
}

/// What one worker says.
#[derive(Debug, Clone, PartialEq)]
pub struct Vote {
    /// The worker.
    pub by: WorkerName,
    /// Its answer, in index order.
    pub solved: Vec<Solved>,
}

/// An index at which two workers say different things.
#[derive(Debug, Clone, PartialEq)]
pub struct Contradiction {
    /// The index.
    pub index: u64,
    /// Who says what: the answer that came first, then the other.
    pub answers: [(WorkerName, Solved); 2],
}

/// A decided dispute.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Verdict {
    /// The two that agree.
    pub(crate) believed: [WorkerName; 2],
    /// Each of the others, with where it differs from those two.
    pub(crate) liars: Vec<Contradiction>,
}

impl Dispute {
    /// A dispute between two workers whose answers differ.
    pub(crate) fn new(indices: Indices, votes: [Vote; 2], since: Duration) -> Self {
        Self {
            indices,
            votes: votes.into(),
            since,
            tie_breakers: Vec::new(),
            crashes: Crashes::default(),
        }
    }

    /// Whether `name` is one of those whose answers differ.
    pub(crate) fn involves(&self, name: &WorkerName) -> bool {
        self.votes.iter().any(|vote| vote.by == *name)
    }

    /// Where the first two differ.
    pub(crate) fn contradiction(&self) -> Option<Contradiction> {
        let [first, second, ..] = self.votes.as_slice() else { return None };
        self.difference(first, second)
    }

    /// Takes the answer of another worker: decided as soon as two agree.
    pub(crate) fn vote(&mut self, vote: Vote) -> Option<Verdict> {
        let agrees = |other: &&Vote| same_bits(&other.solved, &vote.solved);
        let Some(second) = self.votes.iter().find(agrees) else {
            self.votes.push(vote);
            return None;
        };
        let believed = [second.by.clone(), vote.by.clone()];
        let others = self.votes.iter().filter(|other| !agrees(other));
        let liars = others.filter_map(|other| self.difference(&vote, other)).collect();
        Some(Verdict { believed, liars })
    }

    /// Forgets what a banned worker says; whether anything is left to decide.
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

/// Whether two answers are the same to the bit, estimated errors included.
pub(crate) fn same(a: Solved, b: Solved) -> bool {
    let bits = |solved: Solved| {
        let (code, velocity) = encode(solved.outcome);
        (code, velocity.to_bits(), solved.estimated_error.to_bits())
    };
    bits(a) == bits(b)
}

fn same_bits(a: &[Solved], b: &[Solved]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(*a, *b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vote(process: u32, velocity: f64) -> Vote {
        let right = Solved { outcome: Ok(1.0), estimated_error: 0.0 };
        let solved = vec![right, Solved { outcome: Ok(velocity), estimated_error: 0.0 }];
        Vote { by: WorkerName::new("node", process, 0), solved }
    }

    /// The liars, once the answers of workers 1, 2, … are in.
    fn check(velocities: &[f64], expected: Option<&[u32]>) {
        let indices = Indices { first: 10, count: 2 };
        let votes = [vote(1, velocities[0]), vote(2, velocities[1])];
        let mut dispute = Dispute::new(indices, votes, Duration::ZERO);
        let mut verdict = None;
        for (process, velocity) in (3..).zip(&velocities[2..]) {
            assert_eq!(verdict, None);
            verdict = dispute.vote(vote(process, *velocity));
        }
        let liars = verdict.map(|verdict| {
            let liar = |liar: &Contradiction| {
                assert_eq!(liar.index, 11);
                liar.answers[1].0.process()
            };
            verdict.liars.iter().map(liar).collect::<Vec<_>>()
        });
        assert_eq!(liars.as_deref(), expected, "{velocities:?}");
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
