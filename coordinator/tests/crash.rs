//! The coordinator is killed at every single write to its file, just before and just after it; a
//! restart on the remaining files must reach the same result.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod fake;

use std::collections::{BTreeMap, VecDeque};
use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::outcomes::Outcomes;
use osteon_common::version;
use osteon_coordinator::config::Config;
use osteon_coordinator::core::effect::{Answer, Effect};
use osteon_coordinator::core::event::Event;
use osteon_coordinator::core::ids::{BatchId, JobId, ReplyId, WorkerId};
use osteon_coordinator::core::reactor::{Restored, react};
use osteon_coordinator::core::state::State;
use osteon_coordinator::store::job_output;
use osteon_coordinator::store::sqlite::{LostJobs, SqliteStore};
use osteon_coordinator::store::{EvaluationRecord, JobRecord, Store, StoreError, StoredJob};
use osteon_proto::batch::Work;
use osteon_search::{Search, Step};
use tempfile::TempDir;

/// Time of a process's death, counted in writes since the beginning of the job.
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

/// A version of the program with other numerics began the job: none of its outcomes may be in the
/// result.
#[test]
fn evaluations_of_other_numerics_are_computed_again() {
    let specification = fake::identification(20, 6, 5);
    let directory = tempfile::tempdir().unwrap();
    assert!(!live(directory.path(), &specification, Some(Death::After(4))));
    let mut store = SqliteStore::open(directory.path()).unwrap();
    store.reset_job(JobId(1), "osteon 0.0.0 numerics 0").unwrap();
    let mut search = Search::new(Arc::new(specification.clone()));
    for number in 0..3 {
        let Step::Evaluate(point) = search.ask() else { panic!("done") };
        let outcomes: Outcomes = [Ok(4000.0 + number as f64); 20].into();
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

/// A worker returns wrong answers now and then and is found out late. The coordinator is killed at
/// every write before, during and after the recomputation of everything the worker contributed to.
#[test]
fn killed_at_any_write_a_lie_that_was_found_leaves_no_trace() {
    let specification = fake::identification(40, 12, 5);
    let expected = format!("{:?}", fake::plain_run(&specification));
    let lives = |death: Option<Death>| {
        let directory = tempfile::tempdir().unwrap();
        let ended = live_with(directory.path(), &specification, death, Crew::WITH_LIAR);
        if death.is_some() && !ended {
            assert!(live_with(directory.path(), &specification, None, Crew::WITH_LIAR));
        }
        let mut store = SqliteStore::open(directory.path()).unwrap();
        let found = !store.bans().unwrap().is_empty();
        drop(store);
        (ended, found, result(directory.path()) == expected)
    };
    assert_eq!(lives(None), (true, true, true), "the lie is not found");
    let mut found = 0;
    for write in 1.. {
        for death in [Death::Before(write), Death::After(write)] {
            let (ended, banned, right) = lives(Some(death));
            assert!(right || !banned, "{death:?}");
            found += u32::from(banned && !ended);
            if ended {
                assert!(found > write, "{found} of {} times the lie was found", 2 * write);
                return;
            }
        }
    }
}

/// The bytes of every file of a store, as a process that is killed now leaves them.
type Image = Vec<(OsString, Vec<u8>)>;

fn image(directory: &Path) -> Image {
    let entries = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap());
    entries.map(|entry| (entry.file_name(), fs::read(entry.path()).unwrap())).collect()
}

fn part<'i>(image: &'i mut Image, name: &str) -> &'i mut Vec<u8> {
    &mut image.iter_mut().find(|(file, _)| file == name).unwrap().1
}

/// Opens a store with these files.
fn opened(image: &Image, lost: LostJobs) -> (TempDir, Result<SqliteStore, StoreError>) {
    let directory = tempfile::tempdir().unwrap();
    for (name, bytes) in image {
        fs::write(directory.path().join(name), bytes).unwrap();
    }
    let store = SqliteStore::open_with(directory.path(), lost);
    (directory, store)
}

fn record(job: u64) -> JobRecord {
    JobRecord {
        job: JobId(job),
        request_id: String::new(),
        specification: Arc::new(fake::propagation(10, job)),
        accepted: Duration::from_secs(1),
        fingerprint: version::fingerprint(),
        client: String::new(),
        priority: 0,
        name: String::new(),
    }
}

fn numbers(store: &mut SqliteStore) -> Vec<u64> {
    store.jobs().unwrap().iter().map(|job| job.record.job.0).collect()
}

const LOG: &str = "osteon.sqlite-wal";
const MARK: &str = "osteon.acknowledged";

