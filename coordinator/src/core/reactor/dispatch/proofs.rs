//! Asks workers for their proofs of a setup.

use std::collections::BTreeSet;

use crate::core::batch::{Assignment, Batch, Purpose};
use crate::core::effect::Effect;
use crate::core::ids::{BatchId, JobId, WorkerId};
use crate::core::policy::VOTERS_MAX;
use crate::core::proofs::SetupKey;
use crate::core::reactor::turn::Turn;
use crate::core::state::AttachedWorker;

/// Asks a worker that is about to get a batch of a job for its proof of the setup, if there is another
/// host to compare it with. The first time, further hosts are asked, too, for a majority.
pub(crate) fn ask_before(turn: &mut Turn, worker: WorkerId, job: JobId) {
    let known = turn.state.jobs.get(&job).filter(|_| turn.state.config.proofs);
    let Some(setup) = known.map(|job| job.setup) else {
        return;
    };
    let is_proven = |attached: &AttachedWorker| attached.proven.contains(&setup);
    if turn.state.workers.get(&worker).is_none_or(is_proven) {
        return;
    }
    if turn.state.proofs.for_setup(&setup).is_none() {
        if !turn.state.has_several_hosts() || !begin(turn, job, setup) {
            return;
        }
        ask(turn, worker, job);
        ask_further(turn, job, VOTERS_MAX);
    } else {
        ask(turn, worker, job);
    }
}

/// Begins the proofs of a setup with realizations of a job's first known point.
fn begin(turn: &mut Turn, id: JobId, setup: SetupKey) -> bool {
    let attempt = turn.state.new_attempt();
    let known = turn.state.jobs.get(&id).and_then(|job| {
        let evaluation = job.evaluations().next()?;
        Some((evaluation.point, evaluation.realizations()))
    });
    let Some((point, realizations)) = known else {
        return false;
    };
    let Some(input) = turn.state.input(id, attempt, point) else {
        return false;
    };
    turn.state.proofs.begin(setup, (input, realizations), turn.now);
    true
}

/// Asks hosts that have not voted, until `hosts_max` have voted or are asked.
pub(super) fn ask_further(turn: &mut Turn, job: JobId, hosts_max: usize) {
    let Some(setup) = turn.state.jobs.get(&job).map(|job| job.setup) else {
        return;
    };
    let Some(proofs) = turn.state.proofs.for_setup(&setup) else {
        return;
    };
    let state = &*turn.state;
    let asked = proofs.out.keys().filter_map(|id| Some(state.workers.get(id)?.name.host()));
    let mut hosts: BTreeSet<&str> = proofs.ballot.hosts().chain(asked).collect();
    let mut chosen = Vec::new();
    for (id, worker) in &state.workers {
        if hosts.len() >= hosts_max {
            break;
        }
        if state.is_sound(worker) && hosts.insert(worker.name.host()) {
            chosen.push(*id);
        }
    }
    chosen.into_iter().for_each(|worker| ask(turn, worker, job));
}

/// Sends a worker the batch by which it proves itself, unless it has it.
pub(super) fn ask(turn: &mut Turn, worker: WorkerId, job: JobId) {
    let Some(setup) = turn.state.jobs.get(&job).map(|job| job.setup) else {
        return;
    };
    turn.state.proofs.touch(&setup, turn.now);
    let Some(proofs) = turn.state.proofs.for_setup(&setup) else {
        return;
    };
    if proofs.out.contains_key(&worker) {
        return;
    }
    let (attempt, indices) = (proofs.attempt(), proofs.indices());
    let assignment = Assignment { job, attempt, indices };
    let Some(work) = turn.state.work(&assignment) else {
        return;
    };
    let batch = BatchId(turn.state.next_batch);
    turn.state.next_batch += 1;
    turn.state.batches.insert(batch, Batch::new(assignment, Purpose::Proof, worker, turn.now));
    if let Some(attached) = turn.state.workers.get_mut(&worker) {
        attached.proofs.push(batch);
    }
    if let Some(proofs) = turn.state.proofs.for_setup_mut(&setup) {
        proofs.out.insert(worker, batch);
    }
    turn.effects.push(Effect::Send { worker, batch, work });
}
