//! The commands for Slurm, with stand-ins for Slurm's commands. `cargo xtask test slurm` tests them on a
//! real one.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[path = "support/secure.rs"]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod secure;
#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use secure::Secure;
use support::{Coordinator, Finished, Owned, Scratch, eventually, job, osteon, run, text};

/// Starts a step on this machine and notes its process, by which `scancel` finds it.
const SRUN: &str = r#"
while [[ $1 == --* ]]; do shift; done
step=0
while ! mkdir "$SLURM_TEST/step-$SLURM_RESTART_COUNT-$step" 2>/dev/null; do step=$((step + 1)); done
echo $$ >"$SLURM_TEST/step-$SLURM_RESTART_COUNT-$step/process"
export SLURM_STEP_ID=$step SLURM_PROCID=0 SLURM_CPUS_ON_NODE=1
exec "$@"
"#;
const SCANCEL: &str = r#"
echo "$@" >>"$SLURM_TEST/scancel"
for step; do :; done
if [[ $step == *.* ]]; then
    kill -TERM "$(cat "$SLURM_TEST/step-$SLURM_RESTART_COUNT-${step#*.}/process")"
fi
"#;
const SCONTROL: &str = r#"echo "$@" >>"$SLURM_TEST/scontrol""#;
/// Keeps the script, or refuses it with the message in a file.
const SBATCH: &str = r#"
echo "$@" >>"$SLURM_TEST/sbatch"
if [[ -e $SLURM_TEST/refusal ]]; then cat "$SLURM_TEST/refusal" >&2; exit 1; fi
cat >"$SLURM_TEST/script"
echo "17;cluster"
"#;
const SQUEUE: &str = r#"cat "$SLURM_TEST/queue""#;

/// Stand-ins for Slurm's commands, with a directory for what they note.
struct Stage {
    scratch: Scratch,
    path: String,
}

impl Stage {
    fn new() -> Self {
        let scratch = Scratch::new();
        for (name, body) in [
            ("srun", SRUN),
            ("scancel", SCANCEL),
            ("scontrol", SCONTROL),
            ("sbatch", SBATCH),
            ("squeue", SQUEUE),
        ] {
            let file = scratch.write(&format!("bin/{name}"), &format!("#!/bin/bash\n{body}"));
            fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).unwrap();
        }
        scratch.write("slurm/queue", "");
        let old = std::env::var("PATH").unwrap();
        let path = format!("{}:{old}", scratch.path("bin").display());
        Self { scratch, path }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.scratch.path(name)
    }

    /// What the stand-ins noted.
    fn noted(&self, name: &str) -> String {
        fs::read_to_string(self.path("slurm").join(name)).unwrap_or_default()
    }

    /// Prepares a command that finds the stand-ins.
    fn with<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        command.env("PATH", &self.path).env("SLURM_TEST", self.path("slurm"))
    }

    /// Writes the script of a job; returns its path.
    fn script(&self, job: &Path, further: &[&str]) -> PathBuf {
        let (store, out) = (self.path("store"), self.path("out"));
        let own = ["slurm", "script", text(job), "--nodes", "1", "--store", text(&store)];
        let words = [&own[..], &["--out", text(&out)], further].concat();
        self.scratch.write("script", run(&words).succeeded())
    }

    /// Starts a script as a job of Slurm that has been requeued so often.
    fn start(&self, script: &Path, restarts: u32) -> Owned {
        let mut command = Command::new("bash");
        command.arg(script).current_dir(self.path("."));
        for (name, value) in [
            ("SLURM_JOB_ID", "5"),
            ("SLURM_RESTART_COUNT", &restarts.to_string()),
            ("SLURM_JOB_NUM_NODES", "1"),
            ("SLURMD_NODENAME", "here"),
            ("OSTEON_HOST", "localhost"),
        ] {
            command.env(name, value);
        }
        Owned::spawn_logging(self.with(&mut command), &self.path("log"))
    }

    fn log(&self) -> String {
        fs::read_to_string(self.path("log")).unwrap()
    }
}

fn digest(out: &Path) -> String {
    let result = fs::read_to_string(out.join("result.json")).unwrap();
    let result: Value = serde_json::from_str(&result).unwrap();
    result["digest"].as_str().unwrap().to_owned()
}

