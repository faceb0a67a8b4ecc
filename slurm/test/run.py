"""Tests the commands for Slurm on a real one (cluster.py): a job that loses a node and is queued
again, an array of workers, and workers that follow the queue of jobs. Uses the standard library
only."""

import argparse
import contextlib
import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import time

import cluster
from cluster import CALL_S_MAX, Cluster, NotReady, wait_for

ROOT = pathlib.Path(__file__).resolve().parents[2]
QUICK = ROOT / "examples" / "quick.toml"
# Longest wait for a step of a test; each takes seconds.
STEP_S_MAX = 120
# Realizations of the short job, which only has to end.
FEW = 20
# Duration of the long job on this machine, from which its realizations follow: long enough for all
# that happens to it, however fast the machine is.
LONG_JOB_S = 10


def write_job(directory, name, realizations):
    """Writes the quick job with so many realizations; returns its path."""
    text = QUICK.read_text()
    kept = "realizations = 200\n"
    assert kept in text, f"{QUICK} has another number of realizations"
    text = text.replace(kept, f"realizations = {realizations}\n")
    path = directory / f"{name}.toml"
    path.write_text(text.replace('"data/', f'"{QUICK.parent}/data/'))
    return path


class Osteon:
    """The program under test."""

    def __init__(self, program, environment):
        self.program = str(program)
        kept = {name: value for name, value in environment.items() if not name.startswith("OSTEON_")}
        self.environment = kept

    def call(self, *words, check=True, seconds=STEP_S_MAX, **variables):
        """Runs a command to its end; returns what it prints, or `None` if it may fail and does."""
        done = subprocess.run(
            [self.program, *map(str, words)],
            env=self.environment | variables,
            capture_output=True,
            text=True,
            timeout=seconds,
        )
        if done.returncode == 0:
            return done.stdout
        if check:
            raise AssertionError(f"osteon {words[0]} ended with {done.returncode}: {done.stderr}")
        return None

    @contextlib.contextmanager
    def service(self, log, *words, **variables):
        """Runs a command in the background; ends it by SIGTERM."""
        with open(log, "wb") as output:
            process = subprocess.Popen(
                [self.program, *map(str, words)],
                env=self.environment | variables,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
            )
        try:
            yield process
        finally:
            process.terminate()
            try:
                process.wait(CALL_S_MAX)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait(CALL_S_MAX)


def a_job_survives_a_lost_node_and_is_queued_again(slurm, osteon, work):
    """The result is that of a run on this machine, to the bit."""
    begun = time.monotonic()
    osteon.call("identify", write_job(work, "short", FEW))
    scale = LONG_JOB_S / (time.monotonic() - begun)
    file = write_job(work, "job", min(max(round(FEW * scale), FEW), 3000))
    store, out = work / "store", work / "out"
    script = osteon.call(
        "slurm", "script", file, "--nodes", 3, "--cpus-per-node", 1, "--time-limit", "10min",
        "--store", store, "--out", out, "--", f"--chdir={work}",
    )  # fmt: skip
    job = slurm.call("sbatch", "--parsable", text=script).strip()

    def evaluations():
        """Those of the only job, as its coordinator tells; 0 while there is none."""
        with contextlib.suppress(OSError):
            url, private = (store / "address").read_text().strip(), store / f"slurm-{job}"
            listed = osteon.call(
                "job", "list", "--json", "--coordinator", url,
                "--tls-ca", private / "ca.pem", "--token-file", private / "token", check=False,
            )  # fmt: skip
            jobs = json.loads(listed or "[]")
            assert len(jobs) <= 1, f"the job was submitted again: {jobs}"
            return jobs[0]["evaluations"] if jobs else 0
        return 0

    def reaches(least):
        wait_for(f"{least} evaluations", lambda: evaluations() >= least, STEP_S_MAX)

    def restarts(count):
        described = lambda: slurm.call("scontrol", "show", "job", job)
        wait_for(
            f"it runs for the time {count + 1}",
            lambda: f"Restarts={count}" in described() and "JobState=RUNNING" in described(),
            STEP_S_MAX,
        )

    def loses(node):
        slurm.kill_node(node)
        slurm.call("scontrol", "update", f"nodename={node}", "state=down", "reason=test")

    reaches(4)
    # The time limit is near: the job stops in order, and is queued again.
    before = evaluations()
    slurm.call("scancel", "--batch", "--signal=USR1", job)
    restarts(1)
    reaches(before + 4)
    # A node with a worker is lost; then, on the three that are left, that of the coordinator.
    before = evaluations()
    loses("n3")
    restarts(2)
    reaches(before + 4)
    slurm.return_node("n3")
    loses("n1")
    restarts(3)
    # It may have ended before it can be asked once more.
    wait_for("the job ends", lambda: slurm.jobs()[job] not in ("RUNNING", "COMPLETING"), STEP_S_MAX)
    assert slurm.jobs()[job] == "COMPLETED", slurm.jobs()
    local = json.loads(osteon.call("identify", file, "--json"))
    result = json.loads((out / "result.json").read_text())
    assert result["digest"] == local["digest"], (result["digest"], local["digest"])
    assert not (store / f"slurm-{job}").exists(), "certificates and token were left behind"
    log = (work / f"job-{job}.log").read_text()
    end = log.partition("the time limit is near")[2].partition("jobs recovered")[0]
    # In order: workers drained, and the coordinator closed its store. (A batch that was on its way
    # to an idle worker when that left is logged as lost, and computed by others.)
    assert end.count("draining") == 3 and "stopped" in end, log
    slurm.return_node("n1")
    slurm.wait_for_nodes("idle")


