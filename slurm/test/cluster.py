"""A real Slurm of four virtual nodes on this machine, from Debian's packages, in a directory of its
own. Uses the standard library only.

    python3 slurm/test/cluster.py        starts it, says how to use it, ends it at Ctrl-C
"""

import contextlib
import os
import pathlib
import pwd
import re
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

NODES = ("n1", "n2", "n3", "n4")
# Of one virtual node. The test is about the order of events, not about speed.
CPUS = 2
PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue", "scancel", "scontrol")
MISSING = "on Debian: apt-get install --no-install-recommends slurm-wlm munge"
START_S_MAX = 30
CALL_S_MAX = 20
# SlurmdTimeout is the time after which a node that does not answer is down.
CONFIGURATION = """\
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={work}/munge.socket,cred_expire=5
StateSaveLocation={work}/state
SlurmdSpoolDir={work}/spool-%n
SlurmctldPidFile={work}/slurmctld.pid
SlurmdPidFile={work}/slurmd-%n.pid
SlurmctldLogFile={work}/slurmctld.log
SlurmdLogFile={work}/slurmd-%n.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SlurmdParameters=config_overrides
SchedulerType=sched/backfill
SchedulerParameters=bf_interval=1,sched_min_interval=0,batch_sched_delay=0
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SlurmdTimeout=8
SlurmctldTimeout=60
KillWait=4
MinJobAge=300
JobRequeue=1
{nodes}
PartitionName=main Nodes={names} Default=YES MaxTime=INFINITE DefaultTime=10 State=UP
"""


class NotReady(Exception):
    """The cluster cannot be started; the text says what to do."""


class Cluster:
    """A running Slurm. Use it in a `with` statement: its end ends every daemon and every job."""

    def __init__(self, work):
        self.work = pathlib.Path(work).resolve()
        self.daemons = {}
        self.environment = dict(os.environ, SLURM_CONF=str(self.work / "slurm.conf"), TZ="UTC")

    def __enter__(self):
        try:
            self._start()
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(self, *_):
        self.stop()

    def call(self, *words, text=None, check=True, seconds=CALL_S_MAX):
        """Runs a command of Slurm to its end; returns what it prints."""
        done = subprocess.run(
            [str(word) for word in words],
            env=self.environment,
            input=text,
            capture_output=True,
            text=True,
            timeout=seconds,
        )
        if check and done.returncode != 0:
            command = " ".join(map(str, words))
            raise AssertionError(f"{command} ended with {done.returncode}: {done.stderr}")
        return done.stdout

    def jobs(self, *options):
        """The jobs of the queue, those that ended lately included: state by id."""
        text = self.call("squeue", "--noheader", "--array", "--states=all", "--format=%i %T", *options)
        return dict(line.split() for line in text.splitlines())

    def kill_node(self, name):
        """Ends a node as a power failure does: its daemon, and every process of its jobs."""
        daemon = self.daemons.pop(name)
        # Stopped first, so that it cannot report anything.
        daemon.send_signal(signal.SIGSTOP)
        self._kill_steps(name)
        daemon.kill()
        daemon.wait(CALL_S_MAX)

    def start_node(self, name):
        """Starts a node's daemon."""
        self._spawn(name, "slurmd", "-D", "-N", name, "-f", self.work / "slurm.conf")

    def return_node(self, name):
        """Starts a node that was lost, and waits until Slurm uses it again."""
        self.start_node(name)
        # Refused where the node has reported already, by which it returns (ReturnToService).
        self.call("scontrol", "update", f"nodename={name}", "state=resume", check=False)
        self.wait_for_nodes("idle|allocated|mixed|completing", [name])

    def wait_for_nodes(self, state, names=NODES):
        """Waits until these nodes have the state."""

        def reached():
            text = self.call("sinfo", "--noheader", "--Node", "--format=%N %T")
            found = dict(line.split() for line in text.splitlines())
            self._check_daemons()
            return all(re.fullmatch(state, found.get(name, "").rstrip("*")) for name in names)

        wait_for(f"{', '.join(names)}: {state}", reached, START_S_MAX)

    def stop(self):
        """Ends all jobs and daemons, each by its process id."""
        if "slurmctld" in self.daemons:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.call("scancel", "--signal=KILL", "--full", "--me", check=False)
        for name in NODES:
            self._kill_steps(name)
        for name in [*NODES, "slurmctld", "munged"]:
            daemon = self.daemons.pop(name, None)
            if daemon is None:
                continue
            daemon.terminate()
            try:
                daemon.wait(5)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait(5)

    def _kill_steps(self, node):
        steps = step_daemons(self.work / f"slurmd-{node}.log")
        # The daemons first: they would report the end of their processes.
        for process in steps + [process for step in steps for process in descendants(step)]:
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)

    def _start(self):
        find_programs()
        host = socket.gethostname().split(".")[0]
        ports = free_ports(len(NODES) + 1)
        nodes = "\n".join(
            f"NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs={CPUS} State=UNKNOWN"
            for name, port in zip(NODES, ports[1:])
        )
        text = CONFIGURATION.format(
            host=host,
            controller=ports[0],
            user=pwd.getpwuid(os.getuid()).pw_name,
            work=self.work,
            nodes=nodes,
            names=",".join(NODES),
        )
        (self.work / "slurm.conf").write_text(text)
        if version() >= (23, 2):
            # It would use control groups, which this user may not change. Older ones do not know
            # the word.
            (self.work / "cgroup.conf").write_text("CgroupPlugin=disabled\n")
        (self.work / "state").mkdir()
        for name in NODES:
            (self.work / f"spool-{name}").mkdir()
        key = self.work / "munge.key"
        key.touch(0o600)
        key.write_bytes(secrets.token_bytes(1024))
        socket_path = self.work / "munge.socket"
        # The directory is below /tmp, which munge would call insecure without --force.
        self._spawn(
            "munged",
            "munged",
            "--foreground",
            "--force",
            f"--socket={socket_path}",
            f"--key-file={key}",
            f"--pid-file={self.work}/munge.pid",
            f"--seed-file={self.work}/munge.seed",
            f"--log-file={self.work}/munged.log",
        )
        wait_for("munge answers", socket_path.exists, START_S_MAX)
        self._spawn("slurmctld", "slurmctld", "-D", "-f", self.work / "slurm.conf")
        for name in NODES:
            self.start_node(name)
        wait_for("slurmctld answers", self._answers, START_S_MAX)
        self.wait_for_nodes("idle")

    def _answers(self):
        self._check_daemons()
        done = subprocess.run(
            ["scontrol", "ping"], env=self.environment, capture_output=True, timeout=CALL_S_MAX
        )
        return done.returncode == 0

    def _spawn(self, name, program, *words):
        with open(self.work / f"{name}.out", "ab") as log:
            self.daemons[name] = subprocess.Popen(
                [find(program), *map(str, words)],
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
            )

    def _check_daemons(self):
        for name, daemon in self.daemons.items():
            if daemon.poll() is not None:
                said = (self.work / f"{name}.out").read_text(errors="replace")
                raise NotReady(f"{name} ended with {daemon.returncode}: {said[-2000:]}")


