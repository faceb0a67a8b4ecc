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
use osteon_coordinator::leftover;
use osteon_coordinator::reactor::{Restored, react};
use osteon_coordinator::search::{Search, Step};
use osteon_coordinator::state::State;
use osteon_coordinator::store::sqlite::SqliteStore;
use osteon_coordinator::store::{EvaluationRecord, Store};

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

/// A version of the program with other numerics has begun the job: none of its outcomes is left
/// in the result.
#[test]
fn evaluations_of_other_numerics_are_computed_again() {
    let specification = fake::identification(20, 6, 5);
    let directory = tempfile::tempdir().unwrap();
    assert!(!live(directory.path(), &specification, Some(Death::After(4))));
    let mut store = SqliteStore::open(directory.path()).unwrap();
    store.begin_again(JobId(1), "osteon 0.0.0 numerics 0").unwrap();
    let mut search = Search::new(Arc::new(specification.clone()));
    for number in 0..3 {
        let Step::Evaluate(point) = search.ask() else { panic!("done") };
        let outcomes: Arc<[_]> = [Ok(4000.0 + number as f64); 20].into();
        let record = EvaluationRecord {
            job: JobId(1),
            number,
            point,
            outcomes: outcomes.clone(),
            estimated_error: None,
            workers: [].into(),
        };
        store.put_evaluation(&record, true).unwrap();
        search.tell(outcomes, None);
    }
    drop(store);
    assert!(live(directory.path(), &specification, None));
    assert_eq!(result(directory.path()), format!("{:?}", fake::plain_run(&specification)));
    let mut store = SqliteStore::open(directory.path()).unwrap();
    assert_eq!(store.jobs().unwrap()[0].record.fingerprint, version::fingerprint());
}

/// One life of a coordinator with one worker; whether it got to the end of the job.
fn live(directory: &Path, specification: &JobSpecification, death: Option<Death>) -> bool {
    let mut store = SqliteStore::open(directory).unwrap();
    let restored = Restored::load(&mut store).unwrap();
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
        client: String::new(),
        priority: 0,
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
                let solved = fake::solved(&work);
                Event::Answered { worker, batch, solved, elapsed_s: 0.1 }
            }
            Effect::Store(record) => {
                writes += 1;
                if death == Some(Death::Before(writes)) {
                    return false;
                }
                match &record {
                    Record::Job(record) => store.put_job(record).unwrap(),
                    Record::Evaluation { record, is_last } => {
                        store.put_evaluation(record, *is_last).unwrap();
                    }
                    Record::End { end, summary } => store.finish_job(end, summary).unwrap(),
                    Record::Expulsion(_) => unreachable!("there is one worker, and it is honest"),
                }
                if death == Some(Death::After(writes)) {
                    return false;
                }
                let (job, key) = record.key();
                Event::Stored { job, key }
            }
            Effect::Read { job, number } => {
                let found = Ok(store.evaluation(job, number).unwrap());
                Event::Read { job, number, found }
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
    let left = leftover::read(&mut store, jobs[0].end.as_ref().unwrap());
    format!("{:?}", left.unwrap().result)
}