#[test]
fn a_job_that_is_requeued_continues_to_the_result_of_a_local_run() {
    let stage = Stage::new();
    let file = stage.scratch.write("small.toml", &job(300, 12));
    let script = stage.script(&file, &["--max-requeues", "1"]);
    let mut first = stage.start(&script, 0);
    eventually("the worker is there", || stage.log().contains(" attached endpoint="));
    eventually("the job has begun", || stage.log().contains("job started"));
    first.signal("USR1");
    eventually("it is queued again", || stage.noted("scontrol") == "requeue 5\n");
    // In order: the worker has left, and the coordinator has closed its store.
    let log = stage.log();
    assert!(log.contains("the time limit is near"), "{log}");
    assert!(log.contains("draining") && log.contains("stopped"), "{log}");
    // Slurm would end it now.
    first.kill();
    assert!(!stage.path("store/slurm-5").exists(), "the token is left behind");

    assert_eq!(stage.start(&script, 1).code(), Some(0), "{}", stage.log());
    let log = stage.log();
    let recovered = ["unfinished_jobs=1", "ended_jobs=1"].iter().any(|it| log.contains(it));
    assert!(recovered, "{log}");
    assert_eq!(log.matches("job accepted").count(), 1, "{log}");
    let local = stage.path("local");
    run(&["identify", text(&file), "--out", text(&local)]).succeeded();
    assert_eq!(digest(&stage.path("out")), digest(&local));
    assert!(!stage.path("store/slurm-5").exists(), "the token is left behind");
}

#[test]
fn a_script_that_cannot_go_on_says_what_to_do() {
    let stage = Stage::new();
    let file = stage.scratch.write("small.toml", &job(20, 1));
    let check = |script: &Path, restarts: u32, expected: &str| {
        assert_eq!(stage.start(script, restarts).code(), Some(1), "{}", stage.log());
        assert!(stage.log().contains(expected), "{expected} in {}", stage.log());
    };
    let script = stage.script(&file, &["--max-requeues", "2"]);
    check(&script, 3, "requeued 3 times, and at most 2 are allowed (--max-requeues)");
    let absent = stage.script(&file, &["--program", "/nonexistent/osteon"]);
    check(&absent, 0, "/nonexistent/osteon cannot be run on");
    let mut outside = Command::new("bash");
    outside.arg(&script).env_remove("SLURM_JOB_ID");
    let told = Finished::of(outside.output().unwrap());
    assert!(told.stderr.contains("submit the script by: sbatch SCRIPT"), "{told:?}");
    // A store that cannot be made fails the coordinator, and that is told.
    stage.scratch.write("store/osteon.sqlite", "no database at all, but a text of some length");
    check(&stage.script(&file, &[]), 0, "the coordinator did not start; its message is above");
}

#[test]
fn wrong_options_are_refused_before_anything_waits_for_nodes() {
    let stage = Stage::new();
    let file = stage.scratch.write("small.toml", &job(20, 1));
    let certificates = stage.path("certs");
    run(&["certs", text(&certificates)]).succeeded();
    let missing = stage.path("missing.pem");
    let (script, array) = (["slurm", "script"], ["slurm", "array"]);
    let url = ["--coordinator", "https://node-1:7000", "--cpus-per-worker", "2", "--count", "2"];
    let check = |words: &[&[&str]], expected: &str| {
        let told = run(&words.concat());
        assert_eq!((told.code, told.stdout.as_str()), (Some(2), ""), "{told:?}");
        assert!(told.stderr.contains(expected), "{expected} in {told:?}");
    };
    check(&[&script, &["missing.toml", "--nodes", "2"]], "missing.toml");
    let file = [text(&file), "--nodes", "2"];
    check(&[&script, &file, &["--time-limit", "2min"]], "at least 180 s, twice --stop-before");
    check(&[&script, &file, &["--", "--array=1-3"]], "--array cannot be given after --");
    check(&[&script, &file, &["--", "bones"]], "`bones` after -- is not an option of sbatch");
    check(&[&script, &file, &["--out", text(&missing.join("\n"))]], "line break");
    check(&[&array, &url], "need a certificate: give --tls-ca FILE, --tls-cert FILE and --tls-key");
    check(&[&array, &url[2..]], "use --coordinator URL or set OSTEON_COORDINATOR");
    let files = ["--tls-ca", text(&missing), "--tls-cert", "a", "--tls-key", "b"];
    check(&[&array, &url, &files], "missing.pem");
    let url = ["--coordinator", "http://node-1:7000", "--cpus-per-worker", "2"];
    let count = ["--count", "2"];
    check(&[&array, &url, &count, &["--time-limit", "1min"]], "it must be at least 2min");
    check(&[&array, &url, &count, &["--stagger", "40min"]], "at most half of --time-limit, 1800 s");
    let scaling = ["worker", "slurm", "--min", "3", "--max", "2"];
    check(&[&scaling, &url], "--min 3 must not be larger than --max 2");
}

