//! Tests of the file: records are there after it is reopened; damaged and foreign files are
//! refused.

use std::fs;
use std::sync::Arc;

use osteon_common::case::Setup;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{Data, JobKind, JobSpecification, MonteCarlo, Objective, Range, Search};
use osteon_common::observables::{Observable, ObservedValues, PerObservable};
use osteon_common::outcome::{FailureCounts, FailureKind};
use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::Point;
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::results::{EstimatedError, EvaluationRole, GroupEnding, Status};
use osteon_common::systematic::Systematic;

use super::acknowledged::MarkFile;
use super::opening::{FILE, Journal, open_file};
use super::*;
use crate::core::worker_name::WorkerName;

mod damage;
mod groups;
mod parts;
mod pieces;

pub(super) fn job(id: u64) -> JobRecord {
    let mut parameters = Range::of_bone(
        [1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029].map(Range::Fixed),
    );
    parameters[1] = Range::Free { start: 17.717e9, lower: 12e9, upper: 25e9 };
    let specification = JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(Data::from_velocities(vec![3900.25, 3901.5])),
        parameters,
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo::default(),
        objective: Objective::default(),
        search: Search::default(),
        posterior: None,
    };
    JobRecord {
        job: JobId(id),
        request_id: format!("request {id}"),
        specification: Arc::new(specification),
        accepted: Duration::from_nanos(1_763_000_000_123_456_789),
        fingerprint: "osteon 1.2.3 numerics 4".to_owned(),
        client: if id == 2 { "somebody@there".to_owned() } else { String::new() },
        priority: if id == 3 { 9 } else { 0 },
        name: if id == 2 { "Müller, left tibia".to_owned() } else { String::new() },
    }
}

pub(super) fn evaluation(job: u64, number: u64) -> EvaluationRecord {
    EvaluationRecord {
        job: JobId(job),
        number,
        point: Point::of_bone([
            1598.8,
            17.717e9,
            0.3816,
            4.795e9,
            9.8254e9,
            0.4495,
            0.1 + number as f64,
        ]),
        outcomes: [Ok(3900.1), Err(FailureKind::NoConvergence), Ok(f64::MIN_POSITIVE)].into(),
        // As if every realization of the second one had failed.
        estimated_error: (number != 1)
            .then_some(EstimatedError { median: 2e-5, largest: f64::MIN_POSITIVE }),
        workers: (0..number)
            .map(|process| {
                WorkerName::new("a node", u32::try_from(process).unwrap(), process << 62)
            })
            .collect(),
    }
}

pub(super) fn end(job: u64) -> EndRecord {
    EndRecord {
        job: JobId(job),
        ending: Ending {
            status: Status::Failed,
            failure: Some(JobFailure::IntegrityError),
            reason: Some("why".to_owned()),
        },
        program: Program {
            version: "1.2.3".to_owned(),
            numerics: 4,
            commit: Some("c0ffee".to_owned()),
        },
        ended: Duration::from_secs(1_763_000_100),
        evaluations: 2,
        best_cost: None,
        best_moments: Some(Moments { mean: 3900.1, coefficient_of_variation: 0.1 }),
    }
}

/// Returns the evaluations of a job below number 10.
fn evaluations(store: &mut SqliteStore, job: u64) -> Result<Vec<EvaluationRecord>, StoreError> {
    let mut all = Vec::new();
    for number in 0..10 {
        all.extend(store.evaluation(JobId(job), number)?);
    }
    Ok(all)
}

pub(super) fn summary(job: u64) -> Summary {
    let row = |number| osteon_common::results::Evaluation {
        number,
        role: EvaluationRole { group: 1, start: 2, ..EvaluationRole::default() },
        point: evaluation(job, number).point,
        moments: (number == 1).then_some(Moments { mean: 0.1, coefficient_of_variation: 0.3 }),
        observables: PerObservable::default(),
        cost: Some(if number == 1 { 1e-300 } else { f64::INFINITY }),
        failures: FailureCounts::from_outcomes(&evaluation(job, number).outcomes),
        estimated_error: evaluation(job, number).estimated_error,
    };
    let ending = |best| GroupEnding { status: Status::Converged, reason: None, best };
    Summary {
        digest: format!("{job:064x}"),
        best: Some(1),
        history: (0..2).map(row).collect(),
        groups: vec![ending(None), ending(Some(1))],
    }
}

