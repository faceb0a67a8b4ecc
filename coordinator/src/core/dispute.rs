//! Disputes: answers to the same realizations that differ. Further hosts compute the same until one
//! answer has the majority.

use std::time::Duration;

use crate::core::ballot::{Ballot, Cast, Vote};
use crate::core::crashes::Crashes;
use crate::core::ids::BatchId;
use crate::core::indices::Indices;

/// An undecided dispute.
#[derive(Debug, Clone, PartialEq)]
pub struct Dispute {
    /// The votes of at least two hosts.
    pub(crate) ballot: Ballot,
    /// Time when the dispute began.
    pub since: Duration,
    /// Batches of the hosts that are asked for their votes, and their duplicates.
    pub tie_breakers: Vec<BatchId>,
    /// Workers that were lost over it.
    pub(crate) crashes: Crashes,
}

impl Dispute {
    /// Returns a dispute about realizations between two hosts, or `None` if it is one host.
    pub(crate) fn new(indices: Indices, votes: [Vote; 2], since: Duration) -> Option<Self> {
        let mut ballot = Ballot::new(indices);
        let counted = votes.into_iter().all(|vote| ballot.cast(vote) == Cast::Counted);
        (counted && ballot.count() > 1).then(|| Self {
            ballot,
            since,
            tie_breakers: Vec::new(),
            crashes: Crashes::default(),
        })
    }

    /// The disputed realizations.
    pub(crate) fn indices(&self) -> Indices {
        self.ballot.indices()
    }

    /// Returns whether a host has voted.
    pub(crate) fn has_vote_of(&self, host: &str) -> bool {
        self.ballot.has_vote_of(host)
    }

    /// Removes the vote of a banned host, and returns whether anything is left to decide.
    pub(crate) fn forget(&mut self, host: &str) -> bool {
        self.ballot.withdraw(host);
        self.ballot.contradiction().is_some()
    }
}