def a_job_is_not_queued_again_without_end(slurm, osteon, work):
    """The number of requeues has a bound, and what to do is told."""
    file = write_job(work, "short", FEW)
    script = osteon.call(
        "slurm", "script", file, "--nodes", 1, "--cpus-per-node", 1, "--max-requeues", 0,
        "--store", work / "store", "--out", work / "out", "--", f"--chdir={work}",
    )  # fmt: skip
    job = slurm.call("sbatch", "--parsable", text=script).strip()
    wait_for("the coordinator serves", (work / "store" / "address").exists, STEP_S_MAX)
    slurm.call("scancel", "--batch", "--signal=USR1", job)
    wait_for("the job ends", lambda: slurm.jobs()[job] == "FAILED", STEP_S_MAX)
    log = (work / f"short-{job}.log").read_text()
    assert "Submit the same script again to continue" in log, log
    # That is what happens then, in the same store.
    job = slurm.call("sbatch", "--parsable", text=script).strip()
    wait_for("the job ends", lambda: slurm.jobs()[job] == "COMPLETED", STEP_S_MAX)
    assert (work / "out" / "result.json").exists()


@contextlib.contextmanager
def coordinator(osteon, work):
    """A coordinator outside of Slurm; yields its address."""
    store = work / "store"
    words = ("coordinator", "--listen", "127.0.0.1:0", "--store", store)
    with osteon.service(work / "coordinator.log", *words):
        yield wait_for(
            "the coordinator serves",
            lambda: (store / "address").exists() and (store / "address").read_text().strip(),
            STEP_S_MAX,
        )


def workers_of_an_array_join_a_coordinator_elsewhere(slurm, osteon, work):
    """They compute its job, and leave when there is none any more."""
    with coordinator(osteon, work) as url:
        script = osteon.call(
            "slurm", "array", "--count", 2, "--cpus-per-worker", 1, "--idle-timeout", "2s",
            "--", f"--chdir={work}", OSTEON_COORDINATOR=url,
        )  # fmt: skip
        array = slurm.call("sbatch", "--parsable", text=script).strip()
        osteon.call("identify", write_job(work, "short", FEW), "--coordinator", url)
        wait_for(
            "both end",
            lambda: [slurm.jobs()[f"{array}_{task}"] for task in (1, 2)] == ["COMPLETED"] * 2,
            STEP_S_MAX,
        )


