//! Proofs: before the answers of a worker count, it computes a few realizations of the same setup that
//! other hosts compute, too, and its answer must be that of the majority.
//!
//! A worker gives such a proof in each of its stays, as the machine may have changed, and for each setup, as
//! a defect may show with one and not with another. The proofs of all hosts are votes of one ballot, so
//! that it is known at once who is right. They are kept while the coordinator runs, also those of hosts
//! that have left.
//!
//! When two hosts are found to differ at a realization, it becomes the one by which all prove themselves:
//! one that tells sound from broken hosts. So a later host decides what two could not, and until then no
//! result of theirs counts.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::parameters::Point;
use osteon_proto::evaluation::{self, EvaluationInput};
use prost::Message as _;

use crate::core::ballot::Ballot;
use crate::core::ids::{BatchId, WorkerId};
use crate::core::indices::Indices;
use crate::core::policy::{PROOF_DIVISOR, PROOF_MAX, PROVEN_SETUPS_MAX, PROVEN_WORKERS_MAX};
use crate::core::worker_name::WorkerName;

/// Digest of what a solver is set up for: layers, probe, picking, solver settings, random quantities
/// and what is asked for. Different setups have different keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct SetupKey([u8; 32]);

impl SetupKey {
    /// Returns the key of a job's setup.
    pub(crate) fn from_specification(specification: &JobSpecification) -> Self {
        let setup = EvaluationInput {
            id: 0,
            setup: specification.setup.clone(),
            point: specification.start(),
            germs: specification.monte_carlo.germs(),
            random: specification.random,
            observables: specification.observables(),
        };
        let mut message = evaluation::to_message(&setup);
        (message.point, message.seed, message.sampling) = (None, 0, 0);
        message.points_per_scramble = None;
        Self(*blake3::hash(&message.encode_to_vec()).as_bytes())
    }
}

/// The proofs of one setup.
#[derive(Debug)]
pub(crate) struct SetupProofs {
    /// What workers compute for a proof. Its `id` is the attempt, a number that no evaluation has.
    input: Arc<EvaluationInput>,
    /// The votes of the hosts.
    pub(crate) ballot: Ballot,
    /// The batches that workers have not answered yet.
    pub(crate) out: BTreeMap<WorkerId, BatchId>,
    /// The workers that have given their proof, in any of their stays, with the time of the last one.
    given: BTreeMap<WorkerName, Duration>,
    /// Time since which at least two hosts have voted, and no answer has the votes of a majority of those
    /// that have voted or are asked.
    pub(crate) undecided_since: Option<Duration>,
    /// Time of their last use.
    used: Duration,
}

impl SetupProofs {
    /// The realizations of a proof.
    pub(crate) fn indices(&self) -> Indices {
        self.ballot.indices()
    }

    /// The point of the realizations.
    pub(crate) fn point(&self) -> Point {
        self.input.point
    }

    /// Number by which batches refer to what is computed.
    pub(crate) fn attempt(&self) -> u64 {
        self.input.id
    }

    /// Records that a worker has given its proof. If too many have, the one that gave it longest ago is
    /// forgotten: if its answers are needed later, it proves itself again, or one of them is audited. Far more
    /// workers are remembered than can be attached, so that renewed proofs do not push each other out.
    pub(crate) fn give(&mut self, name: &WorkerName, now: Duration) {
        if self.given.len() >= PROVEN_WORKERS_MAX && !self.given.contains_key(name) {
            let longest_ago = self.given.iter().min_by_key(|(_, time)| **time);
            if let Some(name) = longest_ago.map(|(name, _)| name.clone()) {
                self.given.remove(&name);
            }
        }
        self.given.insert(name.clone(), now);
    }

    /// Returns whether a worker has given its proof, in any of its stays.
    pub(crate) fn is_given_by(&self, name: &WorkerName) -> bool {
        self.given.contains_key(name)
    }

    /// Removes what a banned host has given.
    fn withdraw(&mut self, host: &str) {
        self.ballot.withdraw(host);
        self.given.retain(|name, _| name.host() != host);
        self.undecided_since = None;
    }
}

/// The proofs of all setups.
#[derive(Debug, Default)]
pub(crate) struct Proofs(BTreeMap<SetupKey, SetupProofs>);

impl Proofs {
    pub(crate) fn for_setup(&self, setup: &SetupKey) -> Option<&SetupProofs> {
        self.0.get(setup)
    }

    pub(crate) fn for_setup_mut(&mut self, setup: &SetupKey) -> Option<&mut SetupProofs> {
        self.0.get_mut(setup)
    }

