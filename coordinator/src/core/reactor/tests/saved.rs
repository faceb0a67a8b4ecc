//! Results of incomplete evaluations: saved now and then, and used after a restart.

use super::*;
use crate::core::indices::Indices;
use crate::core::job::Stage;
use crate::core::reactor::Restored;
use crate::core::worker_name::WorkerName;
use crate::store::memory::MemoryStore;
use crate::store::{BanRecord, PIECE_OUTCOMES, Store as _};

/// Returns a rig with a propagation of 100 realizations of which worker 1 has answered the first
/// batches, and worker 2 none.
fn rig() -> (Rig, u64) {
    let mut rig = Rig::new();
    rig.state.config.audit_fraction = 0.0;
    rig.accept(propagation(100));
    rig.event(hello_on("one", 1, 1, 2));
    let mut answered = 0;
    for _ in 0..2 {
        let held = &rig.state.workers[&WorkerId(1)].in_flight;
        let batch = held[0];
        let indices = rig.state.batches[&batch].assignment.indices;
        rig.event(answer(1, batch.0, indices.first, indices.count));
        answered += indices.count;
    }
    rig.event(hello_on("two", 2, 2, 2));
    (rig, answered)
}

/// Applies an event, and stores the parts among its effects. Returns the number of results in them.
fn stored_parts(rig: &mut Rig, store: &mut MemoryStore, event: Event) -> usize {
    let effects = react(&mut rig.state, event, rig.now);
    let parts = effects.iter().filter_map(|effect| match effect {
        Effect::Store(Record::Part(part)) => Some(part),
        _ => None,
    });
    let mut results = 0;
    for part in parts {
        store.put_part(part).unwrap();
        results += part.pieces.iter().map(|piece| piece.results.len()).sum::<usize>();
    }
    results
}

/// Returns what another coordinator makes of the store.
fn restart(rig: &Rig, store: &mut MemoryStore) -> Rig {
    store.put_job(&rig.state.jobs[&JobId(1)].record).unwrap();
    let restored = Restored::load(store).unwrap();
    let config = Config { audit_fraction: 0.0, speculation: false, ..Config::default() };
    let (state, _) = State::restore(config, restored, rig.now);
    sanity_check(&state).unwrap();
    Rig { state, now: rig.now }
}

fn filled_realizations(rig: &Rig) -> u64 {
    rig.state.jobs[&JobId(1)].evaluation().unwrap().filled()
}

#[test]
fn answers_of_unproven_workers_are_not_saved() {
    let mut rig = Rig::new();
    (rig.state.config.proofs, rig.state.config.audit_fraction) = (true, 0.0);
    rig.accept(propagation(100));
    rig.event(hello_of(1, 1, 1));
    rig.event(hello_of(2, 2, 1));
    let saved = |rig: &mut Rig| {
        rig.now += Duration::from_secs(2);
        let effects = react(&mut rig.state, Event::Tick, rig.now);
        effects.iter().any(|effect| matches!(effect, Effect::Store(Record::Part(_))))
    };
    // Worker 1 had its batch before anybody could check it; now it owes a proof.
    rig.event(answer(1, 1, 0, 4));
    saved(&mut rig);
    assert!(!saved(&mut rig), "what may be wrong was saved");
    let proofs: Vec<(u64, u64)> =
        rig.state.workers.iter().map(|(id, worker)| (id.0, worker.proofs[0].0)).collect();
    for (worker, batch) in proofs {
        rig.event(answer(worker, batch, 0, 1));
    }
    assert!(saved(&mut rig) || saved(&mut rig));
}

#[test]
fn a_restart_repeats_only_what_was_answered_last() {
    let (mut rig, answered) = rig();
    let mut store = MemoryStore::new();
    // Nothing is saved of an evaluation that is soon complete.
    assert_eq!(stored_parts(&mut rig, &mut store, Event::Tick), 0);
    rig.now += Duration::from_secs(1);
    assert_eq!(stored_parts(&mut rig, &mut store, Event::Tick), 0);
    rig.now += Duration::from_secs(1);
    assert_eq!(stored_parts(&mut rig, &mut store, Event::Tick) as u64, answered);
    // What is saved is not saved again.
    rig.now += Duration::from_secs(2);
    assert_eq!(stored_parts(&mut rig, &mut store, Event::Tick), 0);
    let mut after = restart(&rig, &mut store);
    assert_eq!(filled_realizations(&after), answered);
    let first = format!("send 1: batch 1 = {answered}+");
    assert!(after.event(hello(1, 2))[1].starts_with(&first), "{first}");
}

#[test]
fn a_stop_saves_everything() {
    let (mut rig, answered) = rig();
    let mut store = MemoryStore::new();
    assert_eq!(stored_parts(&mut rig, &mut store, Event::Drain) as u64, answered);
    assert_eq!(filled_realizations(&restart(&rig, &mut store)), answered);
}

#[test]
fn a_write_that_fails_is_repeated_with_the_next() {
    let (mut rig, answered) = rig();
    let mut store = MemoryStore::new();
    stored_parts(&mut rig, &mut store, Event::Tick);
    rig.now += Duration::from_secs(2);
    assert_eq!(stored_parts(&mut rig, &mut MemoryStore::new(), Event::Tick) as u64, answered);
    let error = "the disk is full".to_owned();
    rig.check(Event::StoreFailed { job: JobId(1), key: RecordKey::Part, error }, &[]);
    rig.now += Duration::from_secs(2);
    assert_eq!(stored_parts(&mut rig, &mut store, Event::Tick) as u64, answered);
    assert_eq!(filled_realizations(&restart(&rig, &mut store)), answered);
}