#[test]
fn workers_of_an_array_end_one_after_the_other() {
    let stage = Stage::new();
    let program = stage.scratch.write("osteon", "#!/bin/bash\necho \"$OSTEON_COORDINATOR $*\"\n");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    let words = ["slurm", "array", "--coordinator", "http://node-1:7000", "--count", "3"];
    let own = ["--cpus-per-worker", "2", "--time-limit", "1h", "--stagger", "10min", "--program"];
    let script = run(&[&words[..], &own, &[text(&program)]].concat());
    let script = stage.scratch.write("script", script.succeeded());
    let lifetime = |job: &str| {
        let mut command = Command::new("bash");
        command.arg(&script).env("SLURM_JOB_ID", job).env("SLURM_CPUS_ON_NODE", "2");
        let said = Finished::of(command.output().unwrap()).succeeded().to_owned();
        let (before, rest) = said.split_once(" --time-limit ").unwrap();
        assert_eq!(before, "http://node-1:7000 worker --threads 2");
        let (seconds, rest) = rest.split_once(' ').unwrap();
        assert_eq!(rest, "--idle-timeout 600\n");
        seconds.parse::<u32>().unwrap()
    };
    let lifetimes = ["100", "101", "102", "103"].map(lifetime);
    assert_eq!(lifetimes, [3060, 3290, 3519, 3148]);
}

#[test]
fn over_tls_the_environment_names_all_that_workers_need() {
    let stage = Stage::new();
    let secure = Secure::start();
    let certificate = |name: &str| secure.scratch.path("certs").join(name);
    let read = secure.scratch.path("read.token");
    let variables = [
        ("OSTEON_COORDINATOR", PathBuf::from(&secure.url)),
        ("OSTEON_TLS_CA", certificate("ca.pem")),
        ("OSTEON_TLS_CERT", certificate("worker.pem")),
        ("OSTEON_TLS_KEY", certificate("worker-key.pem")),
        ("OSTEON_TOKEN_FILE", read.clone()),
    ];
    let print = |words: &[&str]| {
        let mut command = osteon();
        command.args(words).args(["--cpus-per-worker", "1"]).envs(variables.clone());
        Finished::of(stage.with(&mut command).output().unwrap()).succeeded().to_owned()
    };
    let told = print(&["worker", "slurm", "--min", "1", "--max", "2", "--dry-run"]);
    assert!(told.contains("1 workers would be submitted"), "{told}");
    let script = print(&["slurm", "array", "--count", "1", "--idle-timeout", "1s"]);
    assert!(!script.contains(text(&read)), "workers need no token: {script}");
    let script = stage.scratch.write("script", &script);
    let mut command = Command::new("bash");
    command.arg(script).env("SLURM_JOB_ID", "5").env("SLURM_CPUS_ON_NODE", "1");
    let mut worker = Owned::spawn_logging(&mut command, &stage.path("log"));
    // It attaches, finds no work, and leaves.
    assert_eq!(worker.code(), Some(0), "{}", stage.log());
    let log = stage.log();
    assert!(log.contains("attached") && log.contains("by=\"the idle timeout\""), "{log}");
    assert!(secure.read("coordinator.log").contains("this worker has drained"));
}

