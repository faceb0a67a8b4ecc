"""Compares what systems add to many short tasks: 2,747 parts of 1 ms on two workers.

Runs each system in turns, so that other load of the machine meets all of them, and prints the best of the
rounds as a table. The other systems are installed into a virtual environment, with the versions of
requirements.txt. `cargo xtask bench peers` builds what is needed and calls this.
"""

import argparse
import datetime
import json
import os
import platform
import subprocess
import sys
import venv
from pathlib import Path

from tasks import PART_S, TASKS, WORKERS

HERE = Path(__file__).resolve().parent
PEERS = {
    "xargs -P": "xargs_peer.py",
    "Dask": "dask_peer.py",
    "Ray": "ray_peer.py",
    "HyperQueue": "hyperqueue_peer.py",
}
PER_TASK = [1, 100]
TIMEOUT_S = 180


def environment(directory):
    """Returns a Python that has the peers."""
    python = directory / "bin" / "python"
    wanted = (HERE / "requirements.txt").read_text()
    note = directory / "requirements.txt"
    if not note.exists() or note.read_text() != wanted:
        venv.create(directory, with_pip=True, clear=True)
        install = [python, "-m", "pip", "install", "--quiet", "-r", HERE / "requirements.txt"]
        subprocess.run(install, check=True, timeout=1200)
        note.write_text(wanted)
    return python


def peer(python, script, per_task):
    """Runs a peer; returns its time and its version."""
    done = subprocess.run(
        [python, HERE / script, str(per_task)], capture_output=True, text=True, timeout=TIMEOUT_S
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode != 0 or not lines:
        raise SystemExit(f"{script} failed with {done.returncode}:\n{done.stderr[-2000:]}")
    found = json.loads(lines[-1])
    return found["seconds"], found["version"]


def osteon(fleet):
    """Runs simulated workers, which sleep, at a real coordinator; returns the time."""
    words = ["--workers", str(WORKERS), "--slots", "1", "--each", "1ms"]
    command = [*fleet, *words, "--realizations", str(TASKS)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S)
    rows = [line for line in done.stdout.splitlines() if line.startswith("|")]
    if done.returncode != 0 or len(rows) != 3:
        raise SystemExit(f"{command} failed with {done.returncode}:\n{done.stderr[-2000:]}")
    names, row = ([cell.strip() for cell in line.strip("|").split("|")] for line in (rows[0], rows[2]))
    return float(row[names.index("measured")].removesuffix(" s"))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3, choices=range(1, 21), metavar="N")
    parser.add_argument("--environment", type=Path, required=True, help="directory for the peers")
    parser.add_argument("--version", required=True, help="what `osteon --version` prints")
    parser.add_argument("fleet", nargs="+", help="the command of the benchmark of fleets")
    arguments = parser.parse_args()
    python = environment(arguments.environment)
    times, versions, loads = {}, {}, [os.getloadavg()[0]]
    for round_ in range(arguments.rounds):
        for name, script in PEERS.items():
            for per_task in PER_TASK:
                seconds, versions[name] = peer(python, script, per_task)
                times.setdefault((name, str(per_task)), []).append(seconds)
                print(f"{round_ + 1}: {name}, {per_task}: {seconds:.3f} s", file=sys.stderr)
        seconds = osteon(arguments.fleet)
        times.setdefault(("osteon", "its own batches"), []).append(seconds)
        print(f"{round_ + 1}: osteon: {seconds:.3f} s", file=sys.stderr)
        loads.append(os.getloadavg()[0])
    versions["osteon"] = arguments.version
    date = datetime.datetime.now(datetime.timezone.utc).strftime("%d %B %Y")
    print(f"{date}, {os.cpu_count()} processors, {platform.system()} {platform.machine()}, Python "
          f"{platform.python_version()}, load {min(loads):.1f} to {max(loads):.1f}, best of "
          f"{arguments.rounds}\n")
    print("| system | version | parts in a task | time | times in all rounds | added per part |")
    print("|---|---|--:|--:|---|--:|")
    for (name, per_task), found in times.items():
        added = (min(found) * WORKERS / TASKS - PART_S) * 1e6
        all_ = ", ".join(f"{seconds:.3f}" for seconds in found)
        print(f"| {name} | {versions[name]} | {per_task} | {min(found):.3f} s | {all_} | {added:.0f} µs |")


if __name__ == "__main__":
    main()
