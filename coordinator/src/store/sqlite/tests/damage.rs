//! Damaged records.

use super::*;

#[test]
fn every_damaged_record_is_named() {
    for (sql, record) in [
        ("UPDATE job SET specification = x'00'", DamagedRecord::Specification),
        ("UPDATE job SET checksum = x''", DamagedRecord::Specification),
        ("UPDATE job SET request_id = 'other'", DamagedRecord::Specification),
        ("UPDATE job SET accepted_ns = 1", DamagedRecord::Specification),
        ("UPDATE job SET fingerprint = 'other'", DamagedRecord::Specification),
        ("UPDATE evaluation SET outcomes = zeroblob(27)", DamagedRecord::Evaluation(7)),
        ("UPDATE evaluation SET point = zeroblob(56)", DamagedRecord::Evaluation(7)),
        ("UPDATE evaluation SET number = 8", DamagedRecord::Evaluation(8)),
        ("UPDATE evaluation SET estimated_error = zeroblob(16)", DamagedRecord::Evaluation(7)),
        ("UPDATE evaluation SET estimated_error = NULL", DamagedRecord::Evaluation(7)),
        ("UPDATE job SET client = 'other'", DamagedRecord::Specification),
        ("UPDATE job SET priority = 1", DamagedRecord::Specification),
        ("UPDATE evaluation SET workers = '1 a'", DamagedRecord::Evaluation(7)),
        ("UPDATE evaluation SET workers = ''", DamagedRecord::Evaluation(7)),
        ("UPDATE ban SET host = 'other'", DamagedRecord::Ban),
        ("UPDATE ending SET status = 'done'", DamagedRecord::End),
        ("UPDATE ending SET status = 'converged'", DamagedRecord::End),
        ("UPDATE ending SET failure = NULL", DamagedRecord::End),
        ("UPDATE ending SET failure = 'store'", DamagedRecord::End),
        ("UPDATE ending SET failure = 'bad luck'", DamagedRecord::End),
        ("UPDATE ending SET reason = NULL", DamagedRecord::End),
        ("UPDATE ending SET reason = ''", DamagedRecord::End),
        ("UPDATE ending SET version = '1.2.4'", DamagedRecord::End),
        ("UPDATE ending SET numerics = 3", DamagedRecord::End),
        ("UPDATE ending SET commit_id = NULL", DamagedRecord::End),
        ("UPDATE ending SET ended_ns = 1", DamagedRecord::End),
        ("UPDATE ending SET evaluations = 3", DamagedRecord::End),
        ("UPDATE ending SET best_cost = 0.0", DamagedRecord::End),
        ("UPDATE ending SET best_mean = 3901.0", DamagedRecord::End),
        ("UPDATE ending SET best_coefficient_of_variation = 0.2", DamagedRecord::End),
        ("UPDATE ending SET checksum = x''", DamagedRecord::End),
        ("UPDATE summary SET digest = ''", DamagedRecord::Summary),
        ("UPDATE summary SET best = 0", DamagedRecord::Summary),
        ("UPDATE summary SET best = NULL", DamagedRecord::Summary),
        ("UPDATE summary SET history = x''", DamagedRecord::Summary),
        ("UPDATE summary SET checksum = x''", DamagedRecord::Summary),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let mut store = SqliteStore::open(directory.path()).unwrap();
        store.put_job(&job(1)).unwrap();
        store.put_evaluation(&evaluation(1, 7), false).unwrap();
        store.finish_job(&end(1), &summary(1)).unwrap();
        store.put_ban(&ban(1)).unwrap();
        store.connection.execute(sql, []).unwrap();
        let jobs = store.jobs().map(|_| ());
        let read = jobs.and_then(|()| store.end(JobId(1)).map(|_| ()));
        let read = read.and_then(|()| evaluations(&mut store, 1).map(|_| ()));
        let read = read.and_then(|()| store.bans().map(|_| ()));
        let error = read.and_then(|()| store.summary(JobId(1)).map(|_| ())).unwrap_err();
        assert!(
            matches!(&error, StoreError::Damaged { record: found, .. } if *found == record),
            "{sql}: {error}"
        );
    }
}

#[test]
fn a_job_whose_end_is_damaged_keeps_no_other_from_being_served() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    for id in [1, 2, 3] {
        store.put_job(&job(id)).unwrap();
    }
    for id in [1, 2] {
        store.finish_job(&end(id), &summary(id)).unwrap();
    }
    store.connection.execute("UPDATE ending SET evaluations = 7 WHERE job = 1", []).unwrap();
    let jobs = store.jobs().unwrap();
    let [damaged, whole, unfinished] = &jobs[..] else { panic!("{jobs:?}") };
    let ending = &damaged.end.as_ref().unwrap().ending;
    assert_eq!(ending.status, Status::Failed);
    let reason = ending.reason.as_deref().unwrap();
    assert!(reason.contains("is damaged: the end of job 1; restore the file"), "{reason}");
    assert_eq!(whole.end, Some(end(2)));
    assert_eq!(unfinished.end, None);
}