#[test]
fn answers_of_a_banned_worker_are_not_used() {
    let (mut rig, answered) = rig();
    let mut store = MemoryStore::new();
    stored_parts(&mut rig, &mut store, Event::Drain);
    let worker = WorkerName::new("one", 1, 0);
    let reason = "lies".to_owned();
    let ban = BanRecord {
        number: 1,
        worker: worker.clone(),
        job: JobId(1),
        reason,
        at: rig.now,
        lifted: None,
    };
    // Banned after the restart.
    let mut after = restart(&rig, &mut store);
    assert_eq!(filled_realizations(&after), answered);
    bans::ban(&mut Turn::new(&mut after.state, rig.now), &worker, JobId(1), "lies".to_owned());
    sanity_check(&after.state).unwrap();
    assert_eq!(filled_realizations(&after), 0);
    // Banned before it.
    store.put_ban(&ban).unwrap();
    assert_eq!(filled_realizations(&restart(&rig, &mut store)), 0);
}

#[test]
fn what_is_used_again_is_audited_like_an_answer() {
    let (mut rig, answered) = rig();
    let mut store = MemoryStore::new();
    stored_parts(&mut rig, &mut store, Event::Drain);
    store.put_job(&rig.state.jobs[&JobId(1)].record).unwrap();
    let restored = Restored::load(&mut store).unwrap();
    let config = Config { audit_fraction: 1.0, speculation: false, ..Config::default() };
    let (state, _) = State::restore(config, restored, rig.now);
    let audits = &state.jobs[&JobId(1)].evaluation().unwrap().audits;
    let audited: u64 = audits.iter().map(|audit| audit.indices.count).sum();
    assert_eq!(audited, answered);
}

#[test]
fn a_complete_evaluation_leaves_nothing_saved() {
    let (mut rig, _) = rig();
    let mut store = MemoryStore::new();
    stored_parts(&mut rig, &mut store, Event::Drain);
    assert!(!store.parts(JobId(1)).unwrap().is_empty());
    let mut after = restart(&rig, &mut store);
    let mut sent: Vec<Effect> = react(&mut after.state, hello(1, 2), after.now);
    while let Some(effect) = sent.pop() {
        match effect {
            Effect::Send { worker, batch, work } => {
                let answer = answer(worker.0, batch.0, work.first, work.count.into());
                sent.extend(react(&mut after.state, answer, after.now));
            }
            Effect::Store(Record::Evaluation { record, deletes_later }) => {
                assert_eq!(record.outcomes, (0..100).map(velocity).collect());
                store.put_evaluation(&record, deletes_later).unwrap();
            }
            _ => {}
        }
    }
    assert!(store.parts(JobId(1)).unwrap().is_empty());
}

#[test]
fn full_pieces_of_a_large_evaluation_are_stored_before_it_is_complete() {
    let mut rig = Rig::with(3 * PIECE_OUTCOMES as u64, &[4]);
    let piece = PIECE_OUTCOMES as u64;
    let fill = |rig: &mut Rig, first, count| {
        let job = rig.state.jobs.get_mut(&JobId(1)).unwrap();
        let Stage::Computing(evaluation) = &mut job.stage else { panic!("nothing is computed") };
        let result = RealizationResult::solved(3900.0, 1e-5);
        let solved = vec![result; usize::try_from(count).unwrap()];
        evaluation.fill(Indices { first, count }, &solved, &WorkerName::new("node", 1, 1));
    };
    let pieces = |rig: &mut Rig| -> Vec<(u64, u64)> {
        let effects = react(&mut rig.state, Event::Tick, rig.now);
        let piece = |effect| match effect {
            Effect::Store(Record::Piece { record, attempt }) => Some((record.first, attempt)),
            _ => None,
        };
        effects.into_iter().filter_map(piece).collect()
    };
    fill(&mut rig, piece, piece - 1);
    assert_eq!(pieces(&mut rig), []);
    fill(&mut rig, 2 * piece - 1, 1);
    let (attempt, being_stored) = {
        let [(first, attempt)] = pieces(&mut rig)[..] else { panic!("not one piece") };
        assert_eq!(first, piece);
        let count =
            |rig: &Rig| rig.state.jobs[&JobId(1)].evaluation().unwrap().pieces.being_stored();
        (attempt, count)
    };
    // Reports of another attempt do not count, and a failure is no reason to try again.
    let error = || "the disk is full".to_owned();
    for (key, left) in [(RecordKey::Piece(attempt + 1), 1), (RecordKey::Piece(attempt), 0)] {
        let _ = react(
            &mut rig.state,
            Event::StoreFailed { job: JobId(1), key, error: error() },
            rig.now,
        );
        assert_eq!(being_stored(&rig), left, "{key:?}");
    }
    assert_eq!(pieces(&mut rig), []);
    fill(&mut rig, 2 * piece, piece);
    assert_eq!(pieces(&mut rig), [(2 * piece, attempt)]);
    let _ = react(&mut rig.state, stored_event(1, RecordKey::Piece(attempt)), rig.now);
    assert_eq!(being_stored(&rig), 0);
}