    /// Returns the setup whose proofs have this attempt, with them.
    pub(crate) fn with_attempt(&self, attempt: u64) -> Option<(SetupKey, &SetupProofs)> {
        let found = self.0.iter().find(|(_, proofs)| proofs.attempt() == attempt);
        found.map(|(setup, proofs)| (*setup, proofs))
    }

    /// Returns what the batches of this attempt compute.
    pub(crate) fn input(&self, attempt: u64) -> Option<Arc<EvaluationInput>> {
        self.with_attempt(attempt).map(|(_, proofs)| Arc::clone(&proofs.input))
    }

    /// Begins the proofs of a setup by some of the realizations of `input`, which has `realizations`.
    pub(crate) fn begin(
        &mut self,
        setup: SetupKey,
        (input, realizations): (EvaluationInput, u64),
        now: Duration,
    ) {
        if self.0.len() >= PROVEN_SETUPS_MAX {
            // Setups in use are touched all the time, so the least recently used one is not in use.
            let without_batches = self.0.iter().filter(|(_, proofs)| proofs.out.is_empty());
            if let Some(oldest) =
                without_batches.min_by_key(|(_, it)| it.used).map(|(setup, _)| *setup)
            {
                self.0.remove(&oldest);
            }
        }
        let indices =
            Indices { first: 0, count: (1 + realizations / PROOF_DIVISOR).min(PROOF_MAX) };
        let proofs = SetupProofs {
            input: Arc::new(input),
            ballot: Ballot::new(indices),
            out: BTreeMap::new(),
            given: BTreeMap::new(),
            undecided_since: None,
            used: now,
        };
        self.0.insert(setup, proofs);
    }

    /// Replaces what is computed for a setup, with votes that are known. No batch for it may be out.
    pub(crate) fn replace(
        &mut self,
        setup: SetupKey,
        (input, ballot): (EvaluationInput, Ballot),
        now: Duration,
    ) {
        let given = ballot.voters().map(|name| (name.clone(), now)).collect();
        let (input, out) = (Arc::new(input), BTreeMap::new());
        let undecided_since = None;
        self.0.insert(setup, SetupProofs { input, ballot, out, given, undecided_since, used: now });
    }

    /// Notes that a setup is in use.
    pub(crate) fn touch(&mut self, setup: &SetupKey, now: Duration) {
        if let Some(proofs) = self.0.get_mut(setup) {
            proofs.used = now;
        }
    }

    /// Removes the batch of a worker, which is answered or revoked.
    pub(crate) fn settle(&mut self, attempt: u64, worker: WorkerId) {
        if let Some(proofs) = self.0.values_mut().find(|proofs| proofs.attempt() == attempt) {
            proofs.out.remove(&worker);
        }
    }

    /// Removes what a banned host has given.
    pub(crate) fn withdraw(&mut self, host: &str) {
        self.0.values_mut().for_each(|proofs| proofs.withdraw(host));
    }

    /// Returns the setups whose proofs are known.
    pub(crate) fn setups(&self) -> impl Iterator<Item = &SetupKey> {
        self.0.keys()
    }
}

#[cfg(test)]
mod tests {
    use osteon_common::job::MonteCarlo;

    use super::*;

    /// When no more can be remembered, the worker whose proof is the oldest is forgotten, not the one whose
    /// name comes first.
    #[test]
    fn a_worker_that_gives_its_proof_again_is_remembered() {
        let mut proofs = Proofs::default();
        let (key, point) = (SetupKey([0; 32]), Point::of_bone([1.0; 7]));
        let input = EvaluationInput {
            id: 0,
            setup: Default::default(),
            point,
            germs: MonteCarlo::default().germs(),
            random: Default::default(),
            observables: Default::default(),
        };
        proofs.begin(key, (input, 1), Duration::ZERO);
        let proofs = proofs.for_setup_mut(&key).unwrap();
        let name = |process: usize| WorkerName::new("a", process as u32, 0);
        let mut seconds = 0;
        let mut give = |process: usize| {
            seconds += 1;
            proofs.give(&name(process), Duration::from_secs(seconds));
        };
        (0..=PROVEN_WORKERS_MAX).for_each(&mut give);
        [0, 1].into_iter().for_each(give);
        assert_eq!(proofs.given.len(), PROVEN_WORKERS_MAX);
        let remembered = [0, 1, 2, 3].map(|process| proofs.is_given_by(&name(process)));
        assert_eq!(remembered, [true, true, false, true]);
    }
}