#[test]
fn workers_are_submitted_when_jobs_wait_and_a_refusal_is_not_repeated_at_once() {
    let stage = Stage::new();
    let coordinator = Coordinator::start(&stage.path("store"));
    let words = ["worker", "slurm", "--max", "5", "--cpus-per-worker", "2", "--interval", "1"];
    let words = [&words[..], &["--coordinator", &coordinator.url]].concat();
    let dry = || {
        let mut command = osteon();
        let output = stage.with(command.args(&words).arg("--dry-run")).output().unwrap();
        Finished::of(output)
    };
    let told = dry();
    assert!(told.succeeded().ends_with("\nnothing would be done\n"), "{told:?}");
    assert!(told.stderr.contains("workers on other machines cannot reach"), "{told:?}");
    let file = stage.scratch.write("small.toml", &job(100, 12));
    coordinator.submit(&file);
    let told = dry();
    assert!(told.succeeded().contains("4 workers would be submitted"), "{told:?}");
    assert!(told.stdout.contains("#SBATCH --array=1-4\n"), "{told:?}");
    assert_eq!(stage.noted("sbatch"), "", "a dry run submits nothing");

    let refusal = stage.scratch.write("slurm/refusal", "sbatch: error: invalid account\n");
    let log = stage.path("scaling.log");
    let read = || fs::read_to_string(&log).unwrap_or_default();
    let start = || {
        let mut command = osteon();
        Owned::spawn_logging(stage.with(command.args(&words)), &log)
    };
    let mut process = start();
    let waits =
        "1 allocations failed, the last one (sbatch failed: sbatch: error: invalid account)";
    eventually("it says why and waits", || read().contains(waits));
    assert_eq!(stage.noted("sbatch").lines().count(), 1);
    process.signal("TERM");
    assert_eq!(process.code(), Some(143), "{}", read());

    fs::remove_file(refusal).unwrap();
    let mut process = start();
    eventually("workers are submitted", || read().contains("submitted job=\"17\" workers=4"));
    let script = stage.noted("script");
    let name = script.lines().find_map(|line| line.strip_prefix("#SBATCH --job-name=")).unwrap();
    // They are seen in the queue, so there is nothing more to do.
    let lines = (1..=4).map(|task| format!("17_{task}|{name}|PENDING|0:00|Resources\n"));
    stage.scratch.write("slurm/queue", &lines.collect::<String>());
    eventually("the queue is seen", || read().contains("0 run, 4 wait in Slurm's queue"));
    // The refused one, and one for all four workers.
    assert_eq!(stage.noted("sbatch").lines().count(), 2);

    // squeue vanishes for a while, as during an upgrade.
    let (here, away) = (stage.path("bin/squeue"), stage.path("bin/away"));
    fs::rename(&here, &away).unwrap();
    eventually("it says so", || read().contains("cannot look now; trying again"));
    stage.scratch.write("slurm/queue", &format!("17_1|{name}|RUNNING|0:10|None\n"));
    fs::rename(&away, &here).unwrap();
    eventually("it goes on", || read().contains("1 run, 0 wait in Slurm's queue"));
    // It hangs, and nobody waits for it to end.
    stage.scratch.write("bin/squeue", "#!/bin/bash\ntouch \"$SLURM_TEST/hangs\"\nexec sleep 600\n");
    eventually("squeue hangs", || stage.path("slurm/hangs").exists());
    process.signal("TERM");
    assert_eq!(process.code(), Some(143), "{}", read());
}

#[test]
fn without_slurm_or_coordinator_the_error_says_so() {
    let stage = Stage::new();
    let words = ["worker", "slurm", "--max", "5", "--cpus-per-worker", "2", "--coordinator"];
    let words = [&words[..], &["http://127.0.0.1:1"]].concat();
    let mut command = osteon();
    let output = command.args(&words).env("PATH", stage.path("nothing")).output().unwrap();
    let told = Finished::of(output);
    assert_eq!(told.code, Some(1), "{told:?}");
    assert!(told.stderr.contains("squeue was not found: run this where"), "{told:?}");
    let mut command = osteon();
    let told = Finished::of(stage.with(command.args(&words)).output().unwrap());
    assert_eq!(told.code, Some(1), "{told:?}");
    assert!(told.stderr.contains("cannot reach the coordinator at http://127.0.0.1:1"), "{told:?}");
}