#[test]
fn what_is_put_is_there_after_a_reopening() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(&directory.path().join("made/on/the/way")).unwrap();
    for _ in 0..2 {
        // Written twice: a write whose report was lost is repeated.
        store.put_job(&job(1)).unwrap();
        store.put_job(&job(2)).unwrap();
        store.put_ban(&ban(1)).unwrap();
        store.put_evaluation(&evaluation(2, 0), false).unwrap();
        store.put_evaluation(&evaluation(1, 1), false).unwrap();
        store.put_evaluation(&evaluation(1, 0), false).unwrap();
        store.finish_job(&end(1), &summary(1)).unwrap();
    }
    drop(store);
    let mut store = SqliteStore::open(&directory.path().join("made/on/the/way")).unwrap();
    let expected = [
        StoredJob { record: job(1), end: Some(end(1)), evaluations: 0 },
        StoredJob { record: job(2), end: None, evaluations: 1 },
    ];
    assert_eq!(store.jobs().unwrap(), expected);
    assert_eq!(evaluations(&mut store, 1).unwrap(), [evaluation(1, 0), evaluation(1, 1)]);
    assert_eq!(evaluations(&mut store, 2).unwrap(), [evaluation(2, 0)]);
    assert_eq!(evaluations(&mut store, 3).unwrap(), []);
    assert_eq!(store.summary(JobId(1)).unwrap(), Some(summary(1)));
    assert_eq!(store.summary(JobId(2)).unwrap(), None);
    assert_eq!(store.job(JobId(2)).unwrap(), Some(job(2)));
    assert_eq!(store.job(JobId(3)).unwrap(), None);
    assert_eq!(store.bans().unwrap(), [ban(1)]);
    assert_eq!(store.doubts().unwrap(), []);
}

#[test]
fn a_ban_makes_the_ended_jobs_of_its_host_doubtful_until_they_are_begun_again() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    for id in [1, 2, 3] {
        store.put_job(&job(id)).unwrap();
        store.put_evaluation(&evaluation(id, 0), false).unwrap();
    }
    // Of which only this has been computed by anybody.
    store.put_evaluation(&evaluation(1, 1), false).unwrap();
    store.finish_job(&end(1), &summary(1)).unwrap();
    let of = |number, host: &str| BanRecord { worker: WorkerName::new(host, 7, 0), ..ban(number) };
    for (number, host) in (1..).zip(["a", "node", "a nodes", "A node", "1 a node", "a node"]) {
        store.put_ban(&of(number, host)).unwrap();
    }
    let doubt = |ban, digest| DoubtRecord { job: JobId(1), ban, digest };
    assert_eq!(store.doubts().unwrap(), [doubt(6, None)]);
    // A repeated write, or one that lifts the ban, casts no new doubt: job 2 ended after it.
    store.finish_job(&end(2), &summary(2)).unwrap();
    let lifted = BanRecord { lifted: Some(Duration::from_secs(1_763_000_099)), ..of(6, "a node") };
    store.put_ban(&lifted).unwrap();
    assert_eq!((store.doubts().unwrap().len(), store.bans().unwrap().pop()), (1, Some(lifted)));

    let reopened = store.reopen_job(JobId(1)).unwrap();
    assert_eq!(reopened, Some(StoredJob { record: job(1), end: None, evaluations: 2 }));
    assert_eq!(store.reopen_job(JobId(9)).unwrap(), None);
    drop(store);
    let mut store = SqliteStore::open(directory.path()).unwrap();
    assert_eq!(store.doubts().unwrap(), [doubt(6, Some(summary(1).digest))]);
    assert_eq!(
        (store.jobs().unwrap()[0].end.clone(), store.summary(JobId(1)).unwrap()),
        (None, None)
    );
    // The first digest remains if it is begun again once more.
    store.finish_job(&end(1), &summary(3)).unwrap();
    store.reopen_job(JobId(1)).unwrap();
    assert_eq!(store.doubts().unwrap(), [doubt(6, Some(summary(1).digest))]);
    store.finish_job(&end(1), &summary(3)).unwrap();
    store.delete_jobs(&[JobId(1)]).unwrap();
    assert_eq!(store.doubts().unwrap(), []);
}

