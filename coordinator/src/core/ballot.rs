//! Ballots: what hosts answered to the same realizations, and which answer counts.
//!
//! A host has one vote, whatever its processes and however often they are started again: what makes one
//! of them compute wrongly (a build, a vector unit, memory) is the same for all. An answer counts when
//! more than half of the hosts that may vote have given it, bit for bit.

use std::collections::BTreeMap;

use osteon_common::outcome::{RealizationResult, encode};

use crate::core::indices::Indices;
use crate::core::worker_name::WorkerName;

/// Vote of one host.
#[derive(Debug, Clone, PartialEq)]
pub struct Vote {
    /// The worker of the host that answered first.
    pub by: WorkerName,
    /// Its answer, in index order.
    pub solved: Vec<RealizationResult>,
}

/// An index at which the answers of two workers differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Contradiction {
    /// The index.
    pub index: u64,
    /// The two workers and their answers; the one that counts, if that is known, comes first.
    pub answers: [(WorkerName, RealizationResult); 2],
    /// All hosts that voted.
    pub hosts: Vec<String>,
}

/// A decided ballot.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BallotResult {
    /// The hosts that gave the answer that counts.
    pub(crate) agreeing: Vec<String>,
    /// A worker of each of the other hosts, with the first index at which its answer differs.
    pub(crate) outvoted: Vec<Contradiction>,
}

/// Result of adding a vote.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Cast {
    /// The host had no vote before, or the same.
    Counted,
    /// The host gave another answer before, which remains its vote.
    Contradicts(Box<Contradiction>),
}

/// Votes about the same realizations.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ballot {
    indices: Indices,
    /// The answers that differ, in the order they arrived, with the number of hosts that gave each.
    answers: Vec<(Vec<RealizationResult>, usize)>,
    /// By host: the worker whose answer is the host's vote, and the index of that answer in `answers`.
    votes: BTreeMap<String, (WorkerName, usize)>,
}

impl Ballot {
    /// Returns a ballot about the realizations `indices` without votes.
    pub(crate) fn new(indices: Indices) -> Self {
        Self { indices, answers: Vec::new(), votes: BTreeMap::new() }
    }

    pub(crate) fn indices(&self) -> Indices {
        self.indices
    }

    /// Returns whether a host has voted.
    pub(crate) fn has_vote_of(&self, host: &str) -> bool {
        self.votes.contains_key(host)
    }

    /// Returns the hosts that have voted.
    pub(crate) fn hosts(&self) -> impl Iterator<Item = &str> {
        self.votes.keys().map(String::as_str)
    }

    /// Returns the number of hosts that have voted.
    pub(crate) fn count(&self) -> usize {
        self.votes.len()
    }

    /// Returns the same votes about one of the realizations.
    pub(crate) fn for_index(&self, index: u64) -> Self {
        let mut about = Self::new(Indices { first: index, count: 1 });
        let at = usize::try_from(index.saturating_sub(self.indices.first)).unwrap_or(usize::MAX);
        for (by, place) in self.votes.values() {
            if let Some(one) = self.answers[*place].0.get(at) {
                about.cast(Vote { by: by.clone(), solved: vec![*one] });
            }
        }
        about
    }

    /// Returns the workers whose answers are the votes.
    pub(crate) fn voters(&self) -> impl Iterator<Item = &WorkerName> {
        self.votes.values().map(|(by, _)| by)
    }

    /// Adds the vote of a worker's host.
    pub(crate) fn cast(&mut self, Vote { by, solved }: Vote) -> Cast {
        let known = self.answers.iter().position(|(answer, _)| same_bits(answer, &solved));
        if let Some((first, place)) = self.votes.get(by.host()) {
            if known == Some(*place) {
                return Cast::Counted;
            }
            let before = self.answers.get(*place).map(|(answer, _)| answer.as_slice());
            let found = self.difference((first, before.unwrap_or_default()), (&by, &solved));
            return found.map_or(Cast::Counted, |found| Cast::Contradicts(Box::new(found)));
        }
        let place = known.unwrap_or_else(|| {
            self.answers.push((solved, 0));
            self.answers.len() - 1
        });
        self.answers[place].1 += 1;
        self.votes.insert(by.host().to_owned(), (by, place));
        Cast::Counted
    }

    /// Removes the vote of a host.
    pub(crate) fn withdraw(&mut self, host: &str) {
        if let Some((_, place)) = self.votes.remove(host) {
            self.answers[place].1 -= 1;
        }
    }

    /// Returns the number of votes that the leading answer lacks for a majority of `voters` hosts.
    pub(crate) fn lacks(&self, voters: usize) -> usize {
        let leading = self.leading_answer().map_or(0, |place| self.answers[place].1);
        (voters.max(self.votes.len()) / 2 + 1).saturating_sub(leading)
    }

    /// Returns whether the answer of a host has a majority of `voters` hosts.
    pub(crate) fn confirms(&self, host: &str, voters: usize) -> bool {
        let count = self.votes.get(host).and_then(|(_, place)| self.answers.get(*place));
        count.is_some_and(|(_, count)| 2 * count > voters.max(self.votes.len()))
    }

    /// Returns what `voters` hosts have decided: `None` as long as no answer has a majority.
    pub(crate) fn verdict(&self, voters: usize) -> Option<BallotResult> {
        let right = self.leading_answer().filter(|_| self.lacks(voters) == 0)?;
        let votes = || self.votes.values();
        let agreeing = votes().filter(|(_, place)| *place == right).map(|(by, _)| by);
        let agreeing: Vec<&WorkerName> = agreeing.collect();
        let first = agreeing.first()?;
        let differs = |(by, place): &(WorkerName, usize)| {
            let answer = |place: usize| self.answers[place].0.as_slice();
            self.difference((first, answer(right)), (by, answer(*place)))
        };
        let outvoted = votes().filter_map(differs).collect();
        Some(BallotResult {
            agreeing: agreeing.iter().map(|by| by.host().to_owned()).collect(),
            outvoted,
        })
    }

