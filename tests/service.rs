//! The services as operators and users see them: coordinator, worker, and every client command.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;
use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use support::{
    Coordinator, Finished, Owned, Scratch, eventually, job, osteon, run, run_with, signal, text,
};

#[test]
fn a_job_from_submission_to_its_results() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(30, 4));
    let coordinator = Coordinator::start(&scratch.path("store"));
    let address = fs::read_to_string(scratch.path("store/address")).unwrap();
    assert_eq!(address.trim_end(), coordinator.url);
    assert_eq!(coordinator.client(&["jobs", "--json"]).json(), Value::Array(vec![]));

    let id = coordinator.submit(&file);
    let waiting = coordinator.job(&id);
    assert_eq!((&waiting["status"], &waiting["kind"]), (&Value::Null, &"identification".into()));

    // Without a worker the job waits, and fetching it writes nothing.
    let out = scratch.path("out");
    let unfinished = coordinator.client(&["fetch", &id, "--out", out.to_str().unwrap()]);
    assert_eq!(unfinished.code, Some(1), "{unfinished:?}");
    assert!(unfinished.stderr.contains("has not ended"), "{unfinished:?}");
    assert!(!out.exists());

    let _worker = coordinator.worker(2);
    let watched = coordinator.client(&["watch", &id]);
    assert!(watched.succeeded().lines().last().unwrap().contains("max_evaluations"), "{watched:?}");
    coordinator.client(&["fetch", &id, "--out", out.to_str().unwrap()]).succeeded();
    for name in ["job.toml", "result.json", "history.csv", "realizations.csv"] {
        assert!(out.join(name).exists(), "{name}");
    }
    let fetched: Value =
        serde_json::from_str(&fs::read_to_string(out.join("result.json")).unwrap()).unwrap();

    // The same job embedded, and through `identify --coordinator`: the same object.
    assert_eq!(run(&["identify", file.to_str().unwrap(), "--json"]).json(), fetched);
    let remote = coordinator.client(&["identify", file.to_str().unwrap(), "--json"]).json();
    assert_eq!(remote, fetched);
}

#[test]
fn submission_is_idempotent_by_request_id() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(30, 4));
    let other = scratch.write("other.toml", &job(31, 4));
    let coordinator = Coordinator::start(&scratch.path("store"));
    let submit = |file: &std::path::Path| {
        let arguments = ["submit", file.to_str().unwrap(), "--request-id", "monday", "--json"];
        coordinator.client(&arguments)
    };
    let first = submit(&file).json();
    assert_eq!(submit(&file).json(), first);
    let refused = submit(&other);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert_ne!(coordinator.submit(&file), first["job"].as_str().unwrap());
    let propagation = ["submit", file.to_str().unwrap(), "--propagate"];
    let id = coordinator.client(&propagation).succeeded().trim_end().to_owned();
    assert_eq!(coordinator.job(&id)["kind"], "propagation");
}

#[test]
fn a_store_that_cannot_be_used_is_named_and_left_as_it_is() {
    let scratch = Scratch::new();
    let refused = |store: &std::path::Path, expected: &str| {
        let listen = ["coordinator", "--listen", "127.0.0.1:0", "--store"];
        let refused = run(&[&listen[..], &[store.to_str().unwrap()]].concat());
        assert_eq!(refused.code, Some(1), "{refused:?}");
        assert!(refused.stderr.contains(expected), "{expected}: {refused:?}");
        assert!(refused.stderr.contains("choose another"), "{refused:?}");
    };
    let coordinator = Coordinator::start(&scratch.path("store"));
    let holder =
        format!("is in use by the coordinator with process {} on ", coordinator.process.id());
    refused(&scratch.path("store"), &holder);
    assert_eq!(coordinator.client(&["jobs"]).succeeded(), "no jobs\n");

    let garbage = scratch.path("garbage");
    fs::create_dir(&garbage).unwrap();
    fs::write(garbage.join("osteon.sqlite"), "no database at all").unwrap();
    refused(&garbage, "is damaged or not a database");
    assert_eq!(fs::read(garbage.join("osteon.sqlite")).unwrap(), b"no database at all");
    refused(&garbage.join("osteon.sqlite"), "cannot create");
    refused(std::path::Path::new("/proc/self"), "cannot write and lock");
}