#[test]
fn other_users_cannot_read_what_is_made() {
    use std::os::unix::fs::PermissionsExt as _;
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    let directory = tempfile::tempdir().unwrap();
    let made = directory.path().join("on/the/way");
    let mut store = SqliteStore::open(&made).unwrap();
    store.put_job(&job(1)).unwrap();
    for path in [&made, made.parent().unwrap()] {
        assert_eq!(mode(path), 0o700, "{}", path.display());
    }
    for name in [FILE, "osteon.sqlite-wal"] {
        assert_eq!(mode(&made.join(name)), 0o600, "{name}");
    }
    drop(store);
    // Modes chosen by an operator are kept.
    fs::set_permissions(&made, fs::Permissions::from_mode(0o750)).unwrap();
    fs::set_permissions(made.join(FILE), fs::Permissions::from_mode(0o640)).unwrap();
    drop(SqliteStore::open(&made).unwrap());
    assert_eq!((mode(&made), mode(&made.join(FILE))), (0o750, 0o640));
}

#[test]
fn a_store_that_is_closed_is_one_file_and_a_copy_of_it_is_whole() {
    let directory = tempfile::tempdir().unwrap();
    let (there, copy) = (directory.path().join("there"), directory.path().join("copy"));
    let mut store = SqliteStore::open(&there).unwrap();
    store.put_job(&job(1)).unwrap();
    store.put_evaluation(&evaluation(1, 0), false).unwrap();
    assert!(there.join("osteon.sqlite-wal").exists());
    drop(store);
    assert!(!there.join("osteon.sqlite-wal").exists());
    fs::create_dir(&copy).unwrap();
    fs::copy(there.join(FILE), copy.join(FILE)).unwrap();
    let mut copied = SqliteStore::open(&copy).unwrap();
    assert_eq!(copied.job(JobId(1)).unwrap(), Some(job(1)));
    assert_eq!(evaluations(&mut copied, 1).unwrap(), [evaluation(1, 0)]);
}

#[test]
fn pages_that_do_not_fit_together_are_found_at_the_start() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    for number in 0..9 {
        store.put_job(&job(number)).unwrap();
    }
    drop(store);
    let path = directory.path().join(FILE);
    let whole = fs::read(&path).unwrap();
    let page = usize::from(u16::from_be_bytes([whole[16], whole[17]]));
    let pages = whole.len() / page;
    for damaged in 2..=pages {
        let mut bytes = whole.clone();
        let first = (damaged - 1) * page;
        bytes[first..first + 64].fill(0xff);
        fs::write(&path, &bytes).unwrap();
        let error = SqliteStore::open(directory.path()).unwrap_err();
        assert!(
            matches!(error, StoreError::Inconsistent { .. } | StoreError::Corrupt { .. }),
            "page {damaged} of {pages}: {error}"
        );
        assert!(error.to_string().contains("choose another directory"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), bytes, "page {damaged}");
    }
    fs::write(&path, &whole).unwrap();
    assert_eq!(SqliteStore::open(directory.path()).unwrap().jobs().unwrap().len(), 9);
}

fn ban(number: u64) -> BanRecord {
    BanRecord {
        number,
        worker: WorkerName::new("a node", 7, u64::MAX),
        job: JobId(2),
        reason: "answered wrongly".to_owned(),
        at: Duration::from_secs(1_763_000_050),
        lifted: None,
    }
}

#[test]
fn the_last_evaluation_of_a_path_forgets_those_of_another() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    for id in [1, 2] {
        store.put_job(&job(id)).unwrap();
        for number in 0..4 {
            store.put_evaluation(&evaluation(id, number), false).unwrap();
        }
    }
    store.put_evaluation(&evaluation(1, 1), true).unwrap();
    assert_eq!(evaluations(&mut store, 1).unwrap(), [evaluation(1, 0), evaluation(1, 1)]);
    assert_eq!(evaluations(&mut store, 2).unwrap().len(), 4);
}