    /// Returns whether no two hosts have voted differently.
    pub(crate) fn is_unanimous(&self) -> bool {
        self.answers.iter().filter(|(_, count)| *count > 0).count() < 2
    }

    /// Returns two votes that differ, at the first index where they do.
    pub(crate) fn contradiction(&self) -> Option<Contradiction> {
        let mut votes = self.votes.values();
        let (first, place) = votes.next()?;
        let (other, others) = votes.find(|(_, other)| other != place)?;
        self.difference((first, &self.answers[*place].0), (other, &self.answers[*others].0))
    }

    /// Returns the place of the answer that most hosts gave.
    fn leading_answer(&self) -> Option<usize> {
        let counted = self.answers.iter().enumerate().rev();
        counted.max_by_key(|(_, (_, count))| *count).map(|(place, _)| place)
    }

    fn difference(
        &self,
        (one, a): (&WorkerName, &[RealizationResult]),
        (other, b): (&WorkerName, &[RealizationResult]),
    ) -> Option<Contradiction> {
        let at = a.iter().zip(b).position(|(a, b)| !same(*a, *b))?;
        let index = self.indices.first + at as u64;
        let answers = [(one.clone(), a[at]), (other.clone(), b[at])];
        Some(Contradiction { index, answers, hosts: self.hosts().map(str::to_owned).collect() })
    }
}

/// Returns whether two answers agree bit for bit, estimated errors and observables included.
pub(crate) fn same(a: RealizationResult, b: RealizationResult) -> bool {
    let bits = |solved: RealizationResult| {
        let (code, velocity) = encode(solved.outcome);
        let observables = solved.observables.map(f64::to_bits);
        (code, velocity.to_bits(), solved.estimated_error.to_bits(), observables)
    };
    bits(a) == bits(b)
}

fn same_bits(a: &[RealizationResult], b: &[RealizationResult]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(*a, *b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vote(host: &str, process: u32, velocity: f64) -> Vote {
        let result = |velocity| RealizationResult::solved(velocity, 0.0);
        Vote { by: WorkerName::new(host, process, 0), solved: vec![result(1.0), result(velocity)] }
    }

    /// Casts the votes of hosts 1, 2, … with these velocities.
    fn ballot(velocities: &[f64]) -> Ballot {
        let mut ballot = Ballot::new(Indices { first: 10, count: 2 });
        for (host, velocity) in (1..).zip(velocities) {
            assert_eq!(ballot.cast(vote(&format!("h{host}"), 1, *velocity)), Cast::Counted);
        }
        ballot
    }

    /// Checks which hosts are outvoted when `voters` may vote.
    fn check(velocities: &[f64], voters: usize, expected: Option<&[&str]>) {
        let verdict = ballot(velocities).verdict(voters);
        let outvoted = verdict.map(|verdict| {
            let host = |it: &Contradiction| {
                assert_eq!(it.index, 11);
                it.answers[1].0.host().to_owned()
            };
            verdict.outvoted.iter().map(host).collect::<Vec<_>>()
        });
        let expected = expected.map(|hosts| hosts.iter().map(|host| (*host).to_owned()).collect());
        assert_eq!(outvoted, expected, "{velocities:?} of {voters}");
    }

    #[test]
    fn more_than_half_of_the_voters_decide() {
        check(&[5.0], 1, Some(&[]));
        check(&[5.0], 2, None);
        check(&[5.0, 5.0], 2, Some(&[]));
        check(&[5.0, 6.0], 2, None);
        check(&[5.0, 6.0, 5.0], 3, Some(&["h2"]));
        check(&[5.0, 6.0, 6.0], 3, Some(&["h1"]));
        check(&[5.0, 6.0, 7.0], 3, None);
        // Two that agree are not more than half of four, and of five three are needed.
        check(&[5.0, 6.0, 6.0], 4, None);
        check(&[5.0, 6.0, 6.0, 5.0], 4, None);
        check(&[5.0, 6.0, 6.0, 5.0, 5.0], 5, Some(&["h2", "h3"]));
        // Who has voted counts, even if it is not there any more.
        check(&[5.0, 6.0, 6.0, 5.0], 3, None);
        check(&[0.0, -0.0, 0.0], 3, Some(&["h2"]));
    }

    #[test]
    fn a_host_has_one_vote() {
        let mut ballot = ballot(&[5.0, 6.0]);
        assert_eq!(ballot.cast(vote("h2", 7, 6.0)), Cast::Counted);
        assert_eq!((ballot.count(), ballot.lacks(2), ballot.verdict(2)), (2, 1, None));
        let Cast::Contradicts(found) = ballot.cast(vote("h2", 8, 5.0)) else {
            panic!("{ballot:?}");
        };
        assert_eq!(found.answers.map(|(by, _)| by.process()), [1, 8]);
        assert_eq!(ballot.verdict(2), None, "the second answer does not count");
        ballot.withdraw("h2");
        assert!(ballot.confirms("h1", 1) && !ballot.confirms("h2", 1));
    }

    #[test]
    fn the_lacking_votes_are_counted() {
        for (velocities, voters, lacks) in [
            (&[][..], 3, 2),
            (&[5.0], 3, 1),
            (&[5.0, 6.0], 3, 1),
            (&[5.0, 6.0], 9, 4),
            (&[5.0, 5.0, 6.0], 3, 0),
        ] {
            assert_eq!(ballot(velocities).lacks(voters), lacks, "{velocities:?} of {voters}");
        }
    }
}
