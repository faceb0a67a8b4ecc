//! Disks that are full, limited or read-only, and files that are damaged, foreign, newer, or in
//! use: the messages to the user, and that no file is half-written.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use osteon_common::job::JobKind;

use crate::api::{Api, specification};
use crate::service::{Service, undisturbed};
use crate::support::{Finished, Owned, Scratch, job, run, text};

/// A memory disk that is visible only to processes started on it.
struct Disk {
    holder: Owned,
    directory: PathBuf,
    /// Prefix of the command line that starts a process on the disk.
    enter: Vec<String>,
}

impl Disk {
    /// Mounts a disk with these options; `None` if this user may not mount any.
    fn mount(scratch: &Scratch, options: &str) -> Option<Self> {
        let directory = scratch.path("disk");
        fs::create_dir_all(&directory).unwrap();
        let mount =
            format!("mount -t tmpfs -o {options} tmpfs {} && echo mounted", text(&directory));
        // As root, or as root of a user namespace.
        for user in [&[] as &[&str], &["--user", "--map-root-user"]] {
            let mut command = Command::new("unshare");
            command.arg("--mount").args(user).args(["sh", "-c", &format!("{mount} && exec cat")]);
            let mut holder = Owned::spawn(command.stdin(Stdio::piped()));
            if holder.line() == "mounted" {
                let target = format!("--target={}", holder.id());
                let mut enter = vec!["nsenter".to_owned(), target, "--mount".to_owned()];
                if !user.is_empty() {
                    enter.extend(["--user".to_owned(), "--preserve-credentials".to_owned()]);
                }
                return Some(Self { holder, directory, enter });
            }
        }
        println!("this user may not mount a disk: a full one is not tested here");
        None
    }

    /// Returns the path of a file on the disk, as seen from outside.
    fn path(&self, name: &str) -> PathBuf {
        let root = format!("/proc/{}/root{}", self.holder.id(), text(&self.directory));
        Path::new(&root).join(name)
    }

    /// Fills the disk.
    fn fill(&self) {
        let mut filler = fs::File::create(self.path("filler")).unwrap();
        let mut size = 1 << 16;
        while size > 0 {
            if filler.write(&vec![1; size]).is_err() {
                size /= 2;
            }
        }
    }

    fn make_room(&self) {
        fs::remove_file(self.path("filler")).unwrap();
    }

    /// Runs a coordinator on the disk that is expected to fail.
    fn coordinator(&self) -> Finished {
        let mut command = Command::new(&self.enter[0]);
        command.args(&self.enter[1..]).arg(env!("CARGO_BIN_EXE_osteon"));
        command.args(["coordinator", "--listen", "127.0.0.1:0", "--store"]).arg(&self.directory);
        Finished::of(command.stdin(Stdio::null()).output().unwrap())
    }
}

#[test]
fn on_a_full_disk_jobs_wait_and_go_on_when_there_is_room() {
    let scratch = Scratch::new();
    let Some(disk) = Disk::mount(&scratch, "size=3m") else { return };
    let file = scratch.write("job.toml", &job(60, 20));
    let digest = undisturbed("identify", &file);
    let mut service = Service::start_in(&scratch, &disk.directory, &disk.enter, &[]);
    let _worker = service.worker(&scratch);
    let mut api = Api::new(service.url());
    let specification = specification(&file, JobKind::Identification);
    let id = api.submit(&specification, "first").unwrap();
    api.until("evaluations are stored", &id, |seen| seen.evaluations > 1);
    disk.fill();
    let waits = |seen: &osteon_proto::v1::JobSnapshot| {
        seen.waiting_for.contains("no room is left") && seen.waiting_for.contains("make room")
    };
    let seen = api.until("the job says that the disk is full", &id, waits);
    let client = ["submit", text(&file), "--coordinator", service.url()];
    let refused = run(&client);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    for part in ["is not accepted", "no room is left", "make room on its disk"] {
        assert!(refused.stderr.contains(part), "{part} in {refused:?}");
    }
    let listed = run(&["jobs", "--coordinator", service.url()]);
    assert!(listed.stderr.contains("the store has refused records for "), "{listed:?}");

    // After a kill on the full disk, it comes back with everything that it had acknowledged.
    service.kill();
    let full = disk.coordinator();
    assert_eq!(full.code, Some(1), "{full:?}");
    for part in ["no room is left", "make room on its disk"] {
        assert!(full.stderr.contains(part), "{part} in {full:?}");
    }
    disk.make_room();
    service.start_again();
    let mut api = Api::new(service.url());
    assert!(api.job(&id).evaluations >= seen.evaluations);
    assert_eq!(api.submit(&specification, "first").unwrap(), id);
    assert_eq!(api.jobs().unwrap().len(), 1, "the refused job is there");
    assert_eq!(api.end(&id).digest(), digest);
}