#[test]
fn ended_jobs_are_pruned_and_their_ids_printed() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(30, 4));
    let coordinator = Coordinator::start(&scratch.path("store"));
    let ids: Vec<String> = (0..4).map(|_| coordinator.submit(&file)).collect();
    for id in &ids[..3] {
        coordinator.client(&["cancel", id]).succeeded();
    }
    let prune = |options: &[&str]| coordinator.client(&[&["jobs", "prune"], options].concat());
    assert_eq!(prune(&["--older-than", "1d"]).succeeded(), "");
    let kept = prune(&["--keep-last", "2", "--json"]).json();
    assert_eq!(kept["pruned"], serde_json::json!([ids[0]]));
    assert_eq!(prune(&[]).succeeded(), format!("{}\n{}\n", ids[1], ids[2]));
    let left = coordinator.client(&["jobs", "--json"]).json();
    assert_eq!(left.as_array().unwrap().len(), 1);
    assert_eq!(left[0]["job"], *ids[3]);
    let gone = coordinator.client(&["watch", &ids[0]]);
    assert_eq!(gone.code, Some(2), "{gone:?}");
    assert!(gone.stderr.contains(&format!("no such job: {}", ids[0])), "{gone:?}");
}

#[test]
fn a_cancelled_job_ends_and_says_so() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(1000, 400));
    let coordinator = Coordinator::start(&scratch.path("store"));
    let _worker = coordinator.worker(1);
    let id = coordinator.submit(&file);
    eventually("the job runs", || coordinator.job(&id)["realizations_done"].as_u64() > Some(0));
    coordinator.client(&["cancel", &id]).succeeded();
    let watched = coordinator.client(&["watch", &id]);
    assert_eq!(watched.code, Some(1), "{watched:?}");
    assert!(watched.stdout.contains("cancelled"), "{watched:?}");
    let out = scratch.path("out");
    coordinator.client(&["fetch", &id, "--out", out.to_str().unwrap()]).succeeded();
    let result: Value =
        serde_json::from_str(&fs::read_to_string(out.join("result.json")).unwrap()).unwrap();
    assert_eq!(result["status"], "cancelled");
}

#[test]
fn a_cancelled_result_gives_way_to_a_finished_one() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(30, 4));
    let file = file.to_str().unwrap();
    let coordinator = Coordinator::start(&scratch.path("store"));
    let cancelled = |arguments: &[&str]| {
        let id = coordinator.client(arguments).succeeded().trim_end().to_owned();
        coordinator.client(&["cancel", &id]).succeeded();
        coordinator.client(&["watch", &id]);
        id
    };
    let out = scratch.path("out");
    let fetch = |id: &str| coordinator.client(&["fetch", id, "--out", out.to_str().unwrap()]);
    let status = || {
        let text = fs::read_to_string(out.join("result.json")).unwrap();
        serde_json::from_str::<Value>(&text).unwrap()["status"].clone()
    };

    // A propagation whose evaluation is not complete has no result.
    let propagation = fetch(&cancelled(&["submit", file, "--propagate"]));
    assert_eq!(propagation.code, Some(1), "{propagation:?}");
    assert!(propagation.stderr.contains("was cancelled"), "{propagation:?}");
    assert!(!out.exists());

    let first = cancelled(&["submit", file]);
    fetch(&first).succeeded();
    assert_eq!(status(), "cancelled");
    let _worker = coordinator.worker(2);
    coordinator.client(&["identify", file, "--out", out.to_str().unwrap()]).succeeded();
    assert_eq!(status(), "max_evaluations");
    let refused = fetch(&first);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains("another result of this job"), "{refused:?}");
    assert_eq!(status(), "max_evaluations");

    fs::remove_dir_all(&out).unwrap();
    fetch(&first).succeeded();
    let second = coordinator.submit(std::path::Path::new(file));
    coordinator.client(&["watch", &second]).succeeded();
    fetch(&second).succeeded();
    assert_eq!(status(), "max_evaluations");
    fetch(&second).succeeded();
}

