//! Identifiers of jobs are assigned once: a client that asks for a deleted job, or fetches it late,
//! must not get the job of another client. That happened after a restart when the newest job had
//! been deleted: the next one got its number.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;

use std::time::Duration;

use osteon_coordinator::config::Config;
use osteon_coordinator::core::effect::{Effect, Record};
use osteon_coordinator::core::event::Event;
use osteon_coordinator::core::ids::{JobId, ReplyId};
use osteon_coordinator::core::reactor::{Restored, react};
use osteon_coordinator::core::state::State;
use osteon_coordinator::store::Store;
use osteon_coordinator::store::memory::MemoryStore;
use osteon_coordinator::store::sqlite::SqliteStore;

/// Returns the identifier that the next run assigns to a job, which it stores.
fn next(store: &mut dyn Store) -> JobId {
    let restored = Restored::load(store).unwrap();
    let (mut state, _) = State::restore(Config::default(), restored, Duration::ZERO);
    let request = fake::submission(&fake::propagation(10, 1), "");
    let submitted = Event::Requested { reply_id: ReplyId(1), request };
    let effects = react(&mut state, submitted, Duration::ZERO);
    let [Effect::Store(Record::Job(record))] = effects.as_slice() else { panic!("{effects:?}") };
    store.put_job(record).unwrap();
    record.job
}

fn check(mut open: impl FnMut() -> Box<dyn Store>) {
    assert_eq!(next(&mut *open()), JobId(1));
    assert_eq!(next(&mut *open()), JobId(2));
    open().delete_jobs(&[JobId(2)]).unwrap();
    assert_eq!(next(&mut *open()), JobId(3));
    // Deleting an older job does not lower it.
    open().delete_jobs(&[JobId(3)]).unwrap();
    open().delete_jobs(&[JobId(1)]).unwrap();
    assert_eq!(open().last_deleted_job().unwrap(), Some(JobId(3)));
    assert_eq!(next(&mut *open()), JobId(4));
}

#[test]
fn no_job_gets_the_number_of_a_forgotten_one() {
    let memory = MemoryStore::new();
    check(|| Box::new(memory.clone()));
    let directory = tempfile::tempdir().unwrap();
    check(|| Box::new(SqliteStore::open(directory.path()).unwrap()));
}