/// Returns a store that has acknowledged jobs 1 to 6, of which 2 is deleted, and its files after
/// each change, with the last job that was acknowledged by then.
fn lives_of_a_store() -> (TempDir, SqliteStore, Vec<(u64, Image)>) {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    let mut images = vec![(0, image(directory.path()))];
    for job in 1..=6 {
        store.put_job(&record(job)).unwrap();
        images.push((job, image(directory.path())));
        if job == 3 {
            store.delete_jobs(&[JobId(2)]).unwrap();
            images.push((job, image(directory.path())));
        }
    }
    (directory, store, images)
}

/// First a job is durable, then the mark names it, then its client is answered.
#[test]
fn killed_between_a_job_and_its_mark_no_job_is_missed() {
    let (_directory, _store, images) = lives_of_a_store();
    for pair in images.windows(2) {
        let [(_, before), (acknowledged, after)] = pair else { panic!("no pair") };
        let mut between = after.clone();
        *part(&mut between, MARK) = part(&mut before.clone(), MARK).clone();
        for image in [before, &between, after] {
            opened(image, LostJobs::Refuse).1.unwrap();
        }
        // In the opposite order a job would be missed.
        let mut lost = before.clone();
        *part(&mut lost, MARK) = part(&mut after.clone(), MARK).clone();
        let missed = lost != *before;
        let refused = opened(&lost, LostJobs::Refuse).1;
        assert_eq!(refused.is_err(), missed, "{acknowledged}");
    }
    // A job that was only stored counts from the next start on.
    let mut between = images[2].1.clone();
    *part(&mut between, MARK) = part(&mut images[1].1.clone(), MARK).clone();
    let (directory, store) = opened(&between, LostJobs::Refuse);
    drop(store.unwrap());
    let mut later = image(directory.path());
    *part(&mut later, "osteon.sqlite") = part(&mut images[0].1.clone(), "osteon.sqlite").clone();
    let refused = opened(&later, LostJobs::Refuse).1.unwrap_err();
    assert!(matches!(refused, StoreError::LostJobs { .. }), "{refused}");
}

/// SQLite takes a log that is truncated, or damaged somewhere, for one that ends there.
#[test]
fn a_log_that_was_cut_anywhere_loses_no_job_in_silence() {
    let (_directory, _store, images) = lives_of_a_store();
    let (acknowledged, whole) = images.last().unwrap();
    let length = part(&mut whole.clone(), LOG).len();
    assert!(length > 10_000, "{length}");
    opened(whole, LostJobs::Refuse).1.unwrap();
    let mut refused = 0;
    for at in (1..length).step_by(509) {
        for cut in [true, false] {
            let mut image = whole.clone();
            let log = part(&mut image, LOG);
            if cut {
                log.truncate(at);
            } else {
                log[at] ^= 0x5a;
            }
            let (directory, store) = opened(&image, LostJobs::Refuse);
            match store {
                Ok(mut store) => {
                    assert_eq!(numbers(&mut store).last(), Some(acknowledged), "{at} {cut}");
                }
                Err(error @ StoreError::LostJobs { last, .. }) => {
                    assert_eq!(last.0, *acknowledged, "{error}");
                    assert_eq!(self::image(directory.path()).len(), image.len(), "{error}");
                    for name in ["osteon.sqlite", LOG, MARK] {
                        let there = fs::read(directory.path().join(name)).unwrap();
                        assert!(there == *part(&mut image, name), "{name} is changed");
                    }
                    refused += 1;
                }
                Err(error) => panic!("{at} {cut}: {error}"),
            }
        }
    }
    assert!(refused > 20, "{refused} refused");
}

#[test]
fn lost_jobs_that_are_accepted_leave_their_numbers_unused() {
    let (_directory, _store, images) = lives_of_a_store();
    let mut image = images[2].1.clone();
    *part(&mut image, MARK) = part(&mut images.last().unwrap().1.clone(), MARK).clone();
    let (_, refused) = opened(&image, LostJobs::Refuse);
    let told = refused.unwrap_err().to_string();
    for part in ["has lost jobs 3 to 6", "restore the store from a copy", "--accept-lost-jobs"] {
        assert!(told.contains(part), "{told}");
    }
    let (directory, store) = opened(&image, LostJobs::Accept);
    let mut store = store.unwrap();
    assert_eq!(numbers(&mut store), [1, 2]);
    assert_eq!(store.last_deleted_job().unwrap(), Some(JobId(6)));
    drop(store);
    drop(SqliteStore::open(directory.path()).unwrap());
    // A damaged mark does not tell which jobs must be there.
    fs::write(directory.path().join(MARK), "?").unwrap();
    let told = SqliteStore::open(directory.path()).unwrap_err().to_string();
    assert!(told.contains("osteon.acknowledged is damaged"), "{told}");
    drop(SqliteStore::open_with(directory.path(), LostJobs::Accept).unwrap());
    drop(SqliteStore::open(directory.path()).unwrap());
}