#[test]
fn unknown_jobs_are_named() {
    let scratch = Scratch::new();
    let coordinator = Coordinator::start(&scratch.path("store"));
    let out = scratch.path("out");
    for arguments in [
        &["watch", "nonsense"] as &[&str],
        &["cancel", "nonsense"],
        &["fetch", "nonsense", "--out", out.to_str().unwrap()],
    ] {
        let finished = coordinator.client(arguments);
        assert_eq!(finished.code, Some(2), "{finished:?}");
        assert!(finished.stderr.contains("nonsense"), "{finished:?}");
    }
    assert!(!out.exists());
}

#[test]
fn an_unreachable_coordinator_is_named_in_time() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(30, 4));
    let out = scratch.path("out");
    // A port that was free a moment ago, and one that accepts connections but never answers.
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let silent = format!("http://{}", listener.local_addr().unwrap());
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let urls = [format!("http://{free}"), silent, "unix:/nonexistent/socket".to_owned()];
    let (file, out) = (file.to_str().unwrap(), out.to_str().unwrap());
    let commands = [&["jobs"] as &[&str], &["submit", file], &["identify", file, "--out", out]];
    let each = urls.iter().flat_map(|url| commands.map(|arguments| (url, arguments)));
    // Run at the same time, because each waits for the client's full time limit.
    std::thread::scope(|scope| {
        for (url, arguments) in each {
            scope.spawn(move || {
                let start = Instant::now();
                let finished = run(&[arguments, &["--coordinator", url]].concat());
                assert_eq!(finished.code, Some(1), "{finished:?}");
                assert!(finished.stderr.contains(url), "{finished:?}");
                // Connected or not, it reports what it waits for.
                let told = ["cannot reach", "no answer from"].map(|what| format!("{what} {url}"));
                assert!(told.iter().any(|told| finished.stderr.starts_with(told)), "{finished:?}");
                assert!(finished.stderr.contains(" for 9 more seconds\n"), "{finished:?}");
                assert_eq!(finished.stdout, "");
                assert!(start.elapsed() < Duration::from_secs(30), "{:?}", start.elapsed());
            });
        }
    });
    assert!(!scratch.path("out").join("job.toml").exists());
}

/// A coordinator that accepts connections, but never answers.
struct SilentCoordinator {
    listener: TcpListener,
    url: String,
}

impl SilentCoordinator {
    fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        Self { listener, url }
    }

    /// Waits until a client has sent a request; returns the connection, which has to be kept.
    fn asked(&self) -> TcpStream {
        let mut asked = None;
        eventually("a client sends a request", || {
            asked = self.listener.accept().ok().and_then(|(stream, _)| request_of(stream));
            asked.is_some()
        });
        asked.unwrap()
    }
}

/// Reads up to the first HEADERS frame of HTTP/2, which begins a request; `None` if the client closes
/// the connection before.
fn request_of(mut stream: TcpStream) -> Option<TcpStream> {
    const PREFACE: usize = 24;
    const HEADERS: u8 = 1;
    stream.set_nonblocking(false).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    stream.read_exact(&mut [0; PREFACE]).ok()?;
    loop {
        let mut frame = [0; 9];
        stream.read_exact(&mut frame).ok()?;
        let [high, middle, low, kind, ..] = frame;
        if kind == HEADERS {
            return Some(stream);
        }
        let length = u32::from_be_bytes([0, high, middle, low]) as usize;
        stream.read_exact(&mut vec![0; length]).ok()?;
    }
}