/// With a limit on file sizes, SQLite gets an error in the middle of a write, as with a quota.
#[test]
fn where_the_quota_ends_jobs_wait_and_go_on_when_it_is_raised() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(60, 20));
    let digest = undisturbed("identify", &file);
    let limited = ["sh", "-c", "trap '' XFSZ; ulimit -S -f 800; exec \"$0\" \"$@\""];
    let limited = limited.map(str::to_owned);
    let mut service = Service::start_in(&scratch, &scratch.path("store"), &limited, &[]);
    let _worker = service.worker(&scratch);
    let mut api = Api::new(service.url());
    let id = api.submit(&specification(&file, JobKind::Identification), "").unwrap();
    let waits = |seen: &osteon_proto::v1::JobSnapshot| {
        seen.waiting_for.contains("quota") && seen.evaluations > 0
    };
    api.until("the job says that nothing can be written", &id, waits);
    let process = service.process().id().to_string();
    let raised = Command::new("prlimit").args(["--pid", &process, "--fsize=unlimited:"]).status();
    assert!(raised.unwrap().success());
    assert_eq!(api.end(&id).digest(), digest);
}

/// Checks the messages of a coordinator that does not start on `directory`, and that nothing there
/// changes.
fn refused_by(directory: &Path, expected: &[&str]) {
    let before = contents(directory);
    let arguments = ["coordinator", "--listen", "127.0.0.1:0", "--store", text(directory)];
    let refused = run(&arguments);
    assert_eq!((refused.code, refused.stdout.as_str()), (Some(1), ""), "{refused:?}");
    for part in expected {
        assert!(refused.stderr.contains(part), "{part} in {refused:?}");
    }
    assert_eq!(contents(directory), before, "{refused:?}");
}

/// Returns the files of a directory, without the lock.
fn contents(directory: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let Ok(entries) = fs::read_dir(directory) else { return BTreeMap::new() };
    let paths = entries.map(|entry| entry.unwrap().path());
    let paths = paths.filter(|path| !path.ends_with("osteon.lock"));
    paths.map(|path| (path.clone(), fs::read(path).unwrap())).collect()
}

/// Creates a store with an ended job, shut down cleanly.
fn store(scratch: &Scratch) -> PathBuf {
    let file = scratch.write("job.toml", &job(30, 3));
    let mut service = Service::start(scratch, &[]);
    let mut worker = service.worker(scratch);
    let mut api = Api::new(service.url());
    let id = api.submit(&specification(&file, JobKind::Identification), "").unwrap();
    api.end(&id);
    for process in [&mut worker, service.process()] {
        process.signal("TERM");
        assert_eq!(process.code(), Some(0));
    }
    scratch.path("store")
}

#[test]
fn files_that_cannot_be_used_are_refused_and_left_as_they_are() {
    let scratch = Scratch::new();
    let directory = store(&scratch);
    let database = directory.join("osteon.sqlite");
    let sound = fs::read(&database).unwrap();

    let change = |sql: &str| {
        let connection = rusqlite::Connection::open(&database).unwrap();
        connection.execute_batch(sql).unwrap();
    };
    change("UPDATE format SET version = 99");
    refused_by(&directory, &["format 99", "run the version that wrote it", text(&database)]);

    let damaged = "is damaged";
    let advice = "restore the file from a copy";
    let mut broken = sound.clone();
    broken[4096..].fill(0xa5);
    for bytes in [&b"no database at all, but some text that is long enough"[..], &broken] {
        fs::write(&database, bytes).unwrap();
        refused_by(&directory, &[damaged, advice, text(&database)]);
    }
    fs::write(&database, &sound[..sound.len() / 2]).unwrap();
    refused_by(&directory, &[damaged, advice, text(&database)]);

    fs::remove_file(&database).unwrap();
    change("CREATE TABLE recipe (name TEXT)");
    refused_by(&directory, &["of another program", "choose another directory"]);

    fs::write(&database, &sound).unwrap();
    let service = Service::start_in(&scratch, &directory, &[], &[]);
    assert_eq!(Api::new(service.url()).jobs().unwrap().len(), 1);
}