/// The workers, and the fraction of batches that is audited.
#[derive(Debug, Clone, Copy)]
struct Crew {
    workers: u32,
    audit_fraction: f64,
    /// This process answers every seventh batch wrongly.
    liar: Option<u32>,
}

impl Crew {
    const ALONE: Self = Self { workers: 1, audit_fraction: 0.0, liar: None };
    const WITH_LIAR: Self = Self { workers: 3, audit_fraction: 0.05, liar: Some(2) };

    fn answer(self, worker: WorkerId, batch: BatchId, work: &Work) -> Event {
        let mut solved = fake::solved(work);
        if self.liar == u32::try_from(worker.0).ok() && batch.0.is_multiple_of(7) {
            solved[0].outcome = Ok(4321.0);
        }
        Event::Answered { worker, batch, solved, elapsed_s: 0.1 }
    }
}

/// Runs a coordinator with one worker; returns whether it reached the end of the job.
fn live(directory: &Path, specification: &JobSpecification, death: Option<Death>) -> bool {
    live_with(directory, specification, death, Crew::ALONE)
}

fn live_with(
    directory: &Path,
    specification: &JobSpecification,
    death: Option<Death>,
    crew: Crew,
) -> bool {
    let mut store = SqliteStore::open(directory).unwrap();
    let restored = Restored::load(&mut store).unwrap();
    let config = Config { audit_fraction: crew.audit_fraction, ..Config::default() };
    let (mut state, effects) = State::restore(config, restored, Duration::ZERO);
    let mut effects = VecDeque::from(effects);
    for event in beginning(specification, crew) {
        effects.extend(react(&mut state, event, Duration::ZERO));
    }
    let mut writes = 0;
    while let Some(effect) = effects.pop_front() {
        let event = match effect {
            Effect::Send { worker, batch, work } => crew.answer(worker, batch, &work),
            Effect::Store(record) => {
                writes += 1;
                if death == Some(Death::Before(writes)) {
                    return false;
                }
                let stored = fake::written(&mut store, &record);
                if death == Some(Death::After(writes)) {
                    return false;
                }
                stored
            }
            Effect::Read { job, number } => fake::read(&mut store, job, number),
            _ => continue,
        };
        effects.extend(react(&mut state, event, Duration::ZERO));
    }
    state.is_idle()
}

/// The client does not know whether its first submission was accepted, and submits again; the
/// workers attach.
fn beginning(specification: &JobSpecification, crew: Crew) -> Vec<Event> {
    let request = fake::submission(specification, "the one");
    let submitted = Event::Requested { reply_id: ReplyId(1), request };
    [submitted].into_iter().chain((1..=crew.workers).map(fake::attached)).collect()
}

/// Returns the stored state of the only job, as text, since NaN is not equal to itself.
fn result(directory: &Path) -> String {
    let mut store = SqliteStore::open(directory).unwrap();
    let jobs = store.jobs().unwrap();
    assert_eq!(jobs.len(), 1);
    let left = job_output::read(&mut store, jobs[0].end.as_ref().unwrap());
    format!("{:?}", left.unwrap().result)
}

/// Time of a process's death, counted in groups of records.
#[derive(Debug, Clone, Copy, PartialEq)]
enum GroupDeath {
    Before(u32),
    /// Half of the records are put, and nothing is committed.
    Within(u32),
    /// Everything is durable, and nothing is reported.
    After(u32),
}