#[test]
fn a_gap_in_a_path_is_found_at_once() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    store.put_job(&job(1)).unwrap();
    for number in [0, 2] {
        store.put_evaluation(&evaluation(1, number), false).unwrap();
    }
    let error = store.jobs().unwrap_err().to_string();
    assert!(error.contains("has 2 evaluations of job 1, but the last has number 2"), "{error}");
}

#[test]
fn forgotten_jobs_are_gone_and_their_room_is_given_back() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    let size = || fs::metadata(directory.path().join(FILE)).unwrap().len();
    let large: Outcomes = vec![Ok(3900.0); 100_000].into();
    for id in [1, 2] {
        store.put_job(&job(id)).unwrap();
        for number in 0..3 {
            let record = EvaluationRecord { outcomes: large.clone(), ..evaluation(id, number) };
            store.put_evaluation(&record, false).unwrap();
        }
        store.finish_job(&end(id), &summary(id)).unwrap();
    }
    store.connection.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |_| Ok(())).unwrap();
    let before = size();
    store.delete_jobs(&[JobId(1), JobId(9)]).unwrap();
    assert!(size() < before * 6 / 10, "{} of {before} bytes are left", size());
    let ids: Vec<JobId> = store.jobs().unwrap().iter().map(|job| job.record.job).collect();
    assert_eq!(ids, [JobId(2)]);
    assert_eq!(store.summary(JobId(1)).unwrap(), None);
    assert_eq!(evaluations(&mut store, 1).unwrap(), []);
    assert_eq!(evaluations(&mut store, 2).unwrap().len(), 3);
}

#[test]
fn a_full_disk_is_named_and_nothing_is_half_written() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    store.put_job(&job(1)).unwrap();
    store.put_evaluation(&evaluation(1, 0), false).unwrap();
    let pages: i64 = store.connection.pragma_query_value(None, "page_count", |r| r.get(0)).unwrap();
    store.connection.pragma_update(None, "max_page_count", pages + 2).unwrap();
    let outcomes: Outcomes = vec![Ok(3900.0); 100_000].into();
    let large = EvaluationRecord { outcomes, ..evaluation(1, 0) };
    let error = store.put_evaluation(&large, true).unwrap_err();
    assert!(matches!(error, StoreError::Full { .. }), "{error}");
    assert!(error.to_string().contains("no room is left for"), "{error}");
    assert_eq!(evaluations(&mut store, 1).unwrap(), [evaluation(1, 0)]);
    store.connection.pragma_update(None, "max_page_count", 1_000_000).unwrap();
    store.put_evaluation(&large, true).unwrap();
    drop(store);
    let mut store = SqliteStore::open(directory.path()).unwrap();
    assert_eq!(evaluations(&mut store, 1).unwrap(), [large]);
}

#[test]
fn a_directory_that_cannot_be_written_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("file");
    fs::write(&file, "").unwrap();
    let error = SqliteStore::open(&file.join("store")).unwrap_err();
    assert!(matches!(error, StoreError::Directory { .. }), "{error}");
    // The user of this test may be allowed to write everywhere, but not here.
    let error = SqliteStore::open(Path::new("/proc/self")).unwrap_err();
    assert!(matches!(error, StoreError::Lock { .. }), "{error}");
    assert!(error.to_string().contains("give the coordinator's user write permission"), "{error}");
}

#[test]
fn a_database_of_another_program_is_left_as_it_is() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(FILE);
    Connection::open(&path).unwrap().execute_batch("CREATE TABLE notes (text TEXT)").unwrap();
    let before = fs::read(&path).unwrap();
    let error = SqliteStore::open(directory.path()).unwrap_err();
    assert!(matches!(error, StoreError::Foreign { .. }), "{error}");
    assert_eq!(fs::read(&path).unwrap(), before);
}

/// Opens a file that was created with a write-ahead log as on a network file system.
fn with_rollback_journal(directory: &Path) -> SqliteStore {
    let path = directory.join(FILE);
    let (mut connection, ()) = open_file(&path, Journal::Rollback, |_, _| Ok(())).unwrap();
    let mode: String = connection.pragma_query_value(None, "journal_mode", |r| r.get(0)).unwrap();
    assert_eq!(mode, "delete");
    let lock = tempfile::tempfile().unwrap();
    let found = Mark::find(directory).unwrap();
    let last = last_known(&connection).unwrap();
    let mark = Mark::open(directory, &found, last).unwrap().into();
    let log = Log::take_over(&mut connection).unwrap();
    SqliteStore {
        connection,
        path,
        lock,
        mark,
        group: Cell::new(None),
        log,
        stale: RefCell::default(),
    }
}