/// SQLite regards a truncated log as a shorter one, so the jobs behind the cut would be lost
/// without notice.
#[test]
fn a_coordinator_that_lost_accepted_jobs_says_so_and_does_not_start() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(30, 3));
    let specification = specification(&file, JobKind::Identification);
    let mut service = Service::start(&scratch, &[]);
    let mut api = Api::new(service.url());
    let ids: Vec<_> = (0..3).map(|_| api.submit(&specification, "").unwrap()).collect();
    assert_eq!(ids, ["1", "2", "3"]);
    service.kill();
    let directory = scratch.path("store");
    let log = directory.join("osteon.sqlite-wal");
    let whole = fs::read(&log).unwrap();
    // One byte of the last page suffices: what was written last then counts as never written.
    let mut damaged = whole.clone();
    *damaged.last_mut().unwrap() ^= 1;
    for bytes in [&whole[..whole.len() - 1], &damaged] {
        fs::write(&log, bytes).unwrap();
        refused_by(&directory, &["has lost job 3,", "check the disk", "--accept-lost-jobs"]);
    }
    fs::write(&log, &whole[..32]).unwrap();
    refused_by(&directory, &["has lost jobs 1 to 3,", "restore the store from a copy"]);
    // Restoring the copy repairs the store.
    fs::write(&log, &whole).unwrap();
    service.start_again();
    assert_eq!(Api::new(service.url()).jobs().unwrap().len(), 3);
}

/// Continuing without the lost jobs must be requested only once, and no number is given twice.
#[test]
fn lost_jobs_that_are_accepted_are_not_asked_about_again() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(30, 3));
    let specification = specification(&file, JobKind::Identification);
    let mut service = Service::start(&scratch, &[]);
    let mut api = Api::new(service.url());
    for expected in ["1", "2", "3"] {
        assert_eq!(api.submit(&specification, "").unwrap(), expected);
    }
    service.kill();
    let directory = scratch.path("store");
    let log = directory.join("osteon.sqlite-wal");
    let whole = fs::read(&log).unwrap();
    fs::write(&log, &whole[..whole.len() - 1]).unwrap();
    refused_by(&directory, &["has lost job 3,"]);
    let mut service = Service::start(&scratch, &["--accept-lost-jobs"]);
    assert!(service.log().contains("has lost job 3,"), "{}", service.log());
    let mut api = Api::new(service.url());
    assert_eq!(api.jobs().unwrap().len(), 2);
    assert_eq!(api.submit(&specification, "").unwrap(), "4");
    service.kill();
    let mut service = Service::start(&scratch, &[]);
    let _worker = service.worker(&scratch);
    let mut api = Api::new(service.url());
    assert_eq!(api.end("4").digest(), undisturbed("identify", &file));
    service.end();
}

#[test]
fn a_second_coordinator_is_refused_and_the_first_goes_on() {
    let scratch = Scratch::new();
    let mut service = Service::start(&scratch, &[]);
    let holder = format!("the coordinator with process {}", service.process().id());
    let directory = scratch.path("store");
    let arguments = ["coordinator", "--listen", "127.0.0.1:0", "--store", text(&directory)];
    for _ in 0..2 {
        let refused = run(&arguments);
        assert_eq!((refused.code, refused.stdout.as_str()), (Some(1), ""), "{refused:?}");
        for part in ["is in use by", &holder, "stop that one, or choose another directory"] {
            assert!(refused.stderr.contains(part), "{part} in {refused:?}");
        }
    }
    let file = scratch.write("job.toml", &job(30, 3));
    let _worker = service.worker(&scratch);
    let mut api = Api::new(service.url());
    let id = api.submit(&specification(&file, JobKind::Identification), "").unwrap();
    assert_eq!(api.end(&id).digest(), undisturbed("identify", &file));
    let address = fs::read_to_string(directory.join("address")).unwrap();
    assert_eq!(address.trim_end(), service.url());
}

#[test]
fn where_nothing_can_be_written_nothing_starts() {
    let scratch = Scratch::new();
    let file = scratch.write("file", "");
    refused_by(&file, &["cannot create", "choose another directory", text(&file)]);
    refused_by(&file.join("below"), &["cannot create", "choose another directory"]);
    if let Some(disk) = Disk::mount(&scratch, "ro,size=1m") {
        let refused = disk.coordinator();
        assert_eq!((refused.code, refused.stdout.as_str()), (Some(1), ""), "{refused:?}");
        for part in ["cannot write and lock", "write permission", "choose another"] {
            assert!(refused.stderr.contains(part), "{part} in {refused:?}");
        }
    }
}