/// The records of jobs that run at the same time are written in groups.
#[test]
fn killed_at_any_group_every_job_goes_on_to_its_result() {
    let jobs: Vec<_> = (0..3).map(|seed| fake::identification(12, 3, seed)).collect();
    let jobs = [jobs, (3..6).map(|seed| fake::propagation(12, seed)).collect()].concat();
    let expected: Vec<_> = jobs.iter().map(|job| format!("{:?}", fake::plain_run(job))).collect();
    for group in 1.. {
        let deaths =
            [GroupDeath::Before(group), GroupDeath::Within(group), GroupDeath::After(group)];
        for death in deaths {
            let directory = tempfile::tempdir().unwrap();
            let (survived, told) = live_in_groups(directory.path(), &jobs, Some(death));
            if survived {
                // Submissions, evaluations of three, and ends: of all jobs together.
                assert_eq!(group, 1 + 3 + 1 + 1, "{death:?}");
                return;
            }
            let (survived, told_again) = live_in_groups(directory.path(), &jobs, None);
            assert!(survived, "{death:?}");
            for (request, job) in &told {
                assert_eq!(told_again.get(request), Some(job), "{death:?}: {job} was accepted");
            }
            let mut store = SqliteStore::open(directory.path()).unwrap();
            let ended = store.jobs().unwrap();
            let result = |job: &StoredJob| {
                let seed = job.record.specification.monte_carlo.seed;
                let left = job_output::read(&mut store, job.end.as_ref().unwrap()).unwrap();
                (seed, format!("{:?}", left.result))
            };
            let results: BTreeMap<u64, String> = ended.iter().map(result).collect();
            assert_eq!(results.into_values().collect::<Vec<_>>(), expected, "{death:?}");
        }
    }
}

/// Runs a coordinator with one worker until all jobs have ended, or it is killed; returns which of
/// the two, and the jobs that its clients were told.
fn live_in_groups(
    directory: &Path,
    jobs: &[JobSpecification],
    death: Option<GroupDeath>,
) -> (bool, BTreeMap<ReplyId, JobId>) {
    let mut store = SqliteStore::open(directory).unwrap();
    let restored = Restored::load(&mut store).unwrap();
    let (mut state, effects) = State::restore(Config::default(), restored, Duration::ZERO);
    let submit = |(number, job): (u64, &JobSpecification)| Event::Requested {
        reply_id: ReplyId(number),
        request: fake::submission(job, &format!("request {number}")),
    };
    let mut events: VecDeque<Event> = (0..).zip(jobs).map(submit).collect();
    events.push_back(fake::attached(1));
    let (mut effects, mut told) = (VecDeque::from(effects), BTreeMap::new());
    for group in 1.. {
        let mut records = Vec::new();
        while let Some(event) = events.pop_front() {
            effects.extend(react(&mut state, event, Duration::ZERO));
            while let Some(effect) = effects.pop_front() {
                match effect {
                    Effect::Send { worker, batch, work } => {
                        events.push_back(Crew::ALONE.answer(worker, batch, &work));
                    }
                    Effect::Store(record) => records.push(record),
                    Effect::Read { job, number } => {
                        events.push_back(fake::read(&mut store, job, number));
                    }
                    Effect::Answer { reply_id, answer: Answer::Submitted(job) } => {
                        told.insert(reply_id, job);
                    }
                    _ => {}
                }
            }
        }
        if records.is_empty() {
            break;
        }
        if death == Some(GroupDeath::Before(group)) {
            return (false, told);
        }
        let written = store.together(&mut |store| {
            for (number, record) in records.iter().enumerate() {
                if death == Some(GroupDeath::Within(group)) && number >= records.len() / 2 {
                    return Err(StoreError::NoFile);
                }
                events.push_back(fake::written(store, record));
            }
            Ok(())
        });
        if written.is_err() || death == Some(GroupDeath::After(group)) {
            return (false, told);
        }
    }
    (state.is_idle(), told)
}

/// Until it is committed, nothing of a group is there, wherever its write was torn.
#[test]
fn a_group_is_there_whole_or_not_at_all() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    store.put_job(&record(1)).unwrap();
    let before = image(directory.path());
    let mut images = Vec::new();
    store
        .together(&mut |store| {
            for job in 2..=40 {
                store.put_job(&record(job))?;
                images.push(image(directory.path()));
            }
            Ok(())
        })
        .unwrap();
    for image in images {
        assert_eq!(numbers(&mut opened(&image, LostJobs::Refuse).1.unwrap()), [1]);
    }
    let whole = image(directory.path());
    let all: Vec<u64> = (1..=40).collect();
    assert_eq!(numbers(&mut opened(&whole, LostJobs::Refuse).1.unwrap()), all);
    let [begin, end] = [&before, &whole].map(|image| part(&mut image.clone(), LOG).len());
    assert!(end > begin + 10_000, "{begin} to {end}");
    for cut in (begin..end).step_by(509) {
        let mut torn = whole.clone();
        part(&mut torn, LOG).truncate(cut);
        // The mark is written after the group.
        *part(&mut torn, MARK) = part(&mut before.clone(), MARK).clone();
        assert_eq!(numbers(&mut opened(&torn, LostJobs::Refuse).1.unwrap()), [1], "{cut}");
    }
}
