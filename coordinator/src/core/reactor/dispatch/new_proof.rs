//! Replaces the realizations by which workers prove themselves by one about which hosts differ.

use osteon_common::parameters::Point;

use super::{batches, proofs};
use crate::core::ballot::Ballot;
use crate::core::ids::JobId;
use crate::core::reactor::turn::Turn;

/// Has all workers prove themselves by one realization of an evaluation about which hosts differ.
pub(crate) fn replace(turn: &mut Turn, (id, point): (JobId, Point), index: u64, votes: &Ballot) {
    let attempt = turn.state.new_attempt();
    let known = turn.state.jobs.get(&id).filter(|_| turn.state.config.proofs);
    let Some(setup) = known.map(|job| job.setup) else {
        return;
    };
    let Some(input) = turn.state.input(id, attempt, point) else {
        return;
    };
    let out =
        turn.state.proofs.for_setup(&setup).map(|proofs| proofs.out.clone()).unwrap_or_default();
    for batch in out.into_values() {
        batches::revoke(turn, batch);
    }
    turn.state.proofs.replace(setup, (input, votes.for_index(index)), turn.now);
    let mut waiting = Vec::new();
    for (worker, attached) in &mut turn.state.workers {
        attached.proven.remove(&setup);
        if !attached.early.is_empty() {
            waiting.push(*worker);
        }
    }
    // Their answers wait for it.
    waiting.into_iter().for_each(|worker| proofs::ask(turn, worker, id));
}