def step_daemons(log):
    """The processes by which a node looks after the steps of jobs: those that have its log open."""
    found = []
    for path in pathlib.Path("/proc").iterdir():
        # Those of other users cannot be read, and are none of this cluster.
        with contextlib.suppress(OSError):
            if path.name.isdigit() and "slurmstepd" in (path / "cmdline").read_text(errors="replace"):
                opened = [os.readlink(descriptor) for descriptor in (path / "fd").iterdir()]
                if str(log) in opened:
                    found.append(int(path.name))
    return found


def descendants(process):
    """The children of a process, their children, and so on."""
    found = []
    for thread in pathlib.Path(f"/proc/{process}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            for child in map(int, thread.read_text().split()):
                found += [child, *descendants(child)]
    return found


def find(program):
    """The path of a program; the daemons are often not on the path of a user."""
    path = os.environ.get("PATH", os.defpath) + ":/usr/sbin:/sbin"
    found = shutil.which(program, path=path)
    if found is None:
        raise NotReady(f"{program} is not installed; {MISSING}")
    return found


def find_programs():
    """Checks that everything is installed."""
    missing = []
    for program in PROGRAMS:
        try:
            find(program)
        except NotReady:
            missing.append(program)
    if missing:
        raise NotReady(f"not installed: {', '.join(missing)}; {MISSING}")


def version():
    """The version of Slurm: year and month."""
    printed = subprocess.run(
        [find("slurmd"), "-V"], capture_output=True, text=True, timeout=CALL_S_MAX
    ).stdout
    found = re.search(r"(\d+)\.(\d+)", printed)
    if found is None:
        raise NotReady(f"slurmd -V prints no version, but `{printed.strip()}`")
    return int(found[1]), int(found[2])


def free_ports(count):
    """Ports that are free now."""
    sockets = [socket.socket() for _ in range(count)]
    try:
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]
    finally:
        for one in sockets:
            one.close()


def wait_for(what, state, seconds):
    """Polls until the state holds; returns what it returned. Fails at the end of the time."""
    end = time.monotonic() + seconds
    while True:
        found = state()
        if found:
            return found
        if time.monotonic() > end:
            raise AssertionError(f"not within {seconds} s: {what}")
        time.sleep(0.2)


def main():
    try:
        find_programs()
        with tempfile.TemporaryDirectory(prefix="osteon-slurm-") as work, Cluster(work) as cluster:
            print(f"nodes {', '.join(NODES)}; in another terminal:\n  export SLURM_CONF={work}/slurm.conf")
            print("Ctrl-C ends it", flush=True)
            # Ended by the signal alone.
            signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
            with contextlib.suppress(KeyboardInterrupt):
                signal.pause()
    except NotReady as error:
        sys.exit(f"cluster.py: {error}")


if __name__ == "__main__":
    main()