/// Ends `command` by the signal once it handles signals and, if it has a coordinator, waits for its
/// answer; checks the exit code.
fn ended_by(
    name: &str,
    code: i32,
    command: &mut Command,
    silent: Option<&SilentCoordinator>,
    expected: &str,
) {
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let _connection = silent.map(SilentCoordinator::asked);
    let status = format!("/proc/{}/status", child.id());
    eventually("it handles SIGINT and SIGTERM", || {
        let status = fs::read_to_string(&status).unwrap();
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
        // Signal n is bit n - 1: SIGINT is 2, SIGTERM 15.
        let both = 1 << 1 | 1 << 14;
        u64::from_str_radix(caught.trim(), 16).unwrap() & both == both
    });
    signal(child.id(), name);
    let finished = Finished::of(child.wait_with_output().unwrap());
    assert_eq!(finished.code, Some(code), "{name}: {finished:?}");
    assert!(finished.stderr.contains(expected), "{expected}: {finished:?}");
}

#[test]
fn a_command_that_a_signal_ends_has_its_code() {
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", &job(1_000_000, 400));
    let case = scratch.write(
        "case.toml",
        "[bone]\ndensity = 1598.8\nmandel = [[20e9, 0.0, 0.0, 0.0, 0.0, 0.0], \
         [0.0, 20e9, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 20e9, 0.0, 0.0, 0.0], \
         [0.0, 0.0, 0.0, 1e10, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 1e10, 0.0], \
         [0.0, 0.0, 0.0, 0.0, 0.0, 1e10]]\n[solver]\nmethod = \"hybrid\"\nrefinement = 16.0\n",
    );
    let (job, case) = (text(&job), text(&case));
    let silent = SilentCoordinator::start();
    let out = scratch.path("out");
    let commands = [
        (&["identify", job] as &[&str], "no results were saved"),
        (&["propagate", job], "no results were saved"),
        (&["simulate", case], "no results were saved"),
    ];
    let asking = [
        (&["identify", job] as &[&str], "a job that was accepted continues"),
        (&["watch", "1"], "the job continues"),
        (&["submit", job], "the job may have been accepted"),
        (&["fetch", "1", "--out", text(&out)], "to fetch the results"),
    ];
    for (name, code) in [("INT", 130), ("TERM", 143)] {
        for (arguments, expected) in commands {
            ended_by(name, code, osteon().args(arguments), None, expected);
        }
        for (arguments, expected) in asking {
            let mut command = osteon();
            command.args(arguments).args(["--coordinator", &silent.url]);
            ended_by(name, code, &mut command, Some(&silent), expected);
        }
    }
}

#[test]
fn a_coordinator_of_the_environment_is_named_first() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(30, 4));
    let coordinator = Coordinator::start(&scratch.path("store"));
    let _worker = coordinator.worker(1);
    let line = format!("running on {} (OSTEON_COORDINATOR)\n", coordinator.url);
    let variable = ("OSTEON_COORDINATOR", coordinator.url.as_str());
    let id = coordinator.submit(&file);
    for arguments in [&["identify", text(&file), "--json"], &["watch", &id] as &[&str]] {
        let named = run_with(variable, arguments);
        named.succeeded();
        assert!(named.stderr.starts_with(&line), "{named:?}");
        let given = coordinator.client(arguments);
        given.succeeded();
        assert!(!given.stderr.contains("running on"), "{given:?}");
    }
}

#[test]
fn a_worker_gives_up_only_when_told_to() {
    let scratch = Scratch::new();
    let url = format!("unix:{}", scratch.path("socket").display());
    let gave_up = run(&["worker", "--coordinator", &url, "--give-up-after", "0.3"]);
    assert_eq!(gave_up.code, Some(1), "{gave_up:?}");
    assert!(gave_up.stderr.contains(&url) && gave_up.stderr.contains("gave up"), "{gave_up:?}");

    let limited = run(&["worker", "--coordinator", &url, "--time-limit", "0.3"]);
    assert_eq!(limited.code, Some(0), "{limited:?}");
}