#[test]
fn with_a_rollback_journal_everything_is_the_same() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    store.put_job(&job(1)).unwrap();
    drop(store);
    let mut store = with_rollback_journal(directory.path());
    store.put_evaluation(&evaluation(1, 0), true).unwrap();
    assert_eq!(store.jobs().unwrap()[0].evaluations, 1);
    assert_eq!(evaluations(&mut store, 1).unwrap(), [evaluation(1, 0)]);
}

/// A mark that was written but not synced may name the job all the same.
#[test]
fn a_job_whose_mark_fails_is_refused_and_does_not_keep_the_store_from_opening() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    store.put_job(&job(1)).unwrap();
    let mark = store.mark.replace(Mark::unwritable(directory.path(), 1));
    let error = store.put_job(&job(2)).unwrap_err();
    assert!(matches!(error, StoreError::Mark { .. }), "{error}");
    assert_eq!(store.jobs().unwrap().len(), 1);
    store.mark.replace(mark);
    store.mark.borrow_mut().acknowledge(JobId(2)).unwrap();
    drop(store);
    let mut store = SqliteStore::open(directory.path()).unwrap();
    assert_eq!(store.last_deleted_job().unwrap(), Some(JobId(2)));
}

#[test]
fn a_second_coordinator_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let _first = SqliteStore::open(directory.path()).unwrap();
    let error = SqliteStore::open(directory.path()).unwrap_err();
    assert!(matches!(error, StoreError::InUse { .. }), "{error}");
    let holder = format!("the coordinator with process {} on ", std::process::id());
    assert!(error.to_string().contains(&holder), "{error}");
}

#[test]
fn another_format_is_refused() {
    for version in [0, 2, 9] {
        let directory = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(directory.path()).unwrap();
        store.connection.execute("UPDATE format SET version = ?1", [version]).unwrap();
        drop(store);
        let error = SqliteStore::open(directory.path()).unwrap_err();
        let expected = format!(
            "osteon.sqlite: this store has format {version}; this version writes 1: run the version \
             that wrote it, or choose another directory"
        );
        assert!(error.to_string().ends_with(&expected), "{error}");
    }
}

#[test]
fn a_job_that_begins_again_has_no_evaluation_and_new_numerics() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    for id in [1, 2] {
        store.put_job(&job(id)).unwrap();
        store.put_evaluation(&evaluation(id, 0), false).unwrap();
    }
    store.reset_job(JobId(1), "osteon 2.0.0 numerics 5").unwrap();
    drop(store);
    let mut store = SqliteStore::open(directory.path()).unwrap();
    let again = JobRecord { fingerprint: "osteon 2.0.0 numerics 5".to_owned(), ..job(1) };
    let stored = |(record, evaluations)| StoredJob { record, end: None, evaluations };
    assert_eq!(store.jobs().unwrap(), [(again, 0), (job(2), 1)].map(stored));
    assert_eq!(evaluations(&mut store, 1).unwrap(), []);
    assert_eq!(evaluations(&mut store, 2).unwrap(), [evaluation(2, 0)]);
}

#[test]
fn a_file_that_is_no_store_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join(FILE), "not a database, whatever its name says").unwrap();
    let error = SqliteStore::open(directory.path()).unwrap_err();
    assert!(matches!(error, StoreError::Corrupt { .. }), "{error}");
    assert!(error.to_string().contains(FILE), "{error}");
}

#[test]
fn the_modes_are_those_that_make_records_durable() {
    let directory = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(directory.path()).unwrap();
    let pragma = |name| {
        let read = |row: &Row<'_>| row.get::<_, rusqlite::types::Value>(0);
        store.connection.pragma_query_value(None, name, read).unwrap()
    };
    assert_eq!(pragma("journal_mode"), "wal".to_owned().into());
    assert_eq!(pragma("locking_mode"), "exclusive".to_owned().into());
    assert_eq!(pragma("synchronous"), 2_i64.into());
    assert_eq!(pragma("page_size"), 16384_i64.into());
}
