//! The coordinator is killed at every single write to its file, just before and just after it;
//! what comes up on what is left goes on to the same result.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod fake;

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::version;
use osteon_coordinator::config::Config;
use osteon_coordinator::effect::{Effect, Record};
use osteon_coordinator::event::{Event, Hello, Request};
use osteon_coordinator::ids::{JobId, Token, WorkerId};
use osteon_coordinator::reactor::{RestoredJob, react};
use osteon_coordinator::search::Search;
use osteon_coordinator::state::State;
use osteon_coordinator::store::Store;
use osteon_coordinator::store::sqlite::SqliteStore;

/// When a process dies, counted in writes since the beginning of the job.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Death {
    Before(u32),
    After(u32),
}

#[test]
fn killed_at_any_write_it_goes_on_to_the_same_result() {
    // The job, its evaluations, its end.
    for (specification, writes) in
        [(fake::identification(20, 6, 5), 1 + 6 + 1), (fake::propagation(30, 5), 1 + 1 + 1)]
    {
        let expected = format!("{:?}", fake::plain_run(&specification));
        for write in 1..=writes {
            for death in [Death::Before(write), Death::After(write)] {
                let directory = tempfile::tempdir().unwrap();
                let survived = live(directory.path(), &specification, Some(death));
                assert!(!survived, "{death:?} never came");
                assert!(live(directory.path(), &specification, None), "{death:?}");
                assert_eq!(result(directory.path()), expected, "{death:?}");
            }
        }
        let directory = tempfile::tempdir().unwrap();
        let beyond = Some(Death::Before(writes + 1));
        assert!(live(directory.path(), &specification, beyond), "a write too many");
    }
}

/// One life of a coordinator with one worker; whether it got to the end of the job.
fn live(directory: &Path, specification: &JobSpecification, death: Option<Death>) -> bool {
    let mut store = SqliteStore::open(directory).unwrap();
    let restored = RestoredJob::load(&mut store).unwrap();
    let (mut state, effects) = State::restore(Config::default(), restored, Duration::ZERO);
    let worker = WorkerId(1);
    let hello = Hello {
        version: version::VERSION.to_owned(),
        fingerprint: version::fingerprint(),
        threads: 1,
        host: String::new(),
        process: 1,
    };
    // The client does not know whether its first submission was accepted, and submits again.
    let submit = Request::Submit {
        specification: Arc::new(specification.clone()),
        request_id: "the one".to_owned(),
    };
    let mut effects = VecDeque::from(effects);
    for event in
        [Event::Requested { token: Token(1), request: submit }, Event::Hello { worker, hello }]
    {
        effects.extend(react(&mut state, event, Duration::ZERO));
    }
    let mut writes = 0;
    while let Some(effect) = effects.pop_front() {
        let event = match effect {
            Effect::Send { batch, work, .. } => {
                let outcomes = fake::outcomes(&work);
                Event::Answered { worker, batch, outcomes, elapsed_s: 0.1 }
            }
            Effect::Store(record) => {
                writes += 1;
                if death == Some(Death::Before(writes)) {
                    return false;
                }
                match &record {
                    Record::Job(record) => store.put_job(record).unwrap(),
                    Record::Evaluation(record) => store.put_evaluation(record).unwrap(),
                    Record::End(record) => store.finish_job(record).unwrap(),
                }
                if death == Some(Death::After(writes)) {
                    return false;
                }
                let (job, key) = record.key();
                Event::Stored { job, key }
            }
            _ => continue,
        };
        effects.extend(react(&mut state, event, Duration::ZERO));
    }
    state.is_idle()
}

/// What the store says of the only job there is, as text: NaN equals nothing.
fn result(directory: &Path) -> String {
    let mut store = SqliteStore::open(directory).unwrap();
    let jobs = store.jobs().unwrap();
    assert_eq!(jobs.len(), 1);
    let evaluations = store.evaluations(JobId(1)).unwrap();
    let told = evaluations.into_iter().map(|stored| (stored.point, stored.outcomes));
    let search = Search::replay(jobs[0].record.specification.clone(), told).unwrap();
    let ending = jobs[0].end.clone().unwrap().ending;
    format!("{:?}", search.result(&ending, version::VERSION))
}