#[test]
fn services_end_cleanly_when_told_to() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(1000, 400));
    let mut coordinator = Coordinator::start(&scratch.path("store"));
    let mut worker = coordinator.worker(1);
    let id = coordinator.submit(&file);
    eventually("the job runs", || coordinator.job(&id)["realizations_done"].as_u64() > Some(0));
    worker.signal("TERM");
    assert_eq!(worker.code(), Some(0));
    eventually("the worker is gone", || coordinator.job(&id)["workers"] == 0);
    coordinator.process.signal("INT");
    assert_eq!(coordinator.process.code(), Some(0));
    assert!(!scratch.path("store/address").exists());
}

#[test]
fn who_interrupts_twice_does_not_wait() {
    let scratch = Scratch::new();
    // A batch that takes a long time.
    let method = "[solver]\nmethod = \"hybrid\"\nrefinement = 16.0\nelement_order = 12\n";
    let file = scratch.write("job.toml", &format!("{}{method}", job(1, 1)));
    let coordinator = Coordinator::start(&scratch.path("store"));
    let mut worker = coordinator.worker(1);
    let id = coordinator.submit(&file);
    eventually("the worker computes", || coordinator.job(&id)["workers"] == 1);
    // A single signal would let it finish its batch and end with 0.
    let mut code = None;
    eventually("the worker ends", || {
        worker.signal("INT");
        code = worker.ended();
        code.is_some()
    });
    assert_eq!(code, Some(130));
    assert_eq!(coordinator.job(&id)["realizations_done"], 0);
}

#[test]
fn workers_wait_for_their_coordinator_and_find_it_again() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(300, 20));
    let socket = scratch.path("socket");
    let url = format!("unix:{}", socket.display());
    let mut worker = osteon();
    let _worker = Owned::spawn(worker.args(["worker", "--coordinator", &url, "--threads", "1"]));
    let start = || {
        let mut command = osteon();
        command.args(["coordinator", "--listen", &url, "--store"]).arg(scratch.path("store"));
        let mut process = Owned::spawn(&mut command);
        assert_eq!(process.line(), url);
        Coordinator { process, url: url.clone() }
    };
    let mut first = start();
    let id = first.submit(&file);
    eventually("an evaluation is complete", || first.job(&id)["evaluations"].as_u64() > Some(0));
    first.process.kill();
    drop(first);
    let second = start();
    second.client(&["watch", &id]).succeeded();
    let out = scratch.path("out");
    second.client(&["fetch", &id, "--out", out.to_str().unwrap()]).succeeded();
    let fetched: Value =
        serde_json::from_str(&fs::read_to_string(out.join("result.json")).unwrap()).unwrap();
    assert_eq!(run(&["identify", file.to_str().unwrap(), "--json"]).json(), fetched);
}

#[test]
fn addresses_that_others_can_reach_need_the_explicit_word() {
    let scratch = Scratch::new();
    let store = scratch.path("store");
    let arguments = ["coordinator", "--listen", "0.0.0.0:0", "--store", store.to_str().unwrap()];
    let refused = run(&arguments);
    assert_eq!((refused.code, refused.stdout.as_str()), (Some(2), ""), "{refused:?}");
    assert!(refused.stderr.contains("--insecure"), "{refused:?}");
    assert!(!store.exists());
    let nowhere = ["coordinator", "--listen", "here", "--store", store.to_str().unwrap()];
    let refused = run(&nowhere);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(!store.exists());
}

#[test]
fn a_closed_pipe_is_success() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(10, 1));
    let arguments = ["draw", file.to_str().unwrap(), "--index", "0"];
    let mut child =
        osteon().args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    // The program may finish before or after the pipe is closed: both are a success.
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));

    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = osteon().args(arguments).stdout(full).stderr(Stdio::piped()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    std::io::stderr().flush().unwrap();
}