def workers_follow_the_queue_of_jobs(slurm, osteon, work):
    """Workers come with jobs, no more than allowed, and go when there are none."""
    os.chdir(work)
    file = write_job(work, "short", FEW)
    with coordinator(osteon, work) as url:
        words = (
            "worker", "slurm", "--max", 3, "--cpus-per-worker", 1, "--idle-timeout", "2s",
            "--interval", 1, "--time-limit", "5min", "--coordinator", url,
        )  # fmt: skip
        known = set(slurm.jobs())

        def active():
            """Workers that wait or run now."""
            states = (state for job, state in slurm.jobs().items() if job not in known)
            return sum(state in ("PENDING", "CONFIGURING", "RUNNING") for state in states)

        assert "nothing would be done" in osteon.call(*words, "--dry-run")
        log = work / "scaling.log"
        with osteon.service(log, *words) as process:
            for _ in range(2):
                submitted = osteon.call("job", "submit", file, "--coordinator", url, "--json")
                job = json.loads(submitted)["job"]
                wait_for("workers come", lambda: active() > 0, STEP_S_MAX)
                osteon.call("job", "watch", job, "--coordinator", url)
                assert 0 < len(set(slurm.jobs()) - known), slurm.jobs()
                assert active() <= 3, slurm.jobs()
                wait_for("workers go", lambda: active() == 0, STEP_S_MAX)
                assert process.poll() is None, log.read_text()
        assert process.returncode == 128 + signal.SIGTERM, process.returncode
        states = {job: state for job, state in slurm.jobs().items() if job not in known}
        ended = {"COMPLETED", "CANCELLED"}
        assert set(states.values()) <= ended, (states, log.read_text())


TESTS = (
    a_job_survives_a_lost_node_and_is_queued_again,
    a_job_is_not_queued_again_without_end,
    workers_of_an_array_join_a_coordinator_elsewhere,
    workers_follow_the_queue_of_jobs,
)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--osteon", required=True, type=pathlib.Path, help="the program to test")
    parser.add_argument("tests", nargs="*", help="names of tests; all without any")
    arguments = parser.parse_args()
    names = {test.__name__: test for test in TESTS}
    unknown = [name for name in arguments.tests if name not in names]
    if unknown:
        sys.exit(f"no test {', '.join(unknown)}; there are {', '.join(names)}")
    if not os.access(arguments.osteon, os.X_OK):
        sys.exit(f"{arguments.osteon} is no program; `cargo build` makes it")
    program = arguments.osteon.resolve()
    try:
        cluster.find_programs()
        with tempfile.TemporaryDirectory(prefix="osteon-slurm-") as directory:
            run(program, pathlib.Path(directory), [names[name] for name in arguments.tests] or TESTS)
    except NotReady as error:
        sys.exit(f"Slurm: {error}")


def run(program, directory, tests):
    (directory / "cluster").mkdir()
    begun = time.monotonic()
    with Cluster(directory / "cluster") as slurm:
        print(f"Slurm runs after {time.monotonic() - begun:.1f} s", flush=True)
        try:
            socket.getaddrinfo(socket.gethostname(), None)
        except OSError:
            # What an administrator of a cluster would repair.
            slurm.environment["OSTEON_HOST"] = "localhost"
        osteon = Osteon(program, slurm.environment)
        for test in tests:
            work = directory / test.__name__
            work.mkdir()
            begun = time.monotonic()
            try:
                test(slurm, osteon, work)
            except BaseException:
                show_logs(slurm, work)
                print(f"{test.__name__} failed", flush=True)
                raise
            print(f"{test.__name__}: ok, {time.monotonic() - begun:.1f} s", flush=True)


def show_logs(slurm, work):
    """Prints what helps to find a failure."""
    for path in [*sorted(work.glob("*.log")), slurm.work / "slurmctld.log"]:
        print(f"---- {path.name}\n{path.read_text(errors='replace')[-4000:]}", flush=True)
    with contextlib.suppress(AssertionError, subprocess.TimeoutExpired):
        print(f"---- squeue\n{slurm.call('squeue', '--states=all')}", flush=True)


if __name__ == "__main__":
    main()
